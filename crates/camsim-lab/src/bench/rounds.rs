//! Times of several variants, measured in turn.
//!
//! A machine is never quite idle, so what is compared is measured in the same rounds: each round renders a burst of frames with every
//! variant. A time a frame is that of a burst, two frames in flight, divided by its frames: plan, poses, passes and read-back are in it,
//! files are not.

use std::{
    convert::Infallible,
    sync::Arc,
    time::{Duration, Instant},
};

use camsim_core::{scenario::Channel, sequence::Sequence};
use camsim_gpu::{Engine, engine::Session};

use super::BenchError;
use crate::timing::{ms, processor_ms, quantile, quartiles};

/// How long to measure.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Frames of a burst: enough for two in flight to pay.
    pub burst: u64,
    /// Rounds at least, whatever they take.
    pub min_rounds: usize,
    /// Rounds at most.
    pub max_rounds: usize,
    /// No round beyond the least number begins after this.
    pub budget: Duration,
}

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

    /// Quartiles of this variant's time over another's in the same round.
    #[must_use]
    pub fn ratio_to(&self, other: &Self) -> [f64; 3] {
        quartiles(&self.wall_ms.iter().zip(&other.wall_ms).map(|(own, other)| own / other).collect::<Vec<_>>())
    }
}

/// Renders frames and drops them.
fn render(session: &mut Session<'_>, frames: impl IntoIterator<Item = u64>) -> Result<(), BenchError> {
    Ok(session.render::<Infallible>(frames, &mut |finished| {
        std::hint::black_box(finished);
        Ok(())
    })?)
}

/// Times of `variants`, in their order. Each renders the frames of its sequence over and over; those of which `still` says so render one
/// frame, so that its ideal frame is drawn once and kept.
///
/// # Errors
/// Whatever the renderer meets.
pub fn measure(engine: &Engine, variants: &[(Arc<Sequence>, bool)], effort: Effort) -> Result<Vec<Times>, BenchError> {
    let mut running = Vec::new();
    for (sequence, still) in variants {
        let begin = Instant::now();
        let mut session = engine.session::<Infallible>(sequence.clone(), &[Channel::Color])?;
        // The first dispatch of a pipeline compiles it.
        render(&mut session, [0, if *still { 0 } else { 1 }])?;
        let times = Times { start_s: begin.elapsed().as_secs_f64(), ..Times::default() };
        running.push((session, *still, 2_u64, sequence.frames.max(1), times));
    }
    let begin = Instant::now();
    for round in 0..effort.max_rounds {
        if round >= effort.min_rounds && begin.elapsed() > effort.budget {
            break;
        }
        // Each variant takes each place in the round once in a while.
        let count = running.len();
        for place in 0..count {
            let (session, still, next, frames, times) = &mut running[(place + round) % count];
            let burst: Vec<u64> = (0..effort.burst).map(|k| if *still { 0 } else { (*next + k) % *frames }).collect();
            *next += effort.burst;
            let busy = processor_ms();
            let begin = Instant::now();
            render(session, burst)?;
            times.wall_ms.push(ms(begin.elapsed()) / effort.burst as f64);
            times.processor_ms.extend(busy.zip(processor_ms()).map(|(before, after)| (after - before) / effort.burst as f64));
        }
    }
    Ok(running.into_iter().map(|(.., times)| times).collect())
}
