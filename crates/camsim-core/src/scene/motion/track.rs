//! Tracks: the motion of one joint in its own frame.

use std::f64::consts::{PI, TAU};

use glam::{DQuat, DVec3};

use super::Curve;

/// Pose of a joint in its frame at one instant, with rates in the frame's axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackState {
    /// Position, in units of the frame.
    pub position_m: DVec3,
    /// Rotation.
    pub rotation: DQuat,
    /// Derivative of the position.
    pub velocity_m_s: DVec3,
    /// Angular rate, rad/s.
    pub rate_rad_s: DVec3,
}

/// Motion of one joint.
#[derive(Clone, Debug, PartialEq)]
pub enum Track {
    /// About an axis through the frame's origin: `angle = 2 pi hz t + phase`, anticlockwise seen against the
    /// axis in right-handed axes.
    Spin {
        /// Unit vector.
        axis: DVec3,
        /// Turns a second.
        hz: f64,
        /// Angle at t = 0.
        phase_rad: f64,
    },
    /// Along keys.
    Keys(Keys),
}

/// Positions and rotations along keys of their own.
#[derive(Clone, Debug, PartialEq)]
pub struct Keys {
    /// Position.
    pub position: Curve<DVec3>,
    /// Rotation.
    pub rotation: Curve<DQuat>,
    /// Time on the keys' clock at path time 0, seconds.
    pub start_s: f64,
    /// How the keys go on; `None` holds the first and the last one.
    pub repeat: Option<Repeat>,
}

/// Keys that begin again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Repeat {
    /// Time of the first repeated instant on the keys' clock, seconds.
    pub from_s: f64,
    /// Time until they begin again, seconds, above 0.
    pub period_s: f64,
    /// Whether they have repeated for ever; else the first key is held before `from_s`.
    pub always: bool,
}

impl Track {
    /// Pose and rates at path time `t_s`.
    #[must_use]
    pub fn state(&self, t_s: f64) -> TrackState {
        match self {
            Self::Spin { axis, hz, phase_rad } => TrackState {
                position_m: DVec3::ZERO,
                // Whole turns are taken off first: after an hour a rotor has made a hundred thousand.
                rotation: DQuat::from_axis_angle(*axis, TAU * (hz * t_s).fract() + phase_rad),
                velocity_m_s: DVec3::ZERO,
                rate_rad_s: TAU * hz * *axis,
            },
            Self::Keys(keys) => {
                let key_s = keys.key_s(t_s);
                let (position_m, velocity_m_s) = keys.position.at(key_s);
                let (rotation, rate_rad_s) = keys.rotation.at(key_s);
                TrackState { position_m, rotation, velocity_m_s, rate_rad_s }
            }
        }
    }

    /// Passes points whose convex hull holds all positions between two path times to `visit`.
    pub(super) fn hull(&self, from_s: f64, to_s: f64, visit: &mut dyn FnMut(DVec3)) {
        match self {
            Self::Spin { .. } => visit(DVec3::ZERO),
            Self::Keys(keys) => {
                keys.parts(from_s, to_s).iter().for_each(|[a, b]| keys.position.hull(*a, *b, visit));
            }
        }
    }

    /// A rotation, and the largest angle to any rotation between two path times, at most pi.
    pub(super) fn turn(&self, from_s: f64, to_s: f64) -> (DQuat, f64) {
        let middle = self.state(0.5 * (from_s + to_s)).rotation;
        let angle_rad = match self {
            Self::Spin { hz, .. } => PI * hz.abs() * (to_s - from_s),
            Self::Keys(keys) => {
                let parts = keys.parts(from_s, to_s);
                let within: f64 = parts.iter().map(|[a, b]| keys.rotation.variation(*a, *b)).sum();
                let jumps = parts.windows(2).map(|pair| {
                    let [a, b] = [pair[0][1], pair[1][0]].map(|t_s| keys.rotation.at(t_s).0);
                    a.angle_between(b)
                });
                within + jumps.sum::<f64>()
            }
        };
        (middle, angle_rad.min(PI))
    }
}

impl Keys {
    /// Time on the keys' clock.
    fn key_s(&self, t_s: f64) -> f64 {
        let key_s = t_s + self.start_s;
        match self.repeat {
            Some(Repeat { from_s, period_s, always }) if always || key_s >= from_s => {
                from_s + (key_s - from_s).rem_euclid(period_s)
            }
            _ => key_s,
        }
    }

    /// The parts of the keys' time that are passed between two path times.
    fn parts(&self, from_s: f64, to_s: f64) -> Vec<[f64; 2]> {
        let Some(Repeat { from_s: begin_s, period_s, always }) = self.repeat else {
            return vec![[from_s + self.start_s, to_s + self.start_s]];
        };
        let [from, to] = [from_s, to_s].map(|t_s| t_s + self.start_s);
        let end_s = begin_s + period_s;
        if to - from >= period_s {
            let before = if always { begin_s } else { from.min(begin_s) };
            return vec![[before, end_s]];
        }
        if !always && to < begin_s {
            return vec![[from, to]];
        }
        let [first, last] = [from_s, to_s].map(|t_s| self.key_s(t_s));
        if first <= last { vec![[first, last]] } else { vec![[first, end_s], [begin_s, last]] }
    }
}
