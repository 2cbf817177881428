//! Numbers over the flight, for plots.

mod desk;

use std::sync::{Arc, Weak};

use camsim_core::flight_log::FlightLog;
use camsim_io::load::Loaded;
pub use desk::Desk;
use glam::{DQuat, DVec3, EulerRot};

/// Instants of a line: more than a plot has points across.
const POINTS: u64 = 800;
/// Instants between two of them that errors are looked for at, at most: every row of a log of 40 Hz over 1000 s.
const MOST_BETWEEN: u64 = 50;

/// What is plotted, over path time.
#[derive(Clone, Debug)]
pub struct Series {
    of: Weak<Loaded>,
    log: Weak<FlightLog>,
    /// Path time of the window's beginning.
    pub start_s: f64,
    /// One plot each.
    pub channels: Vec<Channel>,
}

/// A plot.
#[derive(Clone, Debug)]
pub struct Channel {
    /// What, with its unit.
    pub name: &'static str,
    /// What there is to say beside it.
    pub note: String,
    /// Lines with their names, `[t_s, value]`.
    pub lines: Vec<(&'static str, Vec<[f64; 2]>)>,
    /// What may not be exceeded.
    pub limit: Option<f64>,
    /// The tracker less the log, where there is a log: of the instants between two points the largest.
    pub error: Option<Vec<[f64; 2]>>,
}

impl Series {
    /// Over the window of a scenario.
    pub fn new(loaded: &Arc<Loaded>) -> Self {
        let sequence = &loaded.sequence;
        let span_s = sequence.frames.max(2) as f64 / sequence.scenario.camera.fps;
        let times: Vec<f64> = (0..=POINTS).map(|k| sequence.start_s + span_s * k as f64 / POINTS as f64).collect();
        let over = |value: &dyn Fn(f64) -> f64| times.iter().map(|&t_s| [t_s, value(t_s)]).collect::<Vec<_>>();
        let state = |t_s: f64| sequence.path.trajectory.state(t_s);
        let (limits, camera) = (&loaded.tracked.limits, &sequence.scenario.camera);
        let mut channels = Vec::new();
        let errors = errors(loaded, span_s);
        for (axis, name) in ["north, m", "east, m", "down, m", "roll, deg", "pitch, deg", "yaw, deg"].into_iter().enumerate() {
            let of_log = over(&|t_s| of_log(loaded, t_s)[axis]);
            let tracked = over(&|t_s| of_tracker(loaded, t_s)[axis]);
            let Errors { rms, largest, points } = errors[axis].clone();
            let (unit, is_angle) = if axis < 3 { ("m", false) } else { ("deg", true) };
            let note = format!("error {} {unit} RMS, {} at most", digits(rms), digits(largest));
            let lines = [("log", of_log), ("tracker", tracked)];
            let lines = lines.into_iter().map(|(name, points)| (name, if is_angle { continuous(points) } else { points })).collect();
            channels.push(Channel { name, note, lines, limit: None, error: Some(points) });
        }
        let mut plain = |name: &'static str, points: Vec<[f64; 2]>, limit: Option<f64>| {
            let largest = points.iter().map(|point| point[1]).fold(0.0, f64::max);
            channels.push(Channel { name, note: format!("up to {largest:.3}"), lines: vec![(name, points)], limit, error: None });
        };
        let spec = &sequence.scenario.tracker;
        plain("speed, m/s", over(&|t_s| state(t_s).velocity_ned_m_s.length()), Some(limits.max_speed_m_s));
        plain("acceleration, m/s2", over(&|t_s| state(t_s).acceleration_ned_m_s2.length()), Some(spec.max_acceleration_m_s2));
        let rate_limit = limits.max_angular_rate_rad_s.to_degrees();
        plain("body rate, deg/s", over(&|t_s| state(t_s).rate_body_rad_s.length().to_degrees()), Some(rate_limit));
        let focal_px = 0.5 * (camera.focal_px[0] + camera.focal_px[1]);
        let (exposure_s, readout_s) = (1e-3 * camera.shutter.exposure_ms, 1e-3 * camera.shutter.readout_ms);
        let image_speed = |t_s: f64| image_speed_px_s(loaded, focal_px, t_s);
        plain("blur in the middle, px", over(&|t_s| image_speed(t_s) * exposure_s), None);
        plain("row skew in the middle, px", over(&|t_s| image_speed(t_s) * readout_s), None);
        Self { of: Arc::downgrade(loaded), log: Arc::downgrade(&loaded.log), start_s: sequence.start_s, channels }
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

/// Three decimals, or for what is small three digits.
fn digits(value: f64) -> String {
    let zeros = if value == 0.0 { 0.0 } else { (-value.abs().log10()).floor().clamp(0.0, 5.0) };
    format!("{value:.*}", 3 + zeros as usize)
}

/// How far the tracker is from the log.
#[derive(Clone, Debug, Default)]
struct Errors {
    rms: f64,
    largest: f64,
    points: Vec<[f64; 2]>,
}

impl Errors {
    /// From errors in order of time, so many for each point.
    fn of(errors: &[[f64; 2]], for_each: usize) -> Self {
        let larger = |a: [f64; 2], b: [f64; 2]| if b[1].abs() > a[1].abs() { b } else { a };
        let points: Vec<[f64; 2]> = errors.chunks(for_each.max(1)).filter_map(|part| part.iter().copied().reduce(larger)).collect();
        let squares: f64 = errors.iter().map(|error| error[1] * error[1]).sum();
        let largest = points.iter().map(|point| point[1].abs()).fold(0.0, f64::max);
        Self { rms: (squares / errors.len().max(1) as f64).sqrt(), largest, points }
    }
}

/// North, east, down, roll, pitch, yaw.
fn errors(loaded: &Loaded, span_s: f64) -> [Errors; 6] {
    let start_s = loaded.sequence.start_s;
    let rows = loaded.log.rows.iter().filter(|row| row.t_s >= start_s && row.t_s <= start_s + span_s).count() as u64;
    let between = (rows / POINTS + 1).min(MOST_BETWEEN);
    let count = POINTS * between;
    let mut found: [Vec<[f64; 2]>; 6] = Default::default();
    for k in 0..=count {
        let t_s = start_s + span_s * k as f64 / count as f64;
        let (log, tracked) = (of_log(loaded, t_s), of_tracker(loaded, t_s));
        for (axis, errors) in found.iter_mut().enumerate() {
            let error = tracked[axis] - log[axis];
            errors.push([t_s, if axis < 3 { error } else { shorter_deg(error) }]);
        }
    }
    found.map(|errors| Errors::of(&errors, between as usize))
}

/// An angle's error does not count turns.
fn shorter_deg(error: f64) -> f64 {
    error - 360.0 * (error / 360.0).round()
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

/// How fast what the optical axis meets moves over the picture: by turning, and by moving past it at its distance.
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
mod tests {
    use super::*;
    use crate::tests::harness::demo;

    fn loaded() -> Arc<Loaded> {
        let scenario = camsim_io::scenario_file::read_scenario(&demo(), &[], None).expect("legal");
        Arc::new(camsim_io::load::load_sequence(&scenario).expect("loaded"))
    }

    #[test]
    fn image_speed_is_that_of_the_point_in_the_middle() {
        let loaded = loaded();
        let path = &loaded.sequence.path;
        let terrain = loaded.sequence.scene.terrain.as_ref().expect("a terrain");
        for t_s in [25.3, 27.0, 28.5] {
            let pose = path.pose(t_s);
            let axis = pose.ned_from_camera * DVec3::Z;
            let point = pose.position_ned_m + axis * terrain.intersect(pose.position_ned_m, axis, f64::INFINITY).expect("ground").t;
            // Central difference of the fixed point's ideal coordinates.
            let uv = |t_s: f64| {
                let pose = path.pose(t_s);
                let seen = pose.ned_from_camera.conjugate() * (point - pose.position_ned_m);
                seen.truncate() / seen.z
            };
            let h = 1e-5;
            let exact = 400.0 * (uv(t_s + h) - uv(t_s - h)).length() / (2.0 * h);
            let found = image_speed_px_s(&loaded, 400.0, t_s);
            assert!((found - exact).abs() < 1e-4 * exact, "{found} {exact} px/s at {t_s} s");
        }
    }

    #[test]
    fn errors_keep_their_peaks_however_few_points_there_are() {
        let mut errors: Vec<[f64; 2]> = (0..1000).map(|k| [f64::from(k), 0.1]).collect();
        errors[517] = [517.0, -3.0];
        let found = Errors::of(&errors, 100);
        assert_eq!((found.points.len(), found.points[5], found.largest), (10, [517.0, -3.0], 3.0));
        assert!((found.rms - ((999.0 * 0.01 + 9.0) / 1000.0_f64).sqrt()).abs() < 1e-12, "{}", found.rms);
        assert_eq!([shorter_deg(-358.0), shorter_deg(3.0), shorter_deg(190.0)], [2.0, 3.0, -170.0]);
    }

    #[test]
    fn errors_are_those_of_the_tracker_at_its_instants() {
        let loaded = loaded();
        let series = Series::new(&loaded);
        for (axis, channel) in series.channels.iter().take(6).enumerate() {
            let error = channel.error.as_ref().expect("there is a log");
            for [t_s, error] in error.iter().step_by(97) {
                let found = of_tracker(&loaded, *t_s)[axis] - of_log(&loaded, *t_s)[axis];
                assert!((shorter_deg(found - error)).abs() < 1e-9, "{} at {t_s}: {found} {error}", channel.name);
            }
        }
    }

    #[test]
    fn what_is_small_has_digits_too() {
        assert_eq!(
            [digits(0.0), digits(12.3456), digits(0.1234), digits(0.0191), digits(0.000_312)],
            ["0.000", "12.346", "0.123", "0.0191", "0.000312"]
        );
    }

    #[test]
    fn angles_have_no_jumps() {
        let wrapped = [170.0, 179.0, -172.0, -160.0, 175.0].iter().enumerate().map(|(k, v)| [k as f64, *v]).collect();
        let values: Vec<f64> = continuous(wrapped).iter().map(|point| point[1]).collect();
        assert_eq!(values, [170.0, 179.0, 188.0, 200.0, 175.0]);
    }
}
