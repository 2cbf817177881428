//! Time series of the flight for plots: the whole flight in few points, and a visible part of it refined.

mod sample_times;
mod tracking_error;
mod worker;

use std::sync::{Arc, Weak};

use camsim_core::{
    flight_log::{FlightLog, LogRow},
    trajectory::so3,
};
use camsim_io::load::Loaded;
use glam::{DQuat, DVec3, EulerRot};
pub use worker::SeriesWorker;

use self::{
    sample_times::{SampleTimes, decimate_min_max},
    tracking_error::{TrackingError, format_error, wrapped_deg},
};

/// Steps of a line: more than a plot is pixels wide.
const POINTS: u64 = 800;
/// Rows of the log in a refined span that become points of their own, at most.
const MAX_ROWS: usize = 1600;
/// Plots that compare log and tracker.
const AXES: [&str; 6] = ["north, m", "east, m", "down, m", "roll, deg", "pitch, deg", "yaw, deg"];

/// All plots, over path time.
#[derive(Clone, Debug)]
pub struct Series {
    loaded: Weak<Loaded>,
    log: Weak<FlightLog>,
    /// Begin and end of the scenario's window, path time.
    pub span_s: [f64; 2],
    /// Begin and end of the refined part, path time; `None` for a series of the whole flight.
    pub refined_s: Option<[f64; 2]>,
    /// Path times of the log's rows in the refined part; empty if there are more than [`MAX_ROWS`].
    pub rows_s: Vec<f64>,
    /// One for each plot.
    pub channels: Vec<Channel>,
}

/// One plot.
#[derive(Clone, Debug)]
pub struct Channel {
    /// Title, with its unit.
    pub name: &'static str,
    /// Summary over the whole flight, shown beside the title.
    pub note: String,
    /// Lines with their names; points are `[t_s, value]`.
    pub lines: Vec<(&'static str, Vec<[f64; 2]>)>,
    /// Limit of the tracker for this quantity.
    pub limit: Option<f64>,
    /// Tracker less log, `[t_s, error]`: the largest of each step; `None` for quantities that the log lacks.
    pub error: Option<Vec<[f64; 2]>>,
}

impl Channel {
    /// Keeps the least and the largest value of each step.
    fn decimate(&mut self, times: &SampleTimes) {
        let needs_rays = self.lines.first().is_some_and(|(_, points)| points.len() == times.ground_s.len());
        let per_step = if needs_rays { times.ground_per_step } else { times.per_step };
        self.lines
            .iter_mut()
            .for_each(|(_, points)| *points = decimate_min_max(std::mem::take(points), per_step));
    }
}

impl Series {
    /// Over the whole window of a scenario.
    pub fn new(loaded: &Arc<Loaded>) -> Self {
        let sequence = &loaded.sequence;
        let start_s = sequence.start_s;
        let span_s = [start_s, start_s + sequence.frames.max(2) as f64 / sequence.scenario.camera.fps];
        let times = SampleTimes::new(span_s, rows_within(&loaded.log, span_s).len(), &[]);
        let mut channels = channels(loaded, &times);
        for (axis, channel) in channels.iter_mut().take(AXES.len()).enumerate() {
            let unit = if is_angle(axis) { "deg" } else { "m" };
            let error = TrackingError::new(&tracking_differences(channel), times.per_step);
            channel.note = format!(
                "error {} {unit} RMS, {} at most",
                format_error(error.rms),
                format_error(error.max_abs)
            );
            channel.error = Some(error.points);
        }
        let attitude = &mut channels[AXES.len()];
        let error = TrackingError::new(&attitude.lines[0].1, times.per_step);
        attitude.note = format!("{} RMS, {} at most", format_error(error.rms), format_error(error.max_abs));
        let max_motion = max_motion(loaded, span_s);
        for (channel, exact_max) in
            channels[AXES.len() + 1..].iter_mut().zip(max_motion.into_iter().map(Some).chain([None, None]))
        {
            let sampled_max =
                channel.lines.iter().flat_map(|(_, points)| points).map(|point| point[1]).fold(0.0, f64::max);
            channel.note = match exact_max {
                Some(exact_max) => format!("up to {:.3}", exact_max.max(sampled_max)),
                None => format!("up to about {sampled_max:.3}"),
            };
        }
        channels.iter_mut().for_each(|channel| channel.decimate(&times));
        Self {
            loaded: Arc::downgrade(loaded),
            log: Arc::downgrade(&loaded.log),
            span_s,
            refined_s: None,
            rows_s: Vec::new(),
            channels,
        }
    }

