//! The engine: executes frame plans, keeps two frames in flight, reads back.

use std::{
    collections::HashMap,
    sync::{Arc, Mutex},
    time::Instant,
};

use crate::{
    context::{AdapterChoice, GpuContext, GpuError},
    ideal::IdealPass,
    layout::Truth,
    recorder::{PassClock, Recorder},
    reverse::{
        EMPTY_LIST, ReverseBindings, ReversePass, frame_uniforms,
        host::ReverseOn,
        lens_inverse::{LensInversePass, LensMap},
    },
    shaders::ComposeError,
    staging::Staging,
    upload::SceneBuffers,
};
use camsim_core::{scenario::Channel, scene::LodSelection, sequence::Sequence};
use camsim_plan::{EdgeStage, FramePlan, Planner, RayStage};

mod ahead;
mod drawn;
mod error;
mod exact_truth;
mod finished;
mod inspect;
mod on_host;
mod planners;
mod readback;
mod renew;
mod slot;

use ahead::{Ahead, Lines, Prepared, Preparer};
use drawn::Drawn;
pub use error::RenderError;
pub(crate) use error::RenderErrorBase;
pub use finished::{Finished, FrameTimes};
pub use inspect::IdealImages;
use on_host::{HostFrame, OnHost};
use renew::{noise_table, vignette};
use slot::{Slot, Target, list_buffer, pose_buffer};

/// Frames that the device works on while the host reads an older one.
const FRAMES_IN_FLIGHT: usize = 2;
/// Ideal targets of different size that are kept.
const MAX_TARGETS: usize = 4;
/// The same for supersampled ones, which take 16 times the memory.
const MAX_FINE_TARGETS: usize = 2;

/// The opened device.
#[derive(Debug)]
pub struct Engine {
    gpu: GpuContext,
    fault: Arc<Mutex<Option<String>>>,
}

impl Engine {
    /// Opens an adapter.
    ///
    /// # Errors
    /// No usable adapter.
    pub fn new(choice: AdapterChoice) -> Result<Self, GpuError> {
        let gpu = GpuContext::new(choice)?;
        let fault = Arc::new(Mutex::new(None));
        let note = |fault: &Arc<Mutex<Option<String>>>, text: String| {
            if let Ok(mut first) = fault.lock() {
                first.get_or_insert(text);
            }
        };
        let for_errors = fault.clone();
        gpu.device
            .on_uncaptured_error(Arc::new(move |error: wgpu::Error| note(&for_errors, error.to_string())));
        let for_loss = fault.clone();
        gpu.device.set_device_lost_callback(move |reason, text| {
            if reason != wgpu::DeviceLostReason::Destroyed {
                note(&for_loss, text);
            }
        });
        Ok(Self { gpu, fault })
    }

    /// Device and adapter.
    #[must_use]
    pub fn gpu(&self) -> &GpuContext {
        &self.gpu
    }

    /// Holds pictures of larger sides in tiles, as if textures ended there: for tests, and where the device's
    /// memory is short.
    pub fn limit_pictures(&mut self, max_side_px: u32) {
        self.gpu.max_picture_px = max_side_px.min(self.gpu.max_side_px());
    }

    /// How many pixels of a line each thread takes, for frames of sessions to come: many for a software
    /// adapter (the default there), one for a GPU, which wants threads; 1 to 4096. Pictures are the same,
    /// byte for byte.
    pub fn set_pixels_a_thread(&mut self, pixels: u32) {
        // A line has no more of them; products with a workgroup's side stay far from overflow.
        self.gpu.pixels_a_thread = pixels.clamp(1, 4096);
    }

    /// Where output frames are made from ideal frames, for sessions to come. Pictures differ by rounding.
    pub fn set_reverse_on(&mut self, place: ReverseOn) {
        self.gpu.reverse_on = place;
    }

    /// Whether the host draws the ideal frames of the output frames that it makes, for sessions to come,
    /// where it can draw the scene. Pictures differ by rounding, and where that decides which surface a pixel
    /// shows.
    pub fn set_ideal_on_host(&mut self, is_on_host: bool) {
        self.gpu.ideal_on_host = is_on_host;
    }

