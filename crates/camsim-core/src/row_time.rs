//! Where a frame shows a point of the world: projection with a shutter whose rows read at their own instants.
//!
//! A row `y` is read at `t(y)`, and a point `X` is seen where its projection at that instant lies in the row:
//!
//! ```text
//! y = project(pose(t(y)), X).y
//! ```
//!
//! This equation is implicit in `y`. It has one solution for a slow camera; none, where the point leaves the
//! picture before its row is read; and several, where the picture moves faster than the readout. `t` is linear
//! between the centres of rows and beyond the first and last one. With a sideways readout the same holds for
//! `x`, and each field of an interlaced frame, or half of a split readout, has an equation of its own.

mod projector;

use std::{ops::Range, sync::Arc};

use glam::{DVec2, DVec3};

use crate::{
    camera::CameraModel,
    lens::MAX_FIELD_RAD,
    mount::CameraPath,
    pose::CameraPose,
    scene::RigidMotion,
    shutter::{RowAxis, Shutter},
};

pub use projector::{ImageGain, RowProjector, Shown};

/// Intervals of the readout in which a solution is looked for, one in each at most: for any camera, and for each
/// period of its fastest vibration, and turn of a point that spins, within the readout.
const INTERVALS: usize = 4;
const INTERVALS_A_PERIOD: f64 = 12.0;
const MOST_INTERVALS: usize = 64;
/// Evaluations that close in on a solution, at most: bisection alone needs 17 for the largest frame.
const MOST_EVALUATIONS: usize = 40;

/// A point that a camera may see.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WorldPoint<'a> {
    /// In NED, metres.
    At(DVec3),
    /// Infinitely far away in this direction, NED.
    Towards(DVec3),
    /// On something that moves.
    On {
        /// How that moves.
        motion: &'a RigidMotion,
        /// Where the point is at path time 0, NED, metres.
        at_start_ned_m: DVec3,
    },
}

impl<'a> WorldPoint<'a> {
    /// A point that is at `point_ned_m` at path time `t_s`, on something that moves or stands still.
    #[must_use]
    pub fn on(motion: Option<&'a RigidMotion>, point_ned_m: DVec3, t_s: f64) -> Self {
        motion.map_or(Self::At(point_ned_m), |motion| {
            let at_start_ned_m = motion.state(t_s).point_at_start(point_ned_m);
            Self::On { motion, at_start_ned_m }
        })
    }

    /// Where the point is at path time `t_s`, NED, metres; `None` if it is infinitely far away.
    #[must_use]
    pub fn position_ned_m(&self, t_s: f64) -> Option<DVec3> {
        match self {
            Self::At(point_ned_m) => Some(*point_ned_m),
            Self::Towards(_) => None,
            Self::On { motion, at_start_ned_m } => Some(motion.state(t_s).point(*at_start_ned_m)),
        }
    }
}

/// Where a frame shows a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImagePoint {
    /// Pixel coordinates; 0 is the centre of the first pixel.
    pub px: DVec2,
    /// Instant at which it is seen, path time, seconds.
    pub t_s: f64,
    /// Camera at that instant.
    pub pose: CameraPose,
    /// Planar depth in that camera, metres; infinite for a direction.
    pub depth_m: f64,
    /// Whether the position is within the picture's outer border. Outside, it is where the camera of the row
    /// that is read first or last shows the point.
    pub is_inside: bool,
    /// Number of positions at which the frame shows the point.
    pub solutions: u32,
}

/// Camera of one frame, with the poses of all its rows.
#[derive(Debug)]
pub struct FrameCamera {
    path: Arc<CameraPath>,
    camera: Arc<CameraModel>,
    axis: RowAxis,
    fields: Vec<Field>,
    intervals: usize,
}

/// Rows that are read one after the other, a field or a half of a frame's; columns with a sideways readout.
#[derive(Debug)]
struct Field {
    /// Pixel coordinate of the first row and distance to the next.
    first_px: f64,
    step_px: f64,
    /// Parity of the image rows that belong to the field, where there are two fields.
    parity: Option<u32>,
    /// Mid-exposure of each row, path time, seconds.
    times_s: Vec<f64>,
    poses: Vec<CameraPose>,
}

/// A projection at the instant of a row of the readout.
#[derive(Clone, Copy)]
struct Projection {
    px: DVec2,
    depth_m: f64,
}

