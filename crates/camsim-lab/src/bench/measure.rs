//! The rows of one case.

use std::{collections::HashMap, sync::Arc};

use camsim_core::{
    scenario::{Channel, Preset},
    sequence::Sequence,
};
use camsim_engine::{Engine, RenderError};
use camsim_plan::{FramePlan, Planner, Predicted};

use super::{
    BenchError, Row,
    knobs::{DEFAULT, Family, Variant},
    rounds::{self, Effort, FRAME},
    truth::Truth,
};
use crate::cases::Case;

/// What one row does, frame by frame.
struct Work {
    planner: Planner,
    texts: HashMap<u64, String>,
    plan: FramePlan,
}

impl Work {
    fn new(engine: &Engine, sequence: &Arc<Sequence>) -> Result<Self, BenchError> {
        let planner = Planner::new(sequence.clone(), &[Channel::Color], engine.max_side_px())
            .map_err(RenderError::from)?;
        let plan = planner.plan(FRAME).map_err(RenderError::from)?;
        Ok(Self { planner, texts: HashMap::from([(FRAME, text(plan.clone()))]), plan })
    }

    fn text(&mut self, frame: u64) -> Result<&str, BenchError> {
        if !self.texts.contains_key(&frame) {
            self.texts.insert(frame, text(self.planner.plan(frame).map_err(RenderError::from)?));
        }
        Ok(&self.texts[&frame])
    }

    fn is_same(&mut self, other: &mut Self, frames: u64) -> Result<bool, BenchError> {
        // The frame that both have planned comes first.
        for frame in [FRAME].into_iter().chain(0..frames) {
            if self.text(frame)? != other.text(frame)? {
                return Ok(false);
            }
        }
        Ok(true)
    }
}

/// What the renderer does for a plan: every field, so that one added later counts, but those that are only
/// told to the user.
fn text(plan: FramePlan) -> String {
    format!(
        "{:?}",
        FramePlan {
            predicted: Predicted::default(),
            skipped: Vec::new(),
            price_ms: 0.0,
            ideal_price_ms: 0.0,
            ..plan
        }
    )
}

/// For each variant the first one with the same plans: itself, or one above it. The renderer knows of
/// `quality` only what is in the plans.
fn first_alike(works: &mut [Work], frames: u64) -> Result<Vec<usize>, BenchError> {
    let mut first: Vec<usize> = Vec::new();
    for i in 0..works.len() {
        let (above, rest) = works.split_at_mut(i);
        let mut alike = i;
        for (k, work) in above.iter_mut().enumerate().filter(|(k, _)| first[*k] == *k) {
            if rest[0].is_same(work, frames)? {
                alike = k;
                break;
            }
        }
        first.push(alike);
    }
    Ok(first)
}

/// Whether the sources of the pixels depend on what a row varies, and are looked at.
fn moves_sources(family: Family) -> bool {
    match family {
        Family::Tolerance | Family::Paper | Family::Solver | Family::KeyFrames | Family::Silhouettes => true,
        Family::Blur | Family::Taps | Family::Size => false,
    }
}

/// Measures the rows of a case. Rows with the same plans are rendered once. Rows of another size than the
/// case's are timed only.
///
/// # Errors
/// Whatever the renderer or the oracle meets.
pub fn case(
    engine: &Engine,
    case: &Case,
    variants: &[Variant],
    effort: Effort,
) -> Result<Vec<Row>, BenchError> {
    let mut works =
        variants.iter().map(|variant| Work::new(engine, &variant.sequence)).collect::<Result<Vec<_>, _>>()?;
    let first = first_alike(&mut works, case.sequence.frames)?;
    let rendered: Vec<usize> = (0..variants.len()).filter(|&i| first[i] == i).collect();
    let timed: Vec<_> = rendered.iter().map(|&i| (variants[i].sequence.clone(), false)).collect();
    let measured: HashMap<usize, _> =
        rendered.iter().copied().zip(rounds::measure(engine, &timed, effort)?).collect();
    let default =
        variants.iter().position(|variant| variant.knob == DEFAULT).map(|i| &measured[&first[i]].times);
    let truth = Truth::new(&of_truth(&case.sequence))?;
    let mut rows: Vec<Row> = Vec::new();
    for (i, variant) in variants.iter().enumerate() {
        let scenario = &variant.sequence.scenario;
        let mut row = match first[i] {
            alike if alike < i => Row { same_as: Some(rows[alike].knob.clone()), ..rows[alike].clone() },
            _ => {
                let mut row = Row::empty(case.name, scenario.camera.size_px);
                row.set_times(&measured[&i].times, default);
                if scenario.camera.size_px == case.sequence.scenario.camera.size_px {
                    if let Some(finished) = &measured[&i].finished {
                        row.set_picture_errors(&truth.picture_errors(&finished.frame));
                    }
                    if moves_sources(variant.family)
                        && let Some(errors) = truth.coord_errors(engine, &variant.sequence)?
                    {
                        row.set_coord_errors(&errors);
                    }
                }
                row
            }
        };
        row.knob = variant.knob.clone();
        row.family = variant.family;
        row.group = case.group.name();
        row.preset = if scenario.quality.preset == Preset::Paper { "paper" } else { "default" };
        row.set_plan(&works[i].plan);
        rows.push(row);
    }
    Ok(rows)
}

/// The sequence without anything that concerns how it is rendered.
fn of_truth(sequence: &Arc<Sequence>) -> Arc<Sequence> {
    let mut sequence = (**sequence).clone();
    sequence.scenario.quality = Default::default();
    Arc::new(sequence)
}
