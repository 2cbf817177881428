//! Numbers over the flight, for plots: all of it in few points, and a part of it closer for whoever looks
//! there.

mod desk;
mod errors;
mod instants;

use std::sync::{Arc, Weak};

use camsim_core::{
    flight_log::{FlightLog, LogRow},
    trajectory::so3,
};
use camsim_io::load::Loaded;
pub use desk::Desk;
use glam::{DQuat, DVec3, EulerRot};

use self::{
    errors::{Errors, digits, shorter_deg},
    instants::{Instants, thinned},
};

/// Steps of a line: more than a plot has points across.
const POINTS: u64 = 800;
/// Rows of the log within a closer look that have a point of their own, at most.
const MOST_ROWS: usize = 1600;
/// Plots that compare log and tracker.
const AXES: [&str; 6] = ["north, m", "east, m", "down, m", "roll, deg", "pitch, deg", "yaw, deg"];

/// What is plotted, over path time.
#[derive(Clone, Debug)]
pub struct Series {
    of: Weak<Loaded>,
    log: Weak<FlightLog>,
    /// Path time of the window's beginning, and of its end.
    pub span_s: [f64; 2],
    /// Where it is worked out closer, if it is anywhere.
    pub closer_s: Option<[f64; 2]>,
    /// Instants of the log's rows there; empty if there are too many.
    pub rows_s: Vec<f64>,
    /// One plot each.
    pub channels: Vec<Channel>,
}

/// A plot.
#[derive(Clone, Debug)]
pub struct Channel {
    /// What, with its unit.
    pub name: &'static str,
    /// What there is to say beside it, of the whole flight.
    pub note: String,
    /// Lines with their names, `[t_s, value]`.
    pub lines: Vec<(&'static str, Vec<[f64; 2]>)>,
    /// What may not be exceeded.
    pub limit: Option<f64>,
    /// The tracker less the log, where there is a log: of the instants between two points the largest.
    pub error: Option<Vec<[f64; 2]>>,
}

impl Channel {
    /// Leaves of each step the least and the largest value.
    fn thin(&mut self, instants: &Instants) {
        let of_ground =
            self.lines.first().is_some_and(|(_, points)| points.len() == instants.of_ground.len());
        let for_each = if of_ground { instants.for_each_of_ground } else { instants.for_each };
        self.lines.iter_mut().for_each(|(_, points)| *points = thinned(std::mem::take(points), for_each));
    }
}

impl Series {
    /// Over the window of a scenario.
    pub fn new(loaded: &Arc<Loaded>) -> Self {
        let sequence = &loaded.sequence;
        let start_s = sequence.start_s;
        let span_s = [start_s, start_s + sequence.frames.max(2) as f64 / sequence.scenario.camera.fps];
        let instants = Instants::of(span_s, rows_within(&loaded.log, span_s).len(), &[]);
        let mut channels = channels(loaded, &instants);
        for (axis, channel) in channels.iter_mut().take(AXES.len()).enumerate() {
            let unit = if is_angle(axis) { "deg" } else { "m" };
            let error = Errors::of(&differences(channel), instants.for_each);
            channel.note =
                format!("error {} {unit} RMS, {} at most", digits(error.rms), digits(error.largest));
            channel.error = Some(error.points);
        }
        let attitude = &mut channels[AXES.len()];
        let error = Errors::of(&attitude.lines[0].1, instants.for_each);
        attitude.note = format!("{} RMS, {} at most", digits(error.rms), digits(error.largest));
        let largest = largest_motion(loaded, span_s);
        for (channel, of_knots) in
            channels[AXES.len() + 1..].iter_mut().zip(largest.into_iter().map(Some).chain([None, None]))
        {
            let of_points =
                channel.lines.iter().flat_map(|(_, points)| points).map(|point| point[1]).fold(0.0, f64::max);
            channel.note = match of_knots {
                Some(largest) => format!("up to {:.3}", largest.max(of_points)),
                None => format!("up to about {of_points:.3}"),
            };
        }
        channels.iter_mut().for_each(|channel| channel.thin(&instants));
        Self {
            of: Arc::downgrade(loaded),
            log: Arc::downgrade(&loaded.log),
            span_s,
            closer_s: None,
            rows_s: Vec::new(),
            channels,
        }
    }

