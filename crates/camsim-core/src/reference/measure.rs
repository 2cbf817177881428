//! The error of a rendered frame's source coordinates, in pixels of its ideal frame.

use glam::DVec2;
use rayon::prelude::*;

use super::{Look, Oracle};
use crate::{frame::RenderedFrame, plan::FramePlan};

/// A depth step between neighbours, relative to the nearer, beyond what one surface has.
const STEP: f64 = 0.02;
/// Distance from a silhouette within which pixels count as "at" it, output pixels.
const NEAR_PX: i64 = 3;

/// Errors of one kind of pixel, pixels of the ideal frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ErrorStats {
    /// Pixels.
    pub count: u64,
    /// Root mean square.
    pub rms_px: f64,
    /// 99th percentile.
    pub p99_px: f64,
    /// Largest.
    pub max_px: f64,
}

impl ErrorStats {
    /// Of a set of error magnitudes.
    #[must_use]
    pub fn of(mut errors_px: Vec<f64>) -> Self {
        errors_px.sort_by(f64::total_cmp);
        let count = errors_px.len();
        let Some(&max_px) = errors_px.last() else { return Self::default() };
        let mean_square = errors_px.iter().map(|e| e * e).sum::<f64>() / count as f64;
        let p99_px = errors_px[(((count as f64) * 0.99).ceil() as usize).clamp(1, count) - 1];
        Self { count: count as u64, rms_px: mean_square.sqrt(), p99_px, max_px }
    }
}

/// How far a frame's source coordinates are from the oracle's.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CoordErrors {
    /// All pixels that have a source in both.
    pub all: ErrorStats,
    /// Those farther than 3 px from any silhouette.
    pub smooth: ErrorStats,
    /// The others.
    pub silhouettes: ErrorStats,
    /// Valid in the frame but not by the oracle.
    pub falsely_valid: u64,
    /// Valid by the oracle but not in the frame.
    pub missing: u64,
}

/// Compares `coords` of a frame, rendered by `plan` at exposure phase `phase`, with the oracle: where the point that the pixel's own ray
/// meets lies in the ideal frame. Every `step`-th pixel in both directions. `None` without coords.
#[must_use]
pub fn coord_errors(oracle: &Oracle, plan: &FramePlan, frame: &RenderedFrame, phase: f64, step: u32) -> Option<CoordErrors> {
    let coords = frame.coords.as_ref()?;
    let [width, height] = frame.size_px;
    let looks: Vec<Option<Look>> =
        (0..width * height).into_par_iter().map(|i| oracle.look(plan.frame, [i % width, i / width], DVec2::ZERO, phase)).collect();
    let camera_from_ned = plan.key_pose.ned_from_camera.inverse();
    let source = |look: &Look| {
        let in_key = match &look.hit {
            Some(hit) => camera_from_ned * (hit.point_ned_m - plan.key_pose.position_ned_m),
            None => camera_from_ned * (look.pose.ned_from_camera * look.uv.extend(1.0)),
        };
        plan.ideal.px_from_point(in_key)
    };
    let at = |x: i64, y: i64| looks[(y.clamp(0, i64::from(height) - 1) * i64::from(width) + x.clamp(0, i64::from(width) - 1)) as usize];
    let jumps = |a: Option<Look>, b: Option<Look>| match (a.and_then(|l| l.hit), b.and_then(|l| l.hit)) {
        (Some(a), Some(b)) => a.surface != b.surface || (a.depth_m - b.depth_m).abs() > STEP * a.depth_m.min(b.depth_m),
        (None, None) => false,
        _ => a.is_some() && b.is_some(),
    };
    let (mut smooth, mut edges) = (Vec::new(), Vec::new());
    let mut errors = CoordErrors::default();
    for y in (0..height).step_by(step.max(1) as usize) {
        for x in (0..width).step_by(step.max(1) as usize) {
            let i = (y * width + x) as usize;
            let valid = frame.color_rgba[4 * i + 3] > 0.0;
            let Some(look) = &looks[i] else {
                errors.falsely_valid += u64::from(valid);
                continue;
            };
            if !valid {
                errors.missing += 1;
                continue;
            }
            let found = DVec2::new(f64::from(coords[i][2]), f64::from(coords[i][3]));
            let error_px = found.distance(source(look));
            let (x, y) = (i64::from(x), i64::from(y));
            let near = (-NEAR_PX..=NEAR_PX).any(|dy| (-NEAR_PX..=NEAR_PX).any(|dx| jumps(Some(*look), at(x + dx, y + dy))));
            if near { &mut edges } else { &mut smooth }.push(error_px);
        }
    }
    errors.all = ErrorStats::of(smooth.iter().chain(&edges).copied().collect());
    errors.smooth = ErrorStats::of(smooth);
    errors.silhouettes = ErrorStats::of(edges);
    Some(errors)
}
