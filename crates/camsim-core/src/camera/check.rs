//! Check of a calibration: where the lens folds, and for which part of the image it has ideal rays.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use serde::Serialize;

use super::{CameraError, CameraModel};
use crate::lens::{FOLD_RAYS, Lens};
use crate::scenario::{CameraSpec, Primary};

/// Approximate number of pixels that are tested. Larger images are sampled on a regular grid that includes
/// the borders.
const MAX_SAMPLES: f64 = 250_000.0;

/// Grid over the image on which the branch is tested for being one-to-one.
const BIJECTIVITY_GRID: u32 = 33;

/// Report of [`CameraModel::check`] (`camsim lens CAMERA.toml check --json`).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LensCheck {
    /// Fraction of the pixels that have an ideal ray, within what an ideal plane holds.
    pub valid_fraction: f64,
    /// Fraction of the pixels that have a ray at any angle.
    pub ray_fraction: f64,
    /// Largest angle off axis of such a ray, degrees.
    pub angle_max_deg: f64,
    /// Smallest ideal radius `|(u, v)|` at which the model folds or has a pole; `None` if it has neither
    /// within 89 degrees.
    pub fold_radius_min: Option<f64>,
    /// Largest such radius over all directions.
    pub fold_radius_max: Option<f64>,
    /// Largest distance of a pixel from where its ray is imaged.
    pub worst_roundtrip_px: f64,
    /// Whether no pixel has two ideal rays on the principal branch.
    pub bijective: bool,
    /// Largest distances at which red and blue are imaged from green, pixels, where they have lenses of their
    /// own ([`fringes_px`]).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fringes_px: Option<[f64; 2]>,
}

/// Largest distances of the images of red and blue from that of green over the picture, pixels; `None` of a camera
/// with one lens for all colours.
///
/// # Errors
/// A camera that cannot be used.
pub fn fringes_px(spec: &CameraSpec) -> Result<Option<[f64; 2]>, CameraError> {
    if !spec.is_chromatic() {
        return Ok(None);
    }
    let green = CameraModel::from_spec(spec)?;
    let [width, height] = green.size_px.map(|side| f64::from(side - 1) / f64::from(BIJECTIVITY_GRID - 1));
    let pixels = (0..BIJECTIVITY_GRID * BIJECTIVITY_GRID).map(|cell| {
        let (column, row) = (cell % BIJECTIVITY_GRID, cell / BIJECTIVITY_GRID);
        DVec2::new(f64::from(column) * width, f64::from(row) * height)
    });
    let rays: Vec<(DVec2, DVec3)> =
        pixels.filter_map(|pixel| green.ray(pixel).map(|ray| (pixel, ray))).collect();
    let widest = |primary| {
        let camera = CameraModel::from_spec(&spec.of_primary(primary))?;
        let seen = rays.iter().filter(|(_, ray)| camera.lens.contains_ray(*ray));
        let widths = seen.map(|(pixel, ray)| camera.project_ray(*ray).distance(*pixel));
        Ok::<f64, CameraError>(widths.fold(0.0, f64::max))
    };
    Ok(Some([widest(Primary::Red)?, widest(Primary::Blue)?]))
}

/// What some of the pixels see.
#[derive(Clone, Copy, Default)]
struct Seen {
    valid: usize,
    with_ray: usize,
    angle_max_rad: f64,
    worst_px: f64,
}

impl Seen {
    fn and(self, other: Self) -> Self {
        Self {
            valid: self.valid + other.valid,
            with_ray: self.with_ray + other.with_ray,
            angle_max_rad: self.angle_max_rad.max(other.angle_max_rad),
            worst_px: self.worst_px.max(other.worst_px),
        }
    }
}

impl CameraModel {
    /// Checks lens and intrinsics over the image.
    pub fn check(&self) -> LensCheck {
        let [width, height] = self.size_px;
        let area = f64::from(width) * f64::from(height);
        let stride = (area / MAX_SAMPLES).sqrt().max(1.0);
        let (xs, ys) = (samples(width, stride), samples(height, stride));
        let row = |y: &f64| {
            xs.iter().map(|&x| self.check_pixel(DVec2::new(x, *y))).fold(Seen::default(), Seen::and)
        };
        let seen = ys.par_iter().map(row).reduce(Seen::default, Seen::and);
        let all = (xs.len() * ys.len()) as f64;
        let fold = self.lens.fold_curve().filter(|fold| fold.folds()).map(|fold| fold.range());
        LensCheck {
            valid_fraction: seen.valid as f64 / all,
            ray_fraction: seen.with_ray as f64 / all,
            angle_max_deg: seen.angle_max_rad.to_degrees(),
            fold_radius_min: fold.map(|(min, _)| min),
            fold_radius_max: fold.map(|(_, max)| max),
            worst_roundtrip_px: seen.worst_px,
            bijective: self.is_bijective(),
            fringes_px: None,
        }
    }

