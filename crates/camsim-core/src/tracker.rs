//! Tracker: from the rows of a flight log to a motion that a vehicle could fly (section 3 of the paper).
//!
//! | kind | motion | limits | distance to the log |
//! |---|---|---|---|
//! | `sqrt` | two nested square-root loops on a double integrator follow the log, smoothed without lag | kept at every instant | small |
//! | `spline` | a plant whose accelerations are continuous follows a cubic B-spline fitted to the whole log under the acceleration limits | kept at every instant | smallest |
//! | `linear` | straight lines and great circles between rows; velocity jumps at rows | none | zero |
//! | `hold` | the pose of the latest row, without velocity | none | one row |
//!
//! The limits apply to the lengths of the velocity, acceleration, body rate and angular acceleration vectors.

use std::sync::Arc;

use glam::DVec3;
use serde::Serialize;
use thiserror::Error;

use crate::{
    flight_log::LogRow,
    pose::BodyState,
    scenario::{PAPER_ACCELERATION_M_S2, PAPER_ANGULAR_ACCELERATION_DEG_S2, TrackerKind, TrackerSpec},
    trajectory::{Trajectory, so3},
};

mod plant;
mod reference;
mod report;
mod spline;

use reference::{Curve, LogInterpolator, Reference, Ticks};
pub use report::{Channels, MotionUse, TrackReport};

/// Limits of the platform, all positive and finite.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ResolvedLimits {
    /// Length of the velocity, m/s.
    pub max_speed_m_s: f64,
    /// Length of the acceleration, m/s^2.
    pub max_acceleration_m_s2: f64,
    /// Length of the body rate, rad/s.
    pub max_angular_rate_rad_s: f64,
    /// Length of the angular acceleration, rad/s^2.
    pub max_angular_acceleration_rad_s2: f64,
}

/// Longest uninterrupted time, in seconds, during which each limit reduced the controller's demand.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Saturation {
    /// At the speed limit, seconds.
    pub speed_s: f64,
    /// At the acceleration limit, seconds.
    pub acceleration_s: f64,
    /// At the angular rate limit, seconds.
    pub angular_rate_s: f64,
    /// At the angular acceleration limit, seconds.
    pub angular_acceleration_s: f64,
}

/// A limit of the tracker, by its key.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Limit {
    /// `tracker.max_speed_m_s`.
    MaxSpeed,
    /// `tracker.max_acceleration_m_s2`.
    MaxAcceleration,
    /// `tracker.max_angular_rate_deg_s`.
    MaxAngularRate,
    /// `tracker.max_angular_acceleration_deg_s2`.
    MaxAngularAcceleration,
}

impl Limit {
    /// All limits, in the order of [`ResolvedLimits`].
    pub const ALL: [Self; 4] =
        [Self::MaxSpeed, Self::MaxAcceleration, Self::MaxAngularRate, Self::MaxAngularAcceleration];

    /// Key below `[tracker]`.
    #[must_use]
    pub fn key(self) -> &'static str {
        match self {
            Self::MaxSpeed => "max_speed_m_s",
            Self::MaxAcceleration => "max_acceleration_m_s2",
            Self::MaxAngularRate => "max_angular_rate_deg_s",
            Self::MaxAngularAcceleration => "max_angular_acceleration_deg_s2",
        }
    }
}

/// An uninterrupted interval in which a limit reduced the controller's demand, seconds of path time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SaturationInterval {
    /// The limit.
    pub limit: Limit,
    /// Begin of the interval.
    pub from_s: f64,
    /// End of the interval.
    pub to_s: f64,
}

impl SaturationInterval {
    /// Length of the interval, seconds.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.to_s - self.from_s
    }
}

/// Result of [`track`].
#[derive(Clone, Debug)]
pub struct TrackResult {
    /// The motion. It is shared, because hours of flight take a gigabyte.
    pub trajectory: Arc<Trajectory>,
    /// The limits with `auto` resolved. `linear` and `hold` do not keep them.
    pub limits: ResolvedLimits,
    /// Longest time at each limit; zero for `linear` and `hold`.
    pub saturation: Saturation,
    /// The longest intervals at a limit, the longest first, at most `MAX_INTERVALS`.
    pub saturation_intervals: Vec<SaturationInterval>,
    /// Control rate, hertz.
    pub rate_hz: f64,
}

/// Time at a limit above which there is a warning, seconds.
const SATURATION_WORTH_A_WARNING_S: f64 = 1.0;

/// RMS distance between motion and log above which there is a warning, metres.
const FAR_M: f64 = 1.0;
/// RMS angle between motion and log above which there is a warning, degrees.
const FAR_DEG: f64 = 1.0;
/// Most instants compared for these warnings.
const MAX_COMPARED: f64 = 20_000.0;
/// Most intervals at a limit that are reported.
const MAX_INTERVALS: usize = 32;

