//! One sequence on a gpu: buffers, passes and read-back of its frames.

use std::{collections::HashMap, sync::Arc, time::Instant};

use camsim_core::{
    camera::ZoomTable,
    scene::{LodTolerance, PlacedMesh, Scene, SceneBatches, TerrainTiles},
    sequence::Sequence,
};
use camsim_plan::{EdgeStage, FramePlan, RayStage};

use crate::{
    context::{GpuContext, GpuError},
    error::PassError,
    ideal::{IdealPass, IdealTarget},
    layout::{FrameUniforms, Truth},
    recorder::{PassClock, PassTime, Recorder},
    reverse::{
        EMPTY_LIST, ReverseBindings, ReversePass,
        lens_inverse::{LensInversePass, LensMap},
    },
    shaders::ComposeError,
    staging::Staging,
    upload::SceneBuffers,
};

mod copies;
mod inspect;
mod readback;
mod slot;
mod tables;

use copies::IdealCopies;
pub use copies::IdealCopy;
pub use inspect::IdealImages;
use slot::{Slot, Target, list_buffer, pose_buffer};

/// Frames that are worked on at once: one on the device while the one before is read.
pub const FRAMES_IN_FLIGHT: usize = 2;
/// Ideal targets of different size that are kept.
const MAX_TARGETS: usize = 4;
/// The same for supersampled ones, which take 16 times the memory.
const MAX_FINE_TARGETS: usize = 2;

/// What a frame is made from.
#[derive(Clone, Copy, Debug)]
pub struct GpuJob<'a> {
    /// The plan.
    pub plan: &'a FramePlan,
    /// The scene.
    pub scene: &'a Scene,
    /// Triangles of the terrain for each key frame; none without a terrain.
    pub terrain: &'a [PlacedMesh],
    /// Poses or times of the rows, as the shaders read them.
    pub rows: &'a [u8],
    /// Numbers of the frame.
    pub uniforms: &'a FrameUniforms,
    /// Level of detail of the models.
    pub models: &'a LodTolerance,
    /// Calibrations of a zoom lens.
    pub zoom: Option<&'a ZoomTable>,
    /// Whether the ideal frames differ from those of the frame before.
    pub redraws: bool,
    /// What is read back.
    pub wanted: Wanted,
}

/// What is read back of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wanted {
    /// The output frame.
    Output,
    /// The ideal frame, for the cpu renderer.
    Ideal,
}

/// A frame on the device.
#[derive(Debug)]
pub struct Submitted {
    slot: usize,
    submission: wgpu::SubmissionIndex,
    /// Where a copy of the ideal frame will be, if that is wanted.
    pub copy: Option<IdealCopy>,
    /// Blended triangles that are drawn before something behind them, of all ideal frames.
    pub out_of_order: u32,
    /// Milliseconds that recording took.
    pub record_ms: f64,
    /// Milliseconds that the driver took to accept the commands.
    pub submit_ms: f64,
}

/// Ideal frames that were drawn last.
#[derive(Clone, Copy, Debug)]
struct Drawn {
    /// Place in the targets.
    target: usize,
    /// The slot of the frame that they were drawn for.
    slot: usize,
    out_of_order: u32,
    copy: Option<IdealCopy>,
}

/// One sequence on the device.
#[derive(Debug)]
pub struct GpuSession<'a> {
    gpu: &'a GpuContext,
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
    copies: IdealCopies,
    slots: Vec<Slot>,
    /// Pixels of the frame at work that may see silhouettes, for frames that have any.
    lists: Option<[wgpu::Buffer; 2]>,
    vignette: wgpu::TextureView,
    noise_table: wgpu::TextureView,
}

