//! Where moving things may be seen within the exposure of each row.

use std::sync::Arc;

use camsim_core::{
    mount::CameraPath,
    pose::CameraPose,
    row_time::WorldPoint,
    scene::{Aabb, RigidMotion, terrain::Frustum},
    shutter::RowAxis,
};
use camsim_plan::FramePlan;
use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::line_count;

/// Exposure phases of the cameras that boxes are projected by.
const PHASES: [f64; 3] = [-0.5, 0.0, 0.5];
/// Instants at which a camera that shakes is looked at within an exposure: for each of its fastest vibrations, and at
/// least.
const STEPS_A_SHAKE: f64 = 8.0;
const LEAST_STEPS: f64 = 8.0;
/// Room around the projected corners of a box, pixels, and as a fraction of its size: edges that a lens bends.
const ROOM_PX: f64 = 2.0;
const ROOM: f64 = 0.1;

/// Intervals of a frame's window at whose ends the camera's position is looked up, and factor on its distance
/// for what it travels in between.
const INSTANTS: u32 = 16;
const TRAVEL: f64 = 1.1;

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
    pub fn new(path: &CameraPath, plan: &FramePlan, swept: &[Swept]) -> Self {
        let in_view = swept.iter().filter_map(|swept| swept.in_view(path, plan));
        // Between the instants at which rows are ruled out, a camera may shake.
        let is_steady = path.highest_vibration_hz() == 0.0;
        let swept: Vec<Swept> =
            in_view.map(|swept| if is_steady { swept.within_lines(path, plan) } else { swept }).collect();
        let spans = (0..line_count(plan)).into_par_iter().map(|line| {
            let mut shaken = Shaken::default();
            let here = swept.iter().filter(|swept| swept.may_be_in(plan, line));
            let mut spans: Vec<[u32; 2]> = here
                .flat_map(|swept| {
                    swept.spans_with_room(path, plan, line, shaken.room_px(swept, path, plan, line))
                })
                .collect();
            spans.sort_unstable();
            merged(&spans)
        });
        Self { spans: spans.collect() }
    }
}

/// How far the camera shakes within the exposure of a row beyond what the cameras at [`PHASES`] show, for each
/// thing.
#[derive(Default)]
struct Shaken<'a> {
    known: Vec<(&'a Swept, f64)>,
}

impl<'a> Shaken<'a> {
    fn room_px(&mut self, swept: &'a Swept, path: &CameraPath, plan: &FramePlan, line: usize) -> f64 {
        let is_same =
            |known: &Swept| known.shaken_as == swept.shaken_as && Arc::ptr_eq(&known.motion, &swept.motion);
        if let Some((_, room_px)) = self.known.iter().find(|(known, _)| is_same(known)) {
            return *room_px;
        }
        let whole = swept.shaken_as.and_then(|whole| shake_px(path, plan, line, (&swept.motion, &whole)));
        let Some(room_px) = whole else {
            // Not all of it is in view: that of the part alone, if it is.
            return shake_px(path, plan, line, (&swept.motion, &swept.bounds)).unwrap_or_default();
        };
        self.known.push((swept, room_px));
        room_px
    }
}

/// How far corners of a moving box are seen, at instants close to each other within the exposure of a row, from the
/// box around them at [`PHASES`]; pixels. `None` if a corner is out of view.
fn shake_px(
    path: &CameraPath,
    plan: &FramePlan,
    line: usize,
    (motion, bounds): (&RigidMotion, &Aabb),
) -> Option<f64> {
    let (mid_s, exposure_s) = exposure_of(plan, line);
    let steps = (STEPS_A_SHAKE * path.highest_vibration_hz() * exposure_s).ceil();
    if steps <= 0.0 {
        return Some(0.0);
    }
    // Where it is at mid-exposure: how it moves itself is in its bounds.
    let corners = box_corners(&motion.bounds(bounds, mid_s, mid_s));
    let seen_at = |phase: f64| {
        let t_s = mid_s + phase * exposure_s;
        let pose = path.pose(t_s);
        let show = |corner| plan.camera.show(&pose, t_s, WorldPoint::At(corner)).map(|(px, _)| px);
        corners.map(show).into_iter().collect::<Option<Vec<DVec2>>>()
    };
    let mut hulls = [(DVec2::INFINITY, DVec2::NEG_INFINITY); 8];
    for phase in PHASES {
        for ((low, high), px) in hulls.iter_mut().zip(seen_at(phase)?) {
            (*low, *high) = (low.min(px), high.max(px));
        }
    }
    let steps = steps.max(LEAST_STEPS);
    let mut room_px = 0.0_f64;
    for step in 0..=steps as u32 {
        for ((low, high), px) in hulls.iter().zip(seen_at(f64::from(step) / steps - 0.5)?) {
            room_px = room_px.max((*low - px).max(px - *high).max_element());
        }
    }
    Some(room_px)
}

