//! Faults of `[camera.timing]`: which frames arrive, whose picture they show, when that was taken, and what
//! their stamps say.
//!
//! Every draw is a function of (seed, camera, frame), so that any frame can be asked for by itself. Frame i is
//! triggered at the nominal time `start + (i + phase)/fps`, plus its lateness. Times of rows refer to the
//! trigger. A frame that is doubled shows the picture of the last frame before it that arrived, noise
//! included, under a stamp of its own. Cameras with one trigger draw its faults as functions of (seed, name of
//! the trigger, frame), each for itself: a camera that is rendered alone has those of its rig.

use std::sync::LazyLock;

use crate::{
    noise::{camera_seed, normal_from_bits, sample_words, tail_table},
    scenario::{CameraSpec, LateStamp, StampedBy, TimingSpec},
};

/// Streams of the draws.
mod stream {
    pub const LATE: u32 = 48;
    pub const JITTER: u32 = 49;
    pub const DROP: u32 = 50;
    pub const DOUBLE: u32 = 51;
    pub const MISS: u32 = 52;
}

/// Most of the least time between two triggers by which a stamp is wrong at random, so that stamps ascend.
const MOST_JITTER: f64 = 0.49;

static TAILS: LazyLock<Vec<f32>> = LazyLock::new(tail_table);

/// What becomes of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Delivery {
    /// It arrives with its own picture.
    Own,
    /// Its picture is taken, but does not arrive.
    Dropped,
    /// It arrives with the picture of another frame.
    Doubled(u64),
    /// Its trigger does not come: there is no picture.
    Missed,
}

/// The faults of one camera.
#[derive(Clone, Copy, Debug)]
pub struct TimingFaults<'a> {
    spec: &'a TimingSpec,
    fps: f64,
    phase: f64,
    seed: u64,
    /// Seed of the trigger's draws: that of the camera, if its trigger is its own.
    trigger_seed: u64,
}

/// Number of the frame whose picture a frame of a camera shows ([`TimingFaults::picture`]). `seed` is the
/// scenario's.
#[must_use]
pub fn picture_of(camera: &CameraSpec, seed: u64, frame: u64) -> u64 {
    TimingFaults::new(camera, seed).map_or(frame, |faults| faults.picture(frame as i64) as u64)
}

impl<'a> TimingFaults<'a> {
    /// Those of a camera; `None` where it has none. `seed` is the scenario's.
    #[must_use]
    pub fn new(camera: &'a CameraSpec, seed: u64) -> Option<Self> {
        let spec = camera.timing.as_ref()?;
        // The pictures of a burst have names of their own, but come from one trigger.
        let name = camera.name.split('/').next().unwrap_or_default();
        let own_seed = camera_seed(seed, name);
        // No camera's name has a slash.
        let shared_seed =
            spec.trigger.as_ref().map(|trigger| camera_seed(seed, &format!("trigger/{trigger}")));
        Some(Self {
            spec,
            fps: camera.fps,
            phase: camera.phase,
            seed: own_seed,
            trigger_seed: shared_seed.unwrap_or(own_seed),
        })
    }

    /// What becomes of a frame.
    #[must_use]
    pub fn delivery(&self, frame: u64) -> Delivery {
        if self.is_missed(frame) {
            return Delivery::Missed;
        }
        if self.is_lost(frame) {
            return Delivery::Dropped;
        }
        let picture = self.picture(frame as i64);
        if picture == frame as i64 { Delivery::Own } else { Delivery::Doubled(picture as u64) }
    }

    /// Whether a frame does not arrive: its trigger was missed, or its picture dropped.
    #[must_use]
    pub fn is_lost(&self, frame: u64) -> bool {
        self.is_missed(frame)
            || self.spec.drop.contains(&frame)
            || is_drawn(frame, self.seed, stream::DROP, self.spec.drop_probability)
    }

