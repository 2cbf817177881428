//! The sensors beside the camera.

use std::sync::Arc;

use camsim_core::{
    flight_log::FlightLog,
    scenario::{Scenario, TrackerKind},
    sensors::{STANDARD_GRAVITY_M_S2, SensorInput, Sensors},
    trajectory::Trajectory,
};

use super::LoadError;
use crate::median::median;

/// The sensors of a scenario on the tracked log.
///
/// # Errors
/// A sensor that needs the position of a log in local coordinates; too many samples; a day without magnetic field.
pub fn load_sensors(
    scenario: &Scenario,
    log: &FlightLog,
    trajectory: Arc<Trajectory>,
) -> Result<Sensors, LoadError> {
    let start_s = scenario.flight.window_s.map_or(0.0, |[start_s, _]| start_s / scenario.flight.speed);
    let epoch_ns = scenario.output.stamp_epoch_ns(log.epoch_ns, start_s);
    let last_row_s = log.rows.last().map_or(0.0, |row| row.t_s);
    let input = SensorInput::new(scenario, trajectory, log.frame, epoch_ns, last_row_s);
    Ok(Sensors::new(scenario, &input)?)
}

/// Acceleration that no usual platform has half of the time, m/s^2: 1 g.
const IMPLAUSIBLE_M_S2: f64 = STANDARD_GRAVITY_M_S2;
/// Instants at which the acceleration is looked at.
const INSTANTS: u32 = 2000;

/// What a user of the sensors' tables should know.
#[must_use]
pub fn sensor_warnings(scenario: &Scenario, log: &FlightLog, trajectory: &Trajectory) -> Vec<String> {
    if scenario.imu.is_empty() {
        return Vec::new();
    }
    let jump = match scenario.tracker.kind {
        TrackerKind::Hold => Some(("hold", "positions")),
        TrackerKind::Linear => Some(("linear", "velocities")),
        TrackerKind::Sqrt | TrackerKind::Spline => None,
    };
    let jumps = jump.map(|(kind, what)| {
        format!(
            "tracker.kind = \"{kind}\": {what} jump at the rows of the log, which no sample of an imu shows, so \
             that integrated samples lead elsewhere: use \"sqrt\" or \"spline\""
        )
    });
    let nowhere = log.frame.is_none().then(|| {
        format!(
            "the position of the flight is not known, so that imus feel {STANDARD_GRAVITY_M_S2} m/s^2 straight \
             down: set flight.origin for the gravity of the position"
        )
    });
    let force = implausible_force(scenario, log, trajectory);
    jumps.into_iter().chain(nowhere).chain(force).collect()
}

/// A warning if half of the time the platform accelerates by more than [`IMPLAUSIBLE_M_S2`]: then it follows steps
/// or noise of the log, or is played too fast.
fn implausible_force(scenario: &Scenario, log: &FlightLog, trajectory: &Trajectory) -> Option<String> {
    let median_m_s2 = median_acceleration_m_s2(scenario, log, trajectory)?;
    if median_m_s2 <= IMPLAUSIBLE_M_S2 {
        return None;
    }
    let speed = scenario.flight.speed;
    let rows_s = log.rows.last()?.t_s - log.rows.first()?.t_s;
    let (cause, remedy) = if speed > 1.0 && median_m_s2 / (speed * speed) <= IMPLAUSIBLE_M_S2 {
        let times = speed * speed;
        (
            format!("flight.speed = {speed} multiplies accelerations by {times:.3}"),
            "set flight.speed = 1".to_owned(),
        )
    } else {
        let rate_hz = (log.rows.len() - 1) as f64 / (rows_s * speed).max(1e-9);
        let smoother = match scenario.tracker.kind {
            TrackerKind::Spline => "lower",
            _ => "set tracker.kind = \"spline\", or lower",
        };
        (
            format!("the tracker follows steps or noise of the log, which has {rate_hz:.1} rows a second"),
            format!("{smoother} tracker.max_acceleration_m_s2"),
        )
    };
    Some(format!(
        "imus feel an implausible force: half of the time the platform accelerates by more than {median_m_s2:.1} m/s^2 \
         ({:.1} g, beside gravity), since {cause}: {remedy}",
        median_m_s2 / STANDARD_GRAVITY_M_S2
    ))
}

