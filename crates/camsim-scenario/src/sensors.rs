//! `[[imu]]`, `[[gnss]]`, `[[barometer]]`, `[[magnetometer]]`: sensors beside the camera.

use serde::{Deserialize, Serialize};

mod imu;
mod per_axis;

pub use imu::{ImuSpec, SensorCarrier, TriadSpec};
pub use per_axis::PerAxis;

use super::{
    Scenario,
    camera::{CLOCK_HINT, MAX_CLOCK_OFFSET_MS},
    keys::{Table, Words},
};

/// Largest rate of a sensor, hertz.
const MAX_RATE_HZ: f64 = 100_000.0;

/// Axes of a sensor whose mount has the angles 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Words)]
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

/// Position and orientation of a sensor on the platform.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct SensorMountSpec {
    /// Roll, pitch, yaw (ZYX) of the sensor on the platform, as of a camera's mount.
    #[key(unit = "deg", step = 0.1, names = "roll pitch yaw")]
    pub angles_deg: [f64; 3],
    /// Lever arm in body axes: forward, right, down.
    #[key(unit = "m", step = 0.01, names = "fwd right down")]
    pub offset_m: [f64; 3],
}

/// A satellite receiver.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct GnssSpec {
    /// Name of the sensor and its files. It is part of the seed of its noise.
    #[key(required, example = "\"gnss0\"")]
    pub name: String,
    /// Samples per second.
    #[key(default = 10.0, unit = "Hz", above = 0.0, max = MAX_RATE_HZ, hint = "give samples a second")]
    pub rate_hz: f64,
    /// Position of the antenna in body axes: forward, right, down.
    #[key(unit = "m", step = 0.01, names = "fwd right down")]
    pub offset_m: [f64; 3],
    /// Standard deviation of white noise: horizontal (north and east each), vertical.
    #[key(
        unit = "m",
        step = 0.1,
        min = 0.0,
        hint = "give [horizontal, vertical]; 0 is none",
        names = "horizontal vertical"
    )]
    pub sigma_m: [f64; 2],
    /// Standard deviation of a correlated error: horizontal (north and east each), vertical. It is a
    /// first-order Gauss-Markov process with the correlation time `drift_tau_s`.
    #[key(
        unit = "m",
        step = 0.1,
        min = 0.0,
        hint = "give [horizontal, vertical]; 0 is none",
        names = "horizontal vertical"
    )]
    pub drift_m: [f64; 2],
    /// Correlation time of that error.
    #[key(default = 100.0, unit = "s", above = 0.0, hint = "give the correlation time in seconds")]
    pub drift_tau_s: f64,
    /// Standard deviation of white noise of the velocity: horizontal, vertical. Horizontal is north and east
    /// each.
    #[key(
        unit = "m/s",
        step = 0.01,
        min = 0.0,
        hint = "give [horizontal, vertical]; 0 is none",
        names = "horizontal vertical"
    )]
    pub velocity_sigma_m_s: [f64; 2],
    /// Intervals without a fix: start and end of each, counted from the first good row of the log.
    #[key(unit = "s", example = "[[12.0, 15.0]]", names = "from to")]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub dropouts_s: Vec<[f64; 2]>,
    /// Mean time from the end of one random dropout to the begin of the next. 0 is none.
    #[key(unit = "s", min = 0.0, hint = "0 is none")]
    pub dropout_every_s: f64,
    /// Mean length of random dropouts.
    #[key(unit = "s", step = 0.1, min = 0.0, hint = "0 is none")]
    pub dropout_mean_s: f64,
    /// Time from the instant of a fix until it is available (`t_available_ns`).
    #[key(unit = "ms", min = 0.0, hint = "it is the age of a fix when it arrives")]
    pub delay_ms: f64,
    /// Lead of the sensor's clock, which is added to every stamp.
    #[key(unit = "ms", step = 0.1, within = MAX_CLOCK_OFFSET_MS, hint = CLOCK_HINT)]
    pub clock_offset_ms: f64,
    /// Standard deviation of a random error of every stamp.
    #[key(unit = "ms", step = 0.01, min = 0.0, hint = "0 is none")]
    pub jitter_ms: f64,
}

