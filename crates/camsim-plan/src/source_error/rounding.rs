//! What single precision adds to a source coordinate, from the sizes of the numbers that are rounded.

use camsim_core::{camera::CameraModel, temporal::IdealGeometry};
use glam::{DMat2, DVec2};

use crate::{
    ir::stages::{RayStage, TemporalStage},
    view::probes::Probe,
};

/// Half a unit in the last place of a number of size 1: a rounding moves it by at most twice this, and by
/// about this in the mean square.
const UNIT: f64 = 2.980_232_238_769_531_3e-8;
/// 99th percentile of the length of a vector of two equal normal components, in their standard deviations:
/// `sqrt(-2 ln 0.01)`.
const P99: f64 = 3.035;
/// Roundings, of the size of the distorted radius each, that the residual of the lens inverse takes: the
/// square of the radius, two polynomials, their product with u and v, the tangential terms and the
/// difference, in quadrature.
const LENS_ROUNDINGS: f64 = 4.0;
/// Roundings of a component of `R d + w t`: three entries of R, three products, three sums, in quadrature.
const ROTATION_ROUNDINGS: f64 = 3.0;
/// Squared roundings of a position from the principal point: 1 / z, its product with x, with 1 - t_z w and with
/// f, that factor itself, and the sum with w t (`source_of_depth` of the shader, which has the most).
const POSITION_ROUNDINGS2: f64 = 6.0;
/// Relative roundings of an inverse depth: rasterised, blended, and solved for.
const DEPTH_ROUNDINGS: f64 = 8.0;
/// Where the paper's Gauss-Newton inverse stops, output pixels.
const GAUSS_NEWTON_STOP_PX: f64 = 0.1;

/// 99th percentiles of what rounding adds at a probe, ideal pixels.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Rounding {
    /// Of the ray: its lens inverse.
    pub lens_px: f64,
    /// Of everything after: poses, depth, and the coordinate itself.
    pub format_px: f64,
}

impl Rounding {
    /// At a probe whose source is `at_px`, displaced by `parallax_px`.
    pub fn new(
        probe: &Probe,
        at_px: DVec2,
        parallax_px: f64,
        camera: &CameraModel,
        ideal: &IdealGeometry,
        ray: RayStage,
        temporal: TemporalStage,
    ) -> Self {
        let focal_px = ideal.focal_px.max_element();
        let stretch = || largest_stretch(DMat2::from_diagonal(ideal.focal_px) * probe.uv_from_px);
        let lens_px = match ray {
            RayStage::Pinhole => P99 * UNIT * probe.uv.length() * focal_px,
            RayStage::LensMap => {
                let residual_px =
                    UNIT * LENS_ROUNDINGS * probe.distorted.length().max(0.1) * camera.focal_px.max_element();
                P99 * residual_px * stretch()
            }
            // Not rounding: it stops there. Roots that are false are beyond any prediction.
            RayStage::GaussNewton => GAUSS_NEWTON_STOP_PX * stretch(),
        };
        let from_centre = at_px - ideal.principal_px;
        // The last one is the sum with the principal point.
        let position_px =
            (POSITION_ROUNDINGS2 * from_centre.length_squared() + at_px.length_squared()).sqrt();
        let slant = (1.0 + (from_centre / ideal.focal_px).length_squared()).sqrt();
        let turned_px = match temporal {
            TemporalStage::Identity => 0.0,
            _ => ROTATION_ROUNDINGS * focal_px * slant,
        };
        let depth_px = DEPTH_ROUNDINGS * parallax_px;
        let format_px =
            UNIT * (position_px * position_px + turned_px * turned_px + depth_px * depth_px).sqrt();
        Self { lens_px, format_px: P99 * format_px }
    }

    /// Both together: they are independent.
    pub fn total_px(self) -> f64 {
        self.lens_px.hypot(self.format_px)
    }
}

/// Largest singular value.
fn largest_stretch(matrix: DMat2) -> f64 {
    let squares = matrix.x_axis.length_squared() + matrix.y_axis.length_squared();
    let det = matrix.determinant();
    (0.5 * (squares + (squares * squares - 4.0 * det * det).max(0.0).sqrt())).sqrt()
}
