//! One sequence: its frames in the order asked for.

use std::{
    collections::VecDeque,
    sync::{Arc, atomic::AtomicBool},
    time::Instant,
};

use camsim_core::{
    frame::{Plane, RenderedFrame},
    scenario::{Channel, Preset, Primary},
    scene::{LodSelection, SceneBatches},
    sequence::Sequence,
};
use camsim_cpu::{BufferHandle, CpuRenderer, IdealTexels, ReverseInputs};
use camsim_plan::{
    FramePlan, PixelHit, PlanError, Planner, Renderer,
    adapter::{
        AdapterSession, CopiedIdeal, CopyHandle, FRAMES_IN_FLIGHT, GpuError, GpuJob, IdealPlanes, Readback,
        Submitted,
    },
    uniforms::{FrameUniforms, Truth, frame_uniforms},
};

use crate::{
    Engine, Finished, FrameTimes, RenderError,
    cancel::Cancel,
    error::RenderErrorBase,
    finished,
    lane::{CacheKey, CachedFrames, Lane, add_part, joined, turn_to_camera_axes},
    moving::{Lamps, MovingScene},
    planner_threads,
    prepare_ahead::{Job, PrepareAhead, Prepared, Preparer, ms_since},
    truth::{FramePixels, hits, planes},
    whole_frame::WholeFrame,
};

/// One sequence on the renderers of an engine.
#[derive(Debug)]
pub struct Session<'a> {
    engine: &'a Engine,
    planner: Arc<Planner>,
    /// Knows everything in the scene, where something moves.
    scene_planner: Option<Arc<Planner>>,
    /// One, or one a face.
    lanes: Vec<Lane>,
    cpu: CpuRenderer,
    gpu: Option<Box<dyn AdapterSession + 'a>>,
    coords_phase: f32,
    looks_up_coords: bool,
    channels: Vec<Channel>,
    /// What each pixel of a frame sees; its memory is kept from frame to frame.
    hits: Vec<Option<PixelHit>>,
    stages: WholeFrame,
    cancel: Cancel,
}

/// Location of the ideal frame of a frame in flight.
#[derive(Debug)]
enum FrameLocation {
    /// On the gpu, which renders the output frame too.
    Gpu(Submitted),
    /// On the gpu, which copies it to memory for the cpu renderer.
    Copied(Submitted, CopyHandle),
    /// In a buffer of the cpu renderer.
    Cpu(BufferHandle),
}

/// A submitted frame of a lane.
#[derive(Debug)]
struct InFlight {
    job: Job,
    prepared: Prepared,
    uniforms: FrameUniforms,
    source: FrameLocation,
    lod: LodSelection,
    times: FrameTimes,
}

impl<'a> Session<'a> {
    pub(crate) fn new(
        engine: &'a Engine,
        sequence: Arc<Sequence>,
        channels: &[Channel],
    ) -> Result<Self, RenderErrorBase> {
        let moving = MovingScene::new(&sequence, None);
        let scene_planner = match &moving {
            Some(_) if sequence.scenario.quality.preset == Preset::Paper => return Err(RenderError::Moving),
            Some(_) => Some(Arc::new(Planner::new(sequence.clone(), channels, engine.max_side_px())?)),
            None => None,
        };
        let still = moving.as_ref().map_or(sequence, |moving| moving.still().clone());
        let planner = Planner::new(still.clone(), channels, engine.max_side_px())?;
        let planner = Arc::new(planner.with_capabilities(engine.capabilities()));
        let meshes = Arc::new(SceneBatches::new(&still.scene));
        let gpu = engine
            .adapter()
            .map(|adapter| adapter.session(&still, meshes.clone(), planner.wants_truth()))
            .transpose()?;
        let stages = WholeFrame::new(&still);
        let mut cpu = CpuRenderer::new(still, meshes);
        cpu.set_leaves_truth(true);
        Ok(Self {
            engine,
            lanes: lanes(&planner, scene_planner.as_deref(), moving, &[]),
            cpu,
            planner,
            scene_planner,
            gpu,
            coords_phase: 0.0,
            looks_up_coords: false,
            channels: channels.into(),
            hits: Vec::new(),
            stages,
            cancel: Cancel::default(),
        })
    }

