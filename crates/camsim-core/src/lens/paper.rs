//! The paper's lens inverse (section 5): Gauss-Newton from the distorted point, without a guard. f64 twin of
//! `shaders/reverse/ray/gauss_newton.wgsl`.
//!
//! It is here for comparison: it gives up on rays that exist and accepts roots beyond the fold that no lens
//! shows. [`Lens::undistort`] is the one to use.

use glam::DVec2;

use super::Lens;

/// Most steps.
pub const MAX_STEPS: u32 = 50;
/// Residual at which a point counts as found; see [`gauss_newton`] for its unit.
pub const MAX_RESIDUAL: f64 = 0.1;
/// Residual beyond which the search is given up.
pub const DIVERGED: f64 = 500.0;

/// Ideal point that the search ends at, or `None` where it does not converge.
///
/// Each step is `J^-1 (distorted - F(at))`, which is what Gauss-Newton's `(J'J)^-1 J'` comes to for a square
/// J. The search ends without an answer when the residual grows or passes [`DIVERGED`], and with one when it
/// falls below [`MAX_RESIDUAL`]. The residual is `|(W du, H dv)|`, picture sizes times normalised
/// coordinates, as the paper's program measures it: less than a pixel where the focal length is shorter than
/// the picture.
#[must_use]
pub fn gauss_newton(lens: &Lens, distorted: DVec2, size_px: [u32; 2]) -> Option<DVec2> {
    let size = DVec2::new(f64::from(size_px[0]), f64::from(size_px[1]));
    let mut at = distorted;
    let mut residual = distorted - lens.distort(at);
    let mut error = f64::INFINITY;
    for _ in 0..MAX_STEPS {
        let next = at + lens.jacobian(at).inverse() * residual;
        residual = distorted - lens.distort(next);
        let next_error = (size * residual).length();
        // Written so that NaN ends the search too.
        if !(next_error <= error && next_error <= DIVERGED) {
            return None;
        }
        (at, error) = (next, next_error);
        if error < MAX_RESIDUAL {
            return Some(at);
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

    /// The paper's badly installed fisheye: Galaxy S3, calibrated by Agisoft Lens.
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
    fn on_the_papers_own_lens_it_misses_rays_and_accepts_false_ones() {
        let camera = fisheye();
        let [width, height] = camera.size_px;
        let (mut with_ray, mut missed, mut false_roots, mut worst_px) = (0_u32, 0_u32, 0_u32, 0.0_f64);
        for i in 0..width * height {
            let pixel = DVec2::new(f64::from(i % width), f64::from(i / width));
            let found = gauss_newton(&camera.lens, camera.distorted_from_pixel(pixel), camera.size_px);
            let truth = camera.unproject(pixel);
            with_ray += u32::from(truth.is_some());
            match (found, truth) {
                (None, Some(_)) => missed += 1,
                (Some(found), truth) => match truth.filter(|truth| (found.distance(*truth) * 307.6075) < 1.0)
                {
                    Some(truth) => worst_px = worst_px.max(found.distance(truth) * 307.6075),
                    None => false_roots += 1,
                },
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
        // A prototype found 6.8 and 1.5; the share depends on who counts what as missed.
        assert!(
            (3.0..12.0).contains(&(100.0 * f64::from(missed) / f64::from(with_ray)))
                && percent(false_roots) > 0.3
        );
    }

    #[test]
    fn near_the_axis_it_is_as_good_as_any() {
        let camera = fisheye();
        for pixel in [DVec2::new(305.0, 226.0), DVec2::new(200.0, 300.0), DVec2::new(400.0, 120.0)] {
            let found =
                gauss_newton(&camera.lens, camera.distorted_from_pixel(pixel), camera.size_px).unwrap();
            assert!(camera.project(found).distance(pixel) < 0.1);
        }
    }
}