/// Over the flown window, as far as the log reaches.
fn median_acceleration_m_s2(scenario: &Scenario, log: &FlightLog, trajectory: &Trajectory) -> Option<f64> {
    let (first_s, last_s) = (log.rows.first()?.t_s, log.rows.last()?.t_s);
    let window = scenario.flight.window_s.map(|window| window.map(|t_s| t_s / scenario.flight.speed));
    let [from_s, to_s] = window.unwrap_or([first_s, last_s]);
    let (from_s, to_s) = (from_s.max(first_s), to_s.min(last_s));
    if from_s >= to_s {
        return None;
    }
    let at = |k: u32| from_s + (to_s - from_s) * (f64::from(k) + 0.5) / f64::from(INSTANTS);
    let mut all: Vec<f64> =
        (0..INSTANTS).map(|k| trajectory.state(at(k)).acceleration_ned_m_s2.length()).collect();
    median(&mut all, f64::total_cmp)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use camsim_core::{
        flight_log::{CleaningReport, LogRow},
        tracker::track,
    };
    use glam::{DQuat, DVec3};

    use super::*;
    use crate::scenario_file::parse_scenario;

    /// Warnings of the force on a flight in a circle of 40 m, 10 rows a second, each `turn_rad` after the last and off
    /// by `wave_m` to and fro once a second.
    fn warned(keys: &str, turn_rad: f64, wave_m: f64) -> Vec<String> {
        let text = format!(
            "[flight]\nlog = \"a.csv\"\n{keys}\n[scene.pattern]\nimage = \"g.png\"\nwidth_m = 10\n[[imu]]\nname = \"imu0\""
        );
        let scenario = parse_scenario(&text, Path::new("s.toml"), &[]).expect("legal");
        let speed = scenario.flight.speed;
        let rows: Vec<LogRow> = (0..200)
            .map(|i| {
                let angle = turn_rad * f64::from(i);
                let off_m = wave_m * (std::f64::consts::TAU * 0.1 * f64::from(i)).sin();
                LogRow {
                    t_s: 0.1 * f64::from(i) / speed,
                    position_ned_m: DVec3::new(40.0 * angle.sin() + off_m, 40.0 * angle.cos(), -50.0),
                    ned_from_body: DQuat::IDENTITY,
                }
            })
            .collect();
        let tracked = track(&rows, &scenario.effective_tracker()).expect("tracked");
        let log = FlightLog {
            rows,
            epoch_ns: 0,
            frame: None,
            report: CleaningReport::default(),
            notes: Vec::new(),
        };
        let all = sensor_warnings(&scenario, &log, &tracked.trajectory);
        all.into_iter().filter(|warning| warning.contains("implausible")).collect()
    }

    #[test]
    fn an_implausible_force_is_told_with_cause_and_remedy() {
        // 10 m/s^2 towards the centre is 1.02 g.
        let circle = warned("", 0.05, 0.0);
        assert!(circle.len() == 1 && circle[0].contains("more than 10.0 m/s^2 (1.0 g"), "{circle:?}");
        assert_eq!(warned("", 0.045, 0.0), [""; 0], "8.1 m/s^2");
        let fast = warned("speed = 3.0", 0.045, 0.0);
        assert!(fast.len() == 1 && fast[0].contains("multiplies accelerations by 9"), "{fast:?}");
        let noisy = warned("", 0.045, 1.0);
        assert!(
            noisy.len() == 1
                && noisy[0].contains("10.0 rows a second")
                && noisy[0].contains("tracker.kind = \"spline\", or lower tracker.max_acceleration_m_s2"),
            "{noisy:?}"
        );
    }
}
