//! The rows of one case.

use std::{collections::HashMap, sync::Arc};

use camsim_core::{
    scenario::{Channel, Preset},
    sequence::Sequence,
};
use camsim_engine::{Engine, RenderError};
use camsim_plan::{FramePlan, Planner, Predicted};

use super::{
    BenchError, Compared, Row,
    methods::{DEFAULT_METHOD, Method, MethodFamily},
    rounds::{self, FRAME, RoundLimits, TimedSequence},
    truth::Truth,
};
use crate::cases::Case;

/// The plans of one method.
struct MethodPlans {
    planner: Planner,
    texts: HashMap<u64, String>,
    plan: FramePlan,
}

impl MethodPlans {
    fn new(engine: &Engine, sequence: &Arc<Sequence>) -> Result<Self, BenchError> {
        let planner = Planner::new(sequence.clone(), &[Channel::Color], engine.max_side_px())
            .map_err(RenderError::from)?;
        let plan = planner.plan(FRAME).map_err(RenderError::from)?;
        Ok(Self { planner, texts: HashMap::from([(FRAME, plan_text(plan.clone()))]), plan })
    }

    fn text(&mut self, frame: u64) -> Result<&str, BenchError> {
        if !self.texts.contains_key(&frame) {
            self.texts.insert(frame, plan_text(self.planner.plan(frame).map_err(RenderError::from)?));
        }
        Ok(&self.texts[&frame])
    }

    fn are_same(&mut self, other: &mut Self, frames: u64) -> Result<bool, BenchError> {
        // The frame that both have planned comes first.
        for frame in [FRAME].into_iter().chain(0..frames) {
            if self.text(frame)? != other.text(frame)? {
                return Ok(false);
            }
        }
        Ok(true)
    }
}

/// Every field of a plan that the renderer uses, including those added later: all fields but the ones that
/// only inform the user.
fn plan_text(plan: FramePlan) -> String {
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

/// For each method, the index of the first one with the same plans, which may be its own. The renderer gets
/// `quality` only through the plans, so methods with the same plans have the same pictures and times.
fn first_with_same_plans(methods: &mut [MethodPlans], frames: u64) -> Result<Vec<usize>, BenchError> {
    let mut first: Vec<usize> = Vec::new();
    for i in 0..methods.len() {
        let (above, rest) = methods.split_at_mut(i);
        let mut same = i;
        for (k, method) in above.iter_mut().enumerate().filter(|(k, _)| first[*k] == *k) {
            if rest[0].are_same(method, frames)? {
                same = k;
                break;
            }
        }
        first.push(same);
    }
    Ok(first)
}

/// Whether a family of methods changes source coordinates, so that they are compared with the truth.
fn changes_sources(family: MethodFamily) -> bool {
    use MethodFamily::{Blur, KeyFrames, Paper, Silhouettes, Size, Solver, Taps, Tolerance};
    match family {
        Tolerance | Paper | Solver | KeyFrames | Silhouettes => true,
        Blur | Taps | Size => false,
    }
}

/// Measures the rows of a case, on `engine` and in the same rounds on the renderers in `compared`. Methods
/// with the same plans are rendered once. Rows of another frame size than the case's are timed only.
///
/// # Errors
/// Any error of rendering or of the reference renderer.
pub fn rows(
    engine: &Engine,
    compared: &[Compared<'_>],
    case: &Case,
    methods: &[Method],
    limits: RoundLimits,
) -> Result<Vec<Row>, BenchError> {
    let mut plans = methods
        .iter()
        .map(|method| MethodPlans::new(engine, &method.sequence))
        .collect::<Result<Vec<_>, _>>()?;
    let first = first_with_same_plans(&mut plans, case.sequence.frames)?;
    let rendered: Vec<usize> = (0..methods.len()).filter(|&i| first[i] == i).collect();
    let engines: Vec<Option<&Engine>> =
        [Some(engine)].into_iter().chain(compared.iter().map(|compared| compared.engine)).collect();
    let timed: Vec<((usize, usize), TimedSequence<'_>)> = rendered
        .iter()
        .flat_map(|&i| engines.iter().enumerate().map(move |(k, engine)| ((i, k), *engine)))
        .filter_map(|((i, k), engine)| {
            let sequence = methods[i].sequence.clone();
            Some(((i, k), TimedSequence { engine: engine?, sequence, is_still: false }))
        })
        .collect();
    let (keys, timed): (Vec<_>, Vec<_>) = timed.into_iter().unzip();
    let measured: HashMap<(usize, usize), _> =
        keys.into_iter().zip(rounds::measure(&timed, limits)?).collect();
    let default = methods.iter().position(|method| method.name == DEFAULT_METHOD);
    let default = default.map(|i| &measured[&(first[i], 0)].times);
    let truth = Truth::new(&with_default_quality(&case.sequence))?;
    let mut rows: Vec<Row> = Vec::new();
    for (i, method) in methods.iter().enumerate() {
        let scenario = &method.sequence.scenario;
        let mut row = match first[i] {
            same if same < i => Row { same_as: Some(rows[same].knob.clone()), ..rows[same].clone() },
            _ => {
                let mut row = Row::empty(case.name, scenario.camera.size_px);
                row.set_times(&measured[&(i, 0)].times, default);
                row.compared_ms = (1..engines.len())
                    .map(|k| measured.get(&(i, k)).map(|measured| measured.times.p50_p99_ms()[0]))
                    .collect();
                if scenario.camera.size_px == case.sequence.scenario.camera.size_px {
                    if let Some(finished) = &measured[&(i, 0)].finished {
                        row.set_picture_errors(&truth.picture_errors(&finished.frame));
                    }
                    if changes_sources(method.family)
                        && let Some(errors) = truth.coord_errors(engine, &method.sequence)?
                    {
                        row.set_coord_errors(&errors);
                    }
                }
                row
            }
        };
        row.knob = method.name.clone();
        row.family = method.family;
        row.group = case.group.name();
        row.preset = if scenario.quality.preset == Preset::Paper { "paper" } else { "default" };
        row.set_plan(&plans[i].plan);
        rows.push(row);
    }
    Ok(rows)
}

/// The sequence with the default quality, which the truth does not depend on.
fn with_default_quality(sequence: &Arc<Sequence>) -> Arc<Sequence> {
    let mut sequence = (**sequence).clone();
    sequence.scenario.quality = Default::default();
    Arc::new(sequence)
}