    /// The same with a part of the window worked out in [`POINTS`] steps, and at each row of the log unless
    /// there are many. What is said of the whole flight stays.
    pub fn closer(&self, loaded: &Arc<Loaded>, part_s: [f64; 2]) -> Self {
        let part_s = part_s.map(|t_s| t_s.clamp(self.span_s[0], self.span_s[1]));
        let rows = rows_within(&loaded.log, part_s);
        let rows_s: Vec<f64> =
            if rows.len() > MOST_ROWS { Vec::new() } else { rows.iter().map(|row| row.t_s).collect() };
        let instants = Instants::of(part_s, rows.len(), &rows_s);
        let mut channels = channels(loaded, &instants);
        for (axis, (channel, whole)) in channels.iter_mut().zip(&self.channels).enumerate() {
            channel.note.clone_from(&whole.note);
            if let Some(error) = &whole.error {
                channel.error =
                    Some(around(error, part_s, Errors::of(&differences(channel), instants.for_each).points));
            }
            channel.thin(&instants);
            let mut lines: Vec<_> = whole.lines.clone();
            if is_angle(axis) && axis < AXES.len() {
                [&mut lines, &mut channel.lines]
                    .into_iter()
                    .for_each(|lines| less_turns(lines, 0.5 * (part_s[0] + part_s[1])));
            }
            for ((_, points), (_, whole)) in channel.lines.iter_mut().zip(lines) {
                *points = around(&whole, part_s, std::mem::take(points));
            }
        }
        Self { closer_s: Some(part_s), rows_s, channels, ..self.clone() }
    }

    /// Whether it is of this.
    pub fn is_of(&self, loaded: &Arc<Loaded>) -> bool {
        std::ptr::eq(self.of.as_ptr(), Arc::as_ptr(loaded))
    }

