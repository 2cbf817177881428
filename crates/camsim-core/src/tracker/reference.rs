//! The reference of the plant: the interpolated log, sampled at equal steps and smoothed without lag.

use glam::{DQuat, DVec3, DVec4};

use super::at_rank;
use crate::{flight_log::LogRow, trajectory::so3};

/// Interpolation of the log: straight lines in position, great circles in attitude. Rows are in order of
/// time.
#[derive(Clone, Debug)]
pub(crate) struct LogInterpolator<'a> {
    rows: &'a [LogRow],
    /// Row of the last look-up; look-ups mostly move forward.
    row: usize,
    /// Index of a row and the rotation to the next one, cached because many look-ups fall between the same
    /// two.
    turn: Option<(usize, DVec3)>,
}

impl<'a> LogInterpolator<'a> {
    /// `None` for a log without rows.
    pub(crate) fn new(rows: &'a [LogRow]) -> Option<Self> {
        (!rows.is_empty()).then_some(Self { rows, row: 0, turn: None })
    }

    /// Position and attitude at `t_s`; outside of the log those of the first or last row.
    pub(crate) fn at(&mut self, t_s: f64) -> (DVec3, DQuat) {
        let later = self.rows.get(self.row + 1).is_some_and(|next| next.t_s <= t_s);
        if later || self.rows[self.row].t_s > t_s {
            let ahead = self.row + 2;
            let near = later && self.rows.get(ahead).is_none_or(|row| row.t_s > t_s);
            self.row = if near {
                self.row + 1
            } else {
                self.rows.partition_point(|row| row.t_s <= t_s).saturating_sub(1)
            };
        }
        let from = &self.rows[self.row];
        let Some(to) = self.rows.get(self.row + 1) else { return (from.position_ned_m, from.ned_from_body) };
        let part = ((t_s - from.t_s) / (to.t_s - from.t_s)).clamp(0.0, 1.0);
        let turn = match self.turn {
            Some((row, turn)) if row == self.row => turn,
            _ => so3::log(from.ned_from_body.inverse() * to.ned_from_body),
        };
        self.turn = Some((self.row, turn));
        (from.position_ned_m.lerp(to.position_ned_m, part), from.ned_from_body * so3::exp(turn * part))
    }

    /// As [`Self::at`], but extended beyond either end by point reflection, which keeps position and velocity
    /// continuous there.
    fn reflected(&mut self, t_s: f64) -> (DVec3, DQuat) {
        let (first, last) = (self.rows[0], self.rows[self.rows.len() - 1]);
        let edge = if t_s < first.t_s {
            first
        } else if t_s > last.t_s {
            last
        } else {
            return self.at(t_s);
        };
        let (position, attitude) = self.at(2.0 * edge.t_s - t_s);
        (
            2.0 * edge.position_ned_m - position,
            (edge.ned_from_body * attitude.inverse() * edge.ned_from_body).normalize(),
        )
    }
}

/// Curve whose coefficients a reference has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Curve {
    /// Uniform quadratic B-spline, coefficients at the middles of control intervals: constant accelerations between
    /// ticks.
    Quadratic,
    /// Uniform cubic B-spline, coefficients at the ticks and one before and after: accelerations that are linear
    /// between ticks.
    Cubic,
}

impl Curve {
    /// Coefficients beyond the number of ticks.
    fn more(self) -> usize {
        match self {
            Self::Quadratic => 1,
            Self::Cubic => 2,
        }
    }

    /// Steps from the first coefficient to the first tick.
    fn lead(self) -> f64 {
        0.5 * self.more() as f64
    }
}

/// Positions of a reference: from an instant on, at equal steps, for a number of control ticks.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ticks {
    pub(crate) curve: Curve,
    pub(crate) start_s: f64,
    pub(crate) step_s: f64,
    pub(crate) count: usize,
}

/// Positions and attitudes as coefficients of a B-spline. A plant that starts on such a reference, with sufficient
/// acceleration, stays on it exactly.
#[derive(Clone, Debug)]
pub(crate) struct Reference {
    pub(crate) curve: Curve,
    pub(crate) step_s: f64,
    pub(crate) position_ned_m: Vec<DVec3>,
    pub(crate) ned_from_body: Vec<DQuat>,
}

/// Target of the plant at a control tick: where it shall be, and the velocity and body rate from which it shall
/// accelerate further: at the tick itself with a quadratic curve, with a cubic one the difference between the
/// coefficients at this tick and the next over the step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Target {
    pub(crate) position_ned_m: DVec3,
    pub(crate) velocity_ned_m_s: DVec3,
    pub(crate) ned_from_body: DQuat,
    pub(crate) rate_body_rad_s: DVec3,
}