    /// Most pixels of an output frame with depth and coordinates.
    #[must_use]
    pub fn most_pixels_with_truth(&self) -> u64 {
        self.gpu.max_storage_bytes() / size_of::<Truth>() as u64
    }

    /// Uploads a sequence and prepares for its frames.
    ///
    /// # Errors
    /// What the adapter cannot hold, a camera that cannot be used.
    pub fn session<E: std::error::Error + 'static>(
        &self,
        sequence: Arc<Sequence>,
        channels: &[Channel],
    ) -> Result<Session<'_>, RenderError<E>> {
        let gpu = &self.gpu;
        let planner = Arc::new(Planner::new(sequence.clone(), channels, gpu.max_side_px())?);
        self.check_output(&planner)?;
        let mut buffers = SceneBuffers::new(gpu, &sequence.scene)?;
        let preset = sequence.scenario.quality.preset;
        let ideal_pass =
            IdealPass::new(gpu, preset, buffers.tiles().is_some(), sequence.scene.fog_visibility_m)?;
        let on_host = gpu.reverses_on_host().then(|| OnHost::new(gpu, &sequence, &buffers));
        if !on_host.as_ref().is_some_and(OnHost::draws) {
            buffers.bring_pictures(gpu, &sequence.scene);
        }
        let slots = (0..FRAMES_IN_FLIGHT).map(|_| Slot::new(gpu, &sequence, planner.wants_truth())).collect();
        let session = Session {
            vignette: vignette(gpu, &sequence),
            noise_table: noise_table(gpu),
            ideal_pass,
            reverse_pass: ReversePass::new(gpu),
            lens_pass: None,
            lens_map: None,
            zoom_maps: HashMap::new(),
            targets: Vec::new(),
            drawn: None,
            on_host,
            slots,
            lists: None,
            buffers,
            planner,
            engine: self,
            coords_phase: 0.0,
        };
        self.check()?;
        Ok(session)
    }

    fn check(&self) -> Result<(), GpuError> {
        match self.fault.lock().ok().and_then(|fault| fault.clone()) {
            Some(text) => Err(GpuError::Device(text)),
            None => Ok(()),
        }
    }
}

/// One sequence on the device.
#[derive(Debug)]
pub struct Session<'a> {
    engine: &'a Engine,
    planner: Arc<Planner>,
    buffers: SceneBuffers,
    ideal_pass: IdealPass,
    reverse_pass: ReversePass,
    lens_pass: Option<LensInversePass>,
    /// Current lens map, by the bits of its zoom value.
    lens_map: Option<(u64, LensMap)>,
    /// Maps of the zoom table's entries: starts for those in between.
    zoom_maps: HashMap<usize, LensMap>,
    targets: Vec<Target>,
    drawn: Option<Drawn>,
    /// Frames that the host makes, if it makes any.
    on_host: Option<OnHost>,
    slots: Vec<Slot>,
    /// Pixels of the frame at work that may see silhouettes, for frames that have any.
    lists: Option<[wgpu::Buffer; 2]>,
    vignette: wgpu::TextureView,
    noise_table: wgpu::TextureView,
    coords_phase: f32,
}

/// A submitted frame.
struct InFlight {
    slot: usize,
    plan: FramePlan,
    submission: wgpu::SubmissionIndex,
    lod: LodSelection,
    out_of_order: u32,
    /// What the host makes it from, if it does.
    on_host: Option<(HostFrame, Lines)>,
    times: FrameTimes,
}

