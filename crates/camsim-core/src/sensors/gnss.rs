//! Satellite receiver.

use glam::DVec3;

use super::{
    Earth, SampleClock, SampleTime, SensorError, SensorInput, SensorMount,
    errors::{AxisErrors, ErrorFigures, Normals, Process, Series},
};
use crate::{geodesy::Geodetic, scenario::GnssSpec};

/// First streams of the errors of position and velocity, and stream of random dropouts.
const POSITION_STREAM: u32 = 28;
const VELOCITY_STREAM: u32 = 32;
const DROPOUT_STREAM: u32 = 36;

/// A satellite receiver on a flight.
#[derive(Clone, Debug)]
pub struct Gnss {
    /// Its keys.
    pub spec: GnssSpec,
    /// Position of its antenna.
    pub mount: SensorMount,
    /// Its clock.
    pub clock: SampleClock,
    /// What the samples are made from.
    pub input: SensorInput,
    position: AxisErrors,
    velocity: AxisErrors,
    dropouts: Dropouts,
}

/// Position and velocity of the antenna.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fix {
    /// Latitude, longitude, and height above the ellipsoid.
    pub at: Geodetic,
    /// Height above mean sea level (EGM96).
    pub msl_m: f64,
    /// Position in the local frame.
    pub position_ned_m: DVec3,
    /// Velocity in the axes of the local frame.
    pub velocity_ned_m_s: DVec3,
}

/// A sample of a satellite receiver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GnssSample {
    /// Instant and stamp.
    pub time: SampleTime,
    /// Stamp at which the fix is available, by the sensor's clock.
    pub available_ns: i64,
    /// The measured fix; `None` within a dropout.
    pub fix: Option<Fix>,
    /// The truth.
    pub truth: Fix,
}

/// Random dropouts: the receiver has a fix or not, and changes between the two at constant rates.
#[derive(Clone, Copy, Debug)]
struct Dropouts {
    normals: Normals,
    /// Probability from one sample to the next of losing the fix, and of getting it back.
    lose: f64,
    regain: f64,
}

impl Dropouts {
    fn step(&self, has_fix: bool, sample: i64) -> bool {
        let draw = self.normals.uniform(sample, DROPOUT_STREAM);
        if has_fix { draw >= self.lose } else { draw < self.regain }
    }
}

impl Process for Dropouts {
    type State = bool;

    fn at_zero(&self) -> bool {
        true
    }

    fn after(&self, state: bool, sample: i64) -> bool {
        self.step(state, sample)
    }

    fn before(&self, state: bool, sample: i64) -> bool {
        self.step(state, sample)
    }

    fn changes(&self) -> bool {
        self.lose > 0.0
    }
}

/// Horizontal and vertical figures by axis.
fn axes([horizontal, vertical]: [f64; 2]) -> DVec3 {
    DVec3::new(horizontal, horizontal, vertical)
}

impl Gnss {
    pub(super) fn new(spec: &GnssSpec, seed: u64, input: &SensorInput) -> Result<Self, SensorError> {
        let keys = [spec.rate_hz, spec.clock_offset_ms, spec.jitter_ms];
        let clock = SampleClock::new(("gnss", &spec.name), keys, seed, input)?;
        input.check_position("gnss", &spec.name, "latitude and longitude")?;
        let normals = Normals::new(seed, &spec.name);
        let position = ErrorFigures {
            white: axes(spec.sigma_m),
            drift_sigma: axes(spec.drift_m),
            drift_samples: spec.drift_tau_s * spec.rate_hz,
            ..ErrorFigures::default()
        };
        let velocity = ErrorFigures { white: axes(spec.velocity_sigma_m_s), ..ErrorFigures::default() };
        // A change within a period, at a constant rate; without dropouts the mean times are 0.
        let change = |mean_s: f64| match mean_s > 0.0 {
            true => -(-1.0 / (mean_s * spec.rate_hz)).exp_m1(),
            false => 0.0,
        };
        Ok(Self {
            mount: SensorMount::at(spec.offset_m),
            position: AxisErrors::new(normals, POSITION_STREAM, &position),
            velocity: AxisErrors::new(normals, VELOCITY_STREAM, &velocity),
            dropouts: Dropouts {
                normals,
                lose: change(spec.dropout_every_s),
                regain: change(spec.dropout_mean_s),
            },
            spec: spec.clone(),
            clock,
            input: input.clone(),
        })
    }

    /// All samples in order.
    pub fn samples(&self) -> impl Iterator<Item = GnssSample> + '_ {
        let mut earth = self.input.earth.clone();
        let mut drift = Series::new(&self.position, self.clock.first());
        let mut has_fix = Series::new(&self.dropouts, self.clock.first());
        let delay_ns = (self.spec.delay_ms * 1e6).round() as i64;
        self.clock.times().filter_map(move |time| {
            let motion = self.mount.motion(&self.input.trajectory.state(time.t_s));
            let truth = fix(&mut earth, motion.position_ned_m, motion.velocity_ned_m_s)?;
            let error_m = self.position.bias(&drift.next()) + self.position.white(time.sample);
            let velocity_error = self.velocity.white(time.sample);
            let is_within = |[from_s, to_s]: &[f64; 2]| (*from_s..*to_s).contains(&time.t_s);
            let is_seen = has_fix.next() && !self.spec.dropouts_s.iter().any(is_within);
            let measured = match is_seen {
                true => Some(fix(
                    &mut earth,
                    motion.position_ned_m + error_m,
                    motion.velocity_ned_m_s + velocity_error,
                )?),
                false => None,
            };
            let available_ns = time.stamp_ns.saturating_add(delay_ns);
            Some(GnssSample { time, available_ns, fix: measured, truth })
        })
    }
}

/// `None` where the position is not known, which [`Gnss::new`] refuses.
fn fix(earth: &mut Earth, position_ned_m: DVec3, velocity_ned_m_s: DVec3) -> Option<Fix> {
    let at = earth.geodetic(position_ned_m)?;
    Some(Fix { at, msl_m: earth.msl_m(at), position_ned_m, velocity_ned_m_s })
}
