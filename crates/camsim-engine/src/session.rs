//! One sequence: its frames in the order asked for.

use std::{sync::Arc, time::Instant};

use camsim_core::{
    frame::RenderedFrame,
    pose::CameraPose,
    scenario::Channel,
    scene::{LodSelection, LodTolerance, SceneBatches},
    sequence::Sequence,
    temporal::IdealGeometry,
};
use camsim_cpu::{CpuRenderer, IdealBuffer, IdealTexels, ReverseInputs};
use camsim_gpu::{
    GpuError, GpuJob, GpuSession, IdealImages, Submitted, Wanted,
    session::{FRAMES_IN_FLIGHT, IdealCopy},
};
use camsim_plan::{
    EdgeStage, FramePlan, Planner, PrefilterTaps, Renderer,
    uniforms::{FrameUniforms, Truth, frame_uniforms},
};

use crate::{
    Engine, Finished, FrameTimes, RenderError,
    ahead::{Ahead, Prepared, Preparer},
    error::RenderErrorBase,
    exact_truth, finished, planners,
};

/// One sequence on the renderers of an engine.
#[derive(Debug)]
pub struct Session<'a> {
    engine: &'a Engine,
    planner: Arc<Planner>,
    cpu: CpuRenderer,
    gpu: Option<GpuSession<'a>>,
    drawn: Option<Drawn>,
    coords_phase: f32,
}

/// What an ideal frame depends on. Ideal frames that were drawn for the same need not be drawn again.
#[derive(Clone, Debug, PartialEq)]
struct IdealKey {
    poses: Vec<CameraPose>,
    ideal: IdealGeometry,
    edges: EdgeStage,
    terrain_error_px: f64,
    models: LodTolerance,
    surface_reads: PrefilterTaps,
    samples_a_pixel: u32,
    by: Renderer,
}

/// The ideal frames that were drawn last.
#[derive(Debug)]
struct Drawn {
    key: IdealKey,
    lod: LodSelection,
    /// Where the cpu renderer has it, if it drew it.
    buffer: Option<IdealBuffer>,
}

/// Where the ideal frame of a frame in flight is.
#[derive(Debug)]
enum Source {
    /// The gpu makes the output frame too.
    Gpu(Submitted),
    /// The gpu copies it to memory.
    Copied(Submitted, IdealCopy),
    /// The cpu has drawn it.
    Cpu(IdealBuffer),
}

/// A frame that is being worked on.
#[derive(Debug)]
struct InFlight {
    prepared: Prepared,
    uniforms: FrameUniforms,
    source: Source,
    lod: LodSelection,
    times: FrameTimes,
}

impl<'a> Session<'a> {
    pub(crate) fn new(
        engine: &'a Engine,
        sequence: Arc<Sequence>,
        channels: &[Channel],
    ) -> Result<Self, RenderErrorBase> {
        let planner = Planner::new(sequence.clone(), channels, engine.max_side_px())?;
        let planner = Arc::new(planner.with_capabilities(engine.capabilities()));
        let meshes = Arc::new(SceneBatches::new(&sequence.scene));
        let gpu = engine
            .gpu()
            .map(|gpu| GpuSession::new(gpu, &sequence, meshes.clone(), planner.wants_truth()))
            .transpose()?;
        let cpu = CpuRenderer::new(sequence.clone(), meshes);
        Ok(Self { engine, planner, cpu, gpu, drawn: None, coords_phase: 0.0 })
    }