impl CameraModel {
    /// Pixel coordinates at which a camera shows a point at path time `t_s`, and its planar depth (infinite for
    /// a direction); `None` if it is beyond the reach of the lens. What lies beside or behind the camera has its
    /// distance for a depth. Only a point on something that moves depends on the time.
    #[must_use]
    pub fn show(&self, pose: &CameraPose, t_s: f64, point: WorldPoint<'_>) -> Option<(DVec2, f64)> {
        let camera_from_ned = pose.ned_from_camera.conjugate();
        let from_camera = |point_ned_m: DVec3| (camera_from_ned * (point_ned_m - pose.position_ned_m), false);
        let (ray, is_far) = match point {
            WorldPoint::At(point_ned_m) => from_camera(point_ned_m),
            WorldPoint::Towards(direction_ned) => (camera_from_ned * direction_ned, true),
            WorldPoint::On { motion, at_start_ned_m } => from_camera(motion.state(t_s).point(at_start_ned_m)),
        };
        self.seen(ray, is_far)
    }

    /// Pixel coordinates and depth of what lies along a ray of the camera.
    fn seen(&self, ray: DVec3, is_far: bool) -> Option<(DVec2, f64)> {
        let depth_m = |depth_m: f64| if is_far { f64::INFINITY } else { depth_m };
        let uv = ray.truncate() / ray.z;
        if ray.z > 0.0 && self.lens.contains(uv) {
            return Some((self.project(uv), depth_m(ray.z)));
        }
        // What an ideal plane does not hold.
        let reaches = self.lens.angle_max_rad() > MAX_FIELD_RAD && ray.length_squared() > 0.0;
        let is_beyond = reaches && self.lens.contains_ray(ray);
        let is_seen = is_beyond && (ray.z <= 0.0 || uv.length() >= MAX_FIELD_RAD.tan());
        is_seen.then(|| (self.project_ray(ray), depth_m(if ray.z > 0.0 { ray.z } else { ray.length() })))
    }
}

impl FrameCamera {
    /// Camera of the frame with this stamp.
    #[must_use]
    pub fn new(path: Arc<CameraPath>, camera: Arc<CameraModel>, shutter: &Shutter, stamp_s: f64) -> Self {
        let [columns, rows] = camera.size_px;
        let axis = shutter.row_axis();
        let is_interlaced = shutter.interlace_s() > 0.0 && rows > 1;
        let half = rows / 2;
        let is_split = shutter.is_split() && shutter.readout_s() > 0.0 && half > 0;
        let parts: Vec<(Option<u32>, Range<u32>)> = match (is_interlaced, is_split) {
            (true, _) => vec![(Some(0), 0..rows), (Some(1), 0..rows)],
            (false, true) => vec![(None, 0..half), (None, half..rows)],
            (false, false) => vec![(None, 0..rows)],
        };
        let field = |(parity, part): (Option<u32>, Range<u32>)| {
            let pixels: Vec<[u32; 2]> = match (axis, parity) {
                (RowAxis::Rows, Some(parity)) => (parity..rows).step_by(2).map(|y| [0, y]).collect(),
                (RowAxis::Rows, None) => part.clone().map(|y| [0, y]).collect(),
                (RowAxis::Columns, _) => (0..columns).map(|x| [x, parity.unwrap_or(0)]).collect(),
            };
            let times_s: Vec<f64> = pixels.iter().map(|&[x, y]| stamp_s + shutter.dt_pixel_s(x, y)).collect();
            let poses = times_s.iter().map(|&t_s| path.pose(t_s)).collect();
            let (first_px, step_px) = match (axis, parity) {
                (RowAxis::Rows, Some(parity)) => (f64::from(parity), 2.0),
                (RowAxis::Rows, None) => (f64::from(part.start), 1.0),
                (RowAxis::Columns, _) => (0.0, 1.0),
            };
            Field { first_px, step_px, parity, times_s, poses }
        };
        let fields = parts.into_iter().map(field).collect();
        let periods = path.highest_vibration_hz() * shutter.readout_s();
        let intervals = (INTERVALS + (INTERVALS_A_PERIOD * periods) as usize).min(MOST_INTERVALS);
        Self { path, camera, axis, fields, intervals }
    }

    /// Camera of a picture whose pixels all see the same instant.
    #[must_use]
    pub fn global(path: Arc<CameraPath>, camera: Arc<CameraModel>, t_s: f64) -> Self {
        let pose = path.pose(t_s);
        let field =
            Field { first_px: 0.0, step_px: 1.0, parity: None, times_s: vec![t_s], poses: vec![pose] };
        Self { path, camera, axis: RowAxis::Rows, fields: vec![field], intervals: 1 }
    }

