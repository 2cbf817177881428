//! Cameras with lenses: published and made (tests/data/lens_models.csv), and hostile ones.

use camsim_core::camera::CameraModel;
use camsim_core::lens::LensModel;

pub struct Set {
    pub name: String,
    pub camera: CameraModel,
}

fn model_by_name(name: &str) -> LensModel {
    LensModel::named(name).unwrap()
}

pub fn golden_sets() -> Vec<Set> {
    let text = include_str!("../../../../tests/data/lens_models.csv");
    let set = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        let number = |i: usize| cells[i].parse::<f64>().unwrap();
        let k: Vec<f64> = cells[8].split_whitespace().map(|k| k.parse().unwrap()).collect();
        let size_px = [number(2) as u32, number(3) as u32];
        let (focal, centre) = ([number(4), number(5)], [number(6), number(7)]);
        let camera = CameraModel::new(size_px, focal, Some(centre), model_by_name(cells[1]), &k).unwrap();
        Set { name: cells[0].to_owned(), camera }
    };
    text.lines().skip(1).map(set).collect()
}

/// Twenty sets of each model, of Brown-Conrady with five and with eight coefficients, most of them far from any
/// real lens.
pub fn hostile_sets() -> Vec<Set> {
    let mut state = 48_u64;
    // Knuth's generator: -1 to 1.
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    };
    let mut sets = Vec::new();
    for (model, middle, reach) in BOUNDS {
        for i in 0..20 {
            let k: Vec<f64> =
                middle.iter().zip(*reach).map(|(middle, reach)| middle + reach * random()).collect();
            let focal = [290.0 + 200.0 * random(), 290.0 + 200.0 * random()];
            let centre = [320.0 + 120.0 * random(), 240.0 + 90.0 * random()];
            let camera = CameraModel::new([640, 480], focal, Some(centre), *model, &k).unwrap();
            sets.push(Set { name: format!("{} {i} {k:?}", model.name()), camera });
        }
    }
    sets
}

/// For each coefficient its middle and by how much it may differ.
const BOUNDS: &[(LensModel, &[f64], &[f64])] = &[
    (
        LensModel::BrownConradyPrism,
        &[0.0; 14],
        &[0.5, 0.3, 0.05, 0.05, 0.1, 0.3, 0.1, 0.05, 0.1, 0.05, 0.1, 0.05, 0.4, 0.4],
    ),
    (
        LensModel::Fisheye624,
        &[0.0; 12],
        &[0.1, 0.05, 0.02, 5e-3, 1e-3, 2e-4, 0.05, 0.05, 0.05, 0.03, 0.05, 0.03],
    ),
    (LensModel::KannalaBrandt, &[0.0; 4], &[0.3, 0.1, 0.02, 2e-3]),
    (
        LensModel::FTheta,
        &[1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0],
        &[0.3, 0.3, 0.2, 0.1, 0.02, 0.1, 0.1, 0.1],
    ),
    (
        LensModel::FThetaInverse,
        &[1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0],
        &[0.3, 0.2, 0.1, 0.05, 0.02, 0.1, 0.1, 0.1],
    ),
    (LensModel::DoubleSphere, &[0.0, 0.5], &[0.9, 0.5]),
    (LensModel::Eucm, &[0.5, 2.0], &[0.5, 1.9]),
    (LensModel::Ucm, &[0.5], &[0.5]),
    (LensModel::Mei, &[2.0, 0.0, 0.0, 0.0, 0.0], &[2.0, 2.0, 3.0, 0.05, 0.05]),
    (LensModel::Division, &[-1.0], &[2.0]),
    (LensModel::Fov, &[1.5], &[1.45]),
    (LensModel::BrownConrady, &[0.0; 5], &[0.6, 0.4, 0.05, 0.05, 0.3]),
    (LensModel::BrownConrady, &[0.0; 8], &[0.8, 0.6, 0.05, 0.05, 0.3, 0.8, 0.6, 0.3]),
];
