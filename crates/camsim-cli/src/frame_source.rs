//! What renders the frames of a run: the engine on a device, or the oracle's rays on the CPU.

use std::sync::Arc;

use camsim_core::{
    reference::{Oracle, RenderOptions},
    scenario::Auto,
    scene::LodSelection,
    sequence::Sequence,
};
use camsim_engine::{Engine, Finished, FrameTimes, Session};
use camsim_io::write::WriteError;
use camsim_plan::Planner;

use crate::failure::{Failure, OrFail};

/// Takes finished frames in order.
pub type Sink<'s> = dyn FnMut(Finished) -> Result<(), WriteError> + 's;

/// Something that renders frames of one sequence.
pub trait FrameSource {
    /// What renders, for people.
    fn adapter(&self) -> String;

    /// The planner of the sequence.
    fn planner(&self) -> &Planner;

    /// Renders frames in the order asked for and hands each to `sink`.
    fn render(&mut self, frames: &[u64], sink: &mut Sink<'_>) -> Result<(), Failure>;
}

/// The engine.
#[derive(Debug)]
pub struct Device<'a> {
    engine: &'a Engine,
    session: Session<'a>,
}

impl<'a> Device<'a> {
    /// Uploads a sequence.
    pub fn new(engine: &'a Engine, sequence: &Arc<Sequence>) -> Result<Self, Failure> {
        let session = engine.session::<WriteError>(sequence.clone(), &sequence.scenario.output.channels)?;
        Ok(Self { engine, session })
    }

    /// From now on finished frames tell the time of their passes, if the adapter can.
    pub fn time_passes(&mut self) {
        self.session.time_passes();
    }
}

impl FrameSource for Device<'_> {
    fn adapter(&self) -> String {
        self.engine.to_string()
    }

    fn planner(&self) -> &Planner {
        self.session.planner()
    }

    fn render(&mut self, frames: &[u64], sink: &mut Sink<'_>) -> Result<(), Failure> {
        Ok(self.session.render(frames.iter().copied(), sink)?)
    }
}

/// Share of `quality.max_error_dn` that the reference leaves as the standard error of a pixel.
const SHARE_OF_TOLERANCE: f64 = 0.25;

/// No texture is made of the ideal frame, so nearly any size will do, and any number of pixels.
const MAX_IDEAL_SIDE_PX: u32 = 1 << 30;

/// The oracle. Plans only say which ideal frame source coordinates refer to: the one that the engine would
/// use.
#[derive(Debug)]
pub struct Rays {
    oracle: Oracle,
    planner: Planner,
    options: RenderOptions,
}

impl Rays {
    /// Prepares the scene for rays.
    pub fn new(sequence: &Arc<Sequence>) -> Result<Self, Failure> {
        let scenario = &sequence.scenario;
        let mut planned = Sequence::clone(sequence);
        planned.scenario.quality.solver = Auto::Auto;
        let planner = Planner::new(Arc::new(planned), &scenario.output.channels, MAX_IDEAL_SIDE_PX)
            .or_bad_input()?
            .with_ideals_of_any_area();
        let options = RenderOptions {
            channels: scenario.output.channels.clone(),
            tolerance_dn: SHARE_OF_TOLERANCE * scenario.quality.max_error_dn,
            ..RenderOptions::default()
        };
        Ok(Self { oracle: Oracle::new(sequence.clone()).or_bad_input()?, planner, options })
    }
}

impl FrameSource for Rays {
    fn adapter(&self) -> String {
        Oracle::describe()
    }

    fn planner(&self) -> &Planner {
        &self.planner
    }

    fn render(&mut self, frames: &[u64], sink: &mut Sink<'_>) -> Result<(), Failure> {
        for &frame in frames {
            let plan = self.planner.plan(frame).or_bad_input()?;
            let options = RenderOptions { key: Some(plan.ideal_view()), ..self.options.clone() };
            let frame = self.oracle.render(frame, &options);
            sink(Finished {
                frame,
                plan,
                lod: LodSelection::default(),
                out_of_order: 0,
                times: FrameTimes::default(),
            })
            .or_failed()?;
        }
        Ok(())
    }
}
