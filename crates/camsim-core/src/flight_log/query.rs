//! Queries of a cleaned log: pose at an instant, typical speeds.

use glam::{DQuat, DVec3};

use super::{FlightLog, LogRow, attitude::angle_between_rad};

/// Least time over which speeds are measured: a GPS quantum of 0.11 m over the log's shortest step of 1 ms
/// would be 110 m/s.
const SPEED_BASELINE_S: f64 = 0.25;
/// Least time over which angular rates are measured. Attitude is smoother than position, and real rates
/// change faster.
const RATE_BASELINE_S: f64 = 0.05;

impl FlightLog {
    /// Time of the last row, seconds since the first.
    pub fn duration_s(&self) -> f64 {
        self.rows.last().map_or(0.0, |row| row.t_s)
    }

    /// Position (NED) and attitude (`ned_from_body`) at `t_s`: linear and slerp between rows, with constant
    /// velocity and angular rate outside (those of the first or last 0.25 s and 0.05 s). A log of one row
    /// stands still. NaN gives NaN.
    pub fn interpolate(&self, t_s: f64) -> (DVec3, DQuat) {
        let rows = &self.rows;
        let after = rows.partition_point(|row| row.t_s <= t_s);
        match (after.checked_sub(1).and_then(|i| rows.get(i)), rows.get(after)) {
            (Some(a), Some(b)) => between(a, b, (t_s - a.t_s) / (b.t_s - a.t_s)),
            (None, Some(first)) => {
                self.extrapolate(first, t_s, |row, baseline_s| row.t_s - first.t_s >= baseline_s)
            }
            (Some(last), None) if t_s > last.t_s => {
                let inner = |row: &LogRow, baseline_s: f64| last.t_s - row.t_s >= baseline_s;
                self.extrapolate_back(last, t_s, inner)
            }
            (Some(last), None) => (last.position_ned_m, last.ned_from_body),
            (None, None) => (DVec3::NAN, DQuat::NAN),
        }
    }

    fn extrapolate(
        &self,
        first: &LogRow,
        t_s: f64,
        far_enough: impl Fn(&LogRow, f64) -> bool,
    ) -> (DVec3, DQuat) {
        let inner = |baseline_s| {
            self.rows.iter().find(|row| far_enough(row, baseline_s)).or(self.rows.last()).unwrap_or(first)
        };
        beyond(first, inner(SPEED_BASELINE_S), inner(RATE_BASELINE_S), t_s)
    }

    fn extrapolate_back(
        &self,
        last: &LogRow,
        t_s: f64,
        far_enough: impl Fn(&LogRow, f64) -> bool,
    ) -> (DVec3, DQuat) {
        let inner = |baseline_s| {
            self.rows.iter().rfind(|row| far_enough(row, baseline_s)).or(self.rows.first()).unwrap_or(last)
        };
        beyond(last, inner(SPEED_BASELINE_S), inner(RATE_BASELINE_S), t_s)
    }

    /// Speed, in m/s over at least 0.25 s, that is not exceeded during `fraction` (0..1) of the time. 0 for
    /// one row.
    pub fn speed_percentile_m_s(&self, fraction: f64) -> f64 {
        self.percentile(fraction, SPEED_BASELINE_S, |a, b| a.position_ned_m.distance(b.position_ned_m))
    }

    /// Angular rate, in rad/s over at least 0.05 s, that is not exceeded during `fraction` (0..1) of the
    /// time. 0 for one row.
    pub fn angular_rate_percentile_rad_s(&self, fraction: f64) -> f64 {
        self.percentile(fraction, RATE_BASELINE_S, |a, b| angle_between_rad(a.ned_from_body, b.ned_from_body))
    }

    /// Percentile of the change per second. Each row is weighted by the time to the next one, so that bursts
    /// of rows have no more weight.
    fn percentile(&self, fraction: f64, baseline_s: f64, change: impl Fn(&LogRow, &LogRow) -> f64) -> f64 {
        let rows = &self.rows;
        let mut rates: Vec<(f64, f64)> = Vec::with_capacity(rows.len());
        let mut end = 0;
        for i in 0..rows.len().saturating_sub(1) {
            end = end.max(i + 1);
            while end + 1 < rows.len() && rows[end].t_s - rows[i].t_s < baseline_s {
                end += 1;
            }
            let span_s = rows[end].t_s - rows[i].t_s;
            // The end of the log has no full baseline left; its motion is part of earlier spans.
            if span_s >= baseline_s || rates.is_empty() {
                rates.push((change(&rows[i], &rows[end]) / span_s, rows[i + 1].t_s - rows[i].t_s));
            }
        }
        rates.sort_by(|a, b| a.0.total_cmp(&b.0));
        let total_s: f64 = rates.iter().map(|rate| rate.1).sum();
        let mut passed_s = 0.0;
        for &(rate, weight_s) in &rates {
            passed_s += weight_s;
            if passed_s >= fraction * total_s {
                return rate;
            }
        }
        rates.last().map_or(0.0, |rate| rate.0)
    }
}

fn between(a: &LogRow, b: &LogRow, fraction: f64) -> (DVec3, DQuat) {
    (a.position_ned_m.lerp(b.position_ned_m, fraction), slerp(a.ned_from_body, b.ned_from_body, fraction))
}

/// Slerp along the shorter arc at any fraction, also outside of 0..1.
fn slerp(a: DQuat, b: DQuat, fraction: f64) -> DQuat {
    let relative = a.inverse() * b;
    let relative = if relative.w < 0.0 { -relative } else { relative };
    (a * DQuat::from_scaled_axis(relative.to_scaled_axis() * fraction)).normalize()
}

/// Extrapolation from row `end` away from the log, at the velocity between it and inner rows.
fn beyond(end: &LogRow, inner_position: &LogRow, inner_attitude: &LogRow, t_s: f64) -> (DVec3, DQuat) {
    let fraction = |inner: &LogRow| {
        let span_s = inner.t_s - end.t_s;
        if span_s.abs() > 0.0 { (t_s - end.t_s) / span_s } else { 0.0 }
    };
    let (position, _) = between(end, inner_position, fraction(inner_position));
    let (_, attitude) = between(end, inner_attitude, fraction(inner_attitude));
    (position, attitude)
}
