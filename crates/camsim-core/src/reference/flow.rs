//! Flow, motion and blur path of the reference: where another picture shows what a pixel sees, by a search over
//! the instants of that picture's rows.
//!
//! The equation `position = project(camera(t(position)), point(t(position)))` along the readout is looked at in
//! steps of half a pixel, from border to border. Each change of sign is closed in on by bisection, and each
//! turn near zero by thirds, as two solutions may be beside it.

use glam::{DVec2, DVec3};

use super::{FrameLens, FrameView, RaySample, ReferenceRenderer, zoom_at};
use crate::{
    pose::CameraPose,
    scenario::{FlowInstant, FlowState},
    scene::RigidMotion,
};

/// Step along the readout, pixels: the centres of rows, where the speed of the readout may change, are among the
/// positions.
const STEP_PX: f64 = 0.5;
/// Halvings of an interval of one step.
const BISECTIONS: u32 = 36;
/// Steps towards the turn of a miss: to 1e-5 of two intervals.
const THIRDS: u32 = 28;
/// Step of the derivative by differences, seconds.
const STEP_S: f64 = 1e-4;

/// What a pixel sees.
#[derive(Clone, Copy, Debug)]
enum Goal<'a> {
    /// A point, and the motion of what it is on, with where it was at path time 0.
    Point(DVec3, Option<&'a RigidMotion>),
    /// A direction of the sky.
    Sky(DVec3),
}

/// A picture that flow leads to.
#[derive(Debug)]
pub(super) struct FlowPicture<'a> {
    reference: &'a ReferenceRenderer,
    lens: FrameLens<'a>,
    stamp_s: f64,
    /// All rows at one instant.
    global_s: Option<f64>,
    fields: Vec<FieldScan>,
}

/// The readout of one field, in steps from border to border.
#[derive(Debug)]
struct FieldScan {
    /// An image row of the field.
    row: u32,
    samples: Vec<(f64, f64, CameraPose)>,
}

/// Where a picture shows a goal.
#[derive(Clone, Copy, Debug)]
struct Sighting {
    px: DVec2,
    t_s: f64,
    pose: CameraPose,
}

/// A position along the readout, pixels, and what its camera misses it by.
type Miss = (f64, Option<f64>);

fn changes_sign(a: Miss, b: Miss) -> bool {
    a.1.zip(b.1).is_some_and(|(a, b)| (a >= 0.0) != (b >= 0.0))
}

impl ReferenceRenderer {
    /// The picture of a frame of any number.
    pub(super) fn flow_frame(&self, frame: i64) -> FlowPicture<'_> {
        let stamp_s = self.timing.stamp_of(frame);
        let rows: &[u32] = if self.timing.field_rows() == 2 { &[0, 1] } else { &[0] };
        let scan = |&row: &u32| {
            let [first, last, step] = self.ends_of_field(row).map(f64::from);
            // Half a row of the field beyond its ends, within the picture.
            let low_px = (first - 0.5 * step).max(-0.5);
            let high_px = (last + 0.5 * step).min(f64::from(self.timing.lines()) - 0.5);
            let sample = |k: u32| {
                let along_px = (low_px + STEP_PX * f64::from(k)).min(high_px);
                let t_s = stamp_s + self.timing.dt_along_s(along_px, row);
                (along_px, t_s, self.sequence.path.pose(t_s))
            };
            FieldScan {
                row,
                samples: (0..=((high_px - low_px) / STEP_PX).ceil() as u32).map(sample).collect(),
            }
        };
        FlowPicture {
            reference: self,
            lens: self.lens_of(stamp_s),
            stamp_s,
            global_s: None,
            fields: rows.iter().map(scan).collect(),
        }
    }

    /// The picture of a frame's camera with all rows at one instant.
    pub(super) fn flow_global(&self, frame: u64, instant: FlowInstant) -> FlowPicture<'_> {
        let stamp_s = self.timing.stamp_s(frame);
        let dt_s = self.timing.instant_s(instant);
        let lens = self.lens_of(stamp_s);
        FlowPicture { reference: self, lens, stamp_s, global_s: Some(stamp_s + dt_s), fields: Vec::new() }
    }

    pub(super) fn lens_of(&self, stamp_s: f64) -> FrameLens<'_> {
        match &self.fixed {
            Some(lens) => FrameLens::Fixed(lens),
            None => self
                .zoomed_lens(zoom_at(&self.sequence.zoom_track, stamp_s))
                .map_or(FrameLens::Invalid, FrameLens::Zoomed),
        }
    }

    /// First and last row of the readout that the field of an image row has, and the step between them.
    fn ends_of_field(&self, row: u32) -> [u32; 3] {
        let step = if self.timing.reads_rows() { self.timing.field_rows() } else { 1 };
        let first = if step == 2 { row } else { 0 };
        [first, first + (self.timing.lines() - 1).saturating_sub(first) / step * step, step]
    }

    fn goal<'a>(&'a self, seen: &RaySample) -> Goal<'a> {
        let Some(hit) = seen.hit else {
            return Goal::Sky(seen.pose.ned_from_camera * seen.uv.extend(1.0));
        };
        let mesh = hit.surface.checked_sub(1).and_then(|i| self.sequence.scene.meshes.get(i as usize));
        let motion = mesh.and_then(|mesh| mesh.motion.as_deref());
        let at_start = motion.map_or(hit.point_ned_m, |motion| {
            let state = motion.state(seen.t_s);
            state.rotation.conjugate() * (hit.point_ned_m - state.shift_m)
        });
        Goal::Point(at_start, motion)
    }
}

