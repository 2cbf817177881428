//! The error of a frame's depths and points against the oracle, pixel by pixel, silhouettes included.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::{FrameView, Look, Oracle};
use crate::frame::RenderedFrame;

/// Share of the depth beyond which a depth or a point is wrong.
pub const DEPTH_TOLERANCE: f64 = 1e-3;
/// Directions in which a pixel's surroundings are looked at.
const DIRECTIONS: u32 = 16;
/// Distances of those looks, shares of the largest.
const RINGS: [f64; 3] = [0.3, 0.65, 1.0];

/// How far a frame's depths and points are from the oracle's, relative to the depth.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TruthErrors {
    /// Pixels that are valid in both.
    pub pixels: u64,
    /// Those whose depth is off by more than [`DEPTH_TOLERANCE`], or that show the sky in one of the two
    /// only.
    pub depth_beyond: u64,
    /// Of those: depths that no surface has within the distance from the pixel's centre that was allowed.
    pub depth_faults: u64,
    /// Largest error of a depth; infinite where one of the two shows the sky.
    pub depth_max: f64,
    /// Pixels whose point (north, east, down) is off by more than [`DEPTH_TOLERANCE`] of the depth.
    pub points_beyond: u64,
    /// Of those: points that lie on no surface within the distance that was allowed.
    pub point_faults: u64,
    /// Largest distance of a point, relative to the depth; infinite where one of the two shows the sky.
    pub point_max: f64,
}

impl TruthErrors {
    /// Whether every depth and point belongs to a surface that the pixel may see.
    #[must_use]
    pub fn kept(&self) -> bool {
        self.depth_faults == 0 && self.point_faults == 0
    }
}

/// Of one pixel.
#[derive(Clone, Copy, Debug, Default)]
struct PixelError {
    depth: f64,
    depth_fault: bool,
    point: f64,
    point_fault: bool,
}

/// Compares depth of frame `number`, and points where the frame has coordinates, with what the centre of each
/// pixel sees at mid-exposure. Where they differ, surfaces within `near_px` of the centre are looked at too:
/// at an edge that is nearer than this the other side counts as seen. `None` without depth, or if the frame
/// has another size than the sequence's.
#[must_use]
pub fn truth_errors(
    oracle: &Oracle,
    number: u64,
    frame: &RenderedFrame,
    near_px: f64,
) -> Option<TruthErrors> {
    let depth_m = frame.depth_m.as_ref()?;
    let width = frame.size_px[0];
    let pixels = width as usize * frame.size_px[1] as usize;
    if frame.size_px != oracle.sequence.scenario.camera.size_px
        || depth_m.len() != pixels
        || frame.color_rgba.len() != 4 * pixels
    {
        return None;
    }
    let view = oracle.view(number);
    let error_of = |i: usize| {
        let pixel = [i as u32 % width, i as u32 / width];
        let look = view.look(pixel, DVec2::ZERO, 0.0).filter(|_| frame.color_rgba[4 * i + 3] > 0.0)?;
        let depth_m = f64::from(depth_m[i]);
        let point = frame.coords.as_ref().filter(|_| depth_m > 0.0).map(|coords| {
            let [.., n, e, d] = coords[i];
            DVec3::new(n.into(), e.into(), d.into())
        });
        Some(pixel_error(&view, pixel, &look, depth_m, point, near_px))
    };
    let of_pixels: Vec<PixelError> = (0..pixels).into_par_iter().filter_map(error_of).collect();
    let mut errors = TruthErrors { pixels: of_pixels.len() as u64, ..TruthErrors::default() };
    for PixelError { depth, depth_fault, point, point_fault } in of_pixels {
        errors.depth_beyond += u64::from(depth > DEPTH_TOLERANCE);
        errors.points_beyond += u64::from(point > DEPTH_TOLERANCE);
        errors.depth_faults += u64::from(depth_fault);
        errors.point_faults += u64::from(point_fault);
        errors.depth_max = errors.depth_max.max(depth);
        errors.point_max = errors.point_max.max(point);
    }
    Some(errors)
}

fn pixel_error(
    view: &FrameView<'_>,
    pixel: [u32; 2],
    look: &Look,
    depth_m: f64,
    point: Option<DVec3>,
    near_px: f64,
) -> PixelError {
    let [depth, off] = errors_against(look, depth_m, point);
    let is_depth_off = depth > DEPTH_TOLERANCE;
    let is_point_off = off > DEPTH_TOLERANCE;
    if !is_depth_off && !is_point_off {
        return PixelError { depth, point: off, ..PixelError::default() };
    }
    let (mut depth_near, mut point_near) = (depth, off);
    for i in 0..DIRECTIONS {
        let direction = DVec2::from_angle(std::f64::consts::TAU * f64::from(i) / f64::from(DIRECTIONS));
        for ring in RINGS {
            if let Some(beside) = view.look(pixel, ring * near_px * direction, 0.0) {
                let [depth, point] = errors_against(&beside, depth_m, point);
                (depth_near, point_near) = (depth_near.min(depth), point_near.min(point));
            }
        }
    }
    PixelError {
        depth,
        depth_fault: depth_near > DEPTH_TOLERANCE,
        point: off,
        point_fault: point_near > DEPTH_TOLERANCE,
    }
}

/// Of a depth (0 = sky) and a point against what a ray meets, relative to its depth; what is not a number is
/// infinitely far off.
fn errors_against(look: &Look, depth_m: f64, point: Option<DVec3>) -> [f64; 2] {
    let Some(hit) = look.hit else {
        let error = if depth_m == 0.0 { 0.0 } else { f64::INFINITY };
        return [error, if point.is_some() { error } else { 0.0 }];
    };
    let depth = if depth_m > 0.0 { (depth_m - hit.depth_m).abs() / hit.depth_m } else { f64::INFINITY };
    // Without coordinates, and where the sky is told, there is no point to compare; the depth has been.
    let point = point.map_or(0.0, |point| point.distance(hit.point_ned_m) / hit.depth_m);
    [depth, point].map(|error| if error.is_nan() { f64::INFINITY } else { error })
}
