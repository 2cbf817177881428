//! Trajectory: pose, velocity and acceleration of the platform at any instant, in closed form.
//!
//! Between two knots the acceleration `a` and the body angular acceleration `alpha` are constant, or change
//! linearly from those of a knot to those of the next, by `j` and `i` a second, so that with tau = t - t_k
//!
//! ```text
//! x(t) = x_k + v_k tau + a tau^2/2 + j tau^3/6          v(t) = v_k + a tau + j tau^2/2
//! R(t) = R_k Exp(w_k tau + alpha tau^2/2 + i tau^3/6 + m)          w(t) = w_k + alpha tau + i tau^2/2
//! m = tau^3/12 w_k x alpha + tau^4/24 w_k x i + tau^5/120 alpha x i
//! ```
//!
//! m is the second Magnus term. The error of R over one segment is of order `tau^5 |w|^2 |alpha|`: 1e-13 rad at
//! 120 deg/s and 200 Hz, 1e-8 rad at 400 deg/s and 20 000 deg/s^2.

use glam::DVec3;

use crate::pose::BodyState;

pub mod so3;

/// Time outside of the span after which the motion stops, seconds; it keeps results finite at any finite
/// time.
const LONGEST_COAST_S: f64 = 1e9;

/// Times of the knots.
#[derive(Clone, Debug)]
enum KnotTimes {
    /// Knot k at `start_s + k step_s`.
    Uniform { step_s: f64 },
    /// Strictly increasing times, one per knot.
    Listed(Vec<f64>),
}

/// Distance from a knot at which an instant counts as that of the knot, seconds: the resolution of a stamp.
const AT_KNOT_S: f64 = 1e-9;

/// Accelerations between knots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Accelerations {
    /// Those of the knot before; they jump at knots.
    Constant,
    /// Linear from one knot to the next, and none at the first and the last: they never jump.
    Linear,
}

/// Motion of the platform: segments, each from one knot to the next.
#[derive(Clone, Debug)]
pub struct Trajectory {
    clock: KnotTimes,
    accelerations: Accelerations,
    /// State at the begin of each segment; never empty.
    knots: Vec<BodyState>,
    start_s: f64,
    end_s: f64,
    /// Instant from which the platform coasts: `end_s`, or the last knot where accelerations are linear.
    coast_s: f64,
    /// State at `coast_s`, without acceleration.
    last: BodyState,
}

impl Trajectory {
    /// Segments of equal length `step_s`, the first of which begins at `start_s`; the last one ends at
    /// `end_s`.
    ///
    /// `None` if there is no knot, a number is not finite, or `end_s` is not within the segments or at most
    /// one step after them.
    pub fn uniform(start_s: f64, step_s: f64, end_s: f64, knots: Vec<BodyState>) -> Option<Self> {
        let beyond_s = start_s + step_s * (knots.len() as f64 + 1e-6);
        let ordered = step_s > 0.0
            && step_s.is_finite()
            && start_s.is_finite()
            && end_s >= start_s
            && end_s <= beyond_s;
        Self::build(KnotTimes::Uniform { step_s }, start_s, end_s, ordered, knots)
    }

    /// As [`Self::uniform`], but between knots accelerations change linearly. The first and the last knot have none:
    /// the platform begins to coast, at the latter, without a jump.
    ///
    /// `None` as there, or if the first or last knot has accelerations.
    pub fn uniform_smooth(start_s: f64, step_s: f64, end_s: f64, knots: Vec<BodyState>) -> Option<Self> {
        let (first, last) = (*knots.first()?, *knots.last()?);
        let last_s = start_s + step_s * (knots.len() - 1) as f64;
        let rests = [first, last].iter().all(|state| without_acceleration(state) == *state);
        let trajectory = Self::uniform(start_s, step_s, end_s, knots).filter(|_| rests)?;
        Some(Self { accelerations: Accelerations::Linear, coast_s: last_s, last, ..trajectory })
    }

