//! `NAME_kalibr.yaml`: an inertial unit as Kalibr's tools read it.

use std::fmt::Write as _;

use camsim_core::scenario::{ImuSpec, TriadSpec};
use serde::{Deserialize, Serialize};

use crate::text::numbers::real;

/// The four figures of Kalibr's noise model, in continuous time: rad/s/sqrt(Hz), rad/s^2/sqrt(Hz), m/s^2/sqrt(Hz),
/// m/s^3/sqrt(Hz).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct KalibrFigures {
    pub(crate) gyroscope_noise_density: f64,
    pub(crate) gyroscope_random_walk: f64,
    pub(crate) accelerometer_noise_density: f64,
    pub(crate) accelerometer_random_walk: f64,
}

/// What is written for 0, which Kalibr refuses (`checkGyroStatistics`).
const LEAST: f64 = 1e-12;

/// Noise density and random walk of the worst axis. A Gauss-Markov bias of deviation s and correlation time T
/// is a walk of density s sqrt(2/T) over times much shorter than T.
fn figures(spec: &TriadSpec) -> [f64; 2] {
    let walk = |axis: usize| {
        let drift = spec.drift_sigma.0[axis] * (2.0 / spec.drift_tau_s).sqrt();
        spec.random_walk.0[axis].hypot(drift)
    };
    [spec.noise_density.largest(), (0..3).map(walk).fold(0.0, f64::max)]
}

impl KalibrFigures {
    pub(super) fn new(spec: &ImuSpec) -> Self {
        let ([gyro_noise, gyro_walk], [accel_noise, accel_walk]) =
            (figures(&spec.gyro), figures(&spec.accel));
        Self {
            gyroscope_noise_density: gyro_noise,
            gyroscope_random_walk: gyro_walk,
            accelerometer_noise_density: accel_noise,
            accelerometer_random_walk: accel_walk,
        }
    }
}

/// Text of Kalibr's `imu.yaml`.
#[must_use]
pub fn kalibr_yaml(spec: &ImuSpec) -> String {
    imu_yaml(&KalibrFigures::new(spec), &spec.name, spec.rate_hz)
}

/// Text of Kalibr's `imu.yaml` for a topic.
pub(crate) fn imu_yaml(figures: &KalibrFigures, topic: &str, rate_hz: f64) -> String {
    let mut text =
        String::from("# Noise of the worst axis, in continuous time; drift counts as random walk.\n");
    for (key, value, unit) in [
        ("accelerometer_noise_density", figures.accelerometer_noise_density, "m/s^2/sqrt(Hz)"),
        ("accelerometer_random_walk", figures.accelerometer_random_walk, "m/s^3/sqrt(Hz)"),
        ("gyroscope_noise_density", figures.gyroscope_noise_density, "rad/s/sqrt(Hz)"),
        ("gyroscope_random_walk", figures.gyroscope_random_walk, "rad/s^2/sqrt(Hz)"),
    ] {
        let zero = if value == 0.0 { "; 0 in truth, which Kalibr refuses" } else { "" };
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{key}: {}   # {unit}{zero}", real(value.max(LEAST)));
    }
    let _ = write!(text, "rostopic: /{topic}\nupdate_rate: {}\n", real(rate_hz));
    text
}
