//! The lens models against other programs (scripts/goldens/lens_models.py) and against a scan: region of validity
//! and inverse of real and hostile coefficient sets, judged by the forward function alone.
#![allow(clippy::unwrap_used)]

use std::f64::consts::{PI, TAU};
use std::panic::{AssertUnwindSafe, catch_unwind};

use camsim_core::camera::CameraModel;
use camsim_core::lens::{Lens, LensModel};
use glam::{DVec2, DVec3};
use rayon::prelude::*;

const FORWARD_TOLERANCE_PX: f64 = 1e-6;
const RAYS: usize = 240;
const STEPS: usize = 500;
/// Pixels nearer to the image of the border are not judged: it is a polygon here.
const UNJUDGED_PX: f64 = 0.5;
/// Finite differences of images beyond, in units of the focal length, are rounding errors.
const UNDECIDED: f64 = 1e6;
/// Neighbouring directions whose ends differ by more than this ratio end on different sheets of the border.
const SHEET_RATIO: f64 = 1.1;

struct Set {
    name: String,
    camera: CameraModel,
}

fn model_by_name(name: &str) -> LensModel {
    *LensModel::ALL.iter().find(|model| model.facts().name == name).unwrap()
}

fn golden_sets() -> Vec<Set> {
    let text = include_str!("../../../tests/data/lens_models.csv");
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

#[test]
fn forward_agrees_with_other_programs() {
    let sets = golden_sets();
    let mut checked = vec![0; sets.len()];
    for line in include_str!("../../../tests/data/lens_models_forward.csv").lines().skip(1) {
        let (name, numbers) = line.split_once(',').unwrap();
        let v: Vec<f64> = numbers.split(',').map(|cell| cell.parse().unwrap()).collect();
        let (ray, expected) = (DVec3::new(v[0], v[1], v[2]), DVec2::new(v[3], v[4]));
        let i = sets.iter().position(|set| set.name == name).unwrap();
        let camera = &sets[i].camera;
        if !camera.lens.contains_ray(ray) {
            continue;
        }
        let error_px = (camera.project_ray(ray) - expected).length();
        assert!(error_px < FORWARD_TOLERANCE_PX, "{name} {ray}: {error_px} px from {expected}");
        if ray.z > 0.02 {
            let error_px = (camera.project(ray.truncate() / ray.z) - expected).length();
            assert!(error_px < FORWARD_TOLERANCE_PX, "{name} {ray}, ideal point: {error_px} px");
        }
        checked[i] += 1;
    }
    for (set, checked) in sets.iter().zip(checked) {
        assert!(checked >= 8, "{}: only {checked} rays", set.name);
    }
}

/// Twenty sets of each model, of Brown-Conrady with five and with eight coefficients, most of them far from any real lens.
fn hostile_sets() -> Vec<Set> {
    use LensModel::{
        BrownConrady, BrownConradyPrism, Division, DoubleSphere, Eucm, FTheta, FThetaInverse, Fisheye624,
        Fov, KannalaBrandt, Mei, Ucm,
    };
    // For each coefficient its middle and by how much it may differ.
    let models: [(LensModel, &[[f64; 2]]); 13] = [
        (
            BrownConradyPrism,
            &[
                [0.0, 0.5],
                [0.0, 0.3],
                [0.0, 0.05],
                [0.0, 0.05],
                [0.0, 0.1],
                [0.0, 0.3],
                [0.0, 0.1],
                [0.0, 0.05],
                [0.0, 0.1],
                [0.0, 0.05],
                [0.0, 0.1],
                [0.0, 0.05],
                [0.0, 0.4],
                [0.0, 0.4],
            ],
        ),
        (
            Fisheye624,
            &[
                [0.0, 0.1],
                [0.0, 0.05],
                [0.0, 0.02],
                [0.0, 5e-3],
                [0.0, 1e-3],
                [0.0, 2e-4],
                [0.0, 0.05],
                [0.0, 0.05],
                [0.0, 0.05],
                [0.0, 0.03],
                [0.0, 0.05],
                [0.0, 0.03],
            ],
        ),
        (KannalaBrandt, &[[0.0, 0.3], [0.0, 0.1], [0.0, 0.02], [0.0, 2e-3]]),
        (
            FTheta,
            &[
                [1.0, 0.3],
                [0.0, 0.3],
                [0.0, 0.2],
                [0.0, 0.1],
                [0.0, 0.02],
                [1.0, 0.1],
                [0.0, 0.1],
                [0.0, 0.1],
            ],
        ),
        (
            FThetaInverse,
            &[
                [1.0, 0.3],
                [0.0, 0.2],
                [0.0, 0.1],
                [0.0, 0.05],
                [0.0, 0.02],
                [1.0, 0.1],
                [0.0, 0.1],
                [0.0, 0.1],
            ],
        ),
        (DoubleSphere, &[[0.0, 0.9], [0.5, 0.5]]),
        (Eucm, &[[0.5, 0.5], [2.0, 1.9]]),
        (Ucm, &[[0.5, 0.5]]),
        (Mei, &[[2.0, 2.0], [0.0, 2.0], [0.0, 3.0], [0.0, 0.05], [0.0, 0.05]]),
        (Division, &[[-1.0, 2.0]]),
        (Fov, &[[1.5, 1.45]]),
        (BrownConrady, &[[0.0, 0.6], [0.0, 0.4], [0.0, 0.05], [0.0, 0.05], [0.0, 0.3]]),
        (
            BrownConrady,
            &[
                [0.0, 0.8],
                [0.0, 0.6],
                [0.0, 0.05],
                [0.0, 0.05],
                [0.0, 0.3],
                [0.0, 0.8],
                [0.0, 0.6],
                [0.0, 0.3],
            ],
        ),
    ];
    let mut state = 48_u64;
    // Knuth's generator: -1 to 1.
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    };
    let mut sets = Vec::new();
    for (model, bounds) in models {
        for i in 0..20 {
            let k: Vec<f64> = bounds.iter().map(|[middle, reach]| middle + reach * random()).collect();
            let focal = [290.0 + 200.0 * random(), 290.0 + 200.0 * random()];
            let centre = [320.0 + 120.0 * random(), 240.0 + 90.0 * random()];
            let camera = CameraModel::new([640, 480], focal, Some(centre), model, &k).unwrap();
            sets.push(Set { name: format!("{} {i} {k:?}", model.facts().name), camera });
        }
    }
    sets
}

