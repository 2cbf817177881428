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
/// Instants within an exposure, per second, at which cameras that shake are looked at, and most of them.
const SHAKES_HZ: f64 = 2000.0;
/// How far a camera may shake between [`INSTANTS`], as a fraction of the rows.
const SHAKE: f64 = 0.1;
const MOST_STEPS: f64 = 64.0;
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
        let shake_px = SHAKE * line_count(plan) as f64;
        let swept: Vec<Swept> = in_view.map(|swept| swept.within_lines(path, plan, shake_px)).collect();
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
struct Shaken {
    known: Vec<(Aabb, f64)>,
}

impl Shaken {
    fn room_px(&mut self, swept: &Swept, path: &CameraPath, plan: &FramePlan, line: usize) -> f64 {
        let Some(whole) = swept.shaken_as else { return 0.0 };
        if let Some((_, room_px)) = self.known.iter().find(|(known, _)| *known == whole) {
            return *room_px;
        }
        let room_px = shake_px(path, plan, line, &swept.motion, &whole);
        self.known.push((whole, room_px));
        room_px
    }
}

/// How far corners of a box are seen, at instants close to each other within the exposure of a row, from the
/// box around them at [`PHASES`]; pixels.
fn shake_px(path: &CameraPath, plan: &FramePlan, line: usize, motion: &RigidMotion, bounds: &Aabb) -> f64 {
    let (mid_s, exposure_s) = exposure_of(plan, line);
    let steps = (exposure_s * SHAKES_HZ).ceil().min(MOST_STEPS);
    if exposure_s <= 0.0 {
        return 0.0;
    }
    // Where it is at mid-exposure: how it moves itself is in its bounds.
    let corners = box_corners(&motion.bounds(bounds, mid_s, mid_s));
    let seen_at = |phase: f64| {
        let t_s = mid_s + phase * exposure_s;
        let pose = path.pose(t_s);
        corners.map(|corner| plan.camera.show(&pose, t_s, WorldPoint::At(corner)).map(|(px, _)| px))
    };
    let mut hulls = [(DVec2::INFINITY, DVec2::NEG_INFINITY); 8];
    for seen in PHASES.map(seen_at) {
        for ((low, high), px) in hulls.iter_mut().zip(seen) {
            (*low, *high) = (low.min(px.unwrap_or(*low)), high.max(px.unwrap_or(*high)));
        }
    }
    let away_px = |step: u32| {
        let seen = seen_at(f64::from(step) / steps - 0.5);
        let known = hulls.iter().zip(seen).filter(|((low, _), _)| low.is_finite());
        let away = known.filter_map(|((low, high), px)| Some((*low - px?).max(px? - *high).max_element()));
        away.fold(0.0, f64::max)
    };
    (0..=steps as u32).map(away_px).fold(0.0, f64::max)
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
    /// `room_px` is for how the camera shakes between the instants at which it is looked at.
    pub fn within_lines(self, path: &CameraPath, plan: &FramePlan, room_px: f64) -> Self {
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
        let across_px = across_px.map(|[first, last]| [first - room_px, last + room_px]);
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
