//! Controller and plant: two nested square-root loops on a double integrator, for position and for attitude
//! (section 3 of the paper).
//!
//! The outer loop turns the error e into a velocity relative to the target by eq. (2), with a linear zone
//! around the origin: `p e` for e below `b/p^2`, else `sqrt(2 b (e - b/(2 p^2)))`; both have the slope p
//! where they meet. The target's own velocity is added (feed-forward), and the sum is limited. The inner loop
//! does the same from velocity error to acceleration. Jerk is not limited, so the square root of the inner
//! loop is infinitely steep: what remains are its linear zone, which is everything that one tick can correct,
//! and the acceleration limit.
//!
//! Errors, speeds and accelerations are vectors whose lengths are limited. The velocity after a tick lies
//! between the one before and the demanded one, both inside the ball of the speed limit, so all limits hold
//! at every tick, for any log.
//!
//! On a cubic reference the same loops give the motion of another point: with their velocities u and accelerations
//! a_k = (u_k - u_(k-1))/h, which the plant takes on linearly until tick k, its velocity is a quadratic B-spline with
//! coefficients u. It lies within their hull, as accelerations lie between those of two ticks: all limits hold at
//! every instant. In the last interval the acceleration goes back to zero.

use glam::{DQuat, DVec3};

use super::{
    Limit, MAX_INTERVALS, ResolvedLimits, Saturation, SaturationInterval,
    reference::{Curve, Reference},
};
use crate::{
    pose::BodyState,
    trajectory::{advance, advance_smoothly, so3},
};

/// Gain of the linear zone, 1/s. With braking at 0.8 of the limit, a 10 m step has no overshoot from 50 to
/// 1000 Hz.
const LINEAR_GAIN_HZ: f64 = 8.0;
/// Bound on gain times step: at lower control rates the linear zone grows, instead of oscillating.
const LARGEST_GAIN_STEP: f64 = 0.16;
/// Fraction of the acceleration limit available for braking; the rest is for the target's own acceleration and
/// the finite tick.
const BRAKING_SHARE: f64 = 0.8;
/// Relative excess beyond which a demand counts as limited; it is above rounding.
const EXCESS: f64 = 1e-9;
/// Relative margin of accelerations to their limit, because a difference of velocities divided by the step is
/// rounded.
const ROUNDING_SHARE: f64 = 1e-10;

/// Loops of position or attitude: limits on the lengths of velocity and acceleration.
#[derive(Clone, Copy, Debug)]
struct SqrtLoops {
    step_s: f64,
    gain_hz: f64,
    braking: f64,
    max_velocity: f64,
    max_acceleration: f64,
}

/// Velocity after one tick, and the limits that reduced the demand.
struct Step {
    velocity: DVec3,
    velocity_limited: bool,
    acceleration_limited: bool,
}

impl SqrtLoops {
    fn new(step_s: f64, max_velocity: f64, max_acceleration: f64) -> Self {
        let gain_hz = LINEAR_GAIN_HZ.min(LARGEST_GAIN_STEP / step_s);
        Self { step_s, gain_hz, braking: BRAKING_SHARE * max_acceleration, max_velocity, max_acceleration }
    }

    /// Closing velocity for an error: in its direction, with the length of the SQRT gain.
    fn closing(&self, error: DVec3) -> DVec3 {
        let distance = error.length();
        let linear_zone = self.braking / (self.gain_hz * self.gain_hz);
        if distance <= linear_zone {
            error * self.gain_hz
        } else {
            error * ((2.0 * self.braking * (distance - 0.5 * linear_zone)).sqrt() / distance)
        }
    }

    /// One tick of both loops.
    fn step(&self, velocity: DVec3, error: DVec3, target_velocity: DVec3) -> Step {
        let demand = target_velocity + self.closing(error);
        let wanted = demand.clamp_length_max(self.max_velocity);
        let change = wanted - velocity;
        let largest = self.max_acceleration * (1.0 - ROUNDING_SHARE) * self.step_s;
        Step {
            velocity: velocity + change.clamp_length_max(largest),
            velocity_limited: demand.length() > self.max_velocity * (1.0 + EXCESS),
            acceleration_limited: change.length() > largest * (1.0 + EXCESS),
        }
    }
}