    /// This series with a part of the window resampled in [`POINTS`] steps, and at each row of the log unless
    /// there are more than [`MAX_ROWS`]. Summaries stay those of the whole flight.
    pub fn refined(&self, loaded: &Arc<Loaded>, detail_s: [f64; 2]) -> Self {
        let detail_s = detail_s.map(|t_s| t_s.clamp(self.span_s[0], self.span_s[1]));
        let rows = rows_within(&loaded.log, detail_s);
        let rows_s: Vec<f64> =
            if rows.len() > MAX_ROWS { Vec::new() } else { rows.iter().map(|row| row.t_s).collect() };
        let times = SampleTimes::new(detail_s, rows.len(), &rows_s);
        let mut channels = channels(loaded, &times);
        for (axis, (channel, whole)) in channels.iter_mut().zip(&self.channels).enumerate() {
            channel.note.clone_from(&whole.note);
            if let Some(error) = &whole.error {
                channel.error = Some(splice(
                    error,
                    detail_s,
                    TrackingError::new(&tracking_differences(channel), times.per_step).points,
                ));
            }
            channel.decimate(&times);
            let mut lines: Vec<_> = whole.lines.clone();
            if is_angle(axis) && axis < AXES.len() {
                [&mut lines, &mut channel.lines]
                    .into_iter()
                    .for_each(|lines| remove_turns(lines, 0.5 * (detail_s[0] + detail_s[1])));
            }
            for ((_, points), (_, whole)) in channel.lines.iter_mut().zip(lines) {
                *points = splice(&whole, detail_s, std::mem::take(points));
            }
        }
        Self { refined_s: Some(detail_s), rows_s, channels, ..self.clone() }
    }

    /// Whether the series was computed from `loaded`.
    pub fn belongs_to(&self, loaded: &Arc<Loaded>) -> bool {
        std::ptr::eq(self.loaded.as_ptr(), Arc::as_ptr(loaded))
    }