/// Mid-exposure of a row, path time, and its exposure, seconds.
fn exposure_of(plan: &FramePlan, line: usize) -> (f64, f64) {
    let [x, y] = pixel(plan, line, 0);
    (plan.stamp_s + plan.shutter.dt_pixel_s(x, y), plan.shutter.exposure_pixel_s(x, y))
}

/// Where something that moves may change the picture: where it is itself, and where its shadow may fall.
pub(super) struct Swept {
    pub motion: Arc<RigidMotion>,
    /// What it carries, at path time 0.
    pub bounds: Aabb,
    /// Segments of the path from it along the sun's rays, metres: the first is itself, the others are those on
    /// which a shadow may meet something.
    pub segments_ned_m: Vec<[DVec3; 2]>,
    /// Room around its projected corners, pixels.
    room_px: f64,
    /// First and last position across the rows of the readout at which it may be, pixels.
    across_px: [f64; 2],
    /// The box whose corners tell how the camera shakes within an exposure: that of all of which it is a part.
    /// `None` if its room allows for that.
    shaken_as: Option<Aabb>,
}

impl Swept {
    pub fn new(
        motion: Arc<RigidMotion>,
        bounds: Aabb,
        segments_ned_m: Vec<[DVec3; 2]>,
        room_px: f64,
    ) -> Self {
        let across_px = [f64::NEG_INFINITY, f64::INFINITY];
        let room_px = room_px.max(ROOM_PX);
        Self { motion, bounds, segments_ned_m, room_px, across_px, shaken_as: None }
    }

    /// As a part of something in this box.
    pub fn shaken_as(self, whole: &Aabb) -> Self {
        Self { shaken_as: Some(*whole), ..self }
    }

    /// With the rows of the readout that it can be in, which spares the others a look.
    pub fn within_lines(self, path: &CameraPath, plan: &FramePlan) -> Self {
        let [begin_s, end_s] = plan.window_s;
        let swept = self.motion.bounds(&self.bounds, begin_s, end_s);
        let poses: Vec<(f64, CameraPose)> = (0..=INSTANTS)
            .map(|i| begin_s + (end_s - begin_s) * f64::from(i) / f64::from(INSTANTS))
            .map(|t_s| (t_s, path.pose(t_s)))
            .collect();
        let ends = |projected: Projected| {
            let axis = usize::from(plan.shutter.row_axis() == RowAxis::Rows);
            [projected.low_px[axis], projected.high_px[axis]]
        };
        let all = self
            .segments_ned_m
            .iter()
            .filter_map(|segment| project(plan, &poses, &along(&swept, segment), &self));
        let across_px = all.map(ends).reduce(|[a, b], [c, d]| [a.min(c), b.max(d)]);
        Self { across_px: across_px.unwrap_or(self.across_px), ..self }
    }

    /// Whether it may be in a row of the readout.
    pub fn may_be_in(&self, plan: &FramePlan, line: usize) -> bool {
        let [x, y] = pixel(plan, line, 0).map(f64::from);
        let across = if plan.shutter.row_axis() == RowAxis::Rows { y } else { x };
        (self.across_px[0]..=self.across_px[1]).contains(&across)
    }

    /// First and last pixels along a row of the readout between which its parts may be.
    pub fn spans(&self, path: &CameraPath, plan: &FramePlan, line: usize) -> Vec<[u32; 2]> {
        self.spans_with_room(path, plan, line, 0.0)
    }

    /// As [`Self::spans`] with more room, pixels.
    fn spans_with_room(
        &self,
        path: &CameraPath,
        plan: &FramePlan,
        line: usize,
        room_px: f64,
    ) -> Vec<[u32; 2]> {
        let larger = |Projected { low_px, high_px }: Projected| Projected {
            low_px: low_px - room_px,
            high_px: high_px + room_px,
        };
        let projected = self.project(path, plan, line).into_iter().map(larger);
        projected.filter_map(|projected| span(plan, line, &projected)).collect()
    }