impl<'a> GpuSession<'a> {
    /// Uploads a scene and prepares for frames of its sequence; `truth`: with depth and coordinates.
    ///
    /// # Errors
    /// What the adapter cannot hold, faults of the shader files.
    pub fn new(
        gpu: &'a GpuContext,
        sequence: &Sequence,
        meshes: Arc<SceneBatches>,
        truth: bool,
    ) -> Result<Self, PassError> {
        check_output(gpu, sequence, truth)?;
        let scene = &sequence.scene;
        let buffers = SceneBuffers::new(gpu, scene, meshes)?;
        let preset = sequence.scenario.quality.preset;
        let ideal_pass = IdealPass::new(gpu, preset, buffers.tiles().is_some(), scene.fog_visibility_m)?;
        let session = Self {
            vignette: tables::vignette(gpu, sequence),
            noise_table: tables::noise_table(gpu),
            ideal_pass,
            reverse_pass: ReversePass::new(gpu),
            lens_pass: None,
            lens_map: None,
            zoom_maps: HashMap::new(),
            targets: Vec::new(),
            drawn: None,
            copies: IdealCopies::new(gpu),
            slots: slots(gpu, sequence, truth),
            lists: None,
            buffers,
            gpu,
        };
        gpu.check()?;
        Ok(session)
    }

    /// Goes on with another sequence over the same scene and with the same preset: kernels and pictures stay
    /// on the device. `before` is the sequence of now, with its wish for truth.
    ///
    /// # Errors
    /// Output frames that no storage buffer holds; the session then stays as it was.
    pub fn renew(
        &mut self,
        before: (&Sequence, bool),
        sequence: &Sequence,
        truth: bool,
    ) -> Result<(), GpuError> {
        check_output(self.gpu, sequence, truth)?;
        let same_size = before.0.scenario.camera.size_px == sequence.scenario.camera.size_px;
        if !same_size || truth != before.1 {
            self.slots = slots(self.gpu, sequence, truth);
            self.drawn = None;
        }
        if !same_size {
            self.lists = None;
        }
        self.lens_map = None;
        self.zoom_maps.clear();
        self.vignette = tables::vignette(self.gpu, sequence);
        // Bind groups hold what has just been replaced.
        self.targets.iter_mut().flat_map(|target| &mut target.groups).for_each(|groups| groups.clear());
        self.gpu.check()
    }

    /// Whether ideal frames that were drawn here are still there.
    #[must_use]
    pub fn has_ideal(&self) -> bool {
        self.drawn.is_some()
    }

    /// Forgets what was drawn.
    pub fn forget(&mut self) {
        self.drawn = None;
    }

    /// Tiles of the ground's picture, if it is too large for a texture.
    #[must_use]
    pub fn tiles(&self) -> Option<Arc<TerrainTiles>> {
        self.buffers.tiles().map(|tiles| tiles.ground.clone())
    }

    /// Measures from now on how long each pass takes on the device; `false` where the adapter has no time
    /// stamps.
    pub fn time_passes(&mut self) -> bool {
        for slot in &mut self.slots {
            slot.clock = PassClock::new(self.gpu);
        }
        self.slots.iter().all(|slot| slot.clock.is_some())
    }

    /// Records and submits a frame in one of [`FRAMES_IN_FLIGHT`] slots.
    ///
    /// # Errors
    /// What the adapter cannot hold, faults of the shader files and of the device.
    pub fn submit(&mut self, job: &GpuJob<'_>, slot: usize) -> Result<Submitted, PassError> {
        let begun = Instant::now();
        let mut clock = self.slots[slot].clock.take();
        let mut staging = self.slots[slot].staging.take().unwrap_or_else(|| Staging::new(&self.gpu.device));
        let recorded = self.record(job, slot, Recorder::new(&self.gpu.device, clock.as_mut(), &mut staging));
        self.slots[slot].clock = clock;
        self.slots[slot].staging = Some(staging);
        let commands = recorded.inspect_err(|_| {
            // What was recorded to be kept will never be there.
            (self.drawn, self.lens_map) = (None, None);
            self.zoom_maps.clear();
            self.targets.clear();
            self.copies.forget();
        })?;
        let record_ms = ms_since(begun);
        let begun = Instant::now();
        let submission = self.gpu.queue.submit([commands]);
        let submit_ms = ms_since(begun);
        self.slots[slot].recall(job.wanted == Wanted::Output);
        self.copies.recall();
        self.gpu.check()?;
        let (out_of_order, copy) =
            self.drawn.map(|drawn| (drawn.out_of_order, drawn.copy)).unwrap_or_default();
        Ok(Submitted { slot, submission, copy, out_of_order, record_ms, submit_ms })
    }