    /// Replaces the sequence. The next frames are bit for bit those of a new session. Fast if the scene is
    /// the same [`Arc`] and the preset is the same: pipelines and textures are kept.
    ///
    /// # Errors
    /// Those of [`Engine::session`]; the session is unchanged then.
    pub fn renew<E: std::error::Error + 'static>(
        &mut self,
        sequence: Arc<Sequence>,
        channels: &[Channel],
    ) -> Result<(), RenderError<E>> {
        let before = self.planner.sequence();
        let moving = MovingScene::new(&sequence, self.lanes.first().and_then(|lane| lane.moving.as_ref()));
        let still = moving.as_ref().map_or(&sequence, MovingScene::still).clone();
        let (old, new) = (&before.scenario, &sequence.scenario);
        if !Arc::ptr_eq(&before.scene, &still.scene) || old.quality.preset != new.quality.preset {
            let cancel = self.cancel.clone();
            *self = Self { cancel, ..self.engine.session(sequence, channels)? };
            return Ok(());
        }
        let scene_planner = match &self.scene_planner {
            Some(planner) => Some(Arc::new(planner.renewed(sequence, channels)?)),
            None => None,
        };
        let planner = Arc::new(self.planner.renewed(still.clone(), channels)?);
        if let Some(gpu) = &mut self.gpu {
            gpu.renew((before, self.planner.wants_truth()), &still, planner.wants_truth())?;
        }
        self.stages.renew(&still);
        self.cpu.renew(still);
        self.lanes = lanes(&planner, scene_planner.as_deref(), moving, &self.lanes);
        self.planner = planner;
        self.channels = channels.into();
        self.scene_planner = scene_planner;
        Ok(())
    }

    /// The planner of this sequence.
    #[must_use]
    pub fn planner(&self) -> &Planner {
        &self.planner
    }

    /// A planner of this sequence that knows everything in its scene, things that move too, which
    /// [`Session::planner`] leaves to rays.
    #[must_use]
    pub fn scene_planner(&self) -> &Planner {
        self.scene_planner.as_ref().unwrap_or(&self.planner)
    }

    /// Sets the instant of the exposure, in [-0.5, 0.5], of the source coordinates in `coords` (0 =
    /// mid-exposure), to check the exposure path.
    pub fn set_coords_phase(&mut self, phase: f32) {
        self.coords_phase = phase;
    }

    /// Gives the coordinates that the picture is made by, not those of exact rays: to measure the temporal inverse.
    pub fn set_looked_up_coords(&mut self, looked_up: bool) {
        self.looks_up_coords = looked_up;
        self.cpu.set_leaves_truth(!looked_up);
    }

    /// Frames are cancelled while this is `true`: [`Session::render`] ends with [`RenderError::Cancelled`] before it
    /// draws a frame or makes its output on the cpu, or within the rays of things that move. A plan or a pass in
    /// progress is finished first. The session remains usable.
    pub fn set_cancel(&mut self, cancel: Arc<AtomicBool>) {
        self.cancel = Cancel(Some(cancel));
    }

    fn check_cancel(&self) -> Result<(), RenderErrorBase> {
        if self.cancel.is_set() { Err(RenderError::Cancelled) } else { Ok(()) }
    }

    /// Has the cpu use its general code for every pass that it makes ([`CpuRenderer::set_general_only`]): for
    /// tests, before the first frame.
    #[doc(hidden)]
    pub fn set_general_cpu(&mut self, general_only: bool) {
        self.cpu.set_general_only(general_only);
    }

    /// Measures the time of each gpu pass from now on; `false` without a gpu or without time stamps.
    pub fn time_passes(&mut self) -> bool {
        self.gpu.as_mut().is_some_and(|gpu| gpu.time_passes())
    }

    /// Clears the caches of plans and ideal frames. Pictures stay the same. For benchmarks, which render the
    /// same frames over and over.
    pub fn forget(&mut self) {
        self.gpu.iter_mut().for_each(|gpu| gpu.forget());
        self.lanes.iter_mut().for_each(|lane| lane.ideal = None);
        self.planner.forget();
    }

    /// Renders frames in the given order and passes each to `sink`. While one frame is read, the gpu works on
    /// the next, and other threads plan the following ones; `frames` is read ahead.
    ///
    /// # Errors
    /// The first error of planning, gpu or sink. The frames before it have been passed to `sink`.
    pub fn render<E: std::error::Error + 'static>(
        &mut self,
        frames: impl IntoIterator<Item = u64>,
        sink: &mut dyn FnMut(Finished) -> Result<(), E>,
    ) -> Result<(), RenderError<E>> {
        let tiles = self.gpu.as_ref().and_then(|gpu| gpu.tiles());
        let lanes = self.lanes.len();
        let preparer = |lane| Preparer::new(self.planner.clone(), lane, tiles.clone());
        let preparers: Vec<Preparer> = (0..lanes).map(preparer).collect();
        let mut frames = frames.into_iter();
        let first: Vec<u64> = frames.by_ref().take(2).collect();
        let is_single = first.len() < 2;
        let jobs = first.into_iter().chain(frames);
        let jobs = jobs.flat_map(|frame| (0..lanes).map(move |lane| Job { lane, frame }));
        planner_threads::scope(self.engine.shares_processor(), is_single, |scope| {
            let mut ahead = PrepareAhead::start(scope, &preparers, jobs);
            let mut in_flight: Option<InFlight> = None;
            let mut parts = Parts { wanted: lanes * self.planner.colors(), count: 0, whole: None };
            // Those of the next frame that are not yet submitted.
            let mut waiting = VecDeque::new();
            let mut slot = 0;
            loop {
                if waiting.is_empty() {
                    match ahead.next() {
                        Some((job, Ok(prepared))) => {
                            waiting.extend(prepared.with_other_colors().map(|part| Ok((job, part))));
                        }
                        Some((_, Err(fault))) => waiting.push_back(Err(fault)),
                        None => {}
                    }
                }
                let submitted = match waiting.pop_front() {
                    Some(Ok((job, prepared))) => self.submit(job, prepared, slot).map(Some),
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
                    && let Err(fault) = self.finish(done).map_err(RenderError::lift).and_then(|done| {
                        let whole = parts.add(done).map(|mut whole| {
                            let exposure = whole.plan.exposure;
                            self.stages.finish(&mut whole.frame, whole.plan.stamp_s, exposure.as_ref());
                            whole
                        });
                        whole.map_or(Ok(()), &mut *sink).map_err(RenderError::Sink)
                    })
                {
                    // Buffers of the frame in flight are free only after it. A second error is not reported.
                    let _ = in_flight.map(|unwanted| self.finish(unwanted));
                    return Err(fault);
                }
                if is_last {
                    return fault.map_or(Ok(()), Err);
                }
            }
        })
    }

    /// Draws ideal frames on the cpu, or submits the gpu passes of a frame.
    // Long because: one path through both renderers.
    fn submit(&mut self, job: Job, prepared: Prepared, slot: usize) -> Result<InFlight, RenderErrorBase> {
        self.check_cancel()?;
        let plan = &prepared.plan;
        let planner = self.planner.lane(job.lane);
        let lane = &mut self.lanes[job.lane];
        let sequence = planner.sequence().clone();
        let uniforms = frame_uniforms(plan, &sequence, self.coords_phase);
        let key = CacheKey {
            poses: plan.key_poses(),
            ideal: plan.ideal,
            edges: plan.edges,
            terrain_error_px: plan.terrain_error_px,
            models: plan.model_tolerance(&sequence.scenario.quality),
            surface_reads: plan.surface_reads,
            samples_a_pixel: plan.samples_a_pixel,
            renderer: plan.placement.ideal,
        };
        // Red and blue are made from the ideal frame that green has just been.
        let is_drawn = is_red_or_blue(plan);
        let redraws = lane.ideal.as_ref().is_none_or(|ideal| !is_drawn && ideal.key != key);
        let mut times = FrameTimes { plan_ms: prepared.plan_ms, ..FrameTimes::default() };
        if redraws {
            let lod = prepared.meshes.get(plan.keys.len() / 2).map(|mesh| mesh.lod).unwrap_or_default();
            lane.ideal = Some(CachedFrames { key: key.clone(), lod, buffer: None });
            if key.renderer == Renderer::Cpu {
                let begin = Instant::now();
                let buffer = self.cpu.draw_ideal(plan, &prepared.meshes, &key.models);
                lane.ideal.iter_mut().for_each(|ideal| ideal.buffer = Some(buffer));
                times.ideal_ms = Some(ms_since(begin));
            }
        }
        let (lod, buffer) = lane.ideal.as_ref().map(|ideal| (ideal.lod, ideal.buffer)).unwrap_or_default();
        let source = match (buffer, &mut self.gpu) {
            (Some(buffer), _) => FrameLocation::Cpu(buffer),
            (None, Some(gpu)) => {
                let makes_output = plan.placement.reverse == Renderer::Gpu;
                let inputs = GpuJob {
                    plan,
                    scene: &sequence.scene,
                    terrain: &prepared.meshes,
                    rows: prepared.rows.bytes(),
                    uniforms: &uniforms,
                    models: &key.models,
                    zoom: planner.zoom_table(),
                    redraws,
                    readback: if makes_output { Readback::Output } else { Readback::Ideal },
                };
                let submitted = gpu.submit(&inputs, slot).inspect_err(|_| lane.ideal = None)?;
                times.record_ms = submitted.record_ms;
                times.submit_ms = submitted.submit_ms;
                match submitted.copy.filter(|_| !makes_output) {
                    Some(copy) => FrameLocation::Copied(submitted, copy),
                    None => FrameLocation::Gpu(submitted),
                }
            }
            (None, None) => return Err(GpuError::NoAdapter(String::new()).into()),
        };
        if matches!(source, FrameLocation::Gpu(_) | FrameLocation::Copied(..)) {
            // The gpu holds the ideal frames that it drew last only.
            for other in (0..self.lanes.len()).filter(|&other| other != job.lane) {
                self.lanes[other].ideal.take_if(|ideal| ideal.buffer.is_none());
            }
        }
        Ok(InFlight { job, prepared, uniforms, source, lod, times })
    }

    /// Waits for a frame, and renders or reads its output frame.
    // Long because: one path through both renderers.
    fn finish(&mut self, done: InFlight) -> Result<Finished, RenderErrorBase> {
        let InFlight { job, prepared: Prepared { plan, rows, .. }, uniforms, source, lod, mut times } = done;
        // The gpu's frames are waited for, since their buffers are used again.
        if matches!(source, FrameLocation::Cpu(_)) {
            self.check_cancel()?;
        }
        let inputs = ReverseInputs { plan: &plan, uniforms: &uniforms, rows: &rows };
        let begin = Instant::now();
        if let (Some(gpu), FrameLocation::Gpu(submitted) | FrameLocation::Copied(submitted, _)) =
            (&self.gpu, &source)
        {
            gpu.wait(submitted)?;
            times.wait_ms = ms_since(begin);
        }
        let begin = Instant::now();
        let (color_rgba, truth) = match (&source, &self.gpu) {
            (FrameLocation::Cpu(buffer), _) => self.cpu.reverse(&inputs, *buffer),
            (FrameLocation::Copied(_, copy), Some(gpu)) => {
                let mut made = None;
                gpu.with_copy(*copy, &mut |ideal| {
                    let CopiedIdeal { color, color_stride, depth, depth_stride } = ideal;
                    let texels = IdealTexels { color, color_stride, depth, depth_stride };
                    made = self.cpu.reverse_from(&inputs, texels);
                })?;
                made.ok_or_else(|| GpuError::Device("a copied ideal frame of a plan without poses".into()))?
            }
            (FrameLocation::Gpu(submitted), Some(gpu)) => gpu.output(submitted)?,
            (_, None) => return Err(GpuError::NoAdapter(String::new()).into()),
        };
        let elapsed_ms = ms_since(begin);
        match source {
            FrameLocation::Gpu(_) => times.read_ms = elapsed_ms,
            FrameLocation::Cpu(_) | FrameLocation::Copied(..) => times.reverse_ms = Some(elapsed_ms),
        }
        let begin = Instant::now();
        let frame = self.with_truth(job.lane, &plan, color_rgba, truth)?;
        times.read_ms += ms_since(begin);
        let mut out_of_order = 0;
        if let (Some(gpu), FrameLocation::Gpu(submitted) | FrameLocation::Copied(submitted, _)) =
            (&self.gpu, &source)
        {
            times.passes = gpu.pass_times(submitted)?;
            out_of_order = submitted.out_of_order;
        }
        self.check_cancel()?;
        Ok(Finished { frame, plan, faces: Vec::new(), lod, out_of_order, times })
    }

    /// The frame with its truth.
    fn with_truth(
        &mut self,
        lane: usize,
        plan: &FramePlan,
        mut color_rgba: Vec<f32>,
        mut truth: Option<Vec<Truth>>,
    ) -> Result<RenderedFrame, PlanError> {
        let sequence = self.planner.lane(lane).sequence().clone();
        let is_other = is_red_or_blue(plan);
        let whole = self.scene_planner().lane(lane).sequence().clone();
        self.lanes[lane].missed.paint((&mut color_rgba, truth.as_mut()), plan, &whole, &self.cancel);
        if let Some(moving) = &self.lanes[lane].moving {
            moving.paint(&mut color_rgba, plan, &self.cancel);
        }
        if let Some(lamps) = &self.lanes[lane].lamps {
            lamps.paint(&mut color_rgba, plan, &self.cancel);
        }
        let mut planes = Vec::new();
        if let Some(truth) = truth.as_mut().filter(|_| !self.cancel.is_set()) {
            let is_looked_up = |truth: &Truth| self.looks_up_coords && truth.depth_m >= 0.0;
            let looked_up: Vec<Option<[f32; 2]>> =
                truth.iter().map(|truth| is_looked_up(truth).then_some(truth.source_px)).collect();
            let by_rays = self.complete_truth(lane, plan, &color_rgba, truth)?;
            for (truth, source_px) in truth.iter_mut().zip(looked_up) {
                truth.source_px = source_px.unwrap_or(truth.source_px);
            }
            planes.push(Plane::depth(truth.iter().map(|t| t.depth_m).collect()));
            planes.push(Plane::coords(finished::coords(truth, &color_rgba, plan, &sequence.path)));
            planes.extend(by_rays);
        }
        planes.insert(0, Plane::color(color_rgba));
        let mut frame = RenderedFrame {
            index: plan.frame,
            stamp_ns: sequence.stamp_ns(plan.frame),
            size_px: plan.camera.size_px,
            rows: if is_other { Vec::new() } else { self.planner.rows(plan) },
            planes,
        };
        if self.lanes.len() > 1 {
            turn_to_camera_axes(&mut frame, plan);
        }
        Ok(frame)
    }

    /// Corrects the truth of a renderer by rays, and computes the other truth channels.
    fn complete_truth(
        &mut self,
        lane: usize,
        plan: &FramePlan,
        color_rgba: &[f32],
        truth: &mut Vec<Truth>,
    ) -> Result<Vec<Plane>, PlanError> {
        let mut hits = std::mem::take(&mut self.hits);
        let planner = self.scene_planner().lane(lane);
        let rays = planner.frame_rays(plan, f64::from(self.coords_phase));
        // What moves is not in the picture that depth is looked up in.
        let needs_every_ray =
            self.scene_planner.is_some() || self.channels.iter().any(|channel| channel.needs_every_ray());
        if !needs_every_ray {
            if plan.has_exact_truth() {
                hits::of_all_pixels(truth, color_rgba, plan, &rays, None);
            }
            return Ok(Vec::new());
        }
        // With the paper's solvers depth and coordinates say where these look.
        let mut solved = (!plan.has_exact_truth()).then(|| truth.clone());
        hits.clear();
        hits.resize(truth.len(), None);
        hits::of_all_pixels(solved.as_mut().unwrap_or(truth), color_rgba, plan, &rays, Some(&mut hits));
        let pixels = FramePixels { planner, plan, rays: &rays, truth, color_rgba, hits: &hits };
        let planes = planes(&pixels, &self.channels);
        self.hits = hits;
        planes
    }

    /// Ideal frame of the last rendered frame, the first of several; `None` before the first frame. Linear
    /// RGBA (with the paper preset stored sRGB values) and inverse depth (1/m), row-major. For tests.
    ///
    /// # Errors
    /// Faults of the adapter.
    pub fn read_ideal(&self) -> Result<Option<IdealPlanes>, GpuError> {
        let Some(CachedFrames { key, buffer, .. }) = &self.lanes[0].ideal else { return Ok(None) };
        match (buffer, &self.gpu) {
            (Some(buffer), _) => {
                let (color, inverse_depth) = self.cpu.ideal_images(*buffer);
                Ok(Some((key.ideal, color, inverse_depth)))
            }
            (None, Some(gpu)) => gpu.read_ideal(&key.ideal),
            (None, None) => Ok(None),
        }
    }

    /// Number of terrain triangles near edge marks, which are drawn with several samples per pixel
    /// ([`AdapterSession::triangles_near_edges`]); `None` before the first frame and without a gpu.
    ///
    /// # Errors
    /// Faults of the adapter.
    pub fn triangles_near_edges(&self) -> Result<Option<u64>, GpuError> {
        self.gpu.as_ref().map_or(Ok(None), |gpu| gpu.triangles_near_edges())
    }

    /// Number of terrain texture tiles on the gpu, and of all tiles; `None` if the texture is not tiled.
    #[must_use]
    pub fn tiles_held(&self) -> Option<[usize; 2]> {
        self.gpu.as_ref().and_then(|gpu| gpu.resident_tiles())
    }
}

