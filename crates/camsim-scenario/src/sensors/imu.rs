//! `[[imu]]`: gyroscope and accelerometer.

use serde::{Deserialize, Serialize};

use super::{MAX_RATE_HZ, PerAxis, SensorAxes, SensorMountSpec};
use crate::{
    camera::{CLOCK_HINT, MAX_CLOCK_OFFSET_MS},
    keys::{Table, Words},
};

/// What a sensor is fixed to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Words)]
#[serde(rename_all = "lowercase")]
pub enum SensorCarrier {
    /// The platform.
    #[default]
    Body,
    /// The camera, with its vibration.
    Camera,
}

/// An inertial measurement unit: gyroscope and accelerometer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct ImuSpec {
    /// Name of the sensor and its files. It is part of the seed of its noise.
    #[key(required, example = "\"imu0\"")]
    pub name: String,
    /// Samples per second.
    #[key(default = 200.0, unit = "Hz", above = 0.0, max = MAX_RATE_HZ, hint = "give samples a second")]
    pub rate_hz: f64,
    /// Position and orientation on the platform.
    pub mount: SensorMountSpec,
    /// What the mount is fixed to. Its angles and lever arm are those without vibration.
    pub attached_to: SensorCarrier,
    /// Axes of the output at the mount's angles 0.
    pub axes: SensorAxes,
    /// Whether the gyroscope feels the Earth's rotation. The accelerometer then has its Coriolis
    /// acceleration.
    pub earth_rate: bool,
    /// Errors of the gyroscope.
    #[key(unit = "rad/s")]
    pub gyro: TriadSpec,
    /// Errors of the accelerometer.
    #[key(unit = "m/s2")]
    pub accel: TriadSpec,
    /// Error of the gyroscope by the specific force along each axis. A number, or one of each axis.
    #[key(unit = "(rad/s)/(m/s2)", step = 1e-6)]
    pub g_sensitivity: PerAxis,
    /// Lead of the sensor's clock, which is added to every stamp.
    #[key(unit = "ms", step = 0.1, within = MAX_CLOCK_OFFSET_MS, hint = CLOCK_HINT)]
    pub clock_offset_ms: f64,
    /// Standard deviation of a random error of every stamp.
    #[key(unit = "ms", step = 0.01, min = 0.0, hint = "0 is none")]
    pub jitter_ms: f64,
}

/// Errors of three orthogonal sensors.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct TriadSpec {
    /// Density of white noise, as Kalibr has it. A number, or one of each axis.
    #[key(unit = "U/sqrt(Hz)", step = 1e-5, min = 0.0, hint = "0 is none")]
    pub noise_density: PerAxis,
    /// Density of the white noise whose integral the bias is, as Kalibr has it. A number, or one of each
    /// axis.
    #[key(unit = "U/s/sqrt(Hz)", step = 1e-6, min = 0.0, hint = "0 is none")]
    pub random_walk: PerAxis,
    /// Constant bias. A number, or one of each axis.
    #[key(unit = "U", step = 1e-4)]
    pub bias: PerAxis,
    /// Standard deviation of a constant bias that is drawn once. A number, or one of each axis.
    #[key(unit = "U", step = 1e-4, min = 0.0, hint = "0 is none")]
    pub bias_sigma: PerAxis,
    /// Standard deviation of a bias correlated over `drift_tau_s`. A number, or one of each axis. It is a
    /// first-order Gauss-Markov process.
    #[key(unit = "U", step = 1e-4, min = 0.0, hint = "0 is none")]
    pub drift_sigma: PerAxis,
    /// Correlation time of that bias.
    #[key(default = 100.0, unit = "s", above = 0.0, hint = "give the correlation time in seconds")]
    pub drift_tau_s: f64,
    /// Relative errors of scale. A number, or one of each axis. 0.001 reads 0.1 % too much.
    #[key(step = 1e-4, above = -1.0, below = 1.0, hint = "a relative error: 0.001 reads 0.1 % too much")]
    pub scale: PerAxis,
    /// Angles by which axis i is turned towards axis j: xy, xz, yx, yz, zx, zy.
    #[key(
        unit = "deg",
        step = 0.01,
        above = -45.0,
        below = 45.0,
        hint = "turn the sensor by mount.angles_deg",
        names = "xy xz yx yz zx zy"
    )]
    pub misalignment_deg: [f64; 6],
    /// Step of the output. A number, or one of each axis. 0 is none.
    #[key(unit = "U", step = 1e-4, min = 0.0, hint = "0 is none")]
    pub quantisation: PerAxis,
    /// Largest output. A number, or one of each axis. 0 is no limit.
    #[key(unit = "U", step = 0.1, min = 0.0, hint = "0 is no limit")]
    pub range: PerAxis,
}
