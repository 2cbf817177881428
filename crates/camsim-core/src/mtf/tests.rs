use super::*;
use crate::{
    noise::upper_tail,
    scenario::{CameraSpec, LensModel, LensSpec, PerChannel, PointSpreadSpec},
};

/// An edge that leans by `lean_deg`, seen through a profile of the distance across it.
fn picture([width, height]: [usize; 2], lean_deg: f64, bend: f64, profile: impl Fn(f64) -> f64) -> Vec<f64> {
    let slope = lean_deg.to_radians().tan();
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x as f64, y as f64)));
    let across = |(x, y): (f64, f64)| {
        let t = y - 0.5 * (height as f64 - 1.0);
        let at = 0.5 * (width as f64 - 1.0) + slope * t + bend * t * t;
        (x - at) * lean_deg.to_radians().cos()
    };
    pixels.map(|pixel| profile(across(pixel))).collect()
}

/// Of a step behind a Gaussian.
fn erf_edge(sigma_px: f64) -> impl Fn(f64) -> f64 {
    move |distance: f64| {
        let tail = 0.6 * upper_tail(distance.abs() / sigma_px);
        if distance > 0.0 { 0.8 - tail } else { 0.2 + tail }
    }
}

fn gaussian(sigma_px: f64, cycles_px: f64) -> f64 {
    (-2.0 * (PI * sigma_px * cycles_px).powi(2)).exp()
}

#[test]
fn edges_in_closed_form_have_their_transfer_functions() {
    for sigma_px in [0.5, 0.8, 2.0] {
        for lean_deg in [3.0, 5.0, -8.0] {
            let values = picture([120, 140], lean_deg, 0.0, erf_edge(sigma_px));
            let edge = edge_mtf(&values, [120, 140]).expect("an edge");
            assert!((edge.angle_deg - lean_deg.abs()).abs() < 0.01, "{lean_deg}: {}", edge.angle_deg);
            for cycles_px in [0.0, 0.1, 0.2, 0.3, 0.4, 0.5] {
                let (found, expected) = (edge.at(cycles_px), gaussian(sigma_px, cycles_px));
                assert!(
                    (found - expected).abs() < 6e-3,
                    "{sigma_px} {lean_deg} {cycles_px}: {found} {expected}"
                );
            }
            let half = (0.5 * std::f64::consts::LN_2).sqrt() / (PI * sigma_px);
            assert!((edge.mtf50().expect("below 1") / half - 1.0).abs() < 0.01);
        }
    }
}

#[test]
fn flat_and_bent_edges_are_measured_too() {
    let upright = picture([100, 130], 6.0, 0.0, erf_edge(1.0));
    let turned: Vec<f64> =
        (0..100).flat_map(|x| (0..130).map(move |y| (x, y))).map(|(x, y)| upright[y * 100 + x]).collect();
    let [one, other] = [(upright, [100, 130]), (turned, [130, 100])]
        .map(|(values, size)| edge_mtf(&values, size).expect("an edge"));
    assert_eq!(one.at(0.3), other.at(0.3));
    assert_eq!((one.normal.x, one.normal.y), (other.normal.y, other.normal.x));
    let bent = edge_mtf(&picture([100, 130], 6.0, 5e-4, erf_edge(1.0)), [100, 130]).expect("an edge");
    assert!((bent.at(0.3) - gaussian(1.0, 0.3)).abs() < 0.01, "{}", bent.at(0.3));
}

#[test]
fn what_is_no_slanted_edge_is_refused() {
    let step = erf_edge(1.0);
    let measure = |values: &[f64], size| edge_mtf(values, size).map(|edge| edge.at(0.1));
    assert_eq!(measure(&[0.0; 64], [8, 8]), Err(EdgeError::Small(8, 8)));
    assert_eq!(measure(&[0.5; 1024], [32, 32]), Err(EdgeError::Flat));
    assert_eq!(measure(&[f64::NAN; 1024], [32, 32]), Err(EdgeError::Flat));
    let parallel = picture([64, 64], 0.2, 0.0, &step);
    assert!(matches!(measure(&parallel, [64, 64]), Err(EdgeError::Parallel(_))));
    let beside = picture([64, 64], 8.0, 0.0, |distance| step(distance + 26.0));
    assert!(
        matches!(measure(&beside, [64, 64]), Err(EdgeError::AtBorder(_))),
        "{:?}",
        measure(&beside, [64, 64])
    );
}

fn lens(spec: PointSpreadSpec) -> CameraSpec {
    CameraSpec {
        size_px: [320, 240],
        focal_px: [300.0, 290.0],
        lens: LensSpec { model: LensModel::BrownConrady, coefficients: vec![-0.2, 0.05, 1e-3, -5e-4] },
        point_spread: Some(spec),
        ..CameraSpec::default()
    }
}

#[test]
fn a_camera_has_the_transfer_function_of_its_model() {
    let specs = [
        PointSpreadSpec { sigma_px: Some(0.5), ..PointSpreadSpec::default() },
        PointSpreadSpec { sigma_px: Some(1.2), glare: 0.1, ..PointSpreadSpec::default() },
        PointSpreadSpec {
            f_number: Some(11.0),
            pixel_um: Some(3.45),
            defocus_px: Some(1.5),
            wavelength_nm: PerChannel::Each(vec![650.0, 550.0, 450.0]),
            ..PointSpreadSpec::default()
        },
    ];
    for spec in specs {
        let is_gray = spec.f_number.is_none();
        let mtf = camera_mtf(&lens(spec)).expect("a transfer function");
        assert_eq!(mtf.channels.len(), if is_gray { 1 } else { 3 });
        for channel in mtf.channels {
            assert!(channel.largest_difference < 0.02, "{channel:?}");
        }
    }
    let pixel_alone = camera_mtf(&CameraSpec { point_spread: None, ..lens(PointSpreadSpec::default()) });
    let pixel_alone = pixel_alone.expect("a transfer function");
    // The sinc of half a cycle is 2 / pi.
    let nyquist = pixel_alone.channels[0].curve.last().expect("values");
    assert!((nyquist.measured - 2.0 / PI).abs() < 0.01, "{nyquist:?}");
}