fn ray(phi: f64, theta: f64) -> DVec3 {
    (DVec2::from_angle(phi) * theta.sin()).extend(theta.cos())
}

/// Where a scan along a direction ends: the last regular angle and the first that is not.
struct Border {
    last_good: f64,
    first_bad: f64,
    /// The first regular angle whose image is far from the picture.
    far: Option<f64>,
    /// The image was flung to infinity and came back from the other side.
    is_pole: bool,
}

impl Set {
    fn distorted(&self, ray: DVec3) -> DVec2 {
        (self.camera.project_ray(ray) - self.camera.principal_point_px) / self.camera.focal_px
    }

    /// Whether the forward function is regular at the angle theta in the direction phi: finite, and with a positive
    /// determinant of its finite differences in the plane of angles; of rotation-symmetric lenses both
    /// magnifications are positive.
    fn is_regular(&self, phi: f64, theta: f64) -> bool {
        let image = |at: DVec2| self.distorted(ray(at.y.atan2(at.x), at.length()));
        let (at, h) = (DVec2::from_angle(phi) * theta, 1e-6);
        let [a, b] =
            [DVec2::X, DVec2::Y].map(|axis| (image(at + h * axis) - image(at - h * axis)) / (2.0 * h));
        let is_positive = !matches!(self.camera.lens, Lens::Radial(_)) || a.x + b.y > 0.0;
        a.perp_dot(b) > 0.0 && is_positive
    }

    /// Angles that a lens may have: those of a plane, or all.
    fn limit(&self) -> f64 {
        let is_flat =
            matches!(self.camera.lens.model(), LensModel::BrownConrady | LensModel::BrownConradyPrism);
        if is_flat { 89.0 * PI / 180.0 } else { PI * (1.0 - 1e-4) }
    }

    fn border(&self, phi: f64, to: f64) -> Border {
        let step = self.limit() / STEPS as f64;
        let (mut before, mut far) = (DVec2::ZERO, None);
        let far_px = 3.0 * DVec2::from(self.camera.size_px.map(f64::from)).length();
        for i in 1..=STEPS {
            let theta = i as f64 * step;
            let image = self.distorted(ray(phi, theta));
            let is_pole = image.dot(before) < 0.0 && image.length().min(before.length()) > 1.0;
            if image.length() > UNDECIDED {
                return Border {
                    last_good: theta - step,
                    first_bad: self.limit() + step,
                    far,
                    is_pole: false,
                };
            }
            if is_pole || theta > to || !self.is_regular(phi, theta) {
                return Border { last_good: theta - step, first_bad: theta, far, is_pole };
            }
            if (image * self.camera.focal_px).length() > far_px {
                far.get_or_insert(theta);
            }
            before = image;
        }
        Border { last_good: self.limit(), first_bad: self.limit() + step, far, is_pole: false }
    }
}