/// What is kept for each lane of a planner. `moving` is of the whole camera. Lamps keep the scene of those before.
fn lanes(
    planner: &Planner,
    scene_planner: Option<&Planner>,
    moving: Option<MovingScene>,
    before: &[Lane],
) -> Vec<Lane> {
    let whole = scene_planner.unwrap_or(planner);
    let lamps_before = before.first().and_then(|lane| lane.lamps.as_ref());
    let lamps = |number: usize| Lamps::new(whole.lane(number).sequence(), lamps_before);
    let count = planner.lanes();
    let mut lanes: Vec<Lane> =
        (0..count).map(|number| Lane { lamps: lamps(number), ..Lane::default() }).collect();
    match scene_planner.filter(|_| count > 1) {
        None => lanes[0].moving = moving,
        Some(scene_planner) => {
            for (number, lane) in lanes.iter_mut().enumerate() {
                lane.moving = MovingScene::new(scene_planner.lane(number).sequence(), moving.as_ref());
            }
        }
    }
    lanes
}

/// Collects the faces and colours of a frame, which are finished one after the other.
struct Parts {
    wanted: usize,
    count: usize,
    whole: Option<Finished>,
}

impl Parts {
    /// The frame, once this is its last part.
    fn add(&mut self, done: Finished) -> Option<Finished> {
        add_part(&mut self.whole, done);
        self.count = (self.count + 1) % self.wanted;
        if self.count == 0 { self.whole.take().map(joined) } else { None }
    }
}

/// Whether it is a pass that red or blue has beside that of green.
fn is_red_or_blue(plan: &FramePlan) -> bool {
    matches!(plan.primary, Some(Primary::Red | Primary::Blue))
}