    fn is_missed(&self, frame: u64) -> bool {
        self.spec.miss.contains(&frame)
            || is_drawn(frame, self.trigger_seed, stream::MISS, self.spec.miss_probability)
    }

    /// Number of the frame whose picture a frame shows: its own, or, of a doubled one, that of the last frame
    /// before it that arrived. Frames before the first one are faultless.
    #[must_use]
    pub fn picture(&self, frame: i64) -> i64 {
        let Ok(number) = u64::try_from(frame) else { return frame };
        let mut shown = number;
        while self.is_doubled(shown) {
            match (0..shown).rev().find(|&before| !self.is_lost(before)) {
                Some(before) => shown = before,
                None => break,
            }
        }
        shown as i64
    }

    fn is_doubled(&self, frame: u64) -> bool {
        let spec = self.spec;
        frame > 0
            && (spec.double.contains(&frame)
                || is_drawn(frame, self.seed, stream::DOUBLE, spec.double_probability))
            && !self.is_lost(frame)
    }

    /// How late the trigger of a frame comes, seconds.
    #[must_use]
    pub fn late_s(&self, frame: i64) -> f64 {
        if self.spec.late_ms > 0.0 {
            1e-3 * self.spec.late_ms * uniform(frame, self.trigger_seed, stream::LATE)
        } else {
            0.0
        }
    }

    /// From the start of the window to the trigger of the picture that a frame shows, seconds.
    #[must_use]
    pub fn trigger_s(&self, frame: i64) -> f64 {
        let picture = self.picture(frame);
        self.nominal_s(picture) + self.late_s(picture)
    }

    /// From the start of the window to the time at which a frame was meant to be taken, seconds.
    #[must_use]
    pub fn nominal_s(&self, frame: i64) -> f64 {
        (frame as f64 + self.phase) / self.fps
    }

    /// From the start of the window to the time that the stamp of a frame shows, seconds, but for
    /// `camera.clock_offset_ms`.
    #[must_use]
    pub fn stamp_s(&self, frame: i64) -> f64 {
        let spec = self.spec;
        let late_s = match spec.late_stamp {
            LateStamp::Nominal => 0.0,
            LateStamp::Actual => self.late_s(frame),
        };
        let rate = 1.0 + 1e-6 * spec.drift_ppm;
        (self.nominal_s(frame) + late_s) * rate + self.jitter_s(frame, rate)
    }

    /// How much the stamp of a frame is ahead of the trigger of its picture, seconds.
    #[must_use]
    pub fn stamp_error_s(&self, frame: i64) -> f64 {
        self.stamp_s(frame) - self.trigger_s(frame)
    }

    fn jitter_s(&self, frame: i64, rate: f64) -> f64 {
        let spec = self.spec;
        if spec.jitter_ms <= 0.0 {
            return 0.0;
        }
        let late_ms = if spec.late_stamp == LateStamp::Actual { spec.late_ms } else { 0.0 };
        let most_s = MOST_JITTER * rate * (1.0 / self.fps - 1e-3 * late_ms);
        let seed = match spec.stamped_by {
            StampedBy::Camera => self.seed,
            StampedBy::Trigger => self.trigger_seed,
        };
        let [bits, ..] = sample_words(frame, seed, stream::JITTER);
        (1e-3 * spec.jitter_ms * f64::from(normal_from_bits(bits, &TAILS))).clamp(-most_s, most_s)
    }
}

fn is_drawn(frame: u64, seed: u64, stream: u32, probability: f64) -> bool {
    probability > 0.0 && uniform(frame as i64, seed, stream) < probability
}

