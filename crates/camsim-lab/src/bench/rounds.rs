//! Times of several variants, measured in turn.
//!
//! Other programs disturb measurements, so variants are compared within rounds: each round renders a burst of
//! frames with every variant. The time of a frame is that of a burst, two frames in flight, divided by the
//! number of its frames: it contains plan, poses, passes and read-back, no files. What the frames of a burst
//! share, such as one ideal frame, is planned and drawn anew in each burst.
//!
//! All variants have equal parts of the time budget. A variant leaves when its part is used, so slow ones
//! have few rounds and fast ones many. The common rounds of two variants are the first rounds of both.

use std::{
    convert::Infallible,
    sync::Arc,
    time::{Duration, Instant},
};

use camsim_core::{scenario::Channel, sequence::Sequence};
use camsim_engine::{Engine, Finished, Session};

use super::BenchError;
use crate::timing::{ms, processor_ms, quantile, quartiles};

/// Time of a frame above which a burst has one frame only.
const SLOW_FRAME: Duration = Duration::from_secs(1);

/// The frame whose picture is compared with the truth.
pub const FRAME: u64 = 1;

/// Numbers of rounds, and the time for them.
#[derive(Clone, Copy, Debug)]
pub struct RoundLimits {
    /// Frames in a burst: enough that two in flight overlap. Frames that take longer than a second are
    /// measured one by one, since little overlaps.
    pub burst: u64,
    /// Smallest number of rounds of each variant, whatever they take.
    pub min_rounds: usize,
    /// Largest number of rounds.
    pub max_rounds: usize,
    /// Time for all variants together.
    pub budget: Duration,
}

impl RoundLimits {
    /// Whether a variant takes part in round `round`, counted from 0, after `spent_ms` in earlier rounds.
    fn has_round(&self, round: usize, spent_ms: f64, variants: usize) -> bool {
        round < self.min_rounds || (round < self.max_rounds && spent_ms * (variants as f64) < ms(self.budget))
    }
}

/// A sequence on a renderer.
#[derive(Clone, Debug)]
pub struct TimedSequence<'a> {
    /// The renderer.
    pub engine: &'a Engine,
    /// The sequence.
    pub sequence: Arc<Sequence>,
    /// Whether frame 0 is rendered over and over, so that its ideal frame is drawn once.
    pub is_still: bool,
}

/// Measurements of one variant.
#[derive(Debug)]
pub struct Measured {
    /// Times of all rounds.
    pub times: Times,
    /// Frame [`FRAME`], or frame 0 if the variant is still.
    pub finished: Option<Finished>,
}

/// Milliseconds per frame of one variant, one entry per round.
#[derive(Clone, Debug, Default)]
pub struct Times {
    /// Wall-clock time.
    pub wall_ms: Vec<f64>,
    /// Processor time over all threads; empty where it is not known.
    pub processor_ms: Vec<f64>,
    /// Time to open the session and render the first frame (upload, shader compilation, lens map), seconds.
    pub start_s: f64,
}

impl Times {
    /// Median and 99th percentile of the wall-clock time, milliseconds per frame.
    #[must_use]
    pub fn p50_p99_ms(&self) -> [f64; 2] {
        [0.5, 0.99].map(|part| quantile(&self.wall_ms, part))
    }

    /// Median processor time per frame, milliseconds.
    #[must_use]
    pub fn processor_p50_ms(&self) -> Option<f64> {
        (!self.processor_ms.is_empty()).then(|| quantile(&self.processor_ms, 0.5))
    }

    /// Ratios of this variant's wall-clock times to another's in their common rounds.
    #[must_use]
    pub fn ratios(&self, other: &Self) -> Vec<f64> {
        self.wall_ms.iter().zip(&other.wall_ms).map(|(own, other)| own / other).collect()
    }

    /// Quartiles of [`Self::ratios`].
    #[must_use]
    pub fn ratio_quartiles(&self, other: &Self) -> [f64; 3] {
        quartiles(&self.ratios(other))
    }
}

/// Renders frames and returns the last one.
fn render(
    session: &mut Session<'_>,
    frames: impl IntoIterator<Item = u64>,
) -> Result<Option<Finished>, BenchError> {
    let mut last = None;
    session.render::<Infallible>(frames, &mut |finished| {
        last = std::hint::black_box(Some(finished));
        Ok(())
    })?;
    Ok(last)
}

/// Measures `variants`; the results are in their order. Each variant renders the frames of its sequence over
/// and over.
///
/// # Errors
/// Any error of rendering.
pub fn measure(variants: &[TimedSequence<'_>], limits: RoundLimits) -> Result<Vec<Measured>, BenchError> {
    let mut running = Vec::new();
    for TimedSequence { engine, sequence, is_still } in variants {
        let begin = Instant::now();
        let mut session = engine.session::<Infallible>(sequence.clone(), &[Channel::Color])?;
        let session_opened = begin.elapsed();
        // The first dispatch of a pipeline compiles it.
        let finished = render(&mut session, [if *is_still { 0 } else { FRAME }])?;
        let burst = if begin.elapsed() - session_opened > SLOW_FRAME { 1 } else { limits.burst };
        let times = Times { start_s: begin.elapsed().as_secs_f64(), ..Times::default() };
        let frames = (0..).map(move |k| if *is_still { 0 } else { k % sequence.frames.max(1) });
        running.push((session, frames, *is_still, burst, Measured { times, finished }));
    }
    let count = running.len();
    for round in 0..limits.max_rounds {
        let mut is_finished = true;
        // The order rotates from round to round.
        for k in 0..count {
            let (session, frames, is_still, burst, Measured { times, .. }) =
                &mut running[(k + round) % count];
            let per_frame = |burst_ms: f64| burst_ms / *burst as f64;
            if !limits.has_round(round, *burst as f64 * times.wall_ms.iter().sum::<f64>(), count) {
                continue;
            }
            is_finished = false;
            let frames: Vec<u64> = frames.take(*burst as usize).collect();
            if !*is_still {
                session.forget();
            }
            let processor_begin_ms = processor_ms();
            let begin = Instant::now();
            render(session, frames)?;
            times.wall_ms.push(per_frame(ms(begin.elapsed())));
            times
                .processor_ms
                .extend(processor_begin_ms.zip(processor_ms()).map(|(begin, end)| per_frame(end - begin)));
        }
        if is_finished {
            break;
        }
    }
    Ok(running.into_iter().map(|(.., measured)| measured).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slow_variants_have_fewer_rounds() {
        let limits = RoundLimits { burst: 2, min_rounds: 3, max_rounds: 9, budget: Duration::from_secs(10) };
        let rounds = |round_ms: f64| {
            (0..).take_while(|&round| limits.has_round(round, round_ms * round as f64, 10)).count()
        };
        // The part of each is one second: 3 rounds of 2 s all the same, 4 rounds of 300 ms, at most 9 of 10 ms.
        assert_eq!([2000.0, 300.0, 10.0].map(rounds), [3, 4, 9]);
    }

    #[test]
    fn ratios_are_taken_over_common_rounds() {
        let times = |wall_ms: &[f64]| Times { wall_ms: wall_ms.to_vec(), ..Times::default() };
        let [slow, fast] = [times(&[20.0, 40.0, 20.0]), times(&[10.0, 20.0, 10.0, 500.0, 500.0])];
        assert_eq!(slow.ratio_quartiles(&fast), [2.0; 3]);
        assert_eq!(fast.ratio_quartiles(&slow), [0.5; 3]);
    }
}