    /// Whether the series was computed from the log of `loaded`, perhaps for another camera.
    pub fn belongs_to_log(&self, loaded: &Loaded) -> bool {
        std::ptr::eq(self.log.as_ptr(), Arc::as_ptr(&loaded.log))
    }
}

fn is_angle(axis: usize) -> bool {
    axis >= 3
}

fn is_within(t_s: f64, [from_s, to_s]: [f64; 2]) -> bool {
    t_s >= from_s && t_s <= to_s
}

fn rows_within(log: &FlightLog, [from_s, to_s]: [f64; 2]) -> &[LogRow] {
    let [first, end] =
        [log.rows.partition_point(|row| row.t_s < from_s), log.rows.partition_point(|row| row.t_s <= to_s)];
    &log.rows[first..end]
}

/// `points` with those between `from_s` and `to_s` replaced by `part`.
fn splice(points: &[[f64; 2]], [from_s, to_s]: [f64; 2], part: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    let [first, end] =
        [points.partition_point(|point| point[0] < from_s), points.partition_point(|point| point[0] <= to_s)];
    [&points[..first], &part, &points[end..]].concat()
}

/// Tracker less log, `[t_s, difference]`; empty for a channel without these two lines.
fn tracking_differences(channel: &Channel) -> Vec<[f64; 2]> {
    let [(_, log), (_, tracked)] = channel.lines.as_slice() else { return Vec::new() };
    log.iter().zip(tracked).map(|(log, tracked)| [log[0], tracked[1] - log[1]]).collect()
}

/// All plots sampled at `sample_times`, without summaries.
fn channels(loaded: &Loaded, sample_times: &SampleTimes) -> Vec<Channel> {
    let sequence = &loaded.sequence;
    let over = |times: &[f64], value: &dyn Fn(f64) -> f64| {
        times.iter().map(|&t_s| [t_s, value(t_s)]).collect::<Vec<_>>()
    };
    let (limits, camera, times_s) = (&loaded.tracked.limits, &sequence.scenario.camera, &sample_times.all_s);
    let state = |t_s: f64| sequence.path.trajectory.state(t_s);
    let mut channels = axis_channels(loaded, times_s);
    // Roll and yaw are singular near pitch +-90 deg; the angle of the error rotation is not.
    let attitude_error_deg = |t_s: f64| {
        so3::log(loaded.log.interpolate(t_s).1.inverse() * state(t_s).ned_from_body).length().to_degrees()
    };
    let attitude = vec![("tracker less log", over(times_s, &attitude_error_deg))];
    channels.push(Channel {
        name: "attitude error, deg",
        note: String::new(),
        lines: attitude,
        limit: None,
        error: None,
    });
    let mut plain = |name: &'static str, points: Vec<[f64; 2]>, limit: Option<f64>| {
        channels.push(Channel { name, note: String::new(), lines: vec![(name, points)], limit, error: None });
    };
    plain(
        "speed, m/s",
        over(times_s, &|t_s| state(t_s).velocity_ned_m_s.length()),
        Some(limits.max_speed_m_s),
    );
    plain(
        "acceleration, m/s2",
        over(times_s, &|t_s| state(t_s).acceleration_ned_m_s2.length()),
        Some(limits.max_acceleration_m_s2),
    );
    let rate_limit = limits.max_angular_rate_rad_s.to_degrees();
    plain(
        "body rate, deg/s",
        over(times_s, &|t_s| state(t_s).rate_body_rad_s.length().to_degrees()),
        Some(rate_limit),
    );
    let focal_px = 0.5 * (camera.focal_px[0] + camera.focal_px[1]);
    let (exposure_s, readout_s) = (1e-3 * camera.shutter.exposure_ms, 1e-3 * camera.readout_ms());
    let image_speed = over(&sample_times.ground_s, &|t_s| image_speed_px_s(loaded, focal_px, t_s));
    for (name, fraction_s) in
        [("blur in the middle, px", exposure_s), ("row skew in the middle, px", readout_s)]
    {
        plain(name, image_speed.iter().map(|[t_s, speed]| [*t_s, speed * fraction_s]).collect(), None);
    }
    channels
}

/// Log and tracker along each of [`AXES`], without summaries.
fn axis_channels(loaded: &Loaded, times_s: &[f64]) -> Vec<Channel> {
    let both: Vec<[[f64; 6]; 2]> =
        times_s.iter().map(|&t_s| [log_values(loaded, t_s), tracker_values(loaded, t_s)]).collect();
    let axis_channel = |(axis, name): (usize, &'static str)| {
        let line = |index: usize| {
            times_s.iter().zip(&both).map(move |(&t_s, both)| [t_s, both[index][axis]]).collect::<Vec<_>>()
        };
        let [mut log, mut tracked] = [line(0), line(1)];
        if is_angle(axis) {
            log = unwrapped(log);
            // The turn nearest to the log.
            for (tracked, log) in tracked.iter_mut().zip(&log) {
                tracked[1] = log[1] + wrapped_deg(tracked[1] - log[1]);
            }
        }
        Channel {
            name,
            note: String::new(),
            lines: vec![("log", log), ("tracker", tracked)],
            limit: None,
            error: None,
        }
    };
    AXES.into_iter().enumerate().map(axis_channel).collect()
}