impl Reference {
    /// The interpolated log at the instants of the coefficients.
    pub(crate) fn sampled(log: &mut LogInterpolator<'_>, ticks: Ticks) -> Self {
        Self::sampled_from(log, ticks, 0)
    }

    /// With `margin` more coefficients before and after.
    fn sampled_from(log: &mut LogInterpolator<'_>, ticks: Ticks, margin: usize) -> Self {
        let Ticks { curve, start_s, step_s, count } = ticks;
        let count = count + curve.more() + 2 * margin;
        let (mut position_ned_m, mut ned_from_body) = (Vec::with_capacity(count), Vec::with_capacity(count));
        let mut previous = DQuat::IDENTITY;
        for k in 0..count {
            let (position, attitude) =
                log.reflected(start_s + (k as f64 - margin as f64 - curve.lead()) * step_s);
            // q and -q are the same attitude; the one nearer to its neighbour can be averaged with it.
            previous = if k > 0 && previous.dot(attitude) < 0.0 { -attitude } else { attitude };
            position_ned_m.push(position);
            ned_from_body.push(previous);
        }
        Self { curve, step_s, position_ned_m, ned_from_body }
    }

    /// The log smoothed by four successive moving averages, which together approximate a Gaussian of
    /// `sigma_s` without a shift in time.
    pub(crate) fn smoothed(log: &mut LogInterpolator<'_>, ticks: Ticks, sigma_s: f64) -> Self {
        let Ticks { curve, step_s, .. } = ticks;
        // The variance of a moving average over 2 h + 1 ticks is h (h + 1) / 3 ticks^2; those of the four add
        // up to sigma^2.
        let ticks2 = (sigma_s / step_s).powi(2);
        let half = ((0.25 + 0.75 * ticks2).sqrt() - 0.5).round().max(0.0) as usize;
        let raw = Self::sampled_from(log, ticks, PASSES * half);
        let (mut position, mut attitude) = (raw.position_ned_m, raw.ned_from_body);
        rayon::join(
            || (0..PASSES).for_each(|_| moving_average(&mut position, half)),
            || (0..PASSES).for_each(|_| average_attitude(&mut attitude, half)),
        );
        Self { curve, step_s, position_ned_m: position, ned_from_body: attitude }
    }

    /// Number of control ticks.
    pub(crate) fn ticks(&self) -> usize {
        self.position_ned_m.len() - self.curve.more()
    }

    /// Lengths of the accelerations, m/s^2 and rad/s^2, at a rank from 0 (the smallest) to 1 (the largest).
    pub(crate) fn accelerations(&self, rank: f64) -> [f64; 2] {
        let inner = 1..self.position_ned_m.len() - 1;
        let stride = inner.len() / MAX_RANKED + 1;
        let rate = 1.0 / (self.step_s * self.step_s);
        let linear = |k: usize| {
            (self.position_ned_m[k + 1] - 2.0 * self.position_ned_m[k] + self.position_ned_m[k - 1]).length()
        };
        let turn = |k: usize| so3::log(self.ned_from_body[k].inverse() * self.ned_from_body[k + 1]);
        let angular = |k: usize| (turn(k) - turn(k - 1)).length();
        let ranked =
            |of: &dyn Fn(usize) -> f64| rate * at_rank(inner.clone().step_by(stride).map(of).collect(), rank);
        [ranked(&linear), ranked(&angular)]
    }

    /// Target at tick `k`, below [`Self::ticks`].
    pub(crate) fn target(&self, k: usize) -> Target {
        let turn = |k: usize| so3::log(self.ned_from_body[k].inverse() * self.ned_from_body[k + 1]);
        let (x0, x1, q0) = (self.position_ned_m[k], self.position_ned_m[k + 1], self.ned_from_body[k]);
        match self.curve {
            Curve::Quadratic => {
                let turn = turn(k);
                Target {
                    position_ned_m: 0.5 * (x0 + x1),
                    velocity_ned_m_s: (x1 - x0) / self.step_s,
                    ned_from_body: q0 * so3::exp(0.5 * turn),
                    rate_body_rad_s: turn / self.step_s,
                }
            }
            Curve::Cubic => {
                let x2 = self.position_ned_m[k + 2];
                // Both turns have the same components in the axes of the attitude between them.
                let (before, after) = (turn(k), turn(k + 1));
                Target {
                    position_ned_m: x1 + (x0 - 2.0 * x1 + x2) / 6.0,
                    velocity_ned_m_s: (x2 - x1) / self.step_s,
                    ned_from_body: self.ned_from_body[k + 1] * so3::exp((after - before) / 6.0),
                    rate_body_rad_s: after / self.step_s,
                }
            }
        }
    }

