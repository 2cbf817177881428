//! `[[imu]]`: gyroscope and accelerometer.

use serde::{Deserialize, Serialize};

use super::{PerAxis, SensorAxes, SensorMountSpec};

/// What a sensor is fixed to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SensorCarrier {
    /// The platform.
    #[default]
    Body,
    /// The camera, with its vibration.
    Camera,
}

/// An inertial measurement unit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ImuSpec {
    /// Name of the sensor and its files; part of the seed of its noise.
    pub name: String,
    /// Samples per second.
    pub rate_hz: f64,
    /// Place and orientation.
    pub mount: SensorMountSpec,
    /// What the mount is fixed to. Its angles and lever arm are those without vibration.
    pub attached_to: SensorCarrier,
    /// Axes of the output.
    pub axes: SensorAxes,
    /// Whether the gyroscope feels the Earth's rotation and the accelerometer its Coriolis acceleration.
    pub earth_rate: bool,
    /// Errors of the gyroscope, rad/s.
    pub gyro: TriadSpec,
    /// Errors of the accelerometer, m/s^2.
    pub accel: TriadSpec,
    /// Error of the gyroscope by the specific force along each axis, (rad/s) / (m/s^2).
    pub g_sensitivity: PerAxis,
    /// Added to every stamp.
    pub clock_offset_ms: f64,
    /// Standard deviation of a random error of every stamp.
    pub jitter_ms: f64,
}

impl Default for ImuSpec {
    fn default() -> Self {
        Self {
            name: String::new(),
            rate_hz: 200.0,
            mount: SensorMountSpec::default(),
            attached_to: SensorCarrier::Body,
            axes: SensorAxes::Frd,
            earth_rate: false,
            gyro: TriadSpec::default(),
            accel: TriadSpec::default(),
            g_sensitivity: PerAxis::default(),
            clock_offset_ms: 0.0,
            jitter_ms: 0.0,
        }
    }
}

/// Errors of three orthogonal sensors. U is the unit of what they measure: rad/s or m/s^2.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TriadSpec {
    /// Density of white noise, U / sqrt(Hz).
    pub noise_density: PerAxis,
    /// Density of the white noise whose integral the bias is, U/s / sqrt(Hz).
    pub random_walk: PerAxis,
    /// Constant bias, U.
    pub bias: PerAxis,
    /// Standard deviation of a bias drawn once, U.
    pub bias_sigma: PerAxis,
    /// Standard deviation of a bias correlated over `drift_tau_s` (first-order Gauss-Markov), U.
    pub drift_sigma: PerAxis,
    /// Correlation time of that bias.
    pub drift_tau_s: f64,
    /// Relative errors of scale: 0.001 reads 0.1 % too much.
    pub scale: PerAxis,
    /// Angles by which axis i is turned towards axis j: xy, xz, yx, yz, zx, zy.
    pub misalignment_deg: [f64; 6],
    /// Step of the output, U; 0 is none.
    pub quantisation: PerAxis,
    /// Largest output, U; 0 is no limit.
    pub range: PerAxis,
}

impl Default for TriadSpec {
    fn default() -> Self {
        Self {
            noise_density: PerAxis::default(),
            random_walk: PerAxis::default(),
            bias: PerAxis::default(),
            bias_sigma: PerAxis::default(),
            drift_sigma: PerAxis::default(),
            drift_tau_s: 100.0,
            scale: PerAxis::default(),
            misalignment_deg: [0.0; 6],
            quantisation: PerAxis::default(),
            range: PerAxis::default(),
        }
    }
}
