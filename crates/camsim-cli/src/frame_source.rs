//! Renderers of a run: the engine, or the reference renderer.

use std::sync::Arc;

use anyhow::anyhow;
use camsim_core::{
    reference::{ReferenceRenderer, RenderOptions},
    scenario::{Auto, Preset, Scenario, Solver},
    scene::LodSelection,
    sequence::Sequence,
    validate::validate,
};
use camsim_engine::{CameraReference, Engine, Finished, FrameTimes, Session};
use camsim_io::write::WriteError;
use camsim_plan::{FramePlan, PlanError, Planner};

use crate::failure::{Failure, OrFail};

/// Receives finished frames in order.
pub type Sink<'s> = dyn FnMut(Finished) -> Result<(), WriteError> + 's;

/// Something that renders frames of one sequence.
pub trait FrameSource {
    /// Name of the renderer, for users.
    fn adapter(&self) -> String;

    /// The planner of the sequence.
    fn planner(&self) -> &Planner;

    /// A planner that knows what moves, too.
    fn scene_planner(&self) -> &Planner {
        self.planner()
    }

    /// A planner of another sequence with the same scene.
    fn planner_of(&self, sequence: &Arc<Sequence>) -> Result<Planner, PlanError>;

    /// Turns to another sequence, whose frames are those of a new source. What belongs to the scene is kept if
    /// it is the same [`Arc`].
    fn renew(&mut self, sequence: &Arc<Sequence>) -> Result<(), Failure>;

    /// Renders frames in the given order and passes each to `sink`.
    fn render(&mut self, frames: &[u64], sink: &mut Sink<'_>) -> Result<(), Failure>;
}

/// The engine: cpu or gpu renderer.
#[derive(Debug)]
pub struct EngineSource<'a> {
    engine: &'a Engine,
    session: Session<'a>,
}

impl<'a> EngineSource<'a> {
    /// Opens a session, which uploads the scene if a gpu renders it.
    pub fn new(engine: &'a Engine, sequence: &Arc<Sequence>) -> Result<Self, Failure> {
        let session = engine.session::<WriteError>(sequence.clone(), &sequence.scenario.output.channels)?;
        Ok(Self { engine, session })
    }

    /// Measures the time of each gpu pass, if the adapter has time stamps.
    pub fn time_passes(&mut self) {
        self.session.time_passes();
    }
}

impl FrameSource for EngineSource<'_> {
    fn adapter(&self) -> String {
        self.engine.to_string()
    }

    fn planner(&self) -> &Planner {
        self.session.planner()
    }

    fn scene_planner(&self) -> &Planner {
        self.session.scene_planner()
    }

    fn planner_of(&self, sequence: &Arc<Sequence>) -> Result<Planner, PlanError> {
        self.session.planner().renewed(sequence.clone(), &sequence.scenario.output.channels)
    }

    fn renew(&mut self, sequence: &Arc<Sequence>) -> Result<(), Failure> {
        let channels = &sequence.scenario.output.channels;
        Ok(self.session.renew::<WriteError>(sequence.clone(), channels)?)
    }

    fn render(&mut self, frames: &[u64], sink: &mut Sink<'_>) -> Result<(), Failure> {
        Ok(self.session.render(frames.iter().copied(), sink)?)
    }
}

/// Whether a scenario is rendered by the reference renderer.
#[must_use]
pub fn is_reference(scenario: &Scenario) -> bool {
    scenario.quality.solver == Auto::Value(Solver::Reference)
}

/// The scenario with the reference renderer as a part of it.
///
/// # Errors
/// It names another method.
pub fn with_reference(mut scenario: Scenario) -> Result<Scenario, Failure> {
    let refused = |what: &str| {
        Err(Failure::bad_input(anyhow!(
            "{what} cannot be combined with --backend reference, which always casts exact rays: leave \
             --backend out, or use the default preset and solver (--preset default --set quality.solver=auto)"
        )))
    };
    if scenario.quality.preset == Preset::Paper {
        return refused("quality.preset = \"paper\"");
    }
    match scenario.quality.solver {
        Auto::Auto | Auto::Value(Solver::Reference) => {
            scenario.quality.solver = Auto::Value(Solver::Reference)
        }
        Auto::Value(Solver::Linear) => return refused("quality.solver = \"linear\""),
        Auto::Value(Solver::Rk2) => return refused("quality.solver = \"rk2\""),
        Auto::Value(Solver::Reproject) => return refused("quality.solver = \"reproject\""),
    }
    // Keys that are valid with `auto` but not with the reference.
    match validate(&scenario).first() {
        Some(problem) => Err(Failure::bad_input(anyhow!(
            "{problem} (--backend reference is quality.solver = \"reference\")"
        ))),
        None => Ok(scenario),
    }
}

