//! Things that move: rigid motions in closed form.
//!
//! A [`RigidMotion`] says where the points of a mesh are at any instant t of path time, from where they are at
//! t = 0:
//!
//! ```text
//! X(t) = R(t) X(0) + s(t),   dX/dt = v0(t) + w(t) x X(t)        north, east, down; metres, rad/s
//! ```
//!
//! It is a chain of joints, the outermost first: a car along its path, then a wheel on the car. Each joint is
//! a track (a spin, or keys) in a frame that is fixed to the joint before it and is given as it is at t = 0
//! (the product of exponentials of robotics):
//!
//! ```text
//! X(t) = J1(t) J2(t) ... X(0),   Ji(t) = Fi mi(t) mi(0)^-1 Fi^-1
//! ```
//!
//! So a mesh that moves has the placement of t = 0, and whatever knows nothing of motion sees it there.

mod curve;
mod track;

use glam::{DAffine3, DMat3, DQuat, DVec3};

use super::Aabb;
pub use curve::{Between, Curve};
pub use track::{Keys, Repeat, Track, TrackState};

/// Largest deviation of a frame's axes from right angles and equal lengths, relative: they are often stored
/// in single precision.
const SIMILAR: f64 = 1e-5;

/// Where a moving thing is at one instant, and how it moves then.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigidState {
    /// Rotation since t = 0, NED.
    pub rotation: DQuat,
    /// Position of the point that was at NED (0, 0, 0) at t = 0, metres.
    pub shift_m: DVec3,
    /// Velocity of the point that is at NED (0, 0, 0) now, m/s.
    pub velocity_at_origin_m_s: DVec3,
    /// Angular rate, NED, rad/s.
    pub rate_rad_s: DVec3,
}

impl RigidState {
    /// Nothing has moved.
    pub const STILL: Self = Self {
        rotation: DQuat::IDENTITY,
        shift_m: DVec3::ZERO,
        velocity_at_origin_m_s: DVec3::ZERO,
        rate_rad_s: DVec3::ZERO,
    };

    /// Where a point is that was at `at_start_ned_m` at t = 0.
    #[must_use]
    pub fn point(&self, at_start_ned_m: DVec3) -> DVec3 {
        self.rotation * at_start_ned_m + self.shift_m
    }

    /// Where a point was at t = 0 that is at `point_ned_m` now.
    #[must_use]
    pub fn point_at_start(&self, point_ned_m: DVec3) -> DVec3 {
        self.rotation.conjugate() * (point_ned_m - self.shift_m)
    }

    /// Velocity of a point that is at `point_ned_m` now, m/s.
    #[must_use]
    pub fn velocity(&self, point_ned_m: DVec3) -> DVec3 {
        self.velocity_at_origin_m_s + self.rate_rad_s.cross(point_ned_m)
    }

    /// The motion of what this carries: `inner` first, then this one.
    #[must_use]
    pub fn carrying(&self, inner: &Self) -> Self {
        let inner_rate = self.rotation * inner.rate_rad_s;
        Self {
            rotation: (self.rotation * inner.rotation).normalize(),
            shift_m: self.rotation * inner.shift_m + self.shift_m,
            velocity_at_origin_m_s: self.velocity_at_origin_m_s
                + self.rotation * inner.velocity_at_origin_m_s
                - inner_rate.cross(self.shift_m),
            rate_rad_s: self.rate_rad_s + inner_rate,
        }
    }
}

/// A frame whose axes are at right angles and equally long: it may be turned, scaled and mirrored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointFrame {
    origin_m: DVec3,
    /// Unit axes.
    axes: DMat3,
    scale: f64,
}

impl JointFrame {
    /// NED itself, or the axes of a model.
    pub const IDENTITY: Self = Self { origin_m: DVec3::ZERO, axes: DMat3::IDENTITY, scale: 1.0 };

    /// The frame of a transformation to the outer axes; `None` if that stretches unevenly.
    #[must_use]
    pub fn from_affine(outer_from_frame: &DAffine3) -> Option<Self> {
        let matrix = outer_from_frame.matrix3;
        let scale = matrix.determinant().abs().cbrt();
        let axes = matrix * scale.recip();
        let off = axes.transpose() * axes - DMat3::IDENTITY;
        let is_similar = off.to_cols_array().iter().all(|part| part.abs() <= SIMILAR);
        let origin_m = outer_from_frame.translation;
        (is_similar && origin_m.is_finite()).then_some(Self { origin_m, axes, scale })
    }

    fn point(&self, at: DVec3) -> DVec3 {
        self.origin_m + self.vector(at)
    }

    fn vector(&self, vector: DVec3) -> DVec3 {
        self.scale * (self.axes * vector)
    }