    /// Goes on with `sequence`: the next frames are the ones that a session of its own would make, to the last
    /// bit. Fast where its scene is the one of this session (the same [`Arc`]) and its preset too: kernels and
    /// the scene's pictures stay. Otherwise everything is made anew.
    ///
    /// # Errors
    /// As [`Engine::session`]; the session then stays as it was.
    pub fn renew<E: std::error::Error + 'static>(
        &mut self,
        sequence: Arc<Sequence>,
        channels: &[Channel],
    ) -> Result<(), RenderError<E>> {
        let before = self.planner.sequence();
        let (old, new) = (&before.scenario, &sequence.scenario);
        if !Arc::ptr_eq(&before.scene, &sequence.scene) || old.quality.preset != new.quality.preset {
            *self = self.engine.session(sequence, channels)?;
            return Ok(());
        }
        let planner = Arc::new(self.planner.renewed(sequence.clone(), channels)?);
        if let Some(gpu) = &mut self.gpu {
            gpu.renew((before, self.planner.wants_truth()), &sequence, planner.wants_truth())?;
        }
        self.cpu.renew(sequence);
        self.planner = planner;
        Ok(())
    }

    /// The planner of this sequence.
    #[must_use]
    pub fn planner(&self) -> &Planner {
        &self.planner
    }

    /// Picks the instant of the exposure, in [-0.5, 0.5], at which `coords` reports source coordinates (0 =
    /// mid-exposure): what the blur stage samples can so be checked from outside.
    pub fn set_coords_phase(&mut self, phase: f32) {
        self.coords_phase = phase;
    }

    /// Has the cpu use its general code for every pass that it makes ([`CpuRenderer::set_general_only`]): for
    /// tests, before the first frame.
    #[doc(hidden)]
    pub fn set_general_cpu(&mut self, general_only: bool) {
        self.cpu.set_general_only(general_only);
    }

    /// Measures from now on how long each pass takes on the gpu; `false` without one, and where it has no time
    /// stamps.
    pub fn time_passes(&mut self) -> bool {
        self.gpu.as_mut().is_some_and(GpuSession::time_passes)
    }

    /// Forgets what was planned and drawn last, so that the next frame takes as long as if no other had been
    /// like it. No picture changes: for benchmarks, which render the same frames over and over.
    pub fn forget(&mut self) {
        self.drawn = None;
        self.gpu.iter_mut().for_each(GpuSession::forget);
        self.planner.forget();
    }

    /// Renders frames in the order asked for and hands each to `sink`. While one frame is read, the gpu works
    /// on the next, and other threads plan those that follow; `frames` is read ahead of them.
    ///
    /// # Errors
    /// The first fault of planning, device or sink; frames before it have been handed over.
    pub fn render<E: std::error::Error + 'static>(
        &mut self,
        frames: impl IntoIterator<Item = u64>,
        sink: &mut dyn FnMut(Finished) -> Result<(), E>,
    ) -> Result<(), RenderError<E>> {
        let preparer = Preparer::new(self.planner.clone(), self.gpu.as_ref().and_then(GpuSession::tiles));
        let mut frames = frames.into_iter();
        let first: Vec<u64> = frames.by_ref().take(2).collect();
        let is_single = first.len() < 2;
        planners::scope(self.engine.shares_processor(), is_single, |scope| {
            let mut ahead = Ahead::start(scope, &preparer, first.into_iter().chain(frames));
            let mut in_flight: Option<InFlight> = None;
            let mut slot = 0;
            loop {
                let submitted = match ahead.next() {
                    Some(Ok(prepared)) => self.submit(prepared, slot).map(Some),
                    Some(Err(fault)) => Err(fault.into()),
                    None => Ok(None),
                };
                slot = (slot + 1) % FRAMES_IN_FLIGHT;
                let (next, fault) = match submitted {
                    Ok(next) => (next, None),
                    Err(fault) => (None, Some(RenderError::lift(fault))),
                };
                let is_last = next.is_none();
                if let Some(done) = std::mem::replace(&mut in_flight, next)
                    && let Err(fault) = self
                        .finish(done)
                        .map_err(RenderError::Gpu)
                        .and_then(|frame| sink(frame).map_err(RenderError::Sink))
                {
                    // The frame in flight is not wanted, but its buffers can only be used again after it; a
                    // second fault is not reported.
                    let _ = in_flight.map(|unwanted| self.finish(unwanted));
                    return Err(fault);
                }
                if is_last {
                    return fault.map_or(Ok(()), Err);
                }
            }
        })
    }

    /// Draws the ideal frames of a frame, and has the gpu begin with its passes.
    fn submit(&mut self, prepared: Prepared, slot: usize) -> Result<InFlight, RenderErrorBase> {
        let plan = &prepared.plan;
        let sequence = self.planner.sequence().clone();
        let uniforms = frame_uniforms(plan, &sequence.scenario, self.coords_phase);
        let key = IdealKey {
            poses: plan.key_poses(),
            ideal: plan.ideal,
            edges: plan.edges,
            terrain_error_px: plan.terrain_error_px,
            models: plan.model_tolerance(&sequence.scenario.quality),
            surface_reads: plan.surface_reads,
            samples_a_pixel: plan.samples_a_pixel,
            by: plan.placement.ideal,
        };
        let redraws = self.drawn.as_ref().is_none_or(|drawn| drawn.key != key);
        let mut times = FrameTimes { plan_ms: prepared.plan_ms, ..FrameTimes::default() };
        if redraws {
            let lod = prepared.meshes.get(plan.keys.len() / 2).map(|mesh| mesh.lod).unwrap_or_default();
            self.drawn = Some(Drawn { key: key.clone(), lod, buffer: None });
            if key.by == Renderer::Cpu {
                let begun = Instant::now();
                let terrain = prepared.meshes.first();
                let buffer = self.cpu.draw_ideal(plan, terrain, &key.models);
                self.drawn.iter_mut().for_each(|drawn| drawn.buffer = Some(buffer));
                times.ideal_ms = Some(ms_since(begun));
            }
        }
        let (lod, buffer) = self.drawn.as_ref().map(|drawn| (drawn.lod, drawn.buffer)).unwrap_or_default();
        let source = match (buffer, &mut self.gpu) {
            (Some(buffer), _) => Source::Cpu(buffer),
            (None, Some(gpu)) => {
                let makes_output = plan.placement.reverse == Renderer::Gpu;
                let job = GpuJob {
                    plan,
                    scene: &sequence.scene,
                    terrain: &prepared.meshes,
                    rows: prepared.rows.bytes(),
                    uniforms: &uniforms,
                    models: &key.models,
                    zoom: self.planner.zoom_table(),
                    redraws,
                    wanted: if makes_output { Wanted::Output } else { Wanted::Ideal },
                };
                let submitted = gpu.submit(&job, slot).inspect_err(|_| self.drawn = None)?;
                times.record_ms = submitted.record_ms;
                times.submit_ms = submitted.submit_ms;
                match submitted.copy.filter(|_| !makes_output) {
                    Some(copy) => Source::Copied(submitted, copy),
                    None => Source::Gpu(submitted),
                }
            }
            (None, None) => return Err(GpuError::NoAdapter(String::new()).into()),
        };
        Ok(InFlight { prepared, uniforms, source, lod, times })
    }

    /// Waits for a frame and takes its pictures.
    fn finish(&mut self, done: InFlight) -> Result<Finished, GpuError> {
        let InFlight { prepared: Prepared { plan, rows, .. }, uniforms, source, lod, mut times } = done;
        let inputs = ReverseInputs { plan: &plan, uniforms: &uniforms, rows: &rows };
        let begun = Instant::now();
        if let (Some(gpu), Source::Gpu(submitted) | Source::Copied(submitted, _)) = (&self.gpu, &source) {
            gpu.wait(submitted)?;
            times.wait_ms = ms_since(begun);
        }
        let begun = Instant::now();
        let (color_rgba, truth) = match (&source, &self.gpu) {
            (Source::Cpu(buffer), _) => self.cpu.reverse(&inputs, *buffer),
            (Source::Copied(_, copy), Some(gpu)) => gpu
                .with_copy(*copy, |ideal| {
                    let texels = IdealTexels {
                        color: ideal.color,
                        color_stride: ideal.color_stride,
                        depth: ideal.depth,
                        depth_stride: ideal.depth_stride,
                    };
                    self.cpu.reverse_from(&inputs, texels)
                })?
                .ok_or_else(|| GpuError::Device("a copied ideal frame of a plan without poses".into()))?,
            (Source::Gpu(submitted), Some(gpu)) => gpu.output(submitted)?,
            (_, None) => return Err(GpuError::NoAdapter(String::new())),
        };
        let elapsed_ms = ms_since(begun);
        match source {
            Source::Gpu(_) => times.read_ms = elapsed_ms,
            Source::Cpu(_) | Source::Copied(..) => times.reverse_ms = Some(elapsed_ms),
        }
        let begun = Instant::now();
        let frame = self.completed(&plan, color_rgba, truth);
        times.read_ms += ms_since(begun);
        let mut out_of_order = 0;
        if let (Some(gpu), Source::Gpu(submitted) | Source::Copied(submitted, _)) = (&self.gpu, &source) {
            times.passes = gpu.pass_times(submitted)?;
            out_of_order = submitted.out_of_order;
        }
        Ok(Finished { frame, plan, lod, out_of_order, times })
    }

    /// The frame with its truth, rays cast where look-ups do not tell it.
    fn completed(
        &self,
        plan: &FramePlan,
        color_rgba: Vec<f32>,
        mut truth: Option<Vec<Truth>>,
    ) -> RenderedFrame {
        let sequence = self.planner.sequence();
        if let Some(truth) = truth.as_mut().filter(|_| plan.has_exact_truth()) {
            exact_truth::complete(truth, &color_rgba, &self.planner, plan, f64::from(self.coords_phase));
        }
        let coords = truth.as_ref().map(|truth| finished::coords(truth, &color_rgba, plan, &sequence.path));
        RenderedFrame {
            index: plan.frame,
            stamp_ns: sequence.epoch_ns.saturating_add((plan.stamp_s * 1e9).round() as i64),
            size_px: plan.camera.size_px,
            color_rgba,
            depth_m: truth.as_ref().map(|truth| truth.iter().map(|t| t.depth_m).collect()),
            coords,
            rows: self.planner.rows(plan),
        }
    }

    /// The ideal frame that the last rendered frame was gathered from (of several the first): linear R G B A
    /// (with the paper preset sRGB values as stored) and inverse depth (1/m), row-major. For tests and for
    /// looking at stages one by one.
    ///
    /// # Errors
    /// Device faults; `None` before the first frame.
    pub fn read_ideal(&self) -> Result<Option<IdealImages>, GpuError> {
        let Some(Drawn { key, buffer, .. }) = &self.drawn else { return Ok(None) };
        match (buffer, &self.gpu) {
            (Some(buffer), _) => {
                let (color, inverse_depth) = self.cpu.ideal_images(*buffer);
                Ok(Some((key.ideal, color, inverse_depth)))
            }
            (None, Some(gpu)) => gpu.read_ideal(&key.ideal),
            (None, None) => Ok(None),
        }
    }

    /// Triangles of the terrain near marks, which were drawn with several samples a pixel
    /// ([`GpuSession::triangles_near_marks`]).
    ///
    /// # Errors
    /// Device faults; `None` before the first frame and without a gpu.
    pub fn triangles_near_marks(&self) -> Result<Option<u64>, GpuError> {
        self.gpu.as_ref().map_or(Ok(None), GpuSession::triangles_near_marks)
    }

    /// Tiles of the ground's picture that are on the device, and all that there are; `None` for a picture that
    /// is held whole.
    #[must_use]
    pub fn tiles_held(&self) -> Option<[usize; 2]> {
        self.gpu.as_ref().and_then(GpuSession::tiles_held)
    }
}

pub(crate) fn ms_since(begun: Instant) -> f64 {
    begun.elapsed().as_secs_f64() * 1e3
}
