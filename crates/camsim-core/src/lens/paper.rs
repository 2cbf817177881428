//! The paper's lens inverse (section 5): Gauss-Newton from the distorted point, without safeguards. f64 twin
//! of `camsim-gpu/shaders/reverse/ray/gauss_newton.wgsl`.
//!
//! It is provided for comparison: it fails for some existing rays, and accepts roots beyond the fold that no
//! lens shows. [`Lens::undistort`] is the one to use.

use glam::DVec2;

use super::Lens;

/// Largest number of steps.
const MAX_STEPS: u32 = 50;
/// Residual at which the iteration has converged; for its unit see [`gauss_newton`].
const MAX_RESIDUAL: f64 = 0.1;
/// Residual beyond which the iteration has diverged.
const DIVERGED: f64 = 500.0;

/// Ideal point at which the iteration converges, or `None`.
///
/// Each step is `J^-1 (distorted - F(ideal))`, to which Gauss-Newton's `(J'J)^-1 J'` reduces for a square J.
/// The iteration fails when the residual grows or exceeds `DIVERGED`, and has converged when it is below
/// `MAX_RESIDUAL`. The residual is `|(W du, H dv)|`, image size times normalised coordinates, as in the
/// paper's program: less than a pixel where the focal length is shorter than the image.
#[must_use]
pub fn gauss_newton(lens: &Lens, distorted: DVec2, size_px: [u32; 2]) -> Option<DVec2> {
    let size = DVec2::new(f64::from(size_px[0]), f64::from(size_px[1]));
    let mut ideal = distorted;
    let mut residual = distorted - lens.distort(ideal);
    let mut error = f64::INFINITY;
    for _ in 0..MAX_STEPS {
        let next = ideal + lens.jacobian(ideal).inverse() * residual;
        residual = distorted - lens.distort(next);
        let next_error = (size * residual).length();
        // Written so that NaN also ends the iteration.
        if !(next_error <= error && next_error <= DIVERGED) {
            return None;
        }
        (ideal, error) = (next, next_error);
        if error < MAX_RESIDUAL {
            return Some(ideal);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use crate::{
        camera::CameraModel,
        scenario::{CameraSpec, LensModel, LensSpec},
    };

    /// The paper's badly installed fisheye: Galaxy S3, calibrated with Agisoft Lens.
    fn fisheye() -> CameraModel {
        let coefficients = vec![-0.390_024, 0.111_124, -0.001_274_4, -0.008_151_7, -0.008_427_63];
        CameraModel::from_spec(&CameraSpec {
            size_px: [640, 480],
            focal_px: [307.6075; 2],
            principal_point_px: Some([305.099, 226.236]),
            lens: LensSpec { model: LensModel::BrownConrady, coefficients },
            ..CameraSpec::default()
        })
        .unwrap()
    }

    #[test]
    fn gauss_newton_misses_rays_and_accepts_false_roots_on_the_papers_lens() {
        let camera = fisheye();
        let [width, height] = camera.size_px;
        let (mut with_ray, mut missed, mut false_roots, mut worst_px) = (0_u32, 0_u32, 0_u32, 0.0_f64);
        for i in 0..width * height {
            let pixel = DVec2::new(f64::from(i % width), f64::from(i / width));
            let undistorted = gauss_newton(&camera.lens, camera.distorted_from_pixel(pixel), camera.size_px);
            let truth = camera.unproject(pixel);
            with_ray += u32::from(truth.is_some());
            match (undistorted, truth) {
                (None, Some(_)) => missed += 1,
                (Some(undistorted), truth) => {
                    match truth.filter(|truth| (undistorted.distance(*truth) * 307.6075) < 1.0) {
                        Some(truth) => worst_px = worst_px.max(undistorted.distance(truth) * 307.6075),
                        None => false_roots += 1,
                    }
                }
                (None, None) => {}
            }
        }
        let percent = |count: u32| 100.0 * f64::from(count) / f64::from(width * height);
        eprintln!(
            "S3 fisheye, Agisoft, 640x480: {:.2} % of the pixels have a ray; Gauss-Newton misses {:.2} % of these, falsely accepts {:.2} % of \
             all; worst error of the others {worst_px:.3} px",
            percent(with_ray),
            100.0 * f64::from(missed) / f64::from(with_ray),
            percent(false_roots)
        );
        // The fractions are about 6.8 and 1.5; they depend on what counts as missed.
        assert!(
            (3.0..12.0).contains(&(100.0 * f64::from(missed) / f64::from(with_ray)))
                && percent(false_roots) > 0.3
        );
    }

    #[test]
    fn gauss_newton_is_accurate_near_the_axis() {
        let camera = fisheye();
        for pixel in [DVec2::new(305.0, 226.0), DVec2::new(200.0, 300.0), DVec2::new(400.0, 120.0)] {
            let undistorted =
                gauss_newton(&camera.lens, camera.distorted_from_pixel(pixel), camera.size_px).unwrap();
            assert!(camera.project(undistorted).distance(pixel) < 0.1);
        }
    }
}