#[test]
fn validity_and_inverse_of_every_set() {
    let sets: Vec<Set> = golden_sets()
        .into_iter()
        .chain(hostile_sets())
        .filter(|set| set.camera.lens.model() != LensModel::Equirectangular)
        .collect();
    // Every set is judged, so that one failure does not hide others.
    let judged: Vec<Option<[usize; 2]>> =
        sets.par_iter().map(|set| catch_unwind(AssertUnwindSafe(|| judge(set))).ok()).collect();
    let failed: Vec<&String> =
        sets.iter().zip(&judged).filter(|(_, judged)| judged.is_none()).map(|(set, _)| &set.name).collect();
    assert!(failed.is_empty(), "{} sets failed: {failed:#?}", failed.len());
    let [rays, pixels] = judged.into_iter().flatten().fold([0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]);
    eprintln!("{} sets, {rays} rays found again, {pixels} pixels judged", sets.len());
    assert!(sets.len() > 370 && rays > 50_000 && pixels > 50_000);
}

/// Counts of the rays and pixels that were judged.
fn judge(set: &Set) -> [usize; 2] {
    let (name, camera) = (&set.name, &set.camera);
    let borders: Vec<Border> =
        (0..RAYS).map(|i| set.border(i as f64 * TAU / RAYS as f64, f64::INFINITY)).collect();
    // A branch that is not one-to-one has a smaller limit, which must be the same in all directions.
    let limit = camera.lens.angle_max_rad();
    let mut found = 0;
    let size = DVec2::from(camera.size_px.map(f64::from));
    let border = border_px(set, &borders, limit);
    for (i, Border { last_good, first_bad, .. }) in borders.iter().enumerate() {
        let phi = i as f64 * TAU / RAYS as f64;
        let end = last_good.min(limit);
        let beyond = first_bad + 1e-3;
        assert!(
            beyond > set.limit() || !camera.lens.contains_ray(ray(phi, beyond)),
            "{name}: direction {i} ends at {first_bad}"
        );
        // Every ray inside is found again.
        for k in 0..12 {
            let inside = ray(phi, end * (f64::from(k) + 0.7) / 12.2);
            let px = camera.project_ray(inside);
            assert!(camera.lens.contains_ray(inside), "{name}: direction {i}, share {k} of {end}");
            if !(px.cmpge(DVec2::splat(-0.5)).all() && px.cmple(size - 0.5).all()) {
                continue;
            }
            let again = camera.ray(px);
            let again = again.unwrap_or_else(|| panic!("{name}: missed {inside} at {px}"));
            let off_px = (camera.project_ray(again) - px).length();
            assert!(
                off_px < 1e-4 * (1.0 + px.length() / 1000.0),
                "{name}: {again} is imaged {off_px} px away"
            );
            // Where the border's image winds about a pixel twice, it has two rays.
            let has_one =
                border.as_ref().is_some_and(|border| border.is_whole && winding(&border.px, px).0 <= 1);
            assert!(!has_one || again.distance(inside) < 1e-5, "{name}: {inside} became {again}");
            found += 1;
        }
    }
    [found, judge_pixels(set, border.as_ref())]
}

/// The image of the border, or of a curve within it where the border's is far.
struct Rim {
    px: Vec<DVec2>,
    is_whole: bool,
}