    /// Segments that begin at `times_s` (strictly increasing, one per knot); the last one ends at `end_s`.
    ///
    /// `None` if there is no knot, a number is not finite, the times do not increase, or `end_s` is before
    /// the begin of the last segment.
    pub fn listed(times_s: Vec<f64>, end_s: f64, knots: Vec<BodyState>) -> Option<Self> {
        let start_s = *times_s.first()?;
        let ordered = times_s.len() == knots.len()
            && times_s.iter().all(|t| t.is_finite())
            && times_s.windows(2).all(|pair| pair[0] < pair[1])
            && times_s.last().is_some_and(|last| *last <= end_s)
            && end_s.is_finite();
        Self::build(KnotTimes::Listed(times_s), start_s, end_s, ordered, knots)
    }

    fn build(
        clock: KnotTimes,
        start_s: f64,
        end_s: f64,
        ordered: bool,
        knots: Vec<BodyState>,
    ) -> Option<Self> {
        let last = *knots.last()?;
        if !ordered || !knots.iter().all(is_finite) {
            return None;
        }
        let accelerations = Accelerations::Constant;
        let mut trajectory = Self { clock, accelerations, knots, start_s, end_s, coast_s: end_s, last };
        let k = trajectory.segment(end_s);
        trajectory.last = without_acceleration(&advance(&trajectory.knots[k], end_s - trajectory.knot_s(k)));
        Some(trajectory)
    }

    /// First and last instant of the log, seconds.
    pub fn span_s(&self) -> (f64, f64) {
        (self.start_s, self.end_s)
    }

    /// Whether accelerations are continuous.
    pub fn is_smooth(&self) -> bool {
        self.accelerations == Accelerations::Linear
    }

    /// Number of segments.
    pub fn segments(&self) -> usize {
        self.knots.len()
    }

    /// Instant at which segment `k` begins, seconds; `k` below [`Self::segments`].
    pub fn knot_s(&self, k: usize) -> f64 {
        match &self.clock {
            KnotTimes::Uniform { step_s } => self.start_s + step_s * k as f64,
            KnotTimes::Listed(times_s) => times_s[k.min(times_s.len() - 1)],
        }
    }

    /// States at the beginnings of all segments, in order of time.
    pub fn knots(&self) -> &[BodyState] {
        &self.knots
    }

    /// Motion state at `t_s`, in O(1) for control ticks and O(log n) for rows of a log.
    ///
    /// Outside of [`Self::span_s`] the platform coasts: velocity and body rate keep their values at the end,
    /// for at most 1e9 s. NaN gives the begin.
    pub fn state(&self, t_s: f64) -> BodyState {
        if t_s.is_nan() {
            return self.knots[0];
        }
        self.state_of(self.part(t_s), t_s)
    }

    /// As [`Self::state`], but where accelerations or rates jump within a nanosecond of `t_s`, they are the means of
    /// both sides: what an inertial sensor measures there, whichever side rounding picks.
    pub fn felt_state(&self, t_s: f64) -> BodyState {
        let state = self.state(t_s);
        let [before, after] = [t_s - AT_KNOT_S, t_s + AT_KNOT_S].map(|near_s| self.part(near_s));
        if before == after || self.accelerations == Accelerations::Linear {
            return state;
        }
        let [before, after] = [before, after].map(|part| self.state_of(part, t_s));
        BodyState {
            acceleration_ned_m_s2: 0.5 * (before.acceleration_ned_m_s2 + after.acceleration_ned_m_s2),
            rate_body_rad_s: 0.5 * (before.rate_body_rad_s + after.rate_body_rad_s),
            angular_acceleration_body_rad_s2: 0.5
                * (before.angular_acceleration_body_rad_s2 + after.angular_acceleration_body_rad_s2),
            ..state
        }
    }

    /// The part of the motion to which `t_s` belongs.
    #[inline]
    fn part(&self, t_s: f64) -> Part {
        if t_s >= self.coast_s {
            Part::After
        } else if t_s < self.start_s {
            Part::Before
        } else {
            Part::Segment(self.segment(t_s))
        }
    }

