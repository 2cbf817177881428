//! Barometer.

use glam::DVec3;

use super::{
    SampleClock, SampleTime, SensorError, SensorInput, SensorMount, atmosphere,
    errors::{AxisErrors, ErrorFigures, Normals, Series, read_out},
};
use crate::scenario::BarometerSpec;

/// First stream of the errors.
const STREAM: u32 = 40;

/// A barometer on a flight.
#[derive(Clone, Debug)]
pub struct Barometer {
    /// Its keys.
    pub spec: BarometerSpec,
    /// Its position.
    pub mount: SensorMount,
    /// Its clock.
    pub clock: SampleClock,
    /// What the samples are made from.
    pub input: SensorInput,
    errors: AxisErrors,
}

/// A sample of a barometer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BarometerSample {
    /// Instant and stamp.
    pub time: SampleTime,
    /// Measured pressure.
    pub pressure_pa: f64,
    /// Height at which the standard atmosphere, with 101 325 Pa at sea level, has that pressure.
    pub altitude_m: f64,
    /// True pressure.
    pub true_pressure_pa: f64,
    /// True height above mean sea level.
    pub true_msl_m: f64,
    /// Error without the white noise.
    pub bias_pa: f64,
}

impl Barometer {
    pub(super) fn new(spec: &BarometerSpec, seed: u64, input: &SensorInput) -> Result<Self, SensorError> {
        let keys = [spec.rate_hz, spec.clock_offset_ms, spec.jitter_ms];
        let clock = SampleClock::new(("barometer", &spec.name), keys, seed, input)?;
        input.check_position("barometer", &spec.name, "the height")?;
        let figures = ErrorFigures {
            white: DVec3::X * spec.sigma_pa,
            bias: DVec3::X * spec.bias_pa,
            drift_sigma: DVec3::X * spec.drift_pa,
            drift_samples: spec.drift_tau_s * spec.rate_hz,
            ..ErrorFigures::default()
        };
        Ok(Self {
            mount: SensorMount::at(spec.offset_m),
            errors: AxisErrors::new(Normals::new(seed, &spec.name), STREAM, &figures),
            spec: spec.clone(),
            clock,
            input: input.clone(),
        })
    }

    /// All samples in order.
    pub fn samples(&self) -> impl Iterator<Item = BarometerSample> + '_ {
        let mut earth = self.input.earth.clone();
        let mut bias = Series::new(&self.errors, self.clock.first());
        self.clock.times().map(move |time| {
            let motion = self.mount.motion(&self.input.trajectory.state(time.t_s));
            // A position is known, as `new` has checked.
            let true_msl_m = earth.geodetic(motion.position_ned_m).map_or(f64::NAN, |at| earth.msl_m(at));
            let scale = self.spec.sea_level_pa / atmosphere::SEA_LEVEL_PA;
            let true_pressure_pa = scale * atmosphere::isa_pressure_pa(true_msl_m);
            let bias_pa = self.errors.bias(&bias.next()).x;
            let value = true_pressure_pa + bias_pa + self.errors.white(time.sample).x;
            let pressure_pa = read_out(value, self.spec.quantisation_pa, 0.0);
            let altitude_m = atmosphere::isa_altitude_m(pressure_pa);
            BarometerSample { time, pressure_pa, altitude_m, true_pressure_pa, true_msl_m, bias_pa }
        })
    }
}