impl Goal<'_> {
    /// From the camera, in NED, at path time `t_s`.
    fn direction_from(&self, pose: &CameraPose, t_s: f64) -> DVec3 {
        match self {
            Self::Sky(direction) => *direction,
            Self::Point(point, None) => *point - pose.position_ned_m,
            Self::Point(at_start, Some(motion)) => {
                let state = motion.state(t_s);
                state.rotation * *at_start + state.shift_m - pose.position_ned_m
            }
        }
    }
}

impl FrameLens<'_> {
    /// Pixel at which a camera shows a goal.
    fn show(&self, pose: &CameraPose, t_s: f64, goal: Goal<'_>) -> Option<DVec2> {
        let ray = pose.ned_from_camera.inverse() * goal.direction_from(pose, t_s);
        match self {
            _ if ray.z.is_nan() || ray.z <= 0.0 => None,
            Self::Fixed(lens) => lens.image(ray.truncate() / ray.z),
            Self::Zoomed(lens) => lens.image(ray.truncate() / ray.z),
            Self::Invalid => None,
        }
    }
}

impl FlowPicture<'_> {
    /// Displacement of what a pixel sees, pixels, and state: the channels `flow`, `flow_back` and `flow_global`.
    pub(super) fn flow(&self, from_px: DVec2, seen: &RaySample) -> (DVec2, FlowState) {
        let goal = self.reference.goal(seen);
        let mut sightings = self.sightings(goal);
        sightings.sort_by(|a, b| a.px.distance(from_px).total_cmp(&b.px.distance(from_px)));
        let Some(nearest) = sightings.first() else {
            return self
                .outside(goal, from_px)
                .map_or((DVec2::ZERO, FlowState::None), |px| (px - from_px, FlowState::Outside));
        };
        let shown: Vec<&Sighting> =
            sightings.iter().filter(|sighting| !self.is_hidden(goal, sighting)).collect();
        let (sighting, state) = match shown.as_slice() {
            [] => (nearest, FlowState::Occluded),
            [only] => (*only, FlowState::Visible),
            [nearest, ..] => (*nearest, FlowState::Several),
        };
        (sighting.px - from_px, state)
    }

    /// Whether something is in front of a goal where the picture shows it.
    fn is_hidden(&self, goal: Goal<'_>, sighting: &Sighting) -> bool {
        let direction = goal.direction_from(&sighting.pose, sighting.t_s);
        let hit = self.reference.cast_at(sighting.t_s, sighting.pose.position_ned_m, direction);
        // The parameter is 1 at the goal; the sky is infinitely far away.
        hit.is_some_and(|hit| matches!(goal, Goal::Sky(_)) || hit.depth_m < 1.0 - 1e-6)
    }

    fn is_in_picture(&self, px: DVec2) -> bool {
        let [width, height] = self.reference.sequence.scenario.camera.size_px.map(f64::from);
        px.x >= -0.5 && px.y >= -0.5 && px.x < width - 0.5 && px.y < height - 0.5
    }

    fn along(&self, px: DVec2) -> f64 {
        if self.reference.timing.reads_rows() { px.y } else { px.x }
    }

    /// All positions in the picture at which it shows a goal.
    fn sightings(&self, goal: Goal<'_>) -> Vec<Sighting> {
        if let Some(t_s) = self.global_s {
            let pose = self.reference.sequence.path.pose(t_s);
            let px = self.lens.show(&pose, t_s, goal).filter(|px| self.is_in_picture(*px));
            return px.map(|px| Sighting { px, t_s, pose }).into_iter().collect();
        }
        let mut sightings: Vec<(f64, Sighting)> = Vec::new();
        for field in &self.fields {
            let found = self.sightings_in_field(field, goal).into_iter();
            sightings.extend(found.map(|sighting| (self.to_field_px(field, sighting.px), sighting)));
        }
        // A position belongs to the field whose image row it is in. Only what passes between the rows of both
        // fields is in the nearer one.
        if sightings.iter().any(|(off_px, _)| *off_px <= 0.5) {
            sightings.retain(|(off_px, _)| *off_px <= 0.5);
        } else {
            sightings.sort_by(|a, b| a.0.total_cmp(&b.0));
            sightings.truncate(1);
        }
        sightings.into_iter().map(|(_, sighting)| sighting).collect()
    }

    /// Distance to the nearest image row of a field; 0 without fields.
    fn to_field_px(&self, field: &FieldScan, px: DVec2) -> f64 {
        if self.fields.len() == 1 {
            return 0.0;
        }
        let off = (px.y - f64::from(field.row)).rem_euclid(2.0);
        off.min(2.0 - off)
    }

    fn sightings_in_field(&self, field: &FieldScan, goal: Goal<'_>) -> Vec<Sighting> {
        let misses: Vec<Miss> = field
            .samples
            .iter()
            .map(|(along_px, t_s, pose)| (*along_px, self.miss(*along_px, *t_s, pose, goal)))
            .collect();
        let mut found = Vec::new();
        for (k, &before) in misses.iter().enumerate() {
            if let Some(&after) = misses.get(k + 1)
                && changes_sign(before, after)
            {
                found.extend(self.sighting_between(field, goal, before, after));
            }
            if let Some((turn, [low, high])) = self.turn_beyond_zero(field, goal, &misses, k) {
                found.extend(self.sighting_between(field, goal, low, turn));
                found.extend(self.sighting_between(field, goal, turn, high));
            }
        }
        found
    }

    /// The position along the readout at which a goal is seen from the camera of another, less that other one.
    fn miss(&self, along_px: f64, t_s: f64, pose: &CameraPose, goal: Goal<'_>) -> Option<f64> {
        Some(self.along(self.lens.show(pose, t_s, goal)?) - along_px)
    }

    fn miss_at(&self, field: &FieldScan, along_px: f64, goal: Goal<'_>) -> Miss {
        let (t_s, pose) = self.camera(field, along_px);
        (along_px, self.miss(along_px, t_s, &pose, goal))
    }

    /// The solution between two misses of different signs.
    fn sighting_between(
        &self,
        field: &FieldScan,
        goal: Goal<'_>,
        before: Miss,
        after: Miss,
    ) -> Option<Sighting> {
        let (mut low, mut high) = (before.0, after.0);
        for _ in 0..BISECTIONS {
            let middle = self.miss_at(field, 0.5 * (low + high), goal);
            if middle.1.is_some() && !changes_sign(before, middle) { low = middle.0 } else { high = middle.0 }
        }
        let (t_s, pose) = self.camera(field, 0.5 * (low + high));
        let px = self.lens.show(&pose, t_s, goal).filter(|px| self.is_in_picture(*px))?;
        Some(Sighting { px, t_s, pose })
    }

    /// A miss of the other sign next to one that is less than those before and behind it, closed in on by thirds,
    /// with these two: one solution is before it and one behind.
    fn turn_beyond_zero(
        &self,
        field: &FieldScan,
        goal: Goal<'_>,
        misses: &[Miss],
        k: usize,
    ) -> Option<(Miss, [Miss; 2])> {
        let last = misses.len() - 1;
        let (at, beside) = (misses[k], [misses[k.saturating_sub(1)], misses[last.min(k + 1)]]);
        let [before, here, behind] = [beside[0].1?, at.1?, beside[1].1?].map(f64::abs);
        let is_least = (k == 0 || here < before) && here <= behind;
        if !is_least || beside.iter().any(|&miss| changes_sign(at, miss)) {
            return None;
        }
        // A parabola goes on by no more than an eighth of its second difference.
        let middle = k.min(last.saturating_sub(1)).max(1);
        let three = misses.get(middle - 1..=middle + 1)?;
        if here > (three[0].1? - 2.0 * three[1].1? + three[2].1?).abs() {
            return None;
        }
        let (mut from, mut to) = (beside[0].0, beside[1].0);
        for _ in 0..THIRDS {
            let rows_px = [(2.0 * from + to) / 3.0, (from + 2.0 * to) / 3.0];
            let [first, second] = rows_px.map(|along_px| self.miss_at(field, along_px, goal));
            if let Some(beyond) = [first, second].into_iter().find(|&miss| changes_sign(at, miss)) {
                return Some((beyond, beside));
            }
            if first.1?.abs() < second.1?.abs() { to = rows_px[1] } else { from = rows_px[0] }
        }
        None
    }

    fn camera(&self, field: &FieldScan, along_px: f64) -> (f64, CameraPose) {
        let t_s = self.stamp_s + self.reference.timing.dt_along_s(along_px, field.row);
        (t_s, self.reference.sequence.path.pose(t_s))
    }

    /// Where the camera of the row read first or last shows a goal that no row shows: of both, and of both
    /// fields, that which misses its row by less.
    fn outside(&self, goal: Goal<'_>, from_px: DVec2) -> Option<DVec2> {
        if let Some(t_s) = self.global_s {
            return self.lens.show(&self.reference.sequence.path.pose(t_s), t_s, goal);
        }
        let ends = self.fields.iter().flat_map(|field| {
            let [first, last, step] = self.reference.ends_of_field(field.row);
            [first, last].into_iter().filter_map(move |line| {
                let (t_s, pose) = self.camera(field, f64::from(line));
                let px = self.lens.show(&pose, t_s, goal)?;
                Some((((self.along(px) - f64::from(line)) / f64::from(step)).abs(), px))
            })
        });
        let key = |(miss, px): &(f64, DVec2)| (*miss, px.distance(from_px));
        let nearest = ends.min_by(|a, b| {
            let (a, b) = (key(a), key(b));
            a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
        });
        nearest.map(|(_, px)| px)
    }
}