/// A barometer: static pressure in the standard atmosphere.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct BarometerSpec {
    /// Name of the sensor and its files. It is part of the seed of its noise.
    #[key(required, example = "\"baro0\"")]
    pub name: String,
    /// Samples per second.
    #[key(default = 50.0, unit = "Hz", above = 0.0, max = MAX_RATE_HZ, hint = "give samples a second")]
    pub rate_hz: f64,
    /// Position in body axes: forward, right, down.
    #[key(unit = "m", step = 0.01, names = "fwd right down")]
    pub offset_m: [f64; 3],
    /// Pressure at mean sea level. All pressures are those of the standard atmosphere times this over
    /// 101 325 Pa.
    #[key(
        default = 101_325.0,
        unit = "Pa",
        step = 10.0,
        min = 1e3,
        max = 1e6,
        hint = "give pascals; 101325 is the standard"
    )]
    pub sea_level_pa: f64,
    /// Constant error.
    #[key(unit = "Pa")]
    pub bias_pa: f64,
    /// Standard deviation of white noise.
    #[key(unit = "Pa", step = 0.1, min = 0.0, hint = "0 is none")]
    pub sigma_pa: f64,
    /// Standard deviation of an error correlated over `drift_tau_s` (first-order Gauss-Markov).
    #[key(unit = "Pa", min = 0.0, hint = "0 is none")]
    pub drift_pa: f64,
    /// Correlation time of that error.
    #[key(default = 100.0, unit = "s", above = 0.0, hint = "give the correlation time in seconds")]
    pub drift_tau_s: f64,
    /// Step of the output. 0 is none.
    #[key(unit = "Pa", step = 0.1, min = 0.0, hint = "0 is none")]
    pub quantisation_pa: f64,
    /// Lead of the sensor's clock, which is added to every stamp.
    #[key(unit = "ms", step = 0.1, within = MAX_CLOCK_OFFSET_MS, hint = CLOCK_HINT)]
    pub clock_offset_ms: f64,
    /// Standard deviation of a random error of every stamp.
    #[key(unit = "ms", step = 0.01, min = 0.0, hint = "0 is none")]
    pub jitter_ms: f64,
}

/// A magnetometer: the Earth's field in sensor axes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct MagnetometerSpec {
    /// Name of the sensor and its files. It is part of the seed of its noise.
    #[key(required, example = "\"mag0\"")]
    pub name: String,
    /// Samples per second.
    #[key(default = 50.0, unit = "Hz", above = 0.0, max = MAX_RATE_HZ, hint = "give samples a second")]
    pub rate_hz: f64,
    /// Position and orientation on the platform.
    pub mount: SensorMountSpec,
    /// Axes of the output at the mount's angles 0.
    pub axes: SensorAxes,
    /// The Earth's field everywhere: north, east, down. Either this or `date` is given.
    #[key(unit = "uT", step = 0.1, example = "[21.6, 1.4, 43.1]", names = "N E D")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub field_ned_ut: Option<[f64; 3]>,
    /// Day (`YYYY-MM-DD`) of the field of the World Magnetic Model, instead of `field_ned_ut`.
    #[key(example = "\"2026-11-27\"")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub date: Option<String>,
    /// Constant field of the vehicle, in sensor axes.
    #[key(unit = "uT", step = 0.1, names = "x y z")]
    pub hard_iron_ut: [f64; 3],
    /// Matrix by which the vehicle's iron distorts the field, row by row, in sensor axes.
    #[key(
        default = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        step = 0.01,
        names = "xx xy xz yx yy yz zx zy zz"
    )]
    pub soft_iron: [f64; 9],
    /// Standard deviation of white noise: a number, or one of each axis.
    #[key(unit = "uT", step = 0.01, min = 0.0, hint = "0 is none")]
    pub sigma_ut: PerAxis,
    /// Step of the output. 0 is none.
    #[key(unit = "uT", step = 0.01, min = 0.0, hint = "0 is none")]
    pub quantisation_ut: f64,
    /// Largest output of each axis. 0 is no limit.
    #[key(unit = "uT", min = 0.0, hint = "0 is no limit")]
    pub range_ut: f64,
    /// Lead of the sensor's clock, which is added to every stamp.
    #[key(unit = "ms", step = 0.1, within = MAX_CLOCK_OFFSET_MS, hint = CLOCK_HINT)]
    pub clock_offset_ms: f64,
    /// Standard deviation of a random error of every stamp.
    #[key(unit = "ms", step = 0.01, min = 0.0, hint = "0 is none")]
    pub jitter_ms: f64,
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