    /// Makes a cubic curve end without accelerations.
    pub(crate) fn with_resting_ends(mut self) -> Self {
        let last = self.position_ned_m.len() - 1;
        for [end, next, after] in [[0, 1, 2], [last, last - 1, last - 2]] {
            self.position_ned_m[end] = 2.0 * self.position_ned_m[next] - self.position_ned_m[after];
            let (at, inward) = (self.ned_from_body[next], self.ned_from_body[after]);
            self.ned_from_body[end] = (at * inward.inverse() * at).normalize();
        }
        self
    }
}

/// Most ticks among which a rank is computed.
const MAX_RANKED: usize = 1_000_000;

/// Number of moving averages: four give a kernel with two continuous derivatives.
const PASSES: usize = 4;

/// Replaces values by means over `2 half + 1` of them, which shortens the list by `2 half`. The running sum
/// accumulates rounding, so values are taken relative to the first one. In place, because for hours of flight
/// allocation takes longer than the computation.
fn moving_average(values: &mut Vec<DVec3>, half: usize) {
    let width = 2 * half + 1;
    let Some(&base) = values.first() else { return };
    let mut sum: DVec3 = values.iter().take(width - 1).map(|value| *value - base).sum();
    let count = values.len().saturating_sub(2 * half);
    for k in 0..count {
        let (leaving, entering) = (values[k], values[k + 2 * half]);
        sum += entering - base;
        values[k] = base + sum / width as f64;
        sum -= leaving - base;
    }
    values.truncate(count);
}