/// Result of following a reference.
#[derive(Debug)]
pub(crate) struct PlantRun {
    /// State at each tick, with the accelerations until the next one.
    pub(crate) states: Vec<BodyState>,
    pub(crate) saturation: Saturation,
    /// Intervals at a limit in seconds from the first tick, the longest first.
    pub(crate) saturation_intervals: Vec<SaturationInterval>,
}

/// Follows the reference, starting in its first state.
pub(crate) fn follow(reference: &Reference, limits: &ResolvedLimits) -> PlantRun {
    let loops = Loops::new(reference.step_s, limits);
    match reference.curve {
        Curve::Quadratic => follow_quadratic(reference, limits, &loops),
        Curve::Cubic => follow_cubic(reference, limits, &loops),
    }
}

/// Loops of position and of attitude.
struct Loops {
    linear: SqrtLoops,
    angular: SqrtLoops,
}

impl Loops {
    fn new(step_s: f64, limits: &ResolvedLimits) -> Self {
        Self {
            linear: SqrtLoops::new(step_s, limits.max_speed_m_s, limits.max_acceleration_m_s2),
            angular: SqrtLoops::new(
                step_s,
                limits.max_angular_rate_rad_s,
                limits.max_angular_acceleration_rad_s2,
            ),
        }
    }
}

/// The reference's first state, without accelerations.
fn first_state(reference: &Reference, limits: &ResolvedLimits) -> BodyState {
    let target = reference.target(0);
    BodyState {
        position_ned_m: target.position_ned_m,
        velocity_ned_m_s: target.velocity_ned_m_s.clamp_length_max(limits.max_speed_m_s),
        ned_from_body: target.ned_from_body,
        rate_body_rad_s: target.rate_body_rad_s.clamp_length_max(limits.max_angular_rate_rad_s),
        ..BodyState::default()
    }
}

fn follow_quadratic(reference: &Reference, limits: &ResolvedLimits, loops: &Loops) -> PlantRun {
    let step_s = reference.step_s;
    let mut saturation = SaturationTimer::new(step_s);
    let mut target = reference.target(0);
    let mut state = first_state(reference, limits);
    let mut states = Vec::with_capacity(reference.ticks());
    for k in 1..reference.ticks() {
        let next = reference.target(k);

        // Error that would remain if the next tick had exactly the target's velocity.
        let reached =
            state.position_ned_m + (state.velocity_ned_m_s + next.velocity_ned_m_s) * (0.5 * step_s);
        let moved =
            loops.linear.step(state.velocity_ned_m_s, next.position_ned_m - reached, next.velocity_ned_m_s);
        state.acceleration_ned_m_s2 = (moved.velocity - state.velocity_ned_m_s) / step_s;

        // The same on the rotation group: the error is a rotation vector in body axes, and the target's rate
        // is rotated into them.
        let own_from_target: DQuat = state.ned_from_body.inverse() * target.ned_from_body;
        let target_rate = own_from_target * next.rate_body_rad_s;
        let (rate, mean_rate) = (state.rate_body_rad_s, 0.5 * (state.rate_body_rad_s + target_rate));
        let coning = rate.cross(target_rate) * (step_s * step_s / 12.0);
        let reached = state.ned_from_body * so3::exp(mean_rate * step_s + coning);
        let turned = loops.angular.step(rate, so3::log(reached.inverse() * next.ned_from_body), target_rate);
        state.angular_acceleration_body_rad_s2 = (turned.velocity - rate) / step_s;

        saturation.tick(&moved, &turned);
        states.push(state);
        state = advance(&state, step_s);
        // Velocities are copied, not integrated, so that rounding cannot exceed a limit.
        state.velocity_ned_m_s = moved.velocity;
        state.rate_body_rad_s = turned.velocity;
        state.ned_from_body = state.ned_from_body.normalize();
        target = next;
    }
    state.acceleration_ned_m_s2 = DVec3::ZERO;
    state.angular_acceleration_body_rad_s2 = DVec3::ZERO;
    states.push(state);
    saturation.run(states)
}