impl TrackResult {
    /// One sentence for each limit that was reached for more than one second, naming the key to change.
    pub fn warnings(&self) -> Vec<String> {
        let limits = &self.limits;
        [
            (self.saturation.speed_s, "max_speed_m_s", limits.max_speed_m_s),
            (self.saturation.acceleration_s, "max_acceleration_m_s2", limits.max_acceleration_m_s2),
            (self.saturation.angular_rate_s, "max_angular_rate_deg_s", limits.max_angular_rate_rad_s.to_degrees()),
            (
                self.saturation.angular_acceleration_s,
                "max_angular_acceleration_deg_s2",
                limits.max_angular_acceleration_rad_s2.to_degrees(),
            ),
        ]
        .into_iter()
        .filter(|(longest_s, ..)| *longest_s > SATURATION_WORTH_A_WARNING_S)
        .map(|(longest_s, key, value)| {
            format!("tracker.{key} = {value:.4} held the platform back for {longest_s:.2} s at a stretch; the path lags the log there, raise it to follow closer")
        })
        .collect()
    }

    /// A warning if the motion differs from the interpolated log by more than `FAR_M` or `FAR_DEG` (RMS).
    /// The truth of the frames is the motion, not the log.
    #[must_use]
    pub fn distance_warning(&self, rows: &[LogRow]) -> Option<String> {
        let (start_s, end_s) = self.trajectory.span_s();
        let rate_hz = self.rate_hz.min(MAX_COMPARED / (end_s - start_s).max(1e-9));
        let TrackReport { rms, max_error, .. } = TrackReport::measure(&self.trajectory, rows, rate_hz)?;
        let [off_m, most_m] =
            [rms, max_error].map(|of| DVec3::new(of.north_m, of.east_m, of.down_m).length());
        (off_m > FAR_M || rms.attitude_deg > FAR_DEG).then(|| {
            format!(
                "the tracked motion, which frames and truth follow, is {off_m:.2} m and {:.2} deg RMS from the log (at most {most_m:.1} m, {:.1} deg): see `track --report`, or set tracker.kind = \"spline\" or raise the limits",
                rms.attitude_deg, max_error.attitude_deg
            )
        })
    }

    /// Errors against the interpolated log, and the largest velocities and accelerations, over all control
    /// ticks.
    pub fn report(&self, rows: &[LogRow]) -> Option<TrackReport> {
        TrackReport::measure(&self.trajectory, rows, self.rate_hz)
    }
}

/// Why a log cannot be tracked.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum TrackerError {
    /// The log has no row.
    #[error("the flight log has no usable row; the tracker needs at least one")]
    Empty,
    /// A row has NaN, infinity, or a quaternion that is not of unit length.
    #[error(
        "row {row} of the flight log (counted from 1, after repairs) has a number that is not finite or an attitude that is no rotation; remove the row"
    )]
    BadRow {
        /// Row number, counted from 1.
        row: usize,
    },
    /// Time does not increase.
    #[error(
        "row {row} of the flight log (counted from 1, after repairs) is not later than the row before it; sort the log and merge rows of equal time"
    )]
    TimeOrder {
        /// Row number, counted from 1.
        row: usize,
    },
    /// A key of `[tracker]` is not positive and finite.
    #[error("tracker.{key} = {value} must be a positive, finite number")]
    BadKey {
        /// The key.
        key: &'static str,
        /// Its value.
        value: f64,
    },
    /// Two rows are so close in time that the velocity between them overflows f64.
    #[error(
        "rows of the flight log are so close in time that the velocity between them is not finite; merge rows of nearly equal time"
    )]
    Overflow,
    /// The log is too long for the control rate.
    #[error(
        "{span_s:.0} s of flight log at tracker.rate_hz = {rate_hz} need {ticks:.0} control ticks, more than {MAX_TICKS}; lower the rate, raise flight.speed or leave rows out of the log"
    )]
    TooLong {
        /// Length of the log, seconds.
        span_s: f64,
        /// Control rate, hertz.
        rate_hz: f64,
        /// Number of ticks needed.
        ticks: f64,
    },
}

/// Most control ticks: 3 GiB of states, 14 hours at 400 Hz.
const MAX_TICKS: usize = 20_000_000;

/// Standard deviation of the zero-lag smoothing of the reference of `sqrt`, seconds.
const REFERENCE_SIGMA_S: f64 = 0.09;
/// Standard deviation of the smoothed base that `spline` corrects, seconds.
const SPLINE_BASE_SIGMA_S: f64 = 0.1;