/// Normalised mean quaternions, in place. Exact for a constant rate; otherwise the error is of third order in
/// the angle spanned by the window. Where the log rotates so fast that the mean is meaningless, the attitude
/// is kept.
fn average_attitude(values: &mut Vec<DQuat>, half: usize) {
    let width = 2 * half + 1;
    let components = |q: &DQuat| DVec4::new(q.x, q.y, q.z, q.w);
    let mut sum: DVec4 = values.iter().take(width - 1).map(components).sum();
    let count = values.len().saturating_sub(2 * half);
    for k in 0..count {
        let (leaving, entering) = (values[k], values[k + 2 * half]);
        sum += components(&entering);
        let mean = sum / width as f64;
        let length = mean.length();
        let mean = if length > 0.5 { DQuat::from_vec4(mean / length) } else { values[k + half] };
        values[k] = if k > 0 && values[k - 1].dot(mean) < 0.0 { -mean } else { mean };
        sum -= components(&leaving);
    }
    values.truncate(count);
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn row(t_s: f64, north_m: f64, yaw_rad: f64) -> LogRow {
        LogRow {
            t_s,
            position_ned_m: DVec3::new(north_m, 0.0, -50.0),
            ned_from_body: DQuat::from_rotation_z(yaw_rad),
        }
    }

    fn ticks(curve: Curve, step_s: f64, count: usize) -> Ticks {
        Ticks { curve, start_s: 0.0, step_s, count }
    }

    #[test]
    fn looks_up_forward_backward_and_outside() {
        let rows: Vec<_> = (0..50).map(|i| row(f64::from(i), f64::from(i * i), 0.1 * f64::from(i))).collect();
        let mut log = LogInterpolator::new(&rows).unwrap();
        for (t_s, north_m) in [
            (0.5, 0.5),
            (1.5, 2.5),
            (48.5, 2352.5),
            (3.0, 9.0),
            (2.999, 8.995),
            (-9.0, 0.0),
            (99.0, 2401.0),
            (49.0, 2401.0),
        ] {
            let (position, attitude) = log.at(t_s);
            assert!((position.x - north_m).abs() < 1e-9, "{t_s}");
            let yaw = 0.1 * t_s.clamp(0.0, 49.0);
            assert!(so3::log(DQuat::from_rotation_z(yaw).inverse() * attitude).length() < 1e-12, "{t_s}");
        }
        assert!(LogInterpolator::new(&[]).is_none());
    }

    #[test]
    fn smoothing_keeps_uniform_motion_to_both_ends() {
        let rows: Vec<_> =
            (0..9).map(|i| row(0.5 * f64::from(i), 3.0 * f64::from(i), 0.7 * f64::from(i))).collect();
        let mut log = LogInterpolator::new(&rows).unwrap();
        let reference = Reference::smoothed(&mut log, ticks(Curve::Quadratic, 0.01, 401), 0.1);
        for k in [0, 1, 200, 399, 400] {
            let target = reference.target(k);
            assert!((target.position_ned_m.x - 0.06 * k as f64).abs() < 1e-9);
            assert!((target.velocity_ned_m_s.x - 6.0).abs() < 1e-9);
            assert!((target.rate_body_rad_s - DVec3::new(0.0, 0.0, 1.4)).length() < 1e-9);
            let expected = DQuat::from_rotation_z(0.014 * k as f64);
            assert!(so3::log(expected.inverse() * target.ned_from_body).length() < 1e-9);
        }
    }

    #[test]
    fn smoothing_kernel_has_the_requested_variance() {
        // A parabola is shifted by sigma^2 times half its second derivative.
        let rows: Vec<_> =
            (0..4001).map(|i| row(0.001 * f64::from(i), (0.001 * f64::from(i) - 2.0).powi(2), 0.0)).collect();
        let mut log = LogInterpolator::new(&rows).unwrap();
        let reference = Reference::smoothed(&mut log, ticks(Curve::Quadratic, 0.001, 4000), 0.1);
        let gained = reference.position_ned_m[2000].x - (2000.0 * 0.001 - 0.0005 - 2.0f64).powi(2);
        // The half width is a whole number of ticks: 1 % at 1 ms.
        assert!((gained - 0.01).abs() < 2e-4, "{gained}");
    }

    /// The formulas written out with a new list, with sums in the same order.
    fn averages_written_out(
        positions: &[DVec3],
        attitudes: &[DQuat],
        half: usize,
    ) -> (Vec<DVec3>, Vec<DQuat>) {
        let (width, base) = (2 * half + 1, positions[0]);
        let mut sum: DVec3 = positions.iter().take(width - 1).map(|value| *value - base).sum();
        let mut of_positions = Vec::new();
        for window in positions.windows(width) {
            sum += window[width - 1] - base;
            of_positions.push(base + sum / width as f64);
            sum -= window[0] - base;
        }
        let mut sum: DVec4 = attitudes.iter().take(width - 1).map(|q| DVec4::from_array(q.to_array())).sum();
        let mut of_attitudes: Vec<DQuat> = Vec::new();
        for window in attitudes.windows(width) {
            sum += DVec4::from_array(window[width - 1].to_array());
            let mean = sum / width as f64;
            let mean =
                if mean.length() > 0.5 { DQuat::from_vec4(mean / mean.length()) } else { window[half] };
            let turned = of_attitudes.last().is_some_and(|before| before.dot(mean) < 0.0);
            of_attitudes.push(if turned { -mean } else { mean });
            sum -= DVec4::from_array(window[0].to_array());
        }
        (of_positions, of_attitudes)
    }

    #[test]
    fn in_place_averages_match_the_formulas_bitwise() {
        // Slow rotation, and rotation so fast that a window's mean is close to zero.
        for (rate, half) in [(0.01, 0), (0.01, 7), (0.9, 7), (2.3, 3), (0.01, 150), (0.01, 200)] {
            let time = |k: i32| f64::from(k);
            let mut positions: Vec<DVec3> = (0..301)
                .map(|k| DVec3::new(1e5 + time(k).sin(), time(k * k) * 0.37, -time(k).sqrt()))
                .collect();
            let axis = DVec3::new(0.6, -0.48, 0.64);
            let mut attitudes: Vec<DQuat> = (0..301)
                .map(|k| DQuat::from_axis_angle(axis, rate * time(k) + 0.2 * time(k).cos()))
                .collect();
            let expected = averages_written_out(&positions, &attitudes, half);
            moving_average(&mut positions, half);
            average_attitude(&mut attitudes, half);
            assert_eq!(positions.len(), 301_usize.saturating_sub(2 * half));
            assert!((positions, attitudes) == expected, "{rate} rad a tick, {half} ticks");
        }
        moving_average(&mut Vec::new(), 2);
        average_attitude(&mut Vec::new(), 2);
    }

    #[test]
    fn look_ups_are_independent_of_their_order() {
        let rows: Vec<_> = (0..20).map(|i| row(f64::from(i), f64::from(i * i), 0.3 * f64::from(i))).collect();
        let mut log = LogInterpolator::new(&rows).unwrap();
        for k in 0..400 {
            // Back and forth, often between the same two rows.
            let t_s = 9.5 + 11.0 * (f64::from(k) * 0.05).sin();
            assert_eq!(log.at(t_s), LogInterpolator::new(&rows).unwrap().at(t_s), "{t_s}");
        }
    }
}