fn follow_cubic(reference: &Reference, limits: &ResolvedLimits, loops: &Loops) -> PlantRun {
    let step_s = reference.step_s;
    let mut saturation = SaturationTimer::new(step_s);
    let mut target = reference.target(0);
    let mut state = first_state(reference, limits);
    // The velocity and rate of the loops.
    let (mut velocity, mut rate) = (state.velocity_ned_m_s, state.rate_body_rad_s);
    let mut states = Vec::with_capacity(reference.ticks());
    for k in 1..reference.ticks() {
        let next = reference.target(k);
        // The state at the next tick from the velocity and rate of the loops there.
        let reach = |next_velocity: DVec3, next_rate: DVec3| {
            let to = BodyState {
                acceleration_ned_m_s2: (next_velocity - velocity) / step_s,
                angular_acceleration_body_rad_s2: (next_rate - rate) / step_s,
                ..state
            };
            let reached = advance_smoothly(&state, &to, step_s, step_s);
            BodyState {
                // The means, not integrals, so that rounding cannot exceed a limit.
                velocity_ned_m_s: 0.5 * (velocity + next_velocity),
                rate_body_rad_s: 0.5 * (rate + next_rate),
                acceleration_ned_m_s2: to.acceleration_ned_m_s2,
                angular_acceleration_body_rad_s2: to.angular_acceleration_body_rad_s2,
                ned_from_body: reached.ned_from_body.normalize(),
                ..reached
            }
        };
        states.push(state);
        if k + 1 == reference.ticks() {
            state = reach(velocity, rate);
            break;
        }
        let own_from_target: DQuat = state.ned_from_body.inverse() * target.ned_from_body;
        let target_rate = own_from_target * next.rate_body_rad_s;
        // Error that would remain if the loops had exactly the target's velocity and rate.
        let reached = reach(next.velocity_ned_m_s, target_rate);
        let off_m = next.position_ned_m - reached.position_ned_m;
        let off_rad = so3::log(reached.ned_from_body.inverse() * next.ned_from_body);
        let moved = loops.linear.step(velocity, off_m, next.velocity_ned_m_s);
        let turned = loops.angular.step(rate, off_rad, target_rate);
        saturation.tick(&moved, &turned);
        state = reach(moved.velocity, turned.velocity);
        (velocity, rate) = (moved.velocity, turned.velocity);
        target = next;
    }
    states.push(state);
    saturation.run(states)
}

/// Measures the intervals at each limit.
struct SaturationTimer {
    step_s: f64,
    ticks: u64,
    running_s: [f64; 4],
    longest: Saturation,
    saturation_intervals: Vec<SaturationInterval>,
}

impl SaturationTimer {
    fn new(step_s: f64) -> Self {
        Self {
            step_s,
            ticks: 0,
            running_s: [0.0; 4],
            longest: Saturation::default(),
            saturation_intervals: Vec::new(),
        }
    }

    fn tick(&mut self, moved: &Step, turned: &Step) {
        let limited = [
            moved.velocity_limited,
            moved.acceleration_limited,
            turned.velocity_limited,
            turned.acceleration_limited,
        ];
        for (k, limited) in limited.into_iter().enumerate() {
            if !limited {
                self.end(k);
                continue;
            }
            self.running_s[k] += self.step_s;
            let longest_s = match Limit::ALL[k] {
                Limit::MaxSpeed => &mut self.longest.speed_s,
                Limit::MaxAcceleration => &mut self.longest.acceleration_s,
                Limit::MaxAngularRate => &mut self.longest.angular_rate_s,
                Limit::MaxAngularAcceleration => &mut self.longest.angular_acceleration_s,
            };
            *longest_s = longest_s.max(self.running_s[k]);
        }
        self.ticks += 1;
    }

    fn end(&mut self, k: usize) {
        let duration_s = std::mem::take(&mut self.running_s[k]);
        if duration_s == 0.0 {
            return;
        }
        let to_s = self.ticks as f64 * self.step_s;
        self.saturation_intervals.push(SaturationInterval {
            limit: Limit::ALL[k],
            from_s: to_s - duration_s,
            to_s,
        });
        if self.saturation_intervals.len() >= 8 * MAX_INTERVALS {
            self.keep_longest();
        }
    }

    fn keep_longest(&mut self) {
        self.saturation_intervals.sort_by(|a, b| b.duration_s().total_cmp(&a.duration_s()));
        self.saturation_intervals.truncate(MAX_INTERVALS);
    }

    /// The result with these states.
    fn run(mut self, states: Vec<BodyState>) -> PlantRun {
        (0..Limit::ALL.len()).for_each(|k| self.end(k));
        self.keep_longest();
        PlantRun { states, saturation: self.longest, saturation_intervals: self.saturation_intervals }
    }
}
