//! Times of several variants, measured in turn.
//!
//! A machine is never quite idle, so what is compared is measured in the same rounds: each round renders a
//! burst of frames with every variant. A time a frame is that of a burst, two frames in flight, divided by
//! its frames: plan, poses, passes and read-back are in it, files are not. What the frames of a burst share,
//! such as one ideal frame, is planned and drawn anew in each.
//!
//! The time for all of it is shared out evenly: a variant leaves when it has used its share, so that slow
//! ones have few rounds and quick ones many. Rounds that two variants have in common are the first ones of
//! both.

use std::{
    convert::Infallible,
    sync::Arc,
    time::{Duration, Instant},
};

use camsim_core::{scenario::Channel, sequence::Sequence};
use camsim_engine::{Engine, Finished, Session};

use super::BenchError;
use crate::timing::{ms, processor_ms, quantile, quartiles};

/// A frame that takes longer is measured by itself.
pub const SLOW: Duration = Duration::from_secs(1);

/// How long to measure.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Frames of a burst: enough for two in flight to pay. A frame that takes longer than [`SLOW`] is a burst
    /// of its own: what overlaps is little beside it.
    pub burst: u64,
    /// Rounds of each variant at least, whatever they take.
    pub min_rounds: usize,
    /// Rounds at most.
    pub max_rounds: usize,
    /// For all variants together; each has the same share, and leaves when it has used it.
    pub budget: Duration,
}

impl Effort {
    /// Whether one of `variants` that has spent `spent_ms` in its rounds goes on to round `round`, counted
    /// from 0.
    fn goes_on(&self, round: usize, spent_ms: f64, variants: usize) -> bool {
        round < self.min_rounds || (round < self.max_rounds && spent_ms * (variants as f64) < ms(self.budget))
    }
}

/// What was measured of one variant.
#[derive(Debug)]
pub struct Measured {
    /// Its times.
    pub times: Times,
    /// The frame [`FRAME`] (of a camera that stands still, frame 0).
    pub finished: Option<Finished>,
}

/// The frame that is handed out.
pub const FRAME: u64 = 1;

/// Milliseconds a frame of one variant, an entry a round.
#[derive(Clone, Debug, Default)]
pub struct Times {
    /// By the clock.
    pub wall_ms: Vec<f64>,
    /// On processors, over all threads; empty where it is not known.
    pub processor_ms: Vec<f64>,
    /// Session and first frames: upload, shader compilation, lens map; seconds.
    pub start_s: f64,
}

impl Times {
    /// Median and 99th percentile of the bursts, milliseconds a frame.
    #[must_use]
    pub fn p50_p99_ms(&self) -> [f64; 2] {
        [0.5, 0.99].map(|part| quantile(&self.wall_ms, part))
    }

    /// Median processor time a frame, milliseconds.
    #[must_use]
    pub fn processor_p50_ms(&self) -> Option<f64> {
        (!self.processor_ms.is_empty()).then(|| quantile(&self.processor_ms, 0.5))
    }

    /// This variant's time over another's in the rounds that both were in.
    #[must_use]
    pub fn ratios(&self, other: &Self) -> Vec<f64> {
        self.wall_ms.iter().zip(&other.wall_ms).map(|(own, other)| own / other).collect()
    }

    /// Quartiles of [`Self::ratios`].
    #[must_use]
    pub fn ratio_to(&self, other: &Self) -> [f64; 3] {
        quartiles(&self.ratios(other))
    }
}

/// Renders frames and gives the last.
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

/// Times and a frame of `variants`, in their order. Each renders the frames of its sequence over and over;
/// those of which `still` says so render one frame, so that its ideal frame is drawn once and kept.
///
/// # Errors
/// Whatever the renderer meets.
pub fn measure(
    engine: &Engine,
    variants: &[(Arc<Sequence>, bool)],
    effort: Effort,
) -> Result<Vec<Measured>, BenchError> {
    let mut running = Vec::new();
    for (sequence, still) in variants {
        let begin = Instant::now();
        let mut session = engine.session::<Infallible>(sequence.clone(), &[Channel::Color])?;
        let before_first = begin.elapsed();
        // The first dispatch of a pipeline compiles it.
        let finished = render(&mut session, [if *still { 0 } else { FRAME }])?;
        let burst = if begin.elapsed() - before_first > SLOW { 1 } else { effort.burst };
        let times = Times { start_s: begin.elapsed().as_secs_f64(), ..Times::default() };
        let frames = (0..).map(move |k| if *still { 0 } else { k % sequence.frames.max(1) });
        running.push((session, frames, *still, burst, Measured { times, finished }));
    }
    let count = running.len();
    for round in 0..effort.max_rounds {
        let mut any = false;
        // Each variant takes each place in the round once in a while.
        for place in 0..count {
            let (session, frames, still, burst, Measured { times, .. }) =
                &mut running[(place + round) % count];
            let a_frame = |sum_ms: f64| sum_ms / *burst as f64;
            if !effort.goes_on(round, *burst as f64 * times.wall_ms.iter().sum::<f64>(), count) {
                continue;
            }
            any = true;
            let frames: Vec<u64> = frames.take(*burst as usize).collect();
            if !*still {
                session.forget();
            }
            let busy = processor_ms();
            let begin = Instant::now();
            render(session, frames)?;
            times.wall_ms.push(a_frame(ms(begin.elapsed())));
            times
                .processor_ms
                .extend(busy.zip(processor_ms()).map(|(before, after)| a_frame(after - before)));
        }
        if !any {
            break;
        }
    }
    Ok(running.into_iter().map(|(.., measured)| measured).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slow_variants_leave_early_and_quick_ones_stay() {
        let effort = Effort { burst: 2, min_rounds: 3, max_rounds: 9, budget: Duration::from_secs(10) };
        let rounds = |ms_a_round: f64| {
            (0..).take_while(|&round| effort.goes_on(round, ms_a_round * round as f64, 10)).count()
        };
        // A second each: 3 rounds of 2 s all the same, 4 rounds of 300 ms, no more than 9 of 10 ms.
        assert_eq!([2000.0, 300.0, 10.0].map(rounds), [3, 4, 9]);
    }

    #[test]
    fn ratios_are_of_the_rounds_that_both_were_in() {
        let times = |wall_ms: &[f64]| Times { wall_ms: wall_ms.to_vec(), ..Times::default() };
        let [slow, quick] = [times(&[20.0, 40.0, 20.0]), times(&[10.0, 20.0, 10.0, 500.0, 500.0])];
        assert_eq!(slow.ratio_to(&quick), [2.0; 3]);
        assert_eq!(quick.ratio_to(&slow), [0.5; 3]);
    }
}