impl Session<'_> {
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

    /// From now on measures how long each pass takes on the device; `false` where the adapter has no time
    /// stamps.
    pub fn time_passes(&mut self) -> bool {
        for slot in &mut self.slots {
            slot.clock = PassClock::new(&self.engine.gpu);
        }
        self.slots.iter().all(|slot| slot.clock.is_some())
    }

    /// Forgets what was planned and drawn last, so that the next frame takes as long as if no other had been
    /// like it. No picture changes: for benchmarks, which render the same frames over and over.
    pub fn forget(&mut self) {
        self.drawn = None;
        self.planner.forget();
    }

    /// Renders frames in the order asked for and hands each to `sink`. While the host takes a frame, the
    /// device works on the next, and other threads plan those that follow; `frames` is read ahead of them.
    ///
    /// # Errors
    /// The first fault of planning, device or sink; frames before it have been handed over.
    pub fn render<E: std::error::Error + 'static>(
        &mut self,
        frames: impl IntoIterator<Item = u64>,
        sink: &mut dyn FnMut(Finished) -> Result<(), E>,
    ) -> Result<(), RenderError<E>> {
        let preparer =
            Preparer::new(self.planner.clone(), self.buffers.tiles().map(|tiles| tiles.ground.clone()));
        let mut frames = frames.into_iter();
        let first: Vec<u64> = frames.by_ref().take(2).collect();
        let is_single = first.len() < 2;
        planners::scope(&self.engine.gpu, is_single, |scope| {
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
                    // Nobody wants the frame that is in flight, but its buffers can only be used again after
                    // it; a second fault is not told.
                    let _ = in_flight.map(|unwanted| self.finish(unwanted));
                    return Err(fault);
                }
                if is_last {
                    return fault.map_or(Ok(()), Err);
                }
            }
        })
    }

    /// Records and submits a frame.
    fn submit(&mut self, prepared: Prepared, slot: usize) -> Result<InFlight, RenderErrorBase> {
        let gpu = &self.engine.gpu;
        let begun = Instant::now();
        let mut clock = self.slots[slot].clock.take();
        let mut staging = self.slots[slot].staging.take().unwrap_or_else(|| Staging::new(&gpu.device));
        let recorded = self.record(&prepared, slot, Recorder::new(&gpu.device, clock.as_mut(), &mut staging));
        self.slots[slot].clock = clock;
        self.slots[slot].staging = Some(staging);
        let (commands, on_host) = recorded.inspect_err(|_| {
            // What was recorded to be kept will never be there.
            (self.drawn, self.lens_map) = (None, None);
            self.zoom_maps.clear();
            self.targets.clear();
            self.on_host.iter_mut().for_each(OnHost::forget);
        })?;
        let record_ms = ms_since(begun);
        let begun = Instant::now();
        let submission = gpu.queue.submit([commands]);
        let submit_ms = ms_since(begun);
        self.slots[slot].recall(on_host.is_none());
        self.on_host.iter_mut().for_each(OnHost::recall);
        self.engine.check()?;
        let (lod, out_of_order) =
            self.drawn.as_ref().map(|drawn| (drawn.lod, drawn.out_of_order)).unwrap_or_default();
        let ideal_ms = self.drawn.as_mut().and_then(|drawn| drawn.ideal_ms.take());
        let record_ms = record_ms - ideal_ms.unwrap_or_default();
        let times =
            FrameTimes { plan_ms: prepared.plan_ms, record_ms, ideal_ms, submit_ms, ..FrameTimes::default() };
        let on_host = on_host.map(|frame| (frame, prepared.lines));
        Ok(InFlight { slot, plan: prepared.plan, submission, lod, out_of_order, on_host, times })
    }

    /// Every pass of a frame, in order; and what the host makes it from, if it does.
    fn record(
        &mut self,
        prepared: &Prepared,
        slot: usize,
        mut recorder: Recorder<'_>,
    ) -> Result<(wgpu::CommandBuffer, Option<HostFrame>), RenderErrorBase> {
        if prepared.plan.ray == RayStage::LensMap {
            self.lens_inverse(&mut recorder, &prepared.plan);
        }
        self.ideal(&mut recorder, prepared, slot)?;
        let on_host = self.bring_to_host(&mut recorder, &prepared.plan);
        if on_host.is_none() {
            self.reverse(&mut recorder, prepared, slot)?;
            let slot = &self.slots[slot];
            for output in std::iter::once(&slot.color).chain(&slot.truth) {
                output.copy(recorder.encoder());
            }
        }
        Ok((recorder.finish()?, on_host))
    }

    /// What the host makes the output frame from, where it makes frames like this.
    fn bring_to_host(&mut self, recorder: &mut Recorder<'_>, plan: &FramePlan) -> Option<HostFrame> {
        let on_host =
            self.on_host.as_mut().filter(|on_host| on_host.makes(plan, self.engine.gpu.reverse_on))?;
        let drawn = self.drawn.as_mut()?;
        let gpu = &self.engine.gpu;
        on_host.copy_map(gpu, recorder, plan, self.lens_map.as_ref().map(|(_, map)| map));
        let target = drawn.target.map(|target| &self.targets[target].ideal);
        let copy = drawn
            .copy
            .or_else(|| target.map(|target| on_host.copy_ideal(gpu, recorder, target, &plan.ideal)));
        drawn.copy = copy;
        Some(HostFrame {
            copy: copy?,
            uniforms: frame_uniforms(plan, &self.planner.sequence().scenario, self.coords_phase),
        })
    }

    /// Pass 1, only when the lens has changed: the lens map.
    fn lens_inverse(&mut self, recorder: &mut Recorder<'_>, plan: &FramePlan) {
        let gpu = &self.engine.gpu;
        let bits = plan.zoom.unwrap_or_default().to_bits();
        if self.lens_map.as_ref().is_some_and(|(of, _)| *of == bits) {
            return;
        }
        let pass = self.lens_pass.get_or_insert_with(|| LensInversePass::new(&gpu.device));
        let mut warm = None;
        if let (Some(table), Some(zoom)) = (self.planner.zoom_table(), plan.zoom) {
            let entry = table.nearest(zoom);
            if let (false, Ok(camera)) =
                (self.zoom_maps.contains_key(&entry), table.at(table.entries()[entry].at))
            {
                let mut map = LensMap::new(&gpu.device, camera.size_px);
                pass.encode(&gpu.device, recorder, &camera, &mut map, None);
                self.zoom_maps.insert(entry, map);
            }
            warm = self.zoom_maps.get(&entry);
        }
        let mut map = match self.lens_map.take() {
            Some((_, map)) => map,
            None => LensMap::new(&gpu.device, plan.camera.size_px),
        };
        pass.encode(&gpu.device, recorder, &plan.camera, &mut map, warm);
        self.lens_map = Some((bits, map));
    }

    /// Pass 3: the output frame.
    fn reverse(
        &mut self,
        recorder: &mut Recorder<'_>,
        prepared: &Prepared,
        slot: usize,
    ) -> Result<(), ComposeError> {
        let gpu = &self.engine.gpu;
        let plan = &prepared.plan;
        let uniforms = frame_uniforms(plan, &self.planner.sequence().scenario, self.coords_phase);
        let bytes = prepared.lines.bytes();
        let buffers = &mut self.slots[slot];
        if buffers.poses.size() < bytes.len() as u64 {
            buffers.poses = pose_buffer(gpu, bytes.len() as u64);
            self.targets.iter_mut().for_each(|target| target.groups[slot].clear());
        }
        recorder.write(&buffers.frame, 0, bytemuck::bytes_of(&uniforms));
        recorder.write(&buffers.poses, 0, bytes);
        let Some(target) =
            self.drawn.as_ref().and_then(|drawn| drawn.target).map(|target| &mut self.targets[target])
        else {
            return Ok(());
        };
        let lens_map = if plan.ray == RayStage::LensMap {
            self.lens_map.as_ref().map(|(_, map)| &map.view)
        } else {
            None
        };
        let lists = (plan.edges != EdgeStage::None).then(|| {
            let lists = self.lists.get_or_insert_with(|| {
                ["camsim.candidates", "camsim.listed"]
                    .map(|label| list_buffer(gpu, label, plan.camera.size_px))
            });
            lists.iter().for_each(|list| recorder.write(list, 0, bytemuck::cast_slice(&EMPTY_LIST)));
            &*lists
        });
        let bindings = ReverseBindings {
            lists,
            frame: &buffers.frame,
            noise_table: &self.noise_table,
            color: &target.ideal.gathered_color,
            depth: &target.ideal.gathered_depth,
            fine: target.ideal.fine.as_ref(),
            poses: &buffers.poses,
            vignette: &self.vignette,
            lens_map,
            out_color: &buffers.color.on_device,
            out_truth: buffers.truth.as_ref().map(|truth| &truth.on_device),
        };
        let groups = &mut target.groups[slot];
        self.reverse_pass.encode(gpu, recorder, plan, &bindings, groups)
    }
}

fn ms_since(begun: Instant) -> f64 {
    begun.elapsed().as_secs_f64() * 1e3
}