    /// The camera's intrinsics.
    #[must_use]
    pub fn camera(&self) -> &CameraModel {
        &self.camera
    }

    /// The camera at mid-exposure of each row.
    pub fn poses(&self) -> impl Iterator<Item = &CameraPose> {
        self.fields.iter().flat_map(|field| &field.poses)
    }

    /// Where the frame shows a point. Of several positions the one nearest to `near_px` is returned. `None`
    /// if the point is behind the camera or beyond the reach of its lens.
    #[must_use]
    pub fn find(&self, point: WorldPoint<'_>, near_px: DVec2) -> Option<ImagePoint> {
        let seen = self.find_all(point);
        let nearest = seen
            .iter()
            .min_by(|a, b| a.px.distance_squared(near_px).total_cmp(&b.px.distance_squared(near_px)));
        nearest.copied().or_else(|| self.outside(point, near_px))
    }

    /// All positions within the picture at which the frame shows a point, in the order of its fields and rows;
    /// each has their number.
    #[must_use]
    pub fn find_all(&self, point: WorldPoint<'_>) -> Vec<ImagePoint> {
        let seen = self.fields.iter().flat_map(|field| {
            let solutions = self.solutions(field, point).into_iter();
            let points = solutions.filter_map(|(row, slope)| self.image_point(field, point, row, slope));
            points.filter(|seen| seen.is_inside).map(|seen| (field.distance_to_rows_px(seen.px.y), seen))
        });
        let mut seen: Vec<(f64, ImagePoint)> = seen.collect();
        let is_own = |(distance_px, _): &(f64, ImagePoint)| *distance_px <= 0.5;
        if seen.iter().any(is_own) {
            seen.retain(is_own);
        } else {
            // A point may pass between the rows of both fields. It is then in the field that it is nearest to.
            let nearest = seen.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
            seen = nearest.into_iter().collect();
        }
        let solutions = seen.len() as u32;
        seen.into_iter().map(|(_, seen)| ImagePoint { solutions, ..seen }).collect()
    }

    /// Fractional rows of a field at which it shows a point, with the movement of the projection from row to
    /// row there.
    fn solutions(&self, field: &Field, point: WorldPoint<'_>) -> Vec<(f64, DVec2)> {
        let last = field.poses.len() - 1;
        let at = |row: usize| self.project(&field.poses[row], field.times_s[row], point);
        if last == 0 || field.is_global() {
            let row = at(0).map(|seen| (field.row_of(self.along(seen.px)), DVec2::ZERO));
            return row.into_iter().collect();
        }
        let intervals = self.intervals_for(field, point);
        let mut rows = Vec::new();
        let mut before: Option<(usize, Projection)> = None;
        let miss = |row: usize, seen: &Projection| field.row_of(self.along(seen.px)) - row as f64;
        for i in 0..=intervals {
            let row = i * last / intervals;
            let here = at(row).map(|seen| (row, seen));
            if let (Some(low), Some(high)) = (before, here)
                && low.0 < high.0
                && (miss(low.0, &low.1) >= 0.0) != (miss(high.0, &high.1) >= 0.0)
            {
                rows.extend(self.between(field, point, low, high));
            }
            before = here;
        }
        // Half a row before the first and behind the last one belongs to these.
        let beyond = |[inner, outer]: [usize; 2]| {
            let (near, end) = (at(inner)?, at(outer)?);
            let slope = if inner > outer { near.px - end.px } else { end.px - near.px };
            let miss = miss(outer, &end);
            let row = outer as f64 + miss / (1.0 - self.along(slope) / field.step_px);
            let is_there = if outer == 0 {
                (-0.5..0.0).contains(&row)
            } else {
                (0.0..0.5).contains(&(row - last as f64))
            };
            is_there.then_some((row, slope))
        };
        rows.extend(beyond([1, 0]));
        rows.extend(beyond([last - 1, last]));
        rows
    }

    /// Intervals in which solutions are looked for: more for a point that spins.
    fn intervals_for(&self, field: &Field, point: WorldPoint<'_>) -> usize {
        let WorldPoint::On { motion, .. } = point else { return self.intervals };
        let readout_s = (field.times_s[field.times_s.len() - 1] - field.times_s[0]).abs();
        let turns = motion.highest_spin_hz() * readout_s;
        (self.intervals + (INTERVALS_A_PERIOD * turns) as usize).min(MOST_INTERVALS)
    }

