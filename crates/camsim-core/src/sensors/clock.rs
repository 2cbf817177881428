//! Instants and stamps of a sensor's samples.

use super::{MOST_EARLIER, MOST_SAMPLES, SensorError, SensorInput, errors::Normals};

/// Most of a period by which a stamp is wrong at random, so that stamps ascend.
const MOST_JITTER: f64 = 0.49;
/// Stream of the random errors of stamps.
const JITTER_STREAM: u32 = 16;

/// Clock of a sensor: sample k is taken at path time `k / rate_hz`. Its stamp is that instant plus the clock's
/// offset and a normal error, which is cut at 0.49 periods so that stamps ascend.
#[derive(Clone, Debug)]
pub struct SampleClock {
    rate_hz: f64,
    samples: [i64; 2],
    epoch_ns: i64,
    offset_s: f64,
    jitter_s: f64,
    normals: Normals,
}

/// Instant and stamp of a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleTime {
    /// Number of the sample; 0 is at the first good row of the log.
    pub sample: i64,
    /// Instant, seconds of path time.
    pub t_s: f64,
    /// Stamp by the sensor's clock, nanoseconds.
    pub stamp_ns: i64,
    /// Instant on the clock of the frames' stamps, nanoseconds.
    pub true_ns: i64,
}

/// `rate_hz`, `clock_offset_ms` and `jitter_ms` of a sensor.
pub(super) type ClockKeys = [f64; 3];

impl SampleClock {
    /// Clock of the sensor of table `kind` and name `name`, with the samples within the span of `input`.
    pub(super) fn new(
        (kind, name): (&'static str, &str),
        [rate_hz, offset_ms, jitter_ms]: ClockKeys,
        seed: u64,
        input: &SensorInput,
    ) -> Result<Self, SensorError> {
        // The tolerance keeps a sample on the border of the span, whatever the rounding.
        let [first, last] =
            [(input.span_s[0] * rate_hz - 1e-6).ceil(), (input.span_s[1] * rate_hz + 1e-6).floor()];
        if last > MOST_SAMPLES || first < -MOST_EARLIER || last - first > MOST_SAMPLES {
            let samples = last.max(last - first);
            return Err(SensorError::TooMany { kind, name: name.to_owned(), samples });
        }
        Ok(Self {
            rate_hz,
            samples: [first as i64, last as i64],
            epoch_ns: input.epoch_ns,
            offset_s: offset_ms * 1e-3,
            jitter_s: jitter_ms * 1e-3,
            normals: Normals::new(seed, name),
        })
    }

    /// Samples per second.
    #[must_use]
    pub fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// Number of samples.
    #[must_use]
    pub fn count(&self) -> u64 {
        (self.samples[1] - self.samples[0] + 1).max(0) as u64
    }

    /// Number of the first sample.
    pub(super) fn first(&self) -> i64 {
        self.samples[0]
    }

    /// All samples in order.
    pub(super) fn times(&self) -> impl Iterator<Item = SampleTime> + '_ {
        (self.samples[0]..=self.samples[1]).map(|sample| self.time(sample))
    }

    fn time(&self, sample: i64) -> SampleTime {
        let t_s = sample as f64 / self.rate_hz;
        let most_s = MOST_JITTER / self.rate_hz;
        let jitter_s = match self.jitter_s > 0.0 {
            true => (self.jitter_s * self.normals.at(sample, JITTER_STREAM)[0]).clamp(-most_s, most_s),
            false => 0.0,
        };
        SampleTime { sample, t_s, stamp_ns: self.ns(t_s + self.offset_s + jitter_s), true_ns: self.ns(t_s) }
    }

    /// A path time on the clock of stamps, nanoseconds.
    pub(super) fn ns(&self, t_s: f64) -> i64 {
        self.epoch_ns.saturating_add((t_s * 1e9).round() as i64)
    }
}