/// `None` if a direction ends at a pole nearby, or beside one that ends much farther out: between both the curve
/// is not known.
fn border_px(set: &Set, borders: &[Border], limit: f64) -> Option<Rim> {
    let end = |(i, border): (usize, &Border)| {
        let phi = i as f64 * TAU / RAYS as f64;
        if let Some(far) = border.far.filter(|far| *far < limit) {
            return (phi, far);
        }
        // The scan ends within a step of the border: here by bisection.
        let (mut low, mut high) = (border.last_good, border.first_bad.min(set.limit()));
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            *(if set.is_regular(phi, middle) { &mut low } else { &mut high }) = middle;
        }
        (phi, low.min(limit) * (1.0 - 1e-6))
    };
    let image = |(phi, theta): (f64, f64)| {
        let px = set.camera.project_ray(ray(phi, theta));
        (px.is_finite() && px.length() < 1e5).then_some(px)
    };
    let ends: Vec<(f64, f64)> = borders.iter().enumerate().map(end).collect();
    let is_one_sheet = ends.iter().zip(ends.iter().cycle().skip(1)).all(|((_, a), (_, b))| {
        let ratio = a / b;
        (1.0 / SHEET_RATIO..SHEET_RATIO).contains(&ratio)
    });
    let is_whole = !borders.iter().any(|border| border.far.is_some_and(|far| far < limit));
    let is_known = borders.iter().all(|border| border.far.is_some() || !border.is_pole);
    let px = ends.into_iter().map(image).collect::<Option<Vec<DVec2>>>();
    px.filter(|_| is_known && is_one_sheet).map(|px| Rim { px, is_whole })
}

/// No pixel has a ray that is not inside and does not show there; none that the image of the border winds about is
/// without one.
fn judge_pixels(set: &Set, border: Option<&Rim>) -> usize {
    let (name, camera) = (&set.name, &set.camera);
    let mut judged = 0;
    for k in 0..20 * 20 {
        let share = DVec2::new(f64::from(k % 20), f64::from(k / 20)) / 19.0;
        let px = share * DVec2::from(camera.size_px.map(|side| f64::from(side - 1)));
        let answer = camera.ray(px);
        if let Some(found) = answer {
            let off_px = (camera.project_ray(found) - px).length();
            assert!(off_px < 1e-4, "{name} {px}: {found} is imaged {off_px} px away");
            let (theta, phi) = (found.truncate().length().atan2(found.z), found.y.atan2(found.x));
            let first_bad = set.border(phi, theta).first_bad;
            assert!(theta <= first_bad, "{name} {px}: {found} lies beyond the fold at {first_bad}");
        }
        // The map of a picture holds f32. Where a lens magnifies without limit (beside the end of the division
        // model) its rounding is more.
        if let Some(ideal) = camera.unproject(px) {
            let off_px = (camera.project(ideal.as_vec2().as_dvec2()) - px).length();
            let rounded =
                (camera.lens.jacobian(ideal).abs() * ideal.abs() * camera.focal_px).length() / 2_f64.powi(24);
            assert!(off_px < rounded.max(1e-3), "{name} {px}: {off_px} px in f32");
        }
        let Some(border) = border else { continue };
        let (turns, distance) = winding(&border.px, px);
        if distance > UNJUDGED_PX && (border.is_whole || turns > 0) {
            assert_eq!(
                answer.is_some(),
                turns > 0,
                "{name} {px}: {turns} turns, {distance} px from the border"
            );
            judged += 1;
        }
    }
    judged
}

/// Winding number of a closed polygon about a point, and its distance.
fn winding(polygon: &[DVec2], point: DVec2) -> (i32, f64) {
    let (mut turned, mut distance) = (0.0, f64::INFINITY);
    for (i, a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let (to_a, along) = (*a - point, b - *a);
        turned += to_a.angle_to(b - point);
        let share = (-to_a.dot(along) / along.length_squared().max(1e-300)).clamp(0.0, 1.0);
        distance = distance.min((to_a + along * share).length());
    }
    ((turned / TAU).round() as i32, distance)
}

/// Times of a lens map in f64, of each model's first camera over that of a brown-conrady lens of the same picture.
#[test]
#[ignore = "a measurement: cargo test -p camsim-core --test lens_models -- --ignored --nocapture"]
fn lens_map_times() {
    let seconds = |camera: &CameraModel| {
        let start = std::time::Instant::now();
        let rays = camera.lens_inverse();
        assert!(rays.len() > 100_000);
        start.elapsed().as_secs_f64()
    };
    let k = [-0.283, 0.074, 2e-4, 2e-5];
    let sets = golden_sets();
    for model in LensModel::ALL {
        let Some(set) = sets.iter().find(|set| set.camera.lens.model() == model) else { continue };
        let mut plain = set.camera.clone();
        plain.lens = Lens::new(LensModel::BrownConrady, &k).unwrap();
        // By turns, the least of five: other programs run beside.
        let mut least = [f64::INFINITY; 2];
        for _ in 0..5 {
            least = [least[0].min(seconds(&set.camera)), least[1].min(seconds(&plain))];
        }
        eprintln!("{}: {:.2} times brown-conrady", set.name, least[0] / least[1]);
    }
}