    /// The parts of it that any row may see; `None` if there are none. All rays of the frame have directions
    /// within its ideal frame's field of view, and begin no farther from that frame's camera than the path
    /// leads.
    pub fn in_view(&self, path: &CameraPath, plan: &FramePlan) -> Option<Self> {
        let [begin_s, end_s] = plan.window_s;
        let swept = self.motion.bounds(&self.bounds, begin_s, end_s);
        let instants_s =
            (0..=INSTANTS).map(|i| begin_s + (end_s - begin_s) * f64::from(i) / f64::from(INSTANTS));
        let positions_ned_m: Vec<DVec3> = instants_s.map(|t_s| path.pose(t_s).position_ned_m).collect();
        let key_poses = if plan.keys.is_empty() { vec![plan.key_pose] } else { plan.key_poses() };
        let may_be_seen = |segment: &[DVec3; 2]| {
            let swept = along(&swept, segment);
            key_poses.iter().any(|key_pose| {
                let distance_m = |position_ned_m: &DVec3| position_ned_m.distance(key_pose.position_ned_m);
                let reach_m = TRAVEL * positions_ned_m.iter().map(distance_m).fold(0.0, f64::max);
                let swept = Aabb { min: swept.min - reach_m, max: swept.max + reach_m };
                Frustum::new(key_pose, plan.tangents()).may_see(&swept)
            })
        };
        let segments_ned_m: Vec<[DVec3; 2]> =
            self.segments_ned_m.iter().copied().filter(may_be_seen).collect();
        let seen = Self { motion: self.motion.clone(), segments_ned_m, ..*self };
        (!seen.segments_ned_m.is_empty()).then_some(seen)
    }

    /// Where its parts may be seen during the exposure of a row, those that are not behind the camera. Each is
    /// in the box that holds all of the motion within the exposure, however fast it turns.
    fn project(&self, path: &CameraPath, plan: &FramePlan, line: usize) -> Vec<Projected> {
        let (mid_s, exposure_s) = exposure_of(plan, line);
        let half_s = 0.5 * exposure_s;
        let swept = self.motion.bounds(&self.bounds, mid_s - half_s, mid_s + half_s);
        let poses = PHASES.map(|phase| {
            let t_s = mid_s + phase * exposure_s;
            (t_s, path.pose(t_s))
        });
        self.segments_ned_m
            .iter()
            .filter_map(|segment| project(plan, &poses, &along(&swept, segment), self))
            .collect()
    }
}

/// A box that is shifted along a segment, from its one end to the other.
fn along(bounds: &Aabb, segment: &[DVec3; 2]) -> Aabb {
    let [from, to] = segment;
    Aabb { min: bounds.min + from.min(*to), max: bounds.max + from.max(*to) }
}

fn box_corners(Aabb { min, max }: &Aabb) -> [DVec3; 8] {
    std::array::from_fn(|k| {
        let pick = |bit: usize, low: f64, high: f64| if k >> bit & 1 == 0 { low } else { high };
        DVec3::new(pick(0, min.x, max.x), pick(1, min.y, max.y), pick(2, min.z, max.z))
    })
}

/// Width and height of a box in the picture, pixels; `None` if it is behind the camera or not wholly in view.
pub(super) fn size_px(plan: &FramePlan, poses: &[(f64, CameraPose)], bounds: &Aabb) -> Option<[f64; 2]> {
    let Projected { low_px, high_px } = corners(plan, poses, bounds)?;
    let size_px = high_px - low_px;
    size_px.is_finite().then(|| size_px.to_array())
}

/// Where a box may be seen from poses at path times, with the room about it; `None` if it is behind the camera.
fn project(plan: &FramePlan, poses: &[(f64, CameraPose)], bounds: &Aabb, swept: &Swept) -> Option<Projected> {
    let Projected { low_px, high_px } = corners(plan, poses, bounds)?;
    if !(low_px.is_finite() && high_px.is_finite()) {
        return Some(Projected { low_px, high_px });
    }
    let room_px = DVec2::splat(swept.room_px) + ROOM * (high_px - low_px);
    Some(Projected { low_px: low_px - room_px, high_px: high_px + room_px })
}

/// The corners of a box from poses at path times; everywhere if some are not in view, `None` if all are behind.
fn corners(plan: &FramePlan, poses: &[(f64, CameraPose)], bounds: &Aabb) -> Option<Projected> {
    let everywhere = Projected { low_px: DVec2::NEG_INFINITY, high_px: DVec2::INFINITY };
    let (mut low_px, mut high_px) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    let (mut shown, mut in_front, mut all) = (0, 0, 0);
    for (t_s, pose) in poses {
        for corner_ned_m in box_corners(bounds) {
            all += 1;
            let depth_m = (pose.ned_from_camera.conjugate() * (corner_ned_m - pose.position_ned_m)).z;
            in_front += u32::from(depth_m > 0.0);
            if let Some((px, _)) = plan.camera.show(pose, *t_s, WorldPoint::At(corner_ned_m)) {
                shown += 1;
                (low_px, high_px) = (low_px.min(px), high_px.max(px));
            }
        }
    }
    match (shown, in_front) {
        (_, 0) => None,
        (shown, _) if shown < all => Some(everywhere),
        _ => Some(Projected { low_px, high_px }),
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
pub(super) fn merged(spans: &[[u32; 2]]) -> Vec<[u32; 2]> {
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
