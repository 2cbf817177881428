//! Lenses that no glass makes: pixels without a ray, rays that are imaged far from where the focal length says.

use camsim_core::{
    camera::CameraModel,
    scenario::{CameraSpec, LensModel},
};
use glam::DVec2;

use super::{Doubt, is_flat, model};

/// Most samples along a side.
const SAMPLES: u32 = 32;
/// Fraction of the pixels without a ray from which on it is told.
const NO_RAY: f64 = 0.005;
/// Fraction of the pixels with a ray below which the coefficients are probably wrong.
const FEW_RAYS: f64 = 0.6;
/// Largest usual tangential coefficient; those of published calibrations are below 0.013.
const MOST_TANGENTIAL: f64 = 0.03;

/// What is odd about the rays of a lens over the picture. That an image circle leaves pixels empty is meant.
pub(super) fn doubts_of_rays(camera: &CameraSpec) -> Vec<Doubt> {
    let bare = CameraSpec { image_circle: None, ..camera.clone() };
    let Some(seen) = model(&bare).map(|model| Seen::over(&model, camera.lens.model)) else {
        return Vec::new();
    };
    [seen.rays_doubt(&camera.lens.coefficients), seen.scale_doubt()].into_iter().flatten().collect()
}

/// What a grid of pixels sees.
#[derive(Default)]
struct Seen {
    pixels: u32,
    with_ray: u32,
    /// Angle off axis of a ray, and that of the lens without distortion at the same pixel, radians; those that
    /// differ most.
    worst: Option<[f64; 2]>,
}

impl Seen {
    fn over(camera: &CameraModel, lens: LensModel) -> Self {
        let positions = |size: u32| {
            let count = size.min(SAMPLES);
            let step = f64::from(size - 1) / f64::from(count.max(2) - 1);
            (0..count).map(move |index| f64::from(index) * step)
        };
        let [width, height] = camera.size_px;
        let mut seen = Self::default();
        for y in positions(height) {
            for x in positions(width) {
                seen.add(camera, lens, DVec2::new(x, y));
            }
        }
        seen
    }

    fn add(&mut self, camera: &CameraModel, lens: LensModel, pixel: DVec2) {
        self.pixels += 1;
        let Some(ray) = camera.ray(pixel) else { return };
        self.with_ray += 1;
        let angle = ray.truncate().length().atan2(ray.z);
        let distorted = camera.distorted_from_pixel(pixel).length();
        let plain = if is_flat(lens) { distorted.atan() } else { distorted };
        if has_plain_scale(lens) && is_unlike(lens, angle, plain) {
            let off = |[a, b]: [f64; 2]| (a / b).ln().abs();
            if self.worst.is_none_or(|worst| off([angle, plain]) > off(worst)) {
                self.worst = Some([angle, plain]);
            }
        }
    }

    fn rays_doubt(&self, coefficients: &[f64]) -> Option<Doubt> {
        let fraction = f64::from(self.with_ray) / f64::from(self.pixels.max(1));
        let few = match fraction < FEW_RAYS && !coefficients.is_empty() {
            true => format!(
                ": {:.0} % of the pixels have a ray, so check the order and the scale of the coefficients; see",
                100.0 * fraction
            ),
            false => ": see".to_owned(),
        };
        (1.0 - fraction >= NO_RAY).then(|| {
            Doubt::new(
                "lens",
                format!(
                    "about {:.0} % of the picture has no ray through the lens and stays empty (alpha 0){few} `camsim \
                     lens FILE.toml check`",
                    100.0 * (1.0 - fraction)
                ),
            )
        })
    }

    fn scale_doubt(&self) -> Option<Doubt> {
        let [angle, plain] = self.worst?.map(f64::to_degrees);
        let problem = format!(
            "a pixel sees {angle:.1} degrees off axis, and the focal length alone says {plain:.1}: check the order and \
             the scale of the coefficients"
        );
        Some(Doubt::new("lens.coefficients", problem))
    }
}

/// Whether the focal length is that of the lens without its coefficients.
fn has_plain_scale(lens: LensModel) -> bool {
    is_flat(lens) || matches!(lens, LensModel::KannalaBrandt | LensModel::Fisheye624)
}

/// Whether no glass makes a ray of an angle where the plain lens has another one. Near the axis nothing is seen of
/// it, and beyond 85 degrees a flat lens has no scale.
fn is_unlike(lens: LensModel, angle: f64, plain: f64) -> bool {
    if !(0.02..85_f64.to_radians()).contains(&plain) || angle > 85_f64.to_radians() {
        return false;
    }
    // Barrels of flat lenses are strong, pincushions weak. Fisheyes range from orthographic ones to flat ones.
    let ratio = if is_flat(lens) { plain.tan() / angle.tan() } else { plain / angle };
    let usual = if is_flat(lens) { 1.0 / 6.0..=1.6 } else { 0.4..=2.5 };
    !usual.contains(&ratio)
}

/// Terms in another order: `k1 k2 k3 p1 p2` as `k1 k2 p1 p2 k3`.
pub(super) fn tangential_doubt(camera: &CameraSpec) -> Option<Doubt> {
    if !is_flat(camera.lens.model) {
        return None;
    }
    let terms = camera.lens.coefficients.get(2..4)?;
    let most = terms.iter().fold(0.0, |most: f64, term| most.max(term.abs()));
    (most > MOST_TANGENTIAL).then(|| {
        let problem = format!(
            "the tangential terms p1 and p2 are {terms:?}, and those of lenses are below 0.01: check that the order is \
             k1 k2 p1 p2 k3"
        );
        Doubt::new("lens.coefficients", problem)
    })
}