/// Largest speed, acceleration and body rate (deg/s) in a span, from the tracker's ticks in it and its ends.
/// Velocities are linear between ticks, so the maxima are there.
fn max_motion(loaded: &Loaded, [from_s, to_s]: [f64; 2]) -> [f64; 3] {
    let trajectory = &loaded.sequence.path.trajectory;
    let squares = |state: &camsim_core::pose::BodyState| {
        [state.velocity_ned_m_s, state.acceleration_ned_m_s2, state.rate_body_rad_s]
            .map(|value| value.length_squared())
    };
    let larger = |a: [f64; 3], b: [f64; 3]| std::array::from_fn(|k| f64::max(a[k], b[k]));
    let ends = [from_s, to_s].map(|t_s| squares(&trajectory.state(t_s)));
    let inner = trajectory
        .knots()
        .iter()
        .enumerate()
        .filter(|(k, _)| is_within(trajectory.knot_s(*k), [from_s, to_s]))
        .map(|(_, state)| squares(state));
    let [speed, acceleration, rate] = inner.chain(ends).fold([0.0; 3], larger).map(f64::sqrt);
    [speed, acceleration, rate.to_degrees()]
}

fn log_values(loaded: &Loaded, t_s: f64) -> [f64; 6] {
    let (position_ned_m, ned_from_body) = loaded.log.interpolate(t_s);
    axis_values(position_ned_m, ned_from_body)
}

fn tracker_values(loaded: &Loaded, t_s: f64) -> [f64; 6] {
    let state = loaded.sequence.path.trajectory.state(t_s);
    axis_values(state.position_ned_m, state.ned_from_body)
}

/// In the order of [`AXES`].
fn axis_values(position_ned_m: DVec3, ned_from_body: DQuat) -> [f64; 6] {
    let [roll, pitch, yaw] = euler_deg(ned_from_body);
    [position_ned_m.x, position_ned_m.y, position_ned_m.z, roll, pitch, yaw]
}

/// Roll, pitch, yaw.
fn euler_deg(ned_from_body: DQuat) -> [f64; 3] {
    let (yaw, pitch, roll) = ned_from_body.to_euler(EulerRot::ZYX);
    [roll, pitch, yaw].map(f64::to_degrees)
}

/// Unwraps angles in degrees: no step is larger than half a turn.
fn unwrapped(mut points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    let mut turns = 0.0;
    for index in 1..points.len() {
        let step = points[index][1] + 360.0 * turns - points[index - 1][1];
        turns -= (step / 360.0).round();
        points[index][1] += 360.0 * turns;
    }
    points
}

/// Subtracts the whole turns that the first line has made by `t_s` from all lines. Coarse points over hours
/// cannot resolve the number of turns.
fn remove_turns(lines: &mut [(&'static str, Vec<[f64; 2]>)], t_s: f64) {
    let Some((_, first)) = lines.first() else { return };
    let index = first.partition_point(|point| point[0] < t_s).min(first.len().saturating_sub(1));
    let turns = first.get(index).map_or(0.0, |point| (point[1] / 360.0).round());
    lines.iter_mut().flat_map(|(_, points)| points).for_each(|point| point[1] -= 360.0 * turns);
}

/// Image speed, px/s, of the ground point on the optical axis: by rotation, and by translation at its depth.
fn image_speed_px_s(loaded: &Loaded, focal_px: f64, t_s: f64) -> f64 {
    let path = &loaded.sequence.path;
    let (pose, rate) = (path.pose(t_s), path.rate_camera(t_s));
    let axis_ned = pose.ned_from_camera * DVec3::Z;
    let velocity = pose.ned_from_camera.conjugate() * path.velocity_ned(t_s);
    let terrain = loaded.sequence.scene.terrain.as_ref();
    let depth_m = match terrain {
        Some(terrain) => terrain.intersect(pose.position_ned_m, axis_ned, f64::INFINITY).map(|hit| hit.t),
        None => Some(-pose.position_ned_m.z / axis_ned.z).filter(|t| *t > 0.0),
    };
    let inverse_m = depth_m.map_or(0.0, |depth_m| 1.0 / depth_m);
    // For the point (0, 0, z): d(x/z)/dt = -v_x / z - w_y, d(y/z)/dt = -v_y / z + w_x.
    focal_px * (-velocity.x * inverse_m - rate.y).hypot(-velocity.y * inverse_m + rate.x)
}

#[cfg(test)]
mod tests;