impl FrameView<'_> {
    /// Velocity of the image of what a pixel sees, pixels a second, by differences of fourth order.
    pub(super) fn motion(&self, seen: &RaySample) -> DVec2 {
        let at = |dt_s: f64| self.show_at(seen, seen.t_s + dt_s);
        let pair = |dt_s: f64| Some(at(dt_s)? - at(-dt_s)?);
        let near = pair(STEP_S).zip(pair(2.0 * STEP_S));
        near.map_or(DVec2::ZERO, |(one, two)| (8.0 * one - two) / (12.0 * STEP_S))
    }

    /// Displacement of the image of what a pixel sees at the begin and at the end of its exposure, pixels.
    pub(super) fn blur_path(&self, from_px: DVec2, seen: &RaySample) -> [DVec2; 2] {
        let exposure_s = self.exposure_s(from_px.to_array().map(|px| px.round() as u32));
        [-0.5, 0.5].map(|phase| {
            let t_s = seen.t_s + phase * exposure_s;
            self.show_at(seen, t_s).map_or(DVec2::ZERO, |px| px - from_px)
        })
    }

    fn show_at(&self, seen: &RaySample, t_s: f64) -> Option<DVec2> {
        self.lens.show(&self.reference.sequence.path.pose(t_s), t_s, self.reference.goal(seen))
    }
}
