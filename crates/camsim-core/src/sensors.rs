//! Sensors beside the camera: inertial units, satellite receivers, barometers, magnetometers, all from the
//! closed-form trajectory (docs/guide/SENSORS.md).
//!
//! Sample k of a sensor is taken at path time `k / rate_hz`, k any whole number, so that k = 0 is at the first
//! good row of the log. Its noise is a function of (seed, name of the sensor, k). Errors with a memory
//! (random walks, Gauss-Markov processes, random dropouts) start at k = 0 and are computed from there, hence
//! they do not depend on the window either.

use std::sync::Arc;

use thiserror::Error;

use crate::{
    geodesy::LocalFrame,
    mount::MountError,
    scenario::{HeightReference, MountSpec, Scenario},
    shutter::Shutter,
    trajectory::Trajectory,
};

mod atmosphere;
mod barometer;
mod clock;
mod earth;
mod errors;
mod gnss;
mod imu;
mod magnetometer;
mod mount;

pub use atmosphere::{isa_altitude_m, isa_pressure_pa};
pub use barometer::{Barometer, BarometerSample};
pub use clock::{SampleClock, SampleTime};
pub use earth::{Earth, STANDARD_GRAVITY_M_S2, normal_gravity_m_s2};
pub use gnss::{Fix, Gnss, GnssSample};
pub use imu::{Imu, ImuSample};
pub use magnetometer::{Magnetometer, MagnetometerSample};
pub use mount::SensorMount;

/// Time before and after the flown window for which sensors have samples, seconds: programs want inertial
/// samples before the first frame and after the last.
pub const LEAD_S: f64 = 1.0;

/// Most samples from the first row of the log to the last sample of a sensor.
const MOST_SAMPLES: f64 = 200e6;
/// Most samples before the first row of the log.
const MOST_EARLIER: f64 = 10e6;

/// Why sensors cannot be simulated.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum SensorError {
    /// A sensor that needs the position of the local frame on Earth.
    #[error(
        "{kind} \"{name}\": {reason} needs the position of the flight on Earth, and the log has local \
            coordinates: set flight.origin = [lat_deg, lon_deg, height_m]"
    )]
    NoPosition {
        /// Table of the scenario.
        kind: &'static str,
        /// Name of the sensor.
        name: String,
        /// What needs it.
        reason: &'static str,
    },
    /// Too many samples.
    #[error(
        "{kind} \"{name}\": {samples:.0} samples from the first row of the log on are too many: lower rate_hz, \
            or make flight.window_s shorter"
    )]
    TooMany {
        /// Table of the scenario.
        kind: &'static str,
        /// Name of the sensor.
        name: String,
        /// Their number.
        samples: f64,
    },
    /// The camera's mount, for a sensor on it.
    #[error(transparent)]
    Mount(#[from] MountError),
    /// A position or day without field.
    #[error(
        "magnetometer \"{name}\": the World Magnetic Model has no field there: {problem}; give field_ned_ut"
    )]
    NoField {
        /// Name of the sensor.
        name: String,
        /// What is wrong.
        problem: String,
    },
}

/// What all sensors of a flight share.
#[derive(Clone, Debug)]
pub struct SensorInput {
    /// Motion of the platform.
    pub trajectory: Arc<Trajectory>,
    /// Position of the local frame.
    pub earth: Earth,
    /// Time of the written stamps at path time 0, nanoseconds.
    pub epoch_ns: i64,
    /// First and last instant with samples, seconds of path time.
    pub span_s: [f64; 2],
    /// Mount of the camera.
    pub camera_mount: MountSpec,
}

/// The sensors of a scenario.
#[derive(Clone, Debug, Default)]
pub struct Sensors {
    /// Inertial measurement units.
    pub imus: Vec<Imu>,
    /// Satellite receivers.
    pub gnss: Vec<Gnss>,
    /// Barometers.
    pub barometers: Vec<Barometer>,
    /// Magnetometers.
    pub magnetometers: Vec<Magnetometer>,
}

impl Sensors {
    /// The sensors of `scenario`.
    ///
    /// # Errors
    /// [`SensorError`].
    pub fn new(scenario: &Scenario, input: &SensorInput) -> Result<Self, SensorError> {
        let seed = scenario.seed;
        Ok(Self {
            imus: all(&scenario.imu, |spec| Imu::new(spec, seed, input))?,
            gnss: all(&scenario.gnss, |spec| Gnss::new(spec, seed, input))?,
            barometers: all(&scenario.barometer, |spec| Barometer::new(spec, seed, input))?,
            magnetometers: all(&scenario.magnetometer, |spec| Magnetometer::new(spec, seed, input))?,
        })
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.imus.is_empty()
            && self.gnss.is_empty()
            && self.barometers.is_empty()
            && self.magnetometers.is_empty()
    }
}

fn all<Spec, Sensor>(
    specs: &[Spec],
    new: impl Fn(&Spec) -> Result<Sensor, SensorError>,
) -> Result<Vec<Sensor>, SensorError> {
    specs.iter().map(new).collect()
}

/// The span of a scenario's sensors: the flown window, all exposures of its frames, and [`LEAD_S`] before and
/// after. `last_row_s` is the path time of the log's last row. Where the log is shorter, the platform coasts.
#[must_use]
pub fn span_s(scenario: &Scenario, last_row_s: f64) -> [f64; 2] {
    let (speed, camera) = (scenario.flight.speed, &scenario.camera);
    let [from_s, to_s] =
        scenario.flight.window_s.map_or([0.0, last_row_s], |window| window.map(|t_s| t_s / speed));
    let phase_s = camera.phase / camera.fps;
    let (first_s, last_s) = Shutter::longest_of(camera).map_or((0.0, 0.0), |shutter| shutter.window_s());
    let before_s = (phase_s + first_s).min(0.0);
    let late_s = camera.timing.as_ref().map_or(0.0, |timing| 1e-3 * timing.late_ms);
    let after_s = (phase_s + last_s + late_s).max(0.0);
    [from_s + before_s - LEAD_S, to_s + after_s + LEAD_S]
}

/// The vertical datum of the local frame's heights, after the conversions that loading makes.
#[must_use]
pub fn frame_heights(scenario: &Scenario) -> HeightReference {
    let log = scenario.log_datum();
    let terrain = scenario.scene.terrain.as_ref().map_or(log, |terrain| terrain.height);
    // Equal datums need no conversion; of two, heights above mean sea level become ellipsoidal.
    if log == terrain { log } else { HeightReference::Ellipsoid }
}

impl SensorInput {
    /// What the sensors of a scenario share; `last_row_s` as in [`span_s`].
    #[must_use]
    pub fn new(
        scenario: &Scenario,
        trajectory: Arc<Trajectory>,
        frame: Option<LocalFrame>,
        epoch_ns: i64,
        last_row_s: f64,
    ) -> Self {
        let earth = Earth::new(frame, frame_heights(scenario));
        let span_s = span_s(scenario, last_row_s);
        Self { trajectory, earth, epoch_ns, span_s, camera_mount: scenario.camera.mount.clone() }
    }

    /// That the position of the local frame on Earth is known, which `reason` needs.
    fn check_position(
        &self,
        kind: &'static str,
        name: &str,
        reason: &'static str,
    ) -> Result<(), SensorError> {
        let no_position = || SensorError::NoPosition { kind, name: name.to_owned(), reason };
        self.earth.frame().map(|_| ()).ok_or_else(no_position)
    }
}

#[cfg(test)]
mod tests;