    /// A rotation vector or an angular rate: mirrored axes turn the other way.
    fn turn(&self, vector: DVec3) -> DVec3 {
        self.axes.determinant().signum() * (self.axes * vector)
    }

    fn rotation(&self, rotation: DQuat) -> DQuat {
        let vector = self.turn(rotation.xyz());
        DQuat::from_xyzw(vector.x, vector.y, vector.z, rotation.w).normalize()
    }

    fn of(&self, inner: &Self) -> Self {
        Self {
            origin_m: self.point(inner.origin_m),
            axes: self.axes * inner.axes,
            scale: self.scale * inner.scale,
        }
    }
}

/// A track in its frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    frame: JointFrame,
    track: Track,
    /// The track at t = 0.
    start: TrackState,
}

impl Joint {
    /// A track in a frame that is given as it is at t = 0.
    #[must_use]
    pub fn new(frame: JointFrame, track: Track) -> Self {
        Self { frame, start: track.state(0.0), track }
    }

    /// The track at t = 0.
    #[must_use]
    pub fn start(&self) -> &TrackState {
        &self.start
    }

    /// The same joint seen from axes in which its own outer axes are `frame`.
    #[must_use]
    pub fn within(&self, frame: &JointFrame) -> Self {
        Self { frame: frame.of(&self.frame), ..self.clone() }
    }

    fn state(&self, t_s: f64) -> RigidState {
        let now = self.track.state(t_s);
        let rotation = self.frame.rotation(now.rotation * self.start.rotation.conjugate());
        let (from, to) = (self.frame.point(self.start.position_m), self.frame.point(now.position_m));
        let rate_rad_s = self.frame.turn(now.rate_rad_s);
        RigidState {
            rotation,
            shift_m: to - rotation * from,
            velocity_at_origin_m_s: self.frame.vector(now.velocity_m_s) - rate_rad_s.cross(to),
            rate_rad_s,
        }
    }

    /// Box of all positions between two instants of what is in `bounds` at t = 0.
    fn bounds(&self, bounds: &Aabb, from_s: f64, to_s: f64) -> Aabb {
        let start = self.frame.point(self.start.position_m);
        let mut centres = Aabb::EMPTY;
        self.track.hull(from_s, to_s, &mut |at| centres.include(self.frame.point(at)));
        let (middle, angle_rad) = self.track.turn(from_s, to_s);
        let around = match angle_rad < std::f64::consts::FRAC_PI_2 {
            true => {
                let rotation = self.frame.rotation(middle * self.start.rotation.conjugate());
                let turned = bounds.turned(DMat3::from_quat(rotation), -(rotation * start));
                let reach_m = bounds.farthest_m(start) * 2.0 * (0.5 * angle_rad).sin();
                Aabb { min: turned.min - reach_m, max: turned.max + reach_m }
            }
            false => {
                let reach_m = DVec3::splat(bounds.farthest_m(start));
                Aabb { min: -reach_m, max: reach_m }
            }
        };
        Aabb { min: centres.min + around.min, max: centres.max + around.max }
    }
}

/// A rigid motion over all time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RigidMotion {
    joints: Vec<Joint>,
}

impl RigidMotion {
    /// A chain of joints, the outermost first. Their frames are those of t = 0, all in the same axes.
    #[must_use]
    pub fn new(joints: Vec<Joint>) -> Self {
        Self { joints }
    }

    /// The joints, the outermost first.
    #[must_use]
    pub fn joints(&self) -> &[Joint] {
        &self.joints
    }

    /// Position and rates at path time `t_s`. Where a track jumps or bends, those just after it.
    #[must_use]
    pub fn state(&self, t_s: f64) -> RigidState {
        let Some((last, outer)) = self.joints.split_last() else { return RigidState::STILL };
        outer.iter().rev().fold(last.state(t_s), |inner, joint| joint.state(t_s).carrying(&inner))
    }

    /// Turns a second of its fastest spin; 0 without any.
    #[must_use]
    pub fn highest_spin_hz(&self) -> f64 {
        let hz = |joint: &Joint| match joint.track {
            Track::Spin { hz, .. } => hz.abs(),
            Track::Keys(_) => 0.0,
        };
        self.joints.iter().map(hz).fold(0.0, f64::max)
    }

    /// A box that holds, from `from_s` to `to_s`, all that is in `at_start` at t = 0. Not the smallest one.
    #[must_use]
    pub fn bounds(&self, at_start: &Aabb, from_s: f64, to_s: f64) -> Aabb {
        if at_start.is_empty() {
            return *at_start;
        }
        self.joints.iter().rev().fold(*at_start, |bounds, joint| joint.bounds(&bounds, from_s, to_s))
    }
}

#[cfg(test)]
mod tests;
