//! Measures variants in turn.
//!
//! Other programs disturb measurements. So each round renders the same few frames with every variant, and
//! differences and ratios are medians over the rounds of values from *the same round*. The time of a frame is
//! that of a burst, two frames in flight, divided by the number of its frames: it contains plan, poses,
//! passes and read-back, no files. On Unix the processor time of this program's threads is measured too:
//! without a graphics card it is the whole work and depends little on other programs.

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
pub struct RoundLimits {
    /// Frames in a burst.
    pub burst: u64,
    /// Largest number of rounds.
    pub rounds: usize,
    /// Time after which no round begins.
    pub budget: Duration,
}

impl RoundLimits {
    /// One frame of each variant, for runs that only check that the program works.
    pub const SMOKE_TEST: Self = Self { burst: 1, rounds: 1, budget: Duration::from_secs(1) };

    /// These limits if the program measures, otherwise [`Self::SMOKE_TEST`].
    pub fn or_smoke_test(self, is_measuring: bool) -> Self {
        if is_measuring { self } else { Self::SMOKE_TEST }
    }
}

/// A camera on one renderer, with its measured times.
pub struct Variant<'a> {
    pub session: Session<'a>,
    /// The channels of the session.
    pub channels: Vec<Channel>,
    /// Cameras of a rig, which the session renders in turn; none if it has one camera.
    pub rig: Vec<Arc<Sequence>>,
    /// Whether one frame is rendered over and over, so that its ideal frame is drawn once.
    pub is_still: bool,
    /// Time to open the session and render two frames: upload, pipelines, lens map.
    pub start: Duration,
    /// Milliseconds per frame, one entry per round.
    pub ms: Vec<f64>,
    /// Processor milliseconds per frame over all threads, one entry per round.
    pub processor_ms: Vec<f64>,
}

impl<'a> Variant<'a> {
    /// Opens a session and renders two frames: the first dispatch of a pipeline compiles it.
    pub fn open(engine: &'a Engine, sequence: Arc<Sequence>, channels: &[Channel]) -> Outcome<Self> {
        let begin = Instant::now();
        let mut session = engine.session::<Infallible>(sequence, channels)?;
        render(&mut session, 0..2)?;
        Ok(Self {
            session,
            channels: channels.into(),
            rig: Vec::new(),
            is_still: false,
            start: begin.elapsed(),
            ms: Vec::new(),
            processor_ms: Vec::new(),
        })
    }

    /// Does the same with each camera of the rig, or with the only one. Pipelines, textures and what is known of
    /// the scene stay from camera to camera, as in `camsim render`; a frame is rendered for the lens map.
    pub fn each_camera<T>(
        &mut self,
        mut work: impl FnMut(&mut Session<'a>) -> Outcome<T>,
    ) -> Outcome<Vec<T>> {
        if self.rig.is_empty() {
            return Ok(vec![work(&mut self.session)?]);
        }
        let turn_to = |camera: &Arc<Sequence>| {
            self.session.renew::<Infallible>(camera.clone(), &self.channels)?;
            render(&mut self.session, [0])?;
            work(&mut self.session)
        };
        self.rig.iter().map(turn_to).collect()
    }
}

/// Renders the same frames, below `frames`, with each variant in each round.
pub fn measure(variants: &mut [Variant<'_>], frames: u64, limits: RoundLimits) -> Outcome<()> {
    let RoundLimits { burst, rounds, budget } = limits;
    let begin = Instant::now();
    for round in 0..rounds {
        if begin.elapsed() > budget {
            break;
        }
        let first = (round as u64 * burst) % (frames / burst * burst);
        // The order rotates from round to round.
        let count = variants.len();
        for place in 0..count {
            let variant = &mut variants[(place + round) % count];
            let is_still = variant.is_still;
            let times = variant.each_camera(|session| {
                if is_still {
                    render(session, [first])?;
                } else {
                    session.forget();
                }
                let processor_begin_ms = processor_ms();
                let begin = Instant::now();
                render(session, (first..first + burst).map(|frame| if is_still { first } else { frame }))?;
                let passed_ms = ms(begin.elapsed());
                Ok((passed_ms, processor_begin_ms.zip(processor_ms()).map(|(begin, end)| end - begin)))
            })?;
            let frames = (burst * times.len() as u64) as f64;
            variant.ms.push(times.iter().map(|(ms, _)| ms).sum::<f64>() / frames);
            let processor_ms: Option<f64> = times.iter().map(|(_, ms)| *ms).sum();
            variant.processor_ms.extend(processor_ms.map(|ms| ms / frames));
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

/// Median over the rounds of the ratio of two variants' times.
pub fn median_ratio(numerator: &[f64], denominator: &[f64]) -> f64 {
    quartiles(&numerator.iter().zip(denominator).map(|(a, b)| a / b).collect::<Vec<_>>())[1]
}

/// The line above a table.
pub fn rounds_text(variants: &[Variant<'_>], limits: RoundLimits) -> String {
    let rounds = variants.first().map_or(0, |variant| variant.ms.len());
    format!(
        "\nrounds    {rounds} of {} frames, all variants in turn; medians, quartiles in brackets",
        limits.burst
    )
}
