//! The sensors beside the camera.

use std::sync::Arc;

use camsim_core::{
    flight_log::FlightLog,
    scenario::{Scenario, TrackerKind},
    sensors::{STANDARD_GRAVITY_M_S2, SensorInput, Sensors},
    trajectory::Trajectory,
};

use super::LoadError;

/// The sensors of a scenario on the tracked log.
///
/// # Errors
/// A sensor that needs the place of a log in local coordinates; too many samples; a day without magnetic field.
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

/// What a user of the sensors' tables should know.
#[must_use]
pub fn sensor_warnings(scenario: &Scenario, log: &FlightLog) -> Vec<String> {
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
            "the place of the flight is not known, so that imus feel {STANDARD_GRAVITY_M_S2} m/s^2 straight \
             down: set flight.origin for the gravity of the place"
        )
    });
    jumps.into_iter().chain(nowhere).collect()
}
