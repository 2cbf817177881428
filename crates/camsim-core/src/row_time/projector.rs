//! Where a frame shows many points: as [`FrameCamera::find_all`], from a guess and by matrices of the rows.
//!
//! While a row is read, the picture of a point moves by less than [`MOST_SPEED`] rows in most frames. The
//! equation of the row then has one solution, and Newton's step from row to row finds it. Between two rows the
//! projection is taken as linear, if the rows' poses show that this is exact to [`STRAIGHT_PX`]. Points for
//! which either is not sure are left to [`FrameCamera::find_all`].

use glam::{DMat3, DVec2, DVec3};

use super::{Field, FrameCamera, ImagePoint, Projection, WorldPoint, field::turn_between};
use crate::{camera::CameraModel, pose::CameraPose};

/// Rows by which the picture may move while a row is read. The reserve to 1 is for the movement outside of the
/// picture, where the gains are larger.
const MOST_SPEED: f64 = 0.5;
/// Largest deviation of the path of a point from a straight line between two rows, pixels.
const STRAIGHT_PX: f64 = 3e-4;
/// Steps from row to row, at most.
const MOST_STEPS: usize = 6;

/// A position at which a frame shows a point, within the picture's outer border.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shown {
    /// Pixel coordinates.
    pub px: DVec2,
    /// Instant at which it is seen, path time, seconds.
    pub t_s: f64,
    /// Optical centre at that instant, NED, metres, within micrometres.
    pub position_ned_m: DVec3,
    /// Planar depth, metres; infinite for a direction.
    pub depth_m: f64,
}

/// How far turns and shifts of a camera move its picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageGain {
    /// Pixels a radian, at most.
    pub turn_px: f64,
    /// Pixels for a shift by 1 m at a planar depth of 1 m, at most.
    pub shift_px: f64,
}

impl From<ImagePoint> for Shown {
    fn from(ImagePoint { px, t_s, pose, depth_m, .. }: ImagePoint) -> Self {
        Self { px, t_s, position_ned_m: pose.position_ned_m, depth_m }
    }
}

impl ImageGain {
    /// The largest gains within a camera's picture, on a grid of its pixels.
    #[must_use]
    pub fn new(camera: &CameraModel) -> Self {
        const SIDE: u32 = 16;
        let last = camera.size_px.map(|side| f64::from(side) - 1.0);
        let gains = |i: u32| {
            let fraction = [i % (SIDE + 1), i / (SIDE + 1)].map(|k| f64::from(k) / f64::from(SIDE));
            let px = DVec2::new(fraction[0] * last[0], fraction[1] * last[1]);
            // The norm of all elements bounds that of a matrix.
            let norm = |columns: &[DVec2]| {
                columns.iter().map(|column| (column * camera.focal_px).length_squared()).sum::<f64>().sqrt()
            };
            let Some(uv) = camera.unproject(px) else {
                // Rays that an ideal plane does not hold.
                return camera.ray(px).map(|ray| (norm(&camera.lens.gradient(ray)), 1.0));
            };
            let jacobian = camera.lens.jacobian(uv);
            Some((norm(&[jacobian.x_axis, jacobian.y_axis]), 1.0 + uv.length_squared()))
        };
        let all = (0..(SIDE + 1).pow(2)).filter_map(gains);
        all.fold(Self { turn_px: 0.0, shift_px: 0.0 }, |most, (gain, secant2)| Self {
            turn_px: most.turn_px.max(gain * secant2),
            shift_px: most.shift_px.max(gain * secant2.sqrt()),
        })
    }
}

/// Projections of one frame.
#[derive(Debug)]
pub struct RowProjector<'a> {
    frame: &'a FrameCamera,
    rows: Vec<Row>,
    /// `None` where every point is left to [`FrameCamera::find_all`].
    limits: Option<Limits>,
    contained_radius2: f64,
}

#[derive(Clone, Copy, Debug)]
struct Row {
    camera_from_ned: DMat3,
    position_ned_m: DVec3,
}

/// What decides whether a point can be found by steps: values for a direction, and what 1/m of inverse depth
/// adds.
#[derive(Clone, Copy, Debug)]
struct Limits {
    speed: [f64; 2],
    curve_px: [f64; 2],
    /// Path of the camera during the readout.
    travel_m: f64,
}

impl FrameCamera {
    /// A projector for many points.
    #[must_use]
    pub fn projector(&self) -> RowProjector<'_> {
        let (rows, limits) = match self.fields.as_slice() {
            [field] => (field.poses.iter().map(Row::new).collect(), Limits::new(self, field)),
            _ => (Vec::new(), None),
        };
        let contained_radius2 = self.camera.lens.contained_radius().powi(2);
        RowProjector { frame: self, rows, limits, contained_radius2 }
    }
}

impl Row {
    fn new(pose: &CameraPose) -> Self {
        Self {
            camera_from_ned: DMat3::from_quat(pose.ned_from_camera.conjugate()),
            position_ned_m: pose.position_ned_m,
        }
    }
}