    /// State at `t_s` by the formula of a part.
    #[inline]
    fn state_of(&self, part: Part, t_s: f64) -> BodyState {
        match part {
            Part::Before => {
                advance(&without_acceleration(&self.knots[0]), (t_s - self.start_s).max(-LONGEST_COAST_S))
            }
            Part::After => advance(&self.last, (t_s - self.coast_s).min(LONGEST_COAST_S)),
            Part::Segment(k) => {
                let (from, tau_s) = (&self.knots[k], t_s - self.knot_s(k));
                match (self.accelerations, self.knots.get(k + 1)) {
                    (Accelerations::Linear, Some(to)) => {
                        advance_smoothly(from, to, self.knot_s(k + 1) - self.knot_s(k), tau_s)
                    }
                    _ => advance(from, tau_s),
                }
            }
        }
    }

    /// Index of the segment that contains `t_s`, which is inside the span.
    fn segment(&self, t_s: f64) -> usize {
        let last = match self.accelerations {
            Accelerations::Constant => self.knots.len() - 1,
            // No segment begins at the last knot.
            Accelerations::Linear => self.knots.len().saturating_sub(2),
        };
        match &self.clock {
            // Saturating cast: the quotient is not negative. Rounding at a knot only selects the adjacent
            // segment, which is continuous there.
            KnotTimes::Uniform { step_s } => (((t_s - self.start_s) / step_s) as usize).min(last),
            KnotTimes::Listed(times_s) => {
                times_s.partition_point(|knot| *knot <= t_s).saturating_sub(1).min(last)
            }
        }
    }
}

/// Parts of a motion, each with one formula.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Part {
    /// Before the first row of the log: coasting.
    Before,
    /// From this knot to the next.
    Segment(usize),
    /// After the last row of the log: coasting.
    After,
}

/// The state `tau_s` after `from` (may be negative), under the accelerations of `from`; formulas in the
/// module documentation.
pub fn advance(from: &BodyState, tau_s: f64) -> BodyState {
    let (rate, alpha) = (from.rate_body_rad_s, from.angular_acceleration_body_rad_s2);
    let half2 = 0.5 * tau_s * tau_s;
    let magnus = rate.cross(alpha) * (tau_s * half2 / 6.0);
    BodyState {
        position_ned_m: from.position_ned_m
            + from.velocity_ned_m_s * tau_s
            + from.acceleration_ned_m_s2 * half2,
        velocity_ned_m_s: from.velocity_ned_m_s + from.acceleration_ned_m_s2 * tau_s,
        ned_from_body: from.ned_from_body * so3::exp(rate * tau_s + alpha * half2 + magnus),
        rate_body_rad_s: rate + alpha * tau_s,
        ..*from
    }
}

/// The state `tau_s` after `from`, with accelerations that change linearly to those of `to` within `step_s`.
pub(crate) fn advance_smoothly(from: &BodyState, to: &BodyState, step_s: f64, tau_s: f64) -> BodyState {
    let ramp = |from: DVec3, to: DVec3| (to - from) / step_s;
    let jerk = ramp(from.acceleration_ned_m_s2, to.acceleration_ned_m_s2);
    let (rate, alpha) = (from.rate_body_rad_s, from.angular_acceleration_body_rad_s2);
    let angular_jerk = ramp(alpha, to.angular_acceleration_body_rad_s2);
    let half2 = 0.5 * tau_s * tau_s;
    BodyState {
        position_ned_m: from.position_ned_m
            + from.velocity_ned_m_s * tau_s
            + from.acceleration_ned_m_s2 * half2
            + jerk * (half2 * tau_s / 3.0),
        velocity_ned_m_s: from.velocity_ned_m_s + from.acceleration_ned_m_s2 * tau_s + jerk * half2,
        acceleration_ned_m_s2: from.acceleration_ned_m_s2 + jerk * tau_s,
        ned_from_body: from.ned_from_body * so3::exp(turned(rate, alpha, angular_jerk, tau_s)),
        rate_body_rad_s: rate + alpha * tau_s + angular_jerk * half2,
        angular_acceleration_body_rad_s2: alpha + angular_jerk * tau_s,
    }
}