/// Between 0 and 1.
fn uniform(frame: i64, seed: u64, stream: u32) -> f64 {
    let [bits, ..] = sample_words(frame, seed, stream);
    (f64::from(bits >> 8) + 0.5) * 0.5_f64.powi(24)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(timing: TimingSpec) -> CameraSpec {
        CameraSpec { name: "left".into(), fps: 20.0, timing: Some(timing), ..CameraSpec::default() }
    }

    fn faults(camera: &CameraSpec) -> TimingFaults<'_> {
        TimingFaults::new(camera, 7).expect("has faults")
    }

    #[test]
    fn a_camera_without_faults_has_none() {
        assert!(TimingFaults::new(&CameraSpec::default(), 0).is_none());
        let camera = camera(TimingSpec::default());
        let faults = faults(&camera);
        for frame in [-3, 0, 1, 1_000_000] {
            assert_eq!(faults.picture(frame), frame);
            assert_eq!(faults.stamp_error_s(frame), 0.0);
            assert_eq!(faults.trigger_s(frame), frame as f64 / 20.0);
        }
    }

    #[test]
    fn listed_frames_are_dropped_and_doubled() {
        let timing =
            TimingSpec { drop: vec![0, 4, 6], double: vec![0, 1, 2, 5, 6, 7], ..TimingSpec::default() };
        let camera = camera(timing);
        let found: Vec<Delivery> = (0..9).map(|frame| faults(&camera).delivery(frame)).collect();
        let (own, dropped) = (Delivery::Own, Delivery::Dropped);
        let again = Delivery::Doubled;
        // Before frame 1 nothing arrived; 5 repeats 3, and 7 repeats 5, which is 3 already.
        assert_eq!(found, [dropped, own, again(1), own, dropped, again(3), dropped, again(3), own]);
        // A doubled frame is stamped as if it were new.
        assert!((faults(&camera).stamp_error_s(7) - 4.0 / 20.0).abs() < 1e-12);
    }

    #[test]
    fn draws_have_their_fractions_and_moments() {
        const FRAMES: u32 = 40_000;
        let timing = TimingSpec {
            jitter_ms: 2.0,
            late_ms: 10.0,
            drop_probability: 0.1,
            double_probability: 0.2,
            ..TimingSpec::default()
        };
        let camera = camera(timing);
        let faults = faults(&camera);
        let fraction = |is: &dyn Fn(u64) -> bool| {
            (0..FRAMES).filter(|&frame| is(frame.into())).count() as f64 / f64::from(FRAMES)
        };
        // Five standard deviations of each count.
        assert!((fraction(&|frame| faults.is_lost(frame)) - 0.1).abs() < 0.0075);
        let doubled = fraction(&|frame| matches!(faults.delivery(frame), Delivery::Doubled(_)));
        assert!((doubled - 0.9 * 0.2).abs() < 0.0096, "{doubled}");
        let mean = |value: &dyn Fn(i64) -> f64| {
            (0..FRAMES).map(|k| value(k.into())).sum::<f64>() / f64::from(FRAMES)
        };
        // Evenly from 0 to 10 ms: mean 5 ms, variance 100/12.
        assert!((mean(&|k| faults.late_s(k)) - 5e-3).abs() < 5.0 * 2.887e-3 / 200.0);
        let variance = mean(&|k| (faults.late_s(k) - 5e-3).powi(2));
        assert!((variance / (1e-4 / 12.0) - 1.0).abs() < 0.03, "{variance}");
        let jitter = |k: i64| faults.stamp_s(k) - faults.nominal_s(k);
        assert!(mean(&jitter).abs() < 5.0 * 2e-3 / 200.0);
        assert!((mean(&|k| jitter(k).powi(2)) / 4e-6 - 1.0).abs() < 0.04);
        // White: neighbours are not correlated.
        assert!(mean(&|k| jitter(k) * jitter(k + 1)).abs() / 4e-6 < 5.0 / 200.0);
    }

    #[test]
    fn drift_grows_with_time_and_stamps_ascend() {
        let timing = TimingSpec { drift_ppm: 50.0, ..TimingSpec::default() };
        let camera = camera(timing.clone());
        // 50 ppm of 100 s.
        assert!((faults(&camera).stamp_error_s(2000) - 5e-3).abs() < 1e-12);
        let wild = TimingSpec {
            jitter_ms: 500.0,
            drift_ppm: -5e4,
            late_ms: 40.0,
            late_stamp: LateStamp::Actual,
            ..timing
        };
        let camera = self::camera(wild);
        let stamps: Vec<f64> = (0..5000).map(|frame| faults(&camera).stamp_s(frame)).collect();
        assert!(stamps.windows(2).all(|pair| pair[0] < pair[1]));
    }

    #[test]
    fn cameras_differ_and_bursts_do_not() {
        let timing = TimingSpec { late_ms: 10.0, ..TimingSpec::default() };
        let left = camera(timing);
        let right = CameraSpec { name: "right".into(), ..left.clone() };
        let burst = CameraSpec { name: "left/burst/3".into(), ..left.clone() };
        assert_ne!(faults(&left).late_s(5), faults(&right).late_s(5));
        assert_eq!(faults(&left).late_s(5), faults(&burst).late_s(5));
        // By the key, the stamp follows the trigger.
        let actual = TimingSpec { late_stamp: LateStamp::Actual, late_ms: 10.0, ..TimingSpec::default() };
        let actual = camera(actual);
        assert!(faults(&actual).stamp_error_s(5).abs() < 1e-12);
        assert!((faults(&left).stamp_error_s(5) + faults(&left).late_s(5)).abs() < 1e-12);
    }

    #[test]
    fn cameras_of_one_trigger_are_late_together_and_lose_pictures_apart() {
        let timing = TimingSpec {
            trigger: Some("wire".into()),
            late_ms: 10.0,
            jitter_ms: 1.0,
            drop_probability: 0.1,
            miss: vec![7],
            miss_probability: 0.2,
            ..TimingSpec::default()
        };
        let left = camera(timing.clone());
        let right = CameraSpec { name: "right".into(), ..left.clone() };
        let (a, b) = (faults(&left), faults(&right));
        assert_eq!(a.delivery(7), Delivery::Missed);
        let frames = 0..10_000_u64;
        let is_missed = |of: &TimingFaults<'_>, frame| of.delivery(frame) == Delivery::Missed;
        let both_dropped = |frame: &u64| [a, b].iter().all(|of| of.delivery(*frame) == Delivery::Dropped);
        for frame in frames.clone() {
            assert_eq!(a.late_s(frame as i64), b.late_s(frame as i64));
            assert_eq!(a.trigger_s(frame as i64), b.trigger_s(frame as i64));
            assert_eq!(is_missed(&a, frame), is_missed(&b, frame));
        }
        // Five standard deviations: a fifth is missed, and of the rest a hundredth dropped by both by chance.
        let missed = frames.clone().filter(|frame| is_missed(&a, *frame)).count();
        assert!((1800..2200).contains(&missed), "{missed}");
        let both = frames.filter(both_dropped).count();
        assert!((35..125).contains(&both), "{both}");
        assert_ne!(a.stamp_s(3), b.stamp_s(3));
        // Another wire is late by itself, and so is a camera of the wire's name.
        let other = camera(TimingSpec { trigger: Some("other".into()), ..timing.clone() });
        assert_ne!(faults(&other).late_s(3), a.late_s(3));
        let own = camera(TimingSpec { trigger: None, ..timing.clone() });
        let own = CameraSpec { name: "wire".into(), ..own };
        assert_ne!(faults(&own).late_s(3), a.late_s(3));
        // One device writes the stamps of both.
        let stamped = TimingSpec { stamped_by: StampedBy::Trigger, ..timing };
        let left = camera(stamped);
        let right = CameraSpec { name: "right".into(), ..left.clone() };
        assert!((0..100).all(|frame| faults(&left).stamp_s(frame) == faults(&right).stamp_s(frame)));
        assert_ne!(faults(&left).stamp_s(3), faults(&left).nominal_s(3));
    }
}
