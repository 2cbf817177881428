//! Where moving things may be seen within the exposure of each row.

use std::sync::Arc;

use camsim_core::{
    mount::CameraPath,
    row_time::WorldPoint,
    scene::{Aabb, RigidMotion},
    shutter::RowAxis,
};
use camsim_plan::FramePlan;
use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::line_count;

/// Exposure phases at which boxes are projected.
const PHASES: [f64; 3] = [-0.5, 0.0, 0.5];
/// Room around the projected corners of a box, pixels, and as a share of its size: edges that a lens bends and
/// ways that are not straight.
const ROOM_PX: f64 = 2.0;
const ROOM: f64 = 0.1;

/// Pixels in which something may move.
pub(super) struct Outline {
    /// For each row of the readout: first and last pixel along it, ascending and apart from each other.
    pub spans: Vec<Vec<[u32; 2]>>,
}

/// A box in the picture during the exposure of a row.
struct Projected {
    low_px: DVec2,
    high_px: DVec2,
}

/// Pixel of a row of the readout. Columns of both fields follow each other.
pub(super) fn pixel(plan: &FramePlan, line: usize, along: u32) -> [u32; 2] {
    match plan.shutter.row_axis() {
        RowAxis::Rows => [along, line as u32],
        RowAxis::Columns => [line as u32 / 2, 2 * along + line as u32 % 2],
    }
}

impl Outline {
    pub fn new(path: &CameraPath, plan: &FramePlan, motions: &[(Arc<RigidMotion>, Aabb)]) -> Self {
        let spans = (0..line_count(plan)).into_par_iter().map(|line| {
            let boxes =
                motions.iter().filter_map(|(motion, bounds)| project(path, plan, line, motion, bounds));
            let mut spans: Vec<[u32; 2]> =
                boxes.filter_map(|projected| span(plan, line, &projected)).collect();
            spans.sort_unstable();
            merged(&spans)
        });
        Self { spans: spans.collect() }
    }
}

/// Where a box may be seen during the exposure of a row; `None` if it is behind the camera.
fn project(
    path: &CameraPath,
    plan: &FramePlan,
    line: usize,
    motion: &RigidMotion,
    bounds: &Aabb,
) -> Option<Projected> {
    let [x, y] = pixel(plan, line, 0);
    let mid_s = plan.stamp_s + plan.shutter.dt_pixel_s(x, y);
    let everywhere = Projected { low_px: DVec2::NEG_INFINITY, high_px: DVec2::INFINITY };
    let (mut low_px, mut high_px) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    let (mut shown, mut in_front, mut all) = (0, 0, 0);
    for phase in PHASES {
        let t_s = mid_s + phase * plan.shutter.exposure_s();
        let (pose, state) = (path.pose(t_s), motion.state(t_s));
        for k in 0..8 {
            let pick = |bit: usize, low: f64, high: f64| if k >> bit & 1 == 0 { low } else { high };
            let [min, max] = [bounds.min, bounds.max];
            let corner = DVec3::new(pick(0, min.x, max.x), pick(1, min.y, max.y), pick(2, min.z, max.z));
            let point_ned_m = state.point(corner);
            all += 1;
            let depth_m = (pose.ned_from_camera.conjugate() * (point_ned_m - pose.position_ned_m)).z;
            in_front += u32::from(depth_m > 0.0);
            if let Some((px, _)) = plan.camera.show(&pose, t_s, WorldPoint::At(point_ned_m)) {
                shown += 1;
                (low_px, high_px) = (low_px.min(px), high_px.max(px));
            }
        }
    }
    match (shown, in_front) {
        (_, 0) => None,
        (shown, _) if shown < all => Some(everywhere),
        _ => {
            let room_px = DVec2::splat(ROOM_PX) + ROOM * (high_px - low_px);
            Some(Projected { low_px: low_px - room_px, high_px: high_px + room_px })
        }
    }
}

/// Pixels along a row that a box covers.
fn span(plan: &FramePlan, line: usize, projected: &Projected) -> Option<[u32; 2]> {
    let [x, y] = pixel(plan, line, 0).map(f64::from);
    let Projected { low_px, high_px, .. } = *projected;
    let (across, low, high, along, step) = match plan.shutter.row_axis() {
        RowAxis::Rows => (y, [low_px.y, low_px.x], [high_px.y, high_px.x], plan.camera.size_px[0], 1.0),
        RowAxis::Columns => {
            let rows = plan.camera.size_px[1].saturating_sub(line as u32 % 2).div_ceil(2);
            (x, [low_px.x, low_px.y], [high_px.x, high_px.y], rows, 2.0)
        }
    };
    if across < low[0] || across > high[0] || along == 0 {
        return None;
    }
    let first = (low[1] / step).floor().max(0.0);
    let last = (high[1] / step).ceil().min(f64::from(along) - 1.0);
    (first <= last).then_some([first as u32, last as u32])
}

/// Sorted spans without overlap.
fn merged(spans: &[[u32; 2]]) -> Vec<[u32; 2]> {
    let mut merged: Vec<[u32; 2]> = Vec::new();
    for &[first, last] in spans {
        match merged.last_mut() {
            Some(before) if first <= before[1].saturating_add(1) => before[1] = before[1].max(last),
            _ => merged.push([first, last]),
        }
    }
    merged
}

#[cfg(test)]
mod tests {
    use super::merged;

    #[test]
    fn spans_that_touch_are_one() {
        assert_eq!(merged(&[[0, 4], [5, 6], [2, 3], [9, 12]]), [[0, 6], [9, 12]]);
        assert_eq!(merged(&[]), Vec::<[u32; 2]>::new());
    }
}
