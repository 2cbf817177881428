//! Errors of a frame's depths and points against the reference, pixel by pixel, silhouettes included.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use serde::Serialize;

use super::{FrameView, RaySample, ReferenceRenderer};
use crate::frame::RenderedFrame;

/// Fraction of the depth beyond which a depth or a point is wrong.
pub const DEPTH_TOLERANCE: f64 = 1e-3;
/// Number of directions in which the surroundings of a pixel are sampled.
const DIRECTIONS: u32 = 16;
/// Distances of those samples, as fractions of the largest.
const RINGS: [f64; 3] = [0.3, 0.65, 1.0];

/// Errors of a frame's depths and points against the reference, relative to the depth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct TruthErrors {
    /// Pixels that are valid in both.
    pub pixels: u64,
    /// Pixels whose depth is off by more than [`DEPTH_TOLERANCE`], or that show the sky in one of the two
    /// only.
    pub depth_beyond: u64,
    /// Pixels counted in `depth_beyond` whose depth is that of no surface within the allowed distance from
    /// the pixel's centre.
    pub depth_faults: u64,
    /// Largest error of a depth; infinite if only one of the two shows the sky.
    pub depth_max: f64,
    /// Pixels whose point (north, east, down) is off by more than [`DEPTH_TOLERANCE`] of the depth.
    pub points_beyond: u64,
    /// Pixels counted in `points_beyond` whose point lies on no surface within the allowed distance.
    pub point_faults: u64,
    /// Largest distance of a point, relative to the depth; infinite if only one of the two shows the sky.
    pub point_max: f64,
}

impl TruthErrors {
    /// Whether every depth and point belongs to a surface that is visible within the allowed distance of its
    /// pixel.
    #[must_use]
    pub fn is_consistent(&self) -> bool {
        self.depth_faults == 0 && self.point_faults == 0
    }
}

/// Errors of one pixel.
#[derive(Clone, Copy, Debug, Default)]
struct PixelError {
    depth: f64,
    depth_fault: bool,
    point: f64,
    point_fault: bool,
}

/// Compares the depth of frame `number`, and its points if it has coordinates, with the sample at the centre
/// of each pixel at mid-exposure. Where they differ, surfaces within `near_px` of the centre are sampled as
/// well, because both sides of an edge that near are acceptable. `None` without depth, or if the size differs
/// from that of the sequence.
#[must_use]
pub fn truth_errors(
    reference: &ReferenceRenderer,
    number: u64,
    frame: &RenderedFrame,
    near_px: f64,
) -> Option<TruthErrors> {
    let (depth_m, color_rgba, coords) = (frame.depth_m()?, frame.color_rgba(), frame.coords());
    let width = frame.size_px[0];
    let pixels = width as usize * frame.size_px[1] as usize;
    if frame.size_px != reference.sequence.scenario.camera.size_px
        || depth_m.len() != pixels
        || color_rgba.len() != 4 * pixels
    {
        return None;
    }
    let view = reference.view(number);
    let error_of = |i: usize| {
        let pixel = [i as u32 % width, i as u32 / width];
        let sample = view.sample(pixel, DVec2::ZERO, 0.0).filter(|_| color_rgba[4 * i + 3] > 0.0)?;
        let depth_m = f64::from(depth_m[i]);
        let point = coords.filter(|_| depth_m > 0.0).map(|coords| {
            let [.., n, e, d] = coords[i];
            DVec3::new(n.into(), e.into(), d.into())
        });
        Some(depth_and_point_error(&view, pixel, &sample, depth_m, point, near_px))
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

fn depth_and_point_error(
    view: &FrameView<'_>,
    pixel: [u32; 2],
    sample: &RaySample,
    depth_m: f64,
    point: Option<DVec3>,
    near_px: f64,
) -> PixelError {
    let [depth, off] = errors_against(sample, depth_m, point);
    let is_depth_off = depth > DEPTH_TOLERANCE;
    let is_point_off = off > DEPTH_TOLERANCE;
    if !is_depth_off && !is_point_off {
        return PixelError { depth, point: off, ..PixelError::default() };
    }
    let (mut depth_near, mut point_near) = (depth, off);
    for i in 0..DIRECTIONS {
        let direction = DVec2::from_angle(std::f64::consts::TAU * f64::from(i) / f64::from(DIRECTIONS));
        for ring in RINGS {
            if let Some(beside) = view.sample(pixel, ring * near_px * direction, 0.0) {
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

/// Errors of a depth (0 = sky) and of a point against a sample, relative to its depth. Values that are not
/// numbers are infinitely wrong.
fn errors_against(sample: &RaySample, depth_m: f64, point: Option<DVec3>) -> [f64; 2] {
    let Some(hit) = sample.hit else {
        let error = if depth_m == 0.0 { 0.0 } else { f64::INFINITY };
        return [error, if point.is_some() { error } else { 0.0 }];
    };
    let depth = if depth_m > 0.0 { (depth_m - hit.depth_m).abs() / hit.depth_m } else { f64::INFINITY };
    // Without coordinates, or for the sky, there is no point to compare; the depth has been compared already.
    let point = point.map_or(0.0, |point| point.distance(hit.point_ned_m) / hit.depth_m);
    [depth, point].map(|error| if error.is_nan() { f64::INFINITY } else { error })
}