/// The motion that follows `rows` (strictly increasing in time) by the method of `spec`.
pub fn track(rows: &[LogRow], spec: &TrackerSpec) -> Result<TrackResult, TrackerError> {
    check_rows(rows)?;
    check_spec(spec)?;
    let rate_hz = spec.rate_hz;
    let given = |trajectory: Option<Trajectory>, limits, saturation, saturation_intervals| {
        let trajectory = Arc::new(trajectory.ok_or(TrackerError::Overflow)?);
        Ok(TrackResult { trajectory, limits, saturation, saturation_intervals, rate_hz })
    };
    match spec.kind {
        TrackerKind::Hold | TrackerKind::Linear => {
            let limits = resolve_limits(rows, spec, [0.0; 2]);
            let still = |_: &LogRow, _: &LogRow| (DVec3::ZERO, DVec3::ZERO);
            let trajectory = if spec.kind == TrackerKind::Hold {
                piecewise(rows, still)
            } else {
                piecewise(rows, constant_velocity)
            };
            given(trajectory, limits, Saturation::default(), Vec::new())
        }
        TrackerKind::Sqrt | TrackerKind::Spline => {
            let (reference, limits) = reference(rows, spec)?;
            let plant::PlantRun { states, saturation, mut saturation_intervals } =
                plant::follow(&reference, &limits);
            let (start_s, end_s) = (rows[0].t_s, rows[rows.len() - 1].t_s);
            saturation_intervals
                .iter_mut()
                .for_each(|hold| (hold.from_s, hold.to_s) = (start_s + hold.from_s, start_s + hold.to_s));
            let trajectory = match reference.curve {
                Curve::Quadratic => Trajectory::uniform(start_s, reference.step_s, end_s, states),
                Curve::Cubic => Trajectory::uniform_smooth(start_s, reference.step_s, end_s, states),
            };
            given(trajectory, limits, saturation, saturation_intervals)
        }
    }
}

/// The reference to follow, and the limits; `auto` acceleration limits come from the smoothed log.
fn reference(rows: &[LogRow], spec: &TrackerSpec) -> Result<(Reference, ResolvedLimits), TrackerError> {
    let (start_s, span_s) = (rows[0].t_s, rows[rows.len() - 1].t_s - rows[0].t_s);
    let step_s = 1.0 / spec.rate_hz;
    let ticks = (span_s * spec.rate_hz - 1e-6).ceil().max(0.0) + 1.0;
    if ticks > MAX_TICKS as f64 {
        return Err(TrackerError::TooLong { span_s, rate_hz: spec.rate_hz, ticks });
    }
    let mut log = LogInterpolator::new(rows).ok_or(TrackerError::Empty)?;
    let is_spline = spec.kind == TrackerKind::Spline;
    let sigma_s = if is_spline { SPLINE_BASE_SIGMA_S } else { REFERENCE_SIGMA_S };
    let curve = if is_spline { Curve::Cubic } else { Curve::Quadratic };
    let ticks = Ticks { curve, start_s, step_s, count: ticks as usize };
    let smoothed = Reference::smoothed(&mut log, ticks, sigma_s);
    let limits = resolve_limits(rows, spec, smoothed.accelerations(AUTO_RANK));
    if !is_spline {
        return Ok((smoothed, limits));
    }
    let raw = Reference::sampled(&mut log, ticks);
    Ok((spline::plan_spline(&raw, smoothed, &limits), limits))
}

fn check_rows(rows: &[LogRow]) -> Result<(), TrackerError> {
    if rows.is_empty() {
        return Err(TrackerError::Empty);
    }
    for (i, row) in rows.iter().enumerate() {
        let unit = (row.ned_from_body.length_squared() - 1.0).abs() < 1e-6;
        // Beyond 1e12 m or s, f64 has too little resolution and squares approach overflow.
        let sane = row.t_s.abs() < 1e12 && row.position_ned_m.abs().max_element() < 1e12;
        if !(unit && sane && row.position_ned_m.is_finite()) {
            return Err(TrackerError::BadRow { row: i + 1 });
        }
        if i > 0 && row.t_s <= rows[i - 1].t_s {
            return Err(TrackerError::TimeOrder { row: i + 1 });
        }
    }
    Ok(())
}

fn check_spec(spec: &TrackerSpec) -> Result<(), TrackerError> {
    let keys = [
        ("rate_hz", Some(spec.rate_hz)),
        ("max_speed_m_s", spec.max_speed_m_s.value()),
        ("max_acceleration_m_s2", spec.max_acceleration_m_s2.value()),
        ("max_angular_rate_deg_s", spec.max_angular_rate_deg_s.value()),
        ("max_angular_acceleration_deg_s2", spec.max_angular_acceleration_deg_s2.value()),
    ];
    for (key, value) in keys {
        if let Some(value) = value
            && !(value > 0.0 && value < 1e12)
        {
            return Err(TrackerError::BadKey { key, value });
        }
    }
    Ok(())
}