    /// Waits for a frame.
    ///
    /// # Errors
    /// Faults of the device.
    pub fn wait(&self, submitted: &Submitted) -> Result<(), GpuError> {
        let submission_index = Some(submitted.submission.clone());
        let wait = wgpu::PollType::Wait { submission_index, timeout: None };
        self.gpu.device.poll(wait).map_err(|error| GpuError::Device(error.to_string()))?;
        self.gpu.check()
    }

    /// The output frame of a submission that is done: linear R G B A, and the truth where it is wanted.
    ///
    /// # Errors
    /// Faults of the device.
    pub fn output(&self, submitted: &Submitted) -> Result<(Vec<f32>, Option<Vec<Truth>>), GpuError> {
        let slot = &self.slots[submitted.slot];
        let truth = slot.truth.as_ref().map(|truth| truth.read::<Truth>()).transpose()?;
        Ok((slot.color.read()?, truth))
    }

    /// The copy of an ideal frame, once its submission is done.
    ///
    /// # Errors
    /// Faults of the device.
    pub fn with_copy<R>(
        &self,
        copy: IdealCopy,
        read: impl FnOnce(copies::CopiedIdeal<'_>) -> R,
    ) -> Result<R, GpuError> {
        self.copies.read(copy, read)
    }

    /// How long the passes of a frame took, if they are timed.
    ///
    /// # Errors
    /// Faults of the device.
    pub fn pass_times(&self, submitted: &Submitted) -> Result<Vec<PassTime>, GpuError> {
        match &self.slots[submitted.slot].clock {
            Some(clock) => Ok(clock.passes(self.gpu, &readback::read_mapped(clock.on_host())?)),
            None => Ok(Vec::new()),
        }
    }

    /// Every pass of a frame, in order.
    fn record(
        &mut self,
        job: &GpuJob<'_>,
        slot: usize,
        mut recorder: Recorder<'_>,
    ) -> Result<wgpu::CommandBuffer, PassError> {
        let makes_output = job.wanted == Wanted::Output;
        if makes_output && job.plan.ray == RayStage::LensMap {
            self.lens_inverse(&mut recorder, job);
        }
        if job.redraws || self.drawn.is_none() {
            self.drawn = Some(self.ideal(&mut recorder, job, slot)?);
        }
        if makes_output {
            self.reverse(&mut recorder, job, slot)?;
            let slot = &self.slots[slot];
            for output in std::iter::once(&slot.color).chain(&slot.truth) {
                output.copy(recorder.encoder());
            }
        } else if let Some(drawn) = self.drawn.as_mut().filter(|drawn| drawn.copy.is_none()) {
            let target = &self.targets[drawn.target].ideal;
            drawn.copy = Some(self.copies.record(self.gpu, &mut recorder, target, &job.plan.ideal));
        }
        Ok(recorder.finish()?)
    }

    /// Pass 1, only when the lens has changed: the lens map.
    fn lens_inverse(&mut self, recorder: &mut Recorder<'_>, job: &GpuJob<'_>) {
        let (device, plan) = (&self.gpu.device, job.plan);
        let bits = plan.zoom.unwrap_or_default().to_bits();
        if self.lens_map.as_ref().is_some_and(|(of, _)| *of == bits) {
            return;
        }
        let pass = self.lens_pass.get_or_insert_with(|| LensInversePass::new(device));
        let mut warm = None;
        if let (Some(table), Some(zoom)) = (job.zoom, plan.zoom) {
            let entry = table.nearest(zoom);
            if let (false, Ok(camera)) =
                (self.zoom_maps.contains_key(&entry), table.at(table.entries()[entry].at))
            {
                let mut map = LensMap::new(device, camera.size_px);
                pass.encode(device, recorder, &camera, &mut map, None);
                self.zoom_maps.insert(entry, map);
            }
            warm = self.zoom_maps.get(&entry);
        }
        let mut map = match self.lens_map.take() {
            Some((_, map)) => map,
            None => LensMap::new(device, plan.camera.size_px),
        };
        pass.encode(device, recorder, &plan.camera, &mut map, warm);
        self.lens_map = Some((bits, map));
    }

    /// Pass 2, only when a key pose or the ideal frames' geometry has changed: the ideal frames.
    fn ideal(
        &mut self,
        recorder: &mut Recorder<'_>,
        job: &GpuJob<'_>,
        slot: usize,
    ) -> Result<Drawn, PassError> {
        let (gpu, plan) = (self.gpu, job.plan);
        let target = self.target(plan);
        self.buffers.bring_pictures(gpu, job.scene);
        let ideal_slots = &mut self.slots[slot].ideal;
        while ideal_slots.len() < plan.keys.len() {
            ideal_slots.push(self.ideal_pass.slot(gpu, &self.buffers));
        }
        if let Some(pool) = self.buffers.tiles_mut() {
            let mut tiles: Vec<u32> =
                job.terrain.iter().flat_map(|mesh| mesh.tiles.iter().copied()).collect();
            tiles.sort_unstable();
            tiles.dedup();
            pool.bring(gpu, &tiles)?;
        }
        let out_of_order = self.ideal_pass.encode(
            gpu,
            recorder,
            ideal_slots,
            job.scene,
            &self.buffers,
            plan,
            job.terrain,
            job.models,
            &self.targets[target].ideal,
        )?;
        Ok(Drawn { target, slot, out_of_order, copy: None })
    }

    /// A target for the ideal frames of a plan, the last of all: the one used longest ago makes room.
    fn target(&mut self, plan: &FramePlan) -> usize {
        let size_px = IdealTarget::size_for(plan, self.gpu.max_side_px());
        let known = self.targets.iter().position(|target| target.ideal.serves(size_px, plan));
        let target = known.map(|place| self.targets.remove(place)).unwrap_or_else(|| {
            let has_samples = plan.edges != EdgeStage::None || plan.samples_a_pixel > 1;
            let limit = if has_samples { MAX_FINE_TARGETS } else { MAX_TARGETS };
            let alike = |target: &Target| target.ideal.has_samples() == has_samples;
            if self.targets.iter().filter(|target| alike(target)).count() >= limit {
                let longest_unused = self.targets.iter().position(alike).unwrap_or_default();
                self.targets.remove(longest_unused);
            }
            Target { ideal: IdealTarget::new(self.gpu, size_px, plan), groups: Default::default() }
        });
        self.targets.push(target);
        self.targets.len() - 1
    }

    /// Pass 3: the output frame.
    fn reverse(
        &mut self,
        recorder: &mut Recorder<'_>,
        job: &GpuJob<'_>,
        slot: usize,
    ) -> Result<(), ComposeError> {
        let (gpu, plan) = (self.gpu, job.plan);
        let buffers = &mut self.slots[slot];
        if buffers.poses.size() < job.rows.len() as u64 {
            buffers.poses = pose_buffer(gpu, job.rows.len() as u64);
            self.targets.iter_mut().for_each(|target| target.groups[slot].clear());
        }
        recorder.write(&buffers.frame, 0, bytemuck::bytes_of(job.uniforms));
        recorder.write(&buffers.poses, 0, job.rows);
        let Some(target) = self.drawn.map(|drawn| &mut self.targets[drawn.target]) else { return Ok(()) };
        let lens_map = match plan.ray {
            RayStage::LensMap => self.lens_map.as_ref().map(|(_, map)| &map.view),
            _ => None,
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

/// Refuses output frames that no storage buffer or texture holds.
fn check_output(gpu: &GpuContext, sequence: &Sequence, truth: bool) -> Result<(), GpuError> {
    let [width, height] = sequence.scenario.camera.size_px.map(u64::from);
    // Lens map and vignette are textures of its size.
    let (needed, limit) = (width.max(height), u64::from(gpu.max_side_px()));
    if needed > limit {
        let (what, limit_name) = ("a side of the output frame".into(), "max_texture_dimension_2d (px)");
        return Err(GpuError::TooLarge { what, needed, limit_name, limit, fix: "reduce camera.size_px" });
    }
    gpu.check_storage("the output frame's colour", 16 * width * height, "reduce camera.size_px")?;
    if truth {
        let bytes = size_of::<Truth>() as u64 * width * height;
        let fix = "reduce camera.size_px or leave them out of output.channels";
        gpu.check_storage("the output frame's depth and coords", bytes, fix)?;
    }
    Ok(())
}

fn slots(gpu: &GpuContext, sequence: &Sequence, truth: bool) -> Vec<Slot> {
    (0..FRAMES_IN_FLIGHT).map(|_| Slot::new(gpu, sequence, truth)).collect()
}

fn ms_since(begun: Instant) -> f64 {
    begun.elapsed().as_secs_f64() * 1e3
}