    fn check_pixel(&self, pixel: DVec2) -> Seen {
        let ray = self.ray(pixel);
        let off_px = |image: DVec2| (image - pixel).length();
        let ideal = self.unproject(pixel);
        let worst_px = ray.map_or(0.0, |ray| off_px(self.project_ray(ray)));
        Seen {
            valid: usize::from(ideal.is_some()),
            with_ray: usize::from(ray.is_some()),
            angle_max_rad: ray.map_or(0.0, |ray| ray.truncate().length().atan2(ray.z)),
            worst_px: ideal.map_or(worst_px, |ideal| worst_px.max(off_px(self.project(ideal)))),
        }
    }

    /// On the branch the determinant is positive, so the number of pre-images of a distorted point equals the
    /// winding number of the border's image around it.
    fn is_bijective(&self) -> bool {
        let Some(border) = distorted_border(&self.lens) else { return true };
        let [width, height] = self.size_px.map(|size| f64::from(size - 1) / f64::from(BIJECTIVITY_GRID - 1));
        let cells = BIJECTIVITY_GRID * BIJECTIVITY_GRID;
        (0..cells).into_par_iter().all(|cell| {
            let (column, row) = (cell % BIJECTIVITY_GRID, cell / BIJECTIVITY_GRID);
            let pixel = DVec2::new(f64::from(column) * width, f64::from(row) * height);
            winding_number(&border, self.distorted_from_pixel(pixel)) <= 1
        })
    }
}

/// Image of the fold curve, slightly inside of it (a pole itself has no image); `None` for a lens without a
/// fold curve.
fn distorted_border(lens: &Lens) -> Option<Vec<DVec2>> {
    let radii = lens.fold_curve()?.radii();
    let ray = |(i, radius): (usize, &f64)| {
        let direction = DVec2::from_angle(i as f64 * std::f64::consts::TAU / FOLD_RAYS as f64);
        lens.distort(direction * (radius * (1.0 - 1e-9)))
    };
    Some(radii.iter().enumerate().map(ray).collect())
}

/// Winding number of a closed polygon around a point, anticlockwise positive.
fn winding_number(polygon: &[DVec2], point: DVec2) -> i32 {
    polygon
        .iter()
        .zip(polygon.iter().cycle().skip(1))
        .map(|(a, b)| {
            let left = (*b - *a).perp_dot(point - *a);
            if a.y <= point.y && b.y > point.y && left > 0.0 {
                1
            } else if a.y > point.y && b.y <= point.y && left < 0.0 {
                -1
            } else {
                0
            }
        })
        .sum()
}

/// Pixel coordinates `0, ..., size - 1`, about `stride` apart.
fn samples(size: u32, stride: f64) -> Vec<f64> {
    let last = f64::from(size - 1);
    let count = (last / stride).round().max(1.0).min(last.max(1.0));
    if size == 1 { vec![0.0] } else { (0..=count as u32).map(|i| f64::from(i) * last / count).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::ChromaticSpec;

    #[test]
    fn fringes_are_widest_in_the_corner() {
        let chromatic = ChromaticSpec {
            red_scale: vec![1.0, 0.0, 0.002],
            blue_scale: vec![0.999],
            ..ChromaticSpec::default()
        };
        let spec = CameraSpec { chromatic: Some(chromatic), ..CameraSpec::default() };
        let [red, blue] = fringes_px(&spec).expect("a camera").expect("two lenses");
        // The corner's pixel of 640x480, in pixels and in halves of the shorter side.
        let corner = 319.5_f64.hypot(239.5);
        assert!((blue - 0.001 * corner).abs() < 1e-9, "{blue}");
        assert!((red - 0.002 * corner * (corner / 240.0).powi(2)).abs() < 1e-9, "{red}");
        assert_eq!(fringes_px(&CameraSpec::default()), Ok(None));
    }

    #[test]
    fn winding_numbers_count_turns() {
        let turns = |count: f64| -> Vec<DVec2> {
            (0..100).map(|i| DVec2::from_angle(f64::from(i) * 0.01 * count * std::f64::consts::TAU)).collect()
        };
        for (polygon, inside) in [(turns(1.0), 1), (turns(2.0), 2), (turns(-1.0), -1)] {
            assert_eq!(winding_number(&polygon, DVec2::new(0.2, 0.3)), inside);
            assert_eq!(winding_number(&polygon, DVec2::new(1.2, 0.3)), 0);
        }
    }
}
