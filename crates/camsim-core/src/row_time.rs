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
//! `x`, and each field of an interlaced frame has an equation of its own.

mod field;
mod projector;
mod search;

use std::sync::Arc;

use glam::{DVec2, DVec3};

use crate::{
    camera::CameraModel,
    lens::MAX_FIELD_RAD,
    mount::CameraPath,
    pose::CameraPose,
    scene::RigidMotion,
    shutter::{RowAxis, Shutter},
};

use field::Field;
pub use projector::{ImageGain, RowProjector, Shown};
use search::Search;

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

/// Where a frame shows a point within its picture's outer border.
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
    gain: ImageGain,
    lens_margin_rad: f64,
}

/// A projection at the instant of a row of the readout.
#[derive(Clone, Copy)]
struct Projection {
    px: DVec2,
    depth_m: f64,
}

impl CameraModel {
    /// Whether a position is within the picture's outer border.
    fn holds(&self, px: DVec2) -> bool {
        let [width, height] = self.size_px.map(f64::from);
        px.cmpge(DVec2::splat(-0.5)).all() && px.cmplt(DVec2::new(width, height) - 0.5).all()
    }

    /// Angle between the picture's border and the reach of the lens, radians: 0 if the picture reaches as far.
    fn lens_margin_rad(&self) -> f64 {
        let reach_rad = match self.lens.angle_max_rad() {
            angle_rad if angle_rad > MAX_FIELD_RAD => angle_rad,
            _ => self.lens.contained_radius().atan(),
        };
        let [right, bottom] = self.size_px.map(|side| f64::from(side) - 0.5);
        let corners = [[-0.5, -0.5], [right, -0.5], [-0.5, bottom], [right, bottom]];
        let angle_rad =
            |px: [f64; 2]| self.ray(px.into()).map_or(reach_rad, |ray| ray.angle_between(DVec3::Z));
        (reach_rad - corners.map(angle_rad).into_iter().fold(0.0, f64::max)).max(0.0)
    }

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
        let parities = if is_interlaced { vec![Some(0), Some(1)] } else { vec![None] };
        let field = |parity: Option<u32>| {
            let pixels: Vec<[u32; 2]> = match (axis, parity) {
                (RowAxis::Rows, Some(parity)) => (parity..rows).step_by(2).map(|y| [0, y]).collect(),
                (RowAxis::Rows, None) => (0..rows).map(|y| [0, y]).collect(),
                (RowAxis::Columns, _) => (0..columns).map(|x| [x, parity.unwrap_or(0)]).collect(),
            };
            let times_s = pixels.iter().map(|&[x, y]| stamp_s + shutter.dt_pixel_s(x, y)).collect();
            let first_and_step_px = match (axis, parity) {
                (RowAxis::Rows, Some(parity)) => [f64::from(parity), 2.0],
                _ => [0.0, 1.0],
            };
            Field::new(first_and_step_px, parity, times_s, &path)
        };
        let fields = parities.into_iter().map(field).collect();
        Self::of_fields(path, camera, axis, fields)
    }

    /// Camera of a picture whose pixels all see the same instant.
    #[must_use]
    pub fn global(path: Arc<CameraPath>, camera: Arc<CameraModel>, t_s: f64) -> Self {
        let field = Field::new([0.0, 1.0], None, vec![t_s], &path);
        Self::of_fields(path, camera, RowAxis::Rows, vec![field])
    }

    fn of_fields(path: Arc<CameraPath>, camera: Arc<CameraModel>, axis: RowAxis, fields: Vec<Field>) -> Self {
        let (gain, lens_margin_rad) = (ImageGain::new(&camera), camera.lens_margin_rad());
        Self { path, camera, axis, fields, gain, lens_margin_rad }
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

    /// All positions within the picture at which the frame shows a point, in the order of its fields and rows;
    /// each has their number.
    #[must_use]
    pub fn find_all(&self, point: WorldPoint<'_>) -> Vec<ImagePoint> {
        let seen = self.fields.iter().flat_map(|field| {
            let points = Search::new(self, field, point).run().into_iter();
            points
                .filter(|seen| self.camera.holds(seen.px))
                .map(|seen| (field.distance_to_rows_px(seen.px.y), seen))
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

    /// Where a point that no row shows would be, pixels: as the camera of the picture's first or last row (or
    /// column) has it, beside the picture or in it; of both, and of both fields, that whose row it misses by
    /// less. `None` if it is behind these cameras or beyond the reach of their lens.
    #[must_use]
    pub fn outside(&self, point: WorldPoint<'_>, near_px: DVec2) -> Option<DVec2> {
        let seen = self.fields.iter().flat_map(|field| {
            [0, field.poses.len() - 1].into_iter().filter_map(move |row| {
                let Projection { px, .. } = self.project(&field.poses[row], field.times_s[row], point)?;
                let miss = (field.row_of(self.along(px)) - row as f64).abs();
                Some((miss, px.distance(near_px), px))
            })
        });
        let nearest = seen.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        nearest.map(|(.., px)| px)
    }

    fn seen(&self, t_s: f64, pose: CameraPose, Projection { px, depth_m }: Projection) -> ImagePoint {
        ImagePoint { px, t_s, pose, depth_m, solutions: 1 }
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

#[cfg(test)]
mod tests;