    /// Whether it is of the same log, if perhaps by another camera.
    pub fn is_of_log(&self, loaded: &Loaded) -> bool {
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

/// `points` with those of a part in place of their own there.
fn around(points: &[[f64; 2]], [from_s, to_s]: [f64; 2], part: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    let [first, end] =
        [points.partition_point(|point| point[0] < from_s), points.partition_point(|point| point[0] <= to_s)];
    [&points[..first], &part, &points[end..]].concat()
}

/// Tracker less log, of lines that belong together.
fn differences(channel: &Channel) -> Vec<[f64; 2]> {
    let [(_, log), (_, tracked)] = channel.lines.as_slice() else { return Vec::new() };
    log.iter().zip(tracked).map(|(log, tracked)| [log[0], tracked[1] - log[1]]).collect()
}

/// All plots at these instants, without what there is to say beside them.
fn channels(loaded: &Loaded, instants: &Instants) -> Vec<Channel> {
    let sequence = &loaded.sequence;
    let over = |times: &[f64], value: &dyn Fn(f64) -> f64| {
        times.iter().map(|&t_s| [t_s, value(t_s)]).collect::<Vec<_>>()
    };
    let (limits, camera, times) = (&loaded.tracked.limits, &sequence.scenario.camera, &instants.all);
    let state = |t_s: f64| sequence.path.trajectory.state(t_s);
    let both: Vec<[[f64; 6]; 2]> =
        times.iter().map(|&t_s| [of_log(loaded, t_s), of_tracker(loaded, t_s)]).collect();
    let of_axis = |(axis, name): (usize, &'static str)| {
        let of = |which: usize| {
            times.iter().zip(&both).map(move |(&t_s, both)| [t_s, both[which][axis]]).collect::<Vec<_>>()
        };
        let [mut log, mut tracked] = [of(0), of(1)];
        if is_angle(axis) {
            log = continuous(log);
            // Beside the log, not a turn away from it.
            for (tracked, log) in tracked.iter_mut().zip(&log) {
                tracked[1] = log[1] + shorter_deg(tracked[1] - log[1]);
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
    let mut channels: Vec<Channel> = AXES.into_iter().enumerate().map(of_axis).collect();
    // Roll and yaw mean nothing near pitch +-90; the angle of the whole error always does.
    let off = |t_s: f64| {
        so3::log(loaded.log.interpolate(t_s).1.inverse() * state(t_s).ned_from_body).length().to_degrees()
    };
    let attitude = vec![("tracker less log", over(times, &off))];
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
    plain("speed, m/s", over(times, &|t_s| state(t_s).velocity_ned_m_s.length()), Some(limits.max_speed_m_s));
    plain(
        "acceleration, m/s2",
        over(times, &|t_s| state(t_s).acceleration_ned_m_s2.length()),
        Some(limits.max_acceleration_m_s2),
    );
    let rate_limit = limits.max_angular_rate_rad_s.to_degrees();
    plain(
        "body rate, deg/s",
        over(times, &|t_s| state(t_s).rate_body_rad_s.length().to_degrees()),
        Some(rate_limit),
    );
    let focal_px = 0.5 * (camera.focal_px[0] + camera.focal_px[1]);
    let (exposure_s, readout_s) = (1e-3 * camera.shutter.exposure_ms, 1e-3 * camera.shutter.readout_ms);
    let image_speed = over(&instants.of_ground, &|t_s| image_speed_px_s(loaded, focal_px, t_s));
    for (name, share_s) in [("blur in the middle, px", exposure_s), ("row skew in the middle, px", readout_s)]
    {
        plain(name, image_speed.iter().map(|[t_s, speed]| [*t_s, speed * share_s]).collect(), None);
    }
    channels
}

/// Largest speed, acceleration and body rate (deg/s) at the tracker's own ticks in a span and at its ends:
/// between two ticks velocities go straight, so that none of them is larger there.
fn largest_motion(loaded: &Loaded, [from_s, to_s]: [f64; 2]) -> [f64; 3] {
    let trajectory = &loaded.sequence.path.trajectory;
    let of = |state: &camsim_core::pose::BodyState| {
        [state.velocity_ned_m_s, state.acceleration_ned_m_s2, state.rate_body_rad_s]
            .map(|value| value.length_squared())
    };
    let larger = |a: [f64; 3], b: [f64; 3]| std::array::from_fn(|k| f64::max(a[k], b[k]));
    let ends = [from_s, to_s].map(|t_s| of(&trajectory.state(t_s)));
    let inner = trajectory
        .knots()
        .iter()
        .enumerate()
        .filter(|(k, _)| is_within(trajectory.knot_s(*k), [from_s, to_s]))
        .map(|(_, state)| of(state));
    let [speed, acceleration, rate] = inner.chain(ends).fold([0.0; 3], larger).map(f64::sqrt);
    [speed, acceleration, rate.to_degrees()]
}

fn of_log(loaded: &Loaded, t_s: f64) -> [f64; 6] {
    let (place, attitude) = loaded.log.interpolate(t_s);
    channels_of(place, attitude)
}

fn of_tracker(loaded: &Loaded, t_s: f64) -> [f64; 6] {
    let state = loaded.sequence.path.trajectory.state(t_s);
    channels_of(state.position_ned_m, state.ned_from_body)
}

fn channels_of(place: DVec3, ned_from_body: DQuat) -> [f64; 6] {
    let [roll, pitch, yaw] = euler_deg(ned_from_body);
    [place.x, place.y, place.z, roll, pitch, yaw]
}

fn euler_deg(ned_from_body: DQuat) -> [f64; 3] {
    let (yaw, pitch, roll) = ned_from_body.to_euler(EulerRot::ZYX);
    [roll, pitch, yaw].map(f64::to_degrees)
}

/// Without the jumps of angles that wrap.
fn continuous(mut points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    let mut turns = 0.0;
    for at in 1..points.len() {
        let step = points[at][1] + 360.0 * turns - points[at - 1][1];
        turns -= (step / 360.0).round();
        points[at][1] += 360.0 * turns;
    }
    points
}

/// Takes the turns away that lines of angles have made by `t_s`: how many there were in hours of few points
/// is not known anyway.
fn less_turns(lines: &mut [(&'static str, Vec<[f64; 2]>)], t_s: f64) {
    let Some((_, first)) = lines.first() else { return };
    let at = first.partition_point(|point| point[0] < t_s).min(first.len().saturating_sub(1));
    let turns = first.get(at).map_or(0.0, |point| (point[1] / 360.0).round());
    lines.iter_mut().flat_map(|(_, points)| points).for_each(|point| point[1] -= 360.0 * turns);
}

/// How fast what the optical axis meets moves over the picture: by turning, and by moving past it at its
/// distance.
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
    // Of the point (0, 0, z): d(x/z)/dt = -v_x / z - w_y, d(y/z)/dt = -v_y / z + w_x.
    focal_px * (-velocity.x * inverse_m - rate.y).hypot(-velocity.y * inverse_m + rate.x)
}

#[cfg(test)]
mod tests;