    /// The solution between two rows whose misses differ in sign.
    fn between(
        &self,
        field: &Field,
        point: WorldPoint<'_>,
        mut low: (usize, Projection),
        mut high: (usize, Projection),
    ) -> Option<(f64, DVec2)> {
        let miss = |(row, seen): &(usize, Projection)| field.row_of(self.along(seen.px)) - *row as f64;
        for i in 0..MOST_EVALUATIONS {
            let (below, above) = (miss(&low), miss(&high));
            let share = if below == above { 0.5 } else { below / (below - above) };
            if high.0 - low.0 == 1 {
                return Some((low.0 as f64 + share, high.1.px - low.1.px));
            }
            // The secant, and the middle each third time.
            let share = if i % 3 == 2 { 0.5 } else { share };
            let row = low.0 + (share * (high.0 - low.0) as f64).round() as usize;
            let row = row.clamp(low.0 + 1, high.0 - 1);
            let middle = (row, self.project(&field.poses[row], field.times_s[row], point)?);
            if (miss(&middle) >= 0.0) == (below >= 0.0) { low = middle } else { high = middle }
        }
        None
    }

    /// The point as it is seen at a fractional row, corrected once by the movement from row to row.
    fn image_point(
        &self,
        field: &Field,
        point: WorldPoint<'_>,
        row: f64,
        slope: DVec2,
    ) -> Option<ImagePoint> {
        let first_s = field.time_s(row);
        let first = self.project(&self.path.pose(first_s), first_s, point)?;
        let miss = field.row_of(self.along(first.px)) - row;
        let row = row + miss / (1.0 - self.along(slope) / field.step_px);
        let t_s = field.time_s(row);
        let pose = self.path.pose(t_s);
        let seen = self.project(&pose, t_s, point)?;
        Some(self.seen(t_s, pose, seen))
    }

    /// A point that no row shows, as the camera of the row nearest to it sees it.
    fn outside(&self, point: WorldPoint<'_>, near_px: DVec2) -> Option<ImagePoint> {
        let seen = self.fields.iter().flat_map(|field| {
            [0, field.poses.len() - 1].into_iter().filter_map(move |row| {
                let seen = self.project(&field.poses[row], field.times_s[row], point)?;
                let found = self.seen(field.times_s[row], field.poses[row], seen);
                let miss = (field.row_of(self.along(seen.px)) - row as f64).abs();
                Some((miss, ImagePoint { is_inside: false, ..found }))
            })
        });
        let key = |(miss, found): &(f64, ImagePoint)| (*miss, found.px.distance(near_px));
        let nearest = seen.min_by(|a, b| {
            let (a, b) = (key(a), key(b));
            a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
        });
        nearest.map(|(_, found)| found)
    }

    fn seen(&self, t_s: f64, pose: CameraPose, Projection { px, depth_m }: Projection) -> ImagePoint {
        let [width, height] = self.camera.size_px.map(f64::from);
        let is_inside = px.cmpge(DVec2::splat(-0.5)).all() && px.cmplt(DVec2::new(width, height) - 0.5).all();
        ImagePoint { px, t_s, pose, depth_m, is_inside, solutions: 0 }
    }

    fn project(&self, pose: &CameraPose, t_s: f64, point: WorldPoint<'_>) -> Option<Projection> {
        self.camera.show(pose, t_s, point).map(|(px, depth_m)| Projection { px, depth_m })
    }

    /// Pixel coordinate across the rows of the readout.
    fn along(&self, px: DVec2) -> f64 {
        match self.axis {
            RowAxis::Rows => px.y,
            RowAxis::Columns => px.x,
        }
    }
}

impl Field {
    fn is_global(&self) -> bool {
        self.times_s.first() == self.times_s.last()
    }

    /// Fractional row at a pixel coordinate.
    fn row_of(&self, px: f64) -> f64 {
        (px - self.first_px) / self.step_px
    }

    /// Instant of a fractional row.
    fn time_s(&self, row: f64) -> f64 {
        let [first, last] = [self.times_s[0], self.times_s[self.times_s.len() - 1]];
        match self.times_s.len() {
            1 => first,
            count => first + (last - first) * row / (count - 1) as f64,
        }
    }

    /// Distance from a pixel coordinate to the nearest image row of the field, pixels; 0 where all rows belong
    /// to it.
    fn distance_to_rows_px(&self, y_px: f64) -> f64 {
        let from_first = |parity: u32| y_px - f64::from(parity);
        self.parity.map(from_first).map_or(0.0, |y_px| (y_px - 2.0 * (0.5 * y_px).round()).abs())
    }
}

#[cfg(test)]
mod tests;