/// Rotation vector of the turn within `tau_s` from a body rate, an angular acceleration and its change a second.
fn turned(rate: DVec3, alpha: DVec3, angular_jerk: DVec3, tau_s: f64) -> DVec3 {
    let half2 = 0.5 * tau_s * tau_s;
    let third = tau_s * half2 / 6.0;
    let magnus = rate.cross(alpha) * third
        + rate.cross(angular_jerk) * (0.5 * third * tau_s)
        + alpha.cross(angular_jerk) * (0.1 * third * tau_s * tau_s);
    rate * tau_s + alpha * half2 + angular_jerk * (half2 * tau_s / 3.0) + magnus
}

fn without_acceleration(state: &BodyState) -> BodyState {
    BodyState { acceleration_ned_m_s2: DVec3::ZERO, angular_acceleration_body_rad_s2: DVec3::ZERO, ..*state }
}

fn is_finite(state: &BodyState) -> bool {
    state.position_ned_m.is_finite()
        && state.velocity_ned_m_s.is_finite()
        && state.acceleration_ned_m_s2.is_finite()
        && state.ned_from_body.is_finite()
        && state.rate_body_rad_s.is_finite()
        && state.angular_acceleration_body_rad_s2.is_finite()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    fn still() -> BodyState {
        BodyState {
            position_ned_m: DVec3::new(10.0, -20.0, -100.0),
            velocity_ned_m_s: DVec3::new(12.0, 1.0, -0.5),
            acceleration_ned_m_s2: DVec3::new(-3.0, 8.0, 2.0),
            ned_from_body: so3::exp(DVec3::new(0.2, -0.4, 1.0)),
            rate_body_rad_s: DVec3::new(1.0, -1.5, 0.8),
            angular_acceleration_body_rad_s2: DVec3::new(-0.7, 0.5, 0.9),
        }
    }

    /// Several segments with different accelerations whose states join.
    fn joined(step_s: f64, count: usize) -> Trajectory {
        let mut knots = vec![still()];
        for k in 1..count {
            let mut next = advance(&knots[k - 1], step_s);
            let wave = k as f64;
            next.acceleration_ned_m_s2 = DVec3::new(wave.sin(), (2.0 * wave).cos(), 0.3) * 15.0;
            next.angular_acceleration_body_rad_s2 = DVec3::new((3.0 * wave).sin(), 0.2, wave.cos());
            knots.push(next);
        }
        Trajectory::uniform(5.0, step_s, 5.0 + step_s * count as f64, knots).unwrap()
    }

    #[test]
    fn segment_agrees_with_fine_integration() {
        // 2000 midpoint-exponential steps within one 5 ms tick: their own error is of order (5e-3)^3 /
        // 2000^2.
        let (start, tau_s, steps) = (still(), 5e-3, 2000);
        let h = tau_s / f64::from(steps);
        let (mut x, mut v, mut q) = (start.position_ned_m, start.velocity_ned_m_s, start.ned_from_body);
        for i in 0..steps {
            let mid_s = (f64::from(i) + 0.5) * h;
            x += (v + start.acceleration_ned_m_s2 * (0.5 * h)) * h;
            v += start.acceleration_ned_m_s2 * h;
            q *= so3::exp((start.rate_body_rad_s + start.angular_acceleration_body_rad_s2 * mid_s) * h);
        }
        let end = advance(&start, tau_s);
        assert!((end.position_ned_m - x).length() < 1e-12);
        // Two thousand roundings of 12 m/s, mostly of one sign.
        assert!((end.velocity_ned_m_s - v).length() < 5e-12);
        assert!(so3::log(end.ned_from_body.inverse() * q).length() < 1e-12);
    }

    #[test]
    fn position_velocity_attitude_and_rate_are_continuous() {
        let trajectory = joined(0.01, 40);
        for k in 1..40 {
            let seam_s = trajectory.knot_s(k);
            let (before, after) = (trajectory.state(seam_s - 1e-9), trajectory.state(seam_s + 1e-9));
            // Two nanoseconds of motion at under 20 m/s, 20 m/s^2, 3 rad/s and 2 rad/s^2.
            assert!((after.position_ned_m - before.position_ned_m).length() < 5e-8);
            assert!((after.velocity_ned_m_s - before.velocity_ned_m_s).length() < 1e-7);
            assert!(so3::log(before.ned_from_body.inverse() * after.ned_from_body).length() < 1e-8);
            assert!((after.rate_body_rad_s - before.rate_body_rad_s).length() < 1e-8);
        }
    }

    #[test]
    fn velocity_and_rate_are_derivatives() {
        let trajectory = joined(0.01, 40);
        let h = 1e-4;
        for k in 0..40 {
            let t_s = trajectory.knot_s(k) + 0.0043;
            let (before, at, after) =
                (trajectory.state(t_s - h), trajectory.state(t_s), trajectory.state(t_s + h));
            let velocity = (after.position_ned_m - before.position_ned_m) / (2.0 * h);
            let rate = so3::log(before.ned_from_body.inverse() * after.ned_from_body) / (2.0 * h);
            // Rounding of positions (1e-14 m / 2e-4 s); for the rate also h^2 |w x alpha| / 6.
            assert!((velocity - at.velocity_ned_m_s).length() < 1e-9);
            assert!((rate - at.rate_body_rad_s).length() < 2e-8);
        }
    }

    /// Knots at which accelerations are those of a sum of sines, integrated between by their linear course.
    fn smooth(step_s: f64, count: usize) -> Trajectory {
        let wave = |k: usize| {
            let t_s = step_s * k as f64;
            let rest = if k == 0 || k + 1 == count { 0.0 } else { 1.0 };
            [
                DVec3::new((9.0 * t_s).sin(), (7.0 * t_s).cos(), 0.4) * 12.0,
                DVec3::new(0.7, -1.1, (5.0 * t_s).sin()),
            ]
            .map(|of| of * rest)
        };
        let mut knots = vec![without_acceleration(&still())];
        for k in 1..count {
            let [acceleration_ned_m_s2, angular_acceleration_body_rad_s2] = wave(k);
            let to = BodyState { acceleration_ned_m_s2, angular_acceleration_body_rad_s2, ..knots[k - 1] };
            let next = advance_smoothly(&knots[k - 1], &to, step_s, step_s);
            knots.push(BodyState { acceleration_ned_m_s2, angular_acceleration_body_rad_s2, ..next });
        }
        Trajectory::uniform_smooth(5.0, step_s, 5.0 + step_s * (count as f64 - 1.3), knots).unwrap()
    }

    #[test]
    fn smooth_motion_agrees_with_fine_integration_and_never_jumps() {
        let trajectory = smooth(0.01, 40);
        let (start_s, steps) = (5.0, 40_000);
        let h = 0.4 / f64::from(steps);
        let start = trajectory.state(start_s);
        let (mut x, mut v, mut w) = (start.position_ned_m, start.velocity_ned_m_s, start.rate_body_rad_s);
        let mut q = start.ned_from_body;
        let mut before = start;
        // Midpoint rule from before the last knot to after it, where the platform coasts.
        for i in 0..steps {
            let state = trajectory.state(start_s + (f64::from(i) + 0.5) * h);
            let (a, alpha) = (state.acceleration_ned_m_s2, state.angular_acceleration_body_rad_s2);
            x += (v + a * (0.5 * h)) * h;
            v += a * h;
            q *= so3::exp((w + alpha * (0.5 * h)) * h);
            w += alpha * h;
            // 1e-5 s of 24 m/s^2 in 0.01 s.
            assert!((a - before.acceleration_ned_m_s2).length() < 0.03, "{i}");
            assert!((alpha - before.angular_acceleration_body_rad_s2).length() < 0.003, "{i}");
            before = state;
        }
        let end = trajectory.state(start_s + 0.4);
        // h^2/24 of the second derivatives, and 40 000 roundings.
        assert!((end.position_ned_m - x).length() < 1e-9, "{}", end.position_ned_m - x);
        assert!((end.velocity_ned_m_s - v).length() < 1e-9);
        assert!((end.rate_body_rad_s - w).length() < 1e-10);
        assert!(so3::log(end.ned_from_body.inverse() * q).length() < 1e-9);
        // Knots with accelerations at an end are refused.
        let knots = vec![still(), without_acceleration(&still())];
        assert!(Trajectory::uniform_smooth(0.0, 0.1, 0.1, knots).is_none());
    }

    #[test]
    fn a_jump_is_felt_as_the_mean_of_both_sides() {
        let trajectory = joined(0.1, 3);
        let [first, second] = [trajectory.knots()[0], trajectory.knots()[1]];
        for rounding_s in [-1e-12, 0.0, 1e-12] {
            let felt = trajectory.felt_state(5.1 + rounding_s);
            let mean = 0.5 * (first.acceleration_ned_m_s2 + second.acceleration_ned_m_s2);
            assert!((felt.acceleration_ned_m_s2 - mean).length() < 1e-12);
            assert!((felt.rate_body_rad_s - second.rate_body_rad_s).length() < 1e-11);
            assert!((felt.position_ned_m - second.position_ned_m).length() < 1e-9);
            // The platform coasts before the log.
            let felt = trajectory.felt_state(5.0 + rounding_s);
            assert!((felt.acceleration_ned_m_s2 - 0.5 * first.acceleration_ned_m_s2).length() < 1e-12);
        }
        for t_s in [5.05, 5.1 + 1e-8, 5.1 - 1e-8, 4.0, 9.0] {
            assert_eq!(trajectory.felt_state(t_s), trajectory.state(t_s), "{t_s}");
        }
    }

    #[test]
    fn coasts_outside_and_is_finite_at_any_time() {
        let trajectory = joined(0.01, 10);
        let (start_s, end_s) = trajectory.span_s();
        for (inside_s, outside_s) in [(start_s, start_s - 2.0), (end_s, end_s + 3.0)] {
            let (edge, out) = (trajectory.state(inside_s), trajectory.state(outside_s));
            assert_eq!(edge.velocity_ned_m_s, out.velocity_ned_m_s);
            assert_eq!(edge.rate_body_rad_s, out.rate_body_rad_s);
            let moved = edge.position_ned_m + edge.velocity_ned_m_s * (outside_s - inside_s);
            assert!((moved - out.position_ned_m).length() < 1e-12);
        }
        for t_s in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e300, 5e-324] {
            assert!(is_finite(&trajectory.state(t_s)), "{t_s}");
        }
        assert_eq!(trajectory.state(f64::NAN).position_ned_m, still().position_ned_m);
    }

    #[test]
    fn listed_knots_are_found_and_faults_refused() {
        let times = vec![0.0, 1.0, 1.00005, 4.0];
        let knots: Vec<_> = (0..4)
            .map(|k| BodyState { position_ned_m: DVec3::splat(f64::from(k)), ..BodyState::default() })
            .collect();
        let trajectory = Trajectory::listed(times.clone(), 4.0, knots.clone()).unwrap();
        for (t_s, expected) in [
            (-1.0, 0.0),
            (0.0, 0.0),
            (0.999, 0.0),
            (1.0, 1.0),
            (1.0001, 2.0),
            (3.99, 2.0),
            (4.0, 3.0),
            (9.0, 3.0),
        ] {
            assert_eq!(trajectory.state(t_s).position_ned_m.x, expected, "{t_s}");
        }
        assert!(Trajectory::listed(vec![], 0.0, vec![]).is_none());
        assert!(Trajectory::listed(vec![0.0, 0.0, 1.0, 2.0], 2.0, knots.clone()).is_none());
        assert!(Trajectory::listed(times.clone(), 3.0, knots.clone()).is_none());
        assert!(Trajectory::listed(times, f64::NAN, knots.clone()).is_none());
        assert!(Trajectory::uniform(0.0, 0.0, 0.0, knots.clone()).is_none());
        assert!(Trajectory::uniform(0.0, 0.1, 0.6, knots).is_none());
    }
}
