//! `[[imu]]`, `[[gnss]]`, `[[barometer]]`, `[[magnetometer]]`: sensors beside the camera.

use serde::{Deserialize, Serialize};

mod imu;
mod per_axis;

pub use imu::{ImuSpec, SensorCarrier, TriadSpec};
pub use per_axis::PerAxis;

use super::Scenario;

/// Axes of a sensor whose mount has the angles 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SensorAxes {
    /// Forward, right, down: those of the body.
    #[default]
    Frd,
    /// Forward, left, up.
    Flu,
    /// Right, down, forward: those of a camera with the same mount.
    Rdf,
}

/// Place and orientation of a sensor in the body frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SensorMountSpec {
    /// Roll, pitch, yaw (ZYX), as of a camera's mount.
    pub angles_deg: [f64; 3],
    /// Lever arm in body axes (forward, right, down).
    pub offset_m: [f64; 3],
}

/// `[[gnss]]`: a satellite receiver. Sigmas are of north and east each, and of height.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GnssSpec {
    /// Name of the sensor and its files; part of the seed of its noise.
    pub name: String,
    /// Samples per second.
    pub rate_hz: f64,
    /// Antenna in body axes (forward, right, down).
    pub offset_m: [f64; 3],
    /// Standard deviation of white noise: horizontal (each axis), vertical.
    pub sigma_m: [f64; 2],
    /// Standard deviation of an error correlated over `drift_tau_s` (first-order Gauss-Markov).
    pub drift_m: [f64; 2],
    /// Correlation time of that error.
    pub drift_tau_s: f64,
    /// Standard deviation of white noise of the velocity.
    pub velocity_sigma_m_s: [f64; 2],
    /// Intervals without a fix, seconds of path time.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub dropouts_s: Vec<[f64; 2]>,
    /// Mean time from the end of one random dropout to the begin of the next; 0 is none.
    pub dropout_every_s: f64,
    /// Mean length of random dropouts.
    pub dropout_mean_s: f64,
    /// Time from the instant of a fix until it is available.
    pub delay_ms: f64,
    /// Added to every stamp.
    pub clock_offset_ms: f64,
    /// Standard deviation of a random error of every stamp.
    pub jitter_ms: f64,
}

impl Default for GnssSpec {
    fn default() -> Self {
        Self {
            name: String::new(),
            rate_hz: 10.0,
            offset_m: [0.0; 3],
            sigma_m: [0.0; 2],
            drift_m: [0.0; 2],
            drift_tau_s: 100.0,
            velocity_sigma_m_s: [0.0; 2],
            dropouts_s: Vec::new(),
            dropout_every_s: 0.0,
            dropout_mean_s: 0.0,
            delay_ms: 0.0,
            clock_offset_ms: 0.0,
            jitter_ms: 0.0,
        }
    }
}

/// `[[barometer]]`: static pressure in the standard atmosphere.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BarometerSpec {
    /// Name of the sensor and its files; part of the seed of its noise.
    pub name: String,
    /// Samples per second.
    pub rate_hz: f64,
    /// Place in body axes (forward, right, down).
    pub offset_m: [f64; 3],
    /// Pressure at mean sea level. All pressures are those of the standard atmosphere times this over
    /// 101 325 Pa.
    pub sea_level_pa: f64,
    /// Constant error.
    pub bias_pa: f64,
    /// Standard deviation of white noise.
    pub sigma_pa: f64,
    /// Standard deviation of an error correlated over `drift_tau_s` (first-order Gauss-Markov).
    pub drift_pa: f64,
    /// Correlation time of that error.
    pub drift_tau_s: f64,
    /// Step of the output; 0 is none.
    pub quantisation_pa: f64,
    /// Added to every stamp.
    pub clock_offset_ms: f64,
    /// Standard deviation of a random error of every stamp.
    pub jitter_ms: f64,
}

impl Default for BarometerSpec {
    fn default() -> Self {
        Self {
            name: String::new(),
            rate_hz: 50.0,
            offset_m: [0.0; 3],
            sea_level_pa: 101_325.0,
            bias_pa: 0.0,
            sigma_pa: 0.0,
            drift_pa: 0.0,
            drift_tau_s: 100.0,
            quantisation_pa: 0.0,
            clock_offset_ms: 0.0,
            jitter_ms: 0.0,
        }
    }
}

/// `[[magnetometer]]`: the Earth's field in sensor axes. One of `field_ned_ut` and `date` is given.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MagnetometerSpec {
    /// Name of the sensor and its files; part of the seed of its noise.
    pub name: String,
    /// Samples per second.
    pub rate_hz: f64,
    /// Place and orientation.
    pub mount: SensorMountSpec,
    /// Axes of the output.
    pub axes: SensorAxes,
    /// The field everywhere: north, east, down, microtesla.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub field_ned_ut: Option<[f64; 3]>,
    /// `YYYY-MM-DD`: the field of the World Magnetic Model on this day.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub date: Option<String>,
    /// Constant field of the vehicle, in sensor axes.
    pub hard_iron_ut: [f64; 3],
    /// Matrix by which the vehicle's iron distorts the field, row by row, in sensor axes.
    pub soft_iron: [f64; 9],
    /// Standard deviation of white noise of each axis.
    pub sigma_ut: PerAxis,
    /// Step of the output; 0 is none.
    pub quantisation_ut: f64,
    /// Largest output of each axis; 0 is no limit.
    pub range_ut: f64,
    /// Added to every stamp.
    pub clock_offset_ms: f64,
    /// Standard deviation of a random error of every stamp.
    pub jitter_ms: f64,
}

impl Default for MagnetometerSpec {
    fn default() -> Self {
        Self {
            name: String::new(),
            rate_hz: 50.0,
            mount: SensorMountSpec::default(),
            axes: SensorAxes::Frd,
            field_ned_ut: None,
            date: None,
            hard_iron_ut: [0.0; 3],
            soft_iron: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            sigma_ut: PerAxis::default(),
            quantisation_ut: 0.0,
            range_ut: 0.0,
            clock_offset_ms: 0.0,
            jitter_ms: 0.0,
        }
    }
}

impl MagnetometerSpec {
    /// Year, month and day of `date`; `None` where it is no date.
    #[must_use]
    pub fn year_month_day(&self) -> Option<[u16; 3]> {
        let mut parts = self.date.as_deref()?.split('-');
        let mut part = |digits: usize| {
            let text = parts.next().filter(|text| text.len() == digits)?;
            text.bytes().all(|byte| byte.is_ascii_digit()).then(|| text.parse().ok())?
        };
        let date = [part(4)?, part(2)?, part(2)?];
        let is_whole = parts.next().is_none() && (1..=12).contains(&date[1]) && (1..=31).contains(&date[2]);
        is_whole.then_some(date)
    }
}

impl Scenario {
    /// Kind and name of every sensor beside the camera, in the order of the file's tables.
    pub fn sensor_names(&self) -> impl Iterator<Item = (&'static str, &str)> {
        let imus = self.imu.iter().map(|spec| ("imu", spec.name.as_str()));
        let gnss = self.gnss.iter().map(|spec| ("gnss", spec.name.as_str()));
        let barometers = self.barometer.iter().map(|spec| ("barometer", spec.name.as_str()));
        let magnetometers = self.magnetometer.iter().map(|spec| ("magnetometer", spec.name.as_str()));
        imus.chain(gnss).chain(barometers).chain(magnetometers)
    }
}