/// Standard error of a reference pixel, as a fraction of `quality.max_error_dn`.
const SHARE_OF_TOLERANCE: f64 = 0.25;

/// Side limit of ideal frames, which are not drawn here.
const MAX_IDEAL_SIDE_PX: u32 = 1 << 30;

/// The reference renderer. Plans only determine the ideal frame of the source coordinates, as the engine
/// would choose it.
#[derive(Debug)]
pub struct ReferenceSource {
    reference: CameraReference,
    planner: Planner,
    options: RenderOptions,
}

impl ReferenceSource {
    /// Builds the ray-casting structures.
    pub fn new(sequence: &Arc<Sequence>) -> Result<Self, Failure> {
        let planned = planned(sequence);
        let planner = Planner::new(planned, &sequence.scenario.output.channels, MAX_IDEAL_SIDE_PX)
            .or_bad_input()?
            .with_ideals_of_any_area();
        Self::with_planner(sequence, planner)
    }

    fn with_planner(sequence: &Arc<Sequence>, planner: Planner) -> Result<Self, Failure> {
        let scenario = &sequence.scenario;
        let options = RenderOptions {
            channels: scenario.output.channels.clone(),
            tolerance_dn: SHARE_OF_TOLERANCE * scenario.quality.max_error_dn,
            ..RenderOptions::default()
        };
        let reference = CameraReference::new(sequence.clone(), &options.channels).or_bad_input()?;
        Ok(Self { reference, planner, options })
    }

    fn finished(&self, reference: &ReferenceRenderer, plan: FramePlan) -> Finished {
        let options = RenderOptions { key: Some(plan.ideal_view()), ..self.options.clone() };
        Finished {
            frame: reference.render(plan.frame, &options),
            plan,
            faces: Vec::new(),
            lod: LodSelection::default(),
            out_of_order: 0,
            times: FrameTimes::default(),
        }
    }
}

/// The sequence as the engine would plan it.
fn planned(sequence: &Sequence) -> Arc<Sequence> {
    let mut planned = sequence.clone();
    planned.scenario.quality.solver = Auto::Auto;
    Arc::new(planned)
}

impl FrameSource for ReferenceSource {
    fn adapter(&self) -> String {
        ReferenceRenderer::describe()
    }

    fn planner(&self) -> &Planner {
        &self.planner
    }

    fn planner_of(&self, sequence: &Arc<Sequence>) -> Result<Planner, PlanError> {
        let planner = self.planner.renewed(planned(sequence), &sequence.scenario.output.channels)?;
        Ok(planner.with_ideals_of_any_area())
    }

    fn renew(&mut self, sequence: &Arc<Sequence>) -> Result<(), Failure> {
        *self = Self::with_planner(sequence, self.planner_of(sequence).or_bad_input()?)?;
        Ok(())
    }

    fn render(&mut self, frames: &[u64], sink: &mut Sink<'_>) -> Result<(), Failure> {
        for &frame in frames {
            let plans = self.planner.plans(frame).or_bad_input()?;
            if let [plan] = plans.as_slice() {
                sink(self.finished(&self.reference.parts()[0], plan.clone())).or_failed()?;
                continue;
            }
            let rows = plans.first().map(|plan| self.planner.rows(plan)).unwrap_or_default();
            let plans = plans.into_iter().flat_map(|plan| {
                let others: Vec<FramePlan> = plan.other_colors().collect();
                std::iter::once(plan).chain(others)
            });
            let parts = self.reference.parts().iter().zip(plans);
            let parts = parts.map(|(reference, plan)| self.finished(reference, plan));
            if let Some(mut whole) = self.reference.joined(parts) {
                whole.frame.rows = rows;
                sink(whole).or_failed()?;
            }
        }
        Ok(())
    }
}
