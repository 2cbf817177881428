//! Variants in turn, and the table of what came out.
//!
//! A machine is never quite idle, so what is compared is measured in turn: each round renders the same few
//! frames with every variant, and differences and ratios are medians over the rounds of those *in the same
//! round*. A time a frame is that of a burst, two frames in flight, divided by its frames: plan, poses,
//! passes and read-back are in it, files are not. On Linux the time that this program's threads had a
//! processor stands beside it: with a software adapter that is the work itself, whatever else runs.

use std::{
    convert::Infallible,
    sync::Arc,
    time::{Duration, Instant},
};

use camsim::{
    core::{scenario::Channel, sequence::Sequence},
    engine::{Engine, Session},
    lab::timing::{ms, processor_ms, quartiles},
};

use super::Outcome;

/// How long a table may take.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Frames of a burst.
    pub burst: u64,
    /// Rounds, unless time runs out before.
    pub rounds: usize,
    /// No round begins after this.
    pub budget: Duration,
}

impl Effort {
    /// One frame of each, to see that it works: anything but `cargo bench` runs the program for that alone.
    pub const TRY: Self = Self { burst: 1, rounds: 1, budget: Duration::from_secs(1) };
}

/// One row of a table.
pub struct Variant<'a> {
    pub name: String,
    pub session: Session<'a>,
    /// Renders one frame over and over: its ideal frame is drawn once and kept.
    pub still: bool,
    /// Session and first frames: upload, pipelines, lens map.
    pub start: Duration,
    /// Milliseconds a frame, one entry a round.
    pub ms: Vec<f64>,
    /// The same on processors, over all threads.
    pub processor_ms: Vec<f64>,
}

impl<'a> Variant<'a> {
    /// Opens a session and renders two frames: the first dispatch of a pipeline compiles it.
    pub fn open(
        name: impl Into<String>,
        engine: &'a Engine,
        sequence: Arc<Sequence>,
        channels: &[Channel],
    ) -> Outcome<Self> {
        let begin = Instant::now();
        let mut session = engine.session::<Infallible>(sequence, channels)?;
        render(&mut session, 0..2)?;
        Ok(Self {
            name: name.into(),
            session,
            still: false,
            start: begin.elapsed(),
            ms: Vec::new(),
            processor_ms: Vec::new(),
        })
    }
}

/// Rounds in which each variant renders the same frames, of the `frames` that there are.
pub fn measure(variants: &mut [Variant<'_>], frames: u64, effort: Effort) -> Outcome<()> {
    let Effort { burst, rounds, budget } = effort;
    let begin = Instant::now();
    for round in 0..rounds {
        if begin.elapsed() > budget {
            break;
        }
        let first = (round as u64 * burst) % (frames / burst * burst);
        // Each variant takes each place in the round once in a while.
        let count = variants.len();
        for place in 0..count {
            let variant = &mut variants[(place + round) % count];
            if variant.still {
                render(&mut variant.session, [first])?;
            } else {
                variant.session.forget();
            }
            let busy = processor_ms();
            let begin = Instant::now();
            render(
                &mut variant.session,
                (first..first + burst).map(|frame| if variant.still { first } else { frame }),
            )?;
            variant.ms.push(ms(begin.elapsed()) / burst as f64);
            variant
                .processor_ms
                .extend(busy.zip(processor_ms()).map(|(before, after)| (after - before) / burst as f64));
        }
    }
    Ok(())
}

fn render(session: &mut Session<'_>, frames: impl IntoIterator<Item = u64>) -> Outcome<()> {
    Ok(session.render::<Infallible>(frames, &mut |finished| {
        std::hint::black_box(finished);
        Ok(())
    })?)
}

/// What a variant's row says about its times.
pub fn times(variant: &Variant<'_>, first: &Variant<'_>) -> [String; 5] {
    let rate = format!("{:.1}", 1e3 / quartiles(&variant.ms)[1]);
    let [wall, processor] = [(&variant.ms, &first.ms), (&variant.processor_ms, &first.processor_ms)]
        .map(|(own, first)| against(own, first));
    [wall.0, rate, wall.1, processor.0, processor.1]
}

/// Median and quartiles, and the median of the differences within the rounds.
fn against(own: &[f64], first: &[f64]) -> (String, String) {
    if own.is_empty() {
        return ("not known".to_owned(), String::new());
    }
    let [low, median, high] = quartiles(own);
    let [_, difference, _] =
        quartiles(&own.iter().zip(first).map(|(own, first)| own - first).collect::<Vec<_>>());
    (format!("{median:.1} ({low:.1} .. {high:.1})"), format!("{difference:+.1}"))
}

/// Median of the ratios to another variant's times, within the rounds.
pub fn ratio(own: &[f64], other: &[f64]) -> f64 {
    quartiles(&own.iter().zip(other).map(|(own, other)| own / other).collect::<Vec<_>>())[1]
}

/// The line above a table.
pub fn say_rounds(variants: &[Variant<'_>], effort: Effort) -> String {
    format!(
        "\nrounds    {} of {} frames, variants in turn; medians, quartiles in brackets\n",
        variants[0].ms.len(),
        effort.burst
    )
}