impl Limits {
    fn new(frame: &FrameCamera, field: &Field) -> Option<Self> {
        let gain = frame.gain;
        let mut most = [0.0_f64; 4];
        let mut before = None;
        let mut travel_m = 0.0_f64;
        for (from, to) in field.poses.iter().zip(&field.poses[1..]) {
            let turn = turn_between(from, to);
            let shift = to.position_ned_m - from.position_ned_m;
            let (turn_change, shift_change) = before
                .map_or((0.0, 0.0), |(t, s): (DVec3, DVec3)| ((turn - t).length(), (shift - s).length()));
            most = [
                most[0].max(turn.length()),
                most[1].max(shift.length()),
                most[2].max(turn_change),
                most[3].max(shift_change),
            ];
            travel_m += shift.length();
            before = Some((turn, shift));
        }
        let [turn, shift, turn_change, shift_change] = most;
        let speed_px = [gain.turn_px * turn, gain.shift_px * shift];
        // A parabola is an eighth of its second difference away from its chord. The projection itself bends by
        // the square of the path over the focal length.
        let bend_px = speed_px[0] * speed_px[0] / frame.camera.focal_px.min_element();
        let limits = Self {
            speed: speed_px.map(|px| px / field.step_px),
            curve_px: [
                0.125 * gain.turn_px * turn_change + 0.25 * bend_px,
                0.125 * gain.shift_px * shift_change,
            ],
            travel_m,
        };
        (limits.speed[0] < MOST_SPEED && limits.curve_px[0] < STRAIGHT_PX).then_some(limits)
    }

    /// Whether steps find a point that comes no nearer than so.
    fn allow(&self, inverse_depth: f64) -> bool {
        self.speed[0] + self.speed[1] * inverse_depth < MOST_SPEED
            && self.curve_px[0] + self.curve_px[1] * inverse_depth < STRAIGHT_PX
    }
}

impl RowProjector<'_> {
    /// The frame's camera.
    #[must_use]
    pub fn frame(&self) -> &FrameCamera {
        self.frame
    }

    /// The one position at which the frame shows a point, looked for from `guess_px` on, which need not be near.
    /// `None` where the point has to be looked for in the whole readout ([`FrameCamera::find_all`]).
    #[must_use]
    pub fn by_steps(&self, point: WorldPoint<'_>, guess_px: DVec2) -> Option<Shown> {
        let limits = self.limits?;
        let field = self.frame.fields.first()?;
        let (target, is_far) = match point {
            WorldPoint::At(point_ned_m) => (point_ned_m, false),
            WorldPoint::Towards(direction_ned) => (direction_ned, true),
            WorldPoint::On { .. } => return None,
        };
        let last = self.rows.len() - 1;
        if last == 0 {
            let seen = self.project(0, target, is_far)?;
            return self.shown(field.times_s[0], self.rows[0].position_ned_m, seen);
        }
        let along = |seen: &Projection| field.row_of(self.frame.along(seen.px));
        let guess = field.row_of(self.frame.along(guess_px));
        let mut row = (guess.max(0.0) as usize).min(last - 1);
        for _ in 0..MOST_STEPS {
            let (here, next) = (self.project(row, target, is_far)?, self.project(row + 1, target, is_far)?);
            let (miss, miss_next) = (along(&here) - row as f64, along(&next) - (row + 1) as f64);
            let fraction = miss / (miss - miss_next);
            // Half a row before the first and behind the last one belongs to these.
            let low = if row == 0 { -0.5 } else { 0.0 };
            let high = if row + 1 == last { 1.5 } else { 1.0 };
            if fraction >= low && fraction <= high {
                let mix = |a: f64, b: f64| a + (b - a) * fraction;
                let depth_m = if is_far { here.depth_m } else { mix(here.depth_m, next.depth_m) };
                let nearest_m = depth_m - limits.travel_m;
                let is_sure = is_far || nearest_m > 0.0 && limits.allow(1.0 / nearest_m);
                let [from, to] = [row, row + 1].map(|row| self.rows[row].position_ned_m);
                let seen = Projection { px: here.px.lerp(next.px, fraction), depth_m };
                let t_s = field.time_s(row as f64 + fraction);
                return is_sure.then(|| self.shown(t_s, from.lerp(to, fraction), seen)).flatten();
            }
            let to = (row as f64 + fraction).clamp(0.0, (last - 1) as f64) as usize;
            if to == row {
                return None;
            }
            row = to;
        }
        None
    }

    /// `None` outside of the picture.
    fn shown(
        &self,
        t_s: f64,
        position_ned_m: DVec3,
        Projection { px, depth_m }: Projection,
    ) -> Option<Shown> {
        self.frame.camera.holds(px).then_some(Shown { px, t_s, position_ned_m, depth_m })
    }

    #[inline]
    fn project(&self, row: usize, target: DVec3, is_far: bool) -> Option<Projection> {
        let Row { camera_from_ned, position_ned_m } = self.rows[row];
        let ray = camera_from_ned * if is_far { target } else { target - position_ned_m };
        let camera = &self.frame.camera;
        let uv = ray.truncate() / ray.z;
        if ray.z > 0.0 && uv.length_squared() < self.contained_radius2 {
            let depth_m = if is_far { f64::INFINITY } else { ray.z };
            return Some(Projection { px: camera.project(uv), depth_m });
        }
        camera.seen(ray, is_far).map(|(px, depth_m)| Projection { px, depth_m })
    }
}