/// Least time between the rows from which the log's own speeds are measured, so that steps of 50 us and
/// quanta of 0.1 m do not matter.
const BASELINE_S: f64 = 0.2;
/// `auto` speed limits are this factor times the log's own speed at [`AUTO_RANK`].
const AUTO_FACTOR: f64 = 1.2;
/// Rank of the log's own speed, rate or acceleration from which `auto` limits are derived.
const AUTO_RANK: f64 = 0.999;
/// Least `auto` speed limit, 1 m/s.
const MIN_SPEED_M_S: f64 = 1.0;
/// Least `auto` angular rate limit, 10 deg/s.
const MIN_RATE_RAD_S: f64 = 0.174_532_925_199_432_95;

/// `auto` acceleration limits are this factor times the smoothed log's own. The factor is larger than that
/// for speeds, because an acceleration limit that is too low causes a lasting lag.
const ACCELERATION_FACTOR: f64 = 1.5;

/// Resolves `auto` limits. `accelerations` are those of the smoothed log at [`AUTO_RANK`], m/s^2 and rad/s^2.
fn resolve_limits(rows: &[LogRow], spec: &TrackerSpec, accelerations: [f64; 2]) -> ResolvedLimits {
    let (mut speeds, mut rates) = (Vec::with_capacity(rows.len()), Vec::with_capacity(rows.len()));
    let mut later = 0;
    for row in rows {
        while later + 1 < rows.len() && rows[later].t_s - row.t_s < BASELINE_S {
            later += 1;
        }
        let (to, elapsed_s) = (&rows[later], rows[later].t_s - row.t_s);
        // The last rows have no partner that far away, unless the whole log is shorter.
        if elapsed_s >= BASELINE_S || (speeds.is_empty() && elapsed_s > 0.0) {
            speeds.push((to.position_ned_m - row.position_ned_m).length() / elapsed_s);
            rates.push(so3::log(row.ned_from_body.inverse() * to.ned_from_body).length() / elapsed_s);
        }
    }
    ResolvedLimits {
        max_speed_m_s: spec
            .max_speed_m_s
            .value()
            .unwrap_or_else(|| (AUTO_FACTOR * high_rank(speeds)).max(MIN_SPEED_M_S)),
        max_acceleration_m_s2: spec
            .max_acceleration_m_s2
            .value()
            .unwrap_or_else(|| (ACCELERATION_FACTOR * accelerations[0]).max(PAPER_ACCELERATION_M_S2)),
        max_angular_rate_rad_s: spec
            .max_angular_rate_deg_s
            .value()
            .map_or_else(|| (AUTO_FACTOR * high_rank(rates)).max(MIN_RATE_RAD_S), f64::to_radians),
        max_angular_acceleration_rad_s2: spec.max_angular_acceleration_deg_s2.value().map_or_else(
            || (ACCELERATION_FACTOR * accelerations[1]).max(PAPER_ANGULAR_ACCELERATION_DEG_S2.to_radians()),
            f64::to_radians,
        ),
    }
}

/// Value at [`AUTO_RANK`]; 0 without values.
fn high_rank(values: Vec<f64>) -> f64 {
    at_rank(values, AUTO_RANK)
}

/// Value at a rank from 0 to 1; 0 without values.
fn at_rank(mut values: Vec<f64>, rank: f64) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let rank = ((values.len() - 1) as f64 * rank).ceil() as usize;
    *values.select_nth_unstable_by(rank, f64::total_cmp).1
}

/// A trajectory with one segment per row. `velocities` returns velocity and body rate from a row and the next
/// one. The last row continues the motion of the one before.
fn piecewise(rows: &[LogRow], velocities: impl Fn(&LogRow, &LogRow) -> (DVec3, DVec3)) -> Option<Trajectory> {
    let mut motion = (DVec3::ZERO, DVec3::ZERO);
    let knots = rows.iter().enumerate().map(|(i, row)| {
        if let Some(next) = rows.get(i + 1) {
            motion = velocities(row, next);
        }
        BodyState {
            position_ned_m: row.position_ned_m,
            velocity_ned_m_s: motion.0,
            ned_from_body: row.ned_from_body,
            rate_body_rad_s: motion.1,
            ..BodyState::default()
        }
    });
    let knots = knots.collect();
    Trajectory::listed(rows.iter().map(|row| row.t_s).collect(), rows.last()?.t_s, knots)
}

fn constant_velocity(row: &LogRow, next: &LogRow) -> (DVec3, DVec3) {
    let elapsed_s = next.t_s - row.t_s;
    let turn = so3::log(row.ned_from_body.inverse() * next.ned_from_body);
    ((next.position_ned_m - row.position_ned_m) / elapsed_s, turn / elapsed_s)
}

#[cfg(test)]
mod tests;
