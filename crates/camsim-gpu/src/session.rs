//! One sequence on a GPU: buffers, passes and read-back of its frames.

use std::{collections::HashMap, sync::Arc, time::Instant};

use camsim_core::{
    scenario::{Face, Primary},
    scene::{SceneBatches, TerrainTiles},
    sequence::Sequence,
    temporal::IdealGeometry,
};
use camsim_plan::{EdgeStage, FramePlan, RayStage};

use crate::{
    adapter::{
        AdapterSession, CopiedIdeal, CopyHandle, FRAMES_IN_FLIGHT, GpuError, GpuJob, IdealPlanes, PassTime,
        Readback, Submitted,
    },
    context::GpuContext,
    ideal::{DrawPass, RenderTarget},
    layout::Truth,
    recorder::{PassClock, Recorder},
    reverse::{
        EMPTY_LIST, ReverseBindings, ReversePass,
        lens_inverse::{LensInversePass, LensMap, has_shader},
    },
    shaders::ComposeError,
    staging::Staging,
    upload::SceneBuffers,
};

mod frame_slot;
mod ideal_copies;
mod inspect;
mod readback;
mod tables;

use frame_slot::{FrameSlot, SessionTarget, group_of, list_buffer, pose_buffer};
use ideal_copies::FrameCopies;

/// Maximum number of cached ideal targets.
const MAX_TARGETS: usize = 4;
/// Maximum number of cached supersampled or multisampled ideal targets, which take up to 16 times the memory.
const MAX_FINE_TARGETS: usize = 2;

/// The ideal frames that were drawn last.
#[derive(Clone, Copy, Debug)]
struct LastIdeal {
    /// Index in the targets.
    target: usize,
    /// Slot of the frame for which they were drawn.
    slot: usize,
    out_of_order: u32,
    copy: Option<CopyHandle>,
}

/// One sequence on the GPU.
#[derive(Debug)]
pub struct GpuSession<'a> {
    gpu: &'a GpuContext,
    buffers: SceneBuffers,
    ideal_pass: DrawPass,
    reverse_pass: ReversePass,
    lens_pass: Option<LensInversePass>,
    /// Current lens map of each face and colour, and the bits of its zoom value.
    lens_maps: HashMap<(Option<Face>, Option<Primary>), (u64, LensMap)>,
    /// Lens maps of the zoom table's entries: initial values for the zoom values in between.
    zoom_maps: HashMap<usize, LensMap>,
    targets: Vec<SessionTarget>,
    last_ideal: Option<LastIdeal>,
    copies: FrameCopies,
    frame_slots: Vec<FrameSlot>,
    /// Pixel lists of the frame that is being recorded, for frames with silhouettes.
    lists: Option<[wgpu::Buffer; 2]>,
    vignette: wgpu::TextureView,
    noise_table: wgpu::TextureView,
}

impl<'a> GpuSession<'a> {
    /// Uploads a scene and prepares for frames of its sequence. `truth`: frames have depth and coordinates.
    ///
    /// # Errors
    /// What the adapter cannot hold, faults of the shader files.
    pub fn new(
        gpu: &'a GpuContext,
        sequence: &Sequence,
        meshes: Arc<SceneBatches>,
        truth: bool,
    ) -> Result<Self, GpuError> {
        check_output(gpu, sequence, truth)?;
        let scene = &sequence.scene;
        let buffers = SceneBuffers::new(gpu, scene, meshes)?;
        let preset = sequence.scenario.quality.preset;
        let ideal_pass = DrawPass::new(gpu, preset, buffers.tiles().is_some(), scene.fog_visibility_m)?;
        let session = Self {
            vignette: tables::vignette(gpu, sequence),
            noise_table: tables::noise_table(gpu),
            ideal_pass,
            reverse_pass: ReversePass::new(gpu),
            lens_pass: None,
            lens_maps: HashMap::new(),
            zoom_maps: HashMap::new(),
            targets: Vec::new(),
            last_ideal: None,
            copies: FrameCopies::new(gpu),
            frame_slots: frame_slots(gpu, sequence, truth),
            lists: None,
            buffers,
            gpu,
        };
        gpu.check()?;
        Ok(session)
    }
}

impl AdapterSession for GpuSession<'_> {
    fn renew(&mut self, before: (&Sequence, bool), sequence: &Sequence, truth: bool) -> Result<(), GpuError> {
        check_output(self.gpu, sequence, truth)?;
        let same_size = before.0.scenario.camera.size_px == sequence.scenario.camera.size_px;
        if !same_size || truth != before.1 {
            self.frame_slots = frame_slots(self.gpu, sequence, truth);
            self.last_ideal = None;
        }
        if !same_size {
            self.lists = None;
        }
        self.lens_maps.clear();
        self.zoom_maps.clear();
        self.vignette = tables::vignette(self.gpu, sequence);
        // Bind groups refer to what has just been replaced.
        self.targets.iter_mut().flat_map(|target| &mut target.groups).for_each(|groups| groups.clear());
        self.gpu.check()
    }

    fn forget(&mut self) {
        self.last_ideal = None;
    }

    fn tiles(&self) -> Option<Arc<TerrainTiles>> {
        self.buffers.tiles().map(|tiles| tiles.ground.clone())
    }

    fn time_passes(&mut self) -> bool {
        for slot in &mut self.frame_slots {
            slot.clock = PassClock::new(self.gpu);
        }
        self.frame_slots.iter().all(|slot| slot.clock.is_some())
    }

    fn submit(&mut self, job: &GpuJob<'_>, slot: usize) -> Result<Submitted, GpuError> {
        let start = Instant::now();
        let mut clock = self.frame_slots[slot].clock.take();
        let mut staging =
            self.frame_slots[slot].staging.take().unwrap_or_else(|| Staging::new(&self.gpu.device));
        let result = self.record(job, slot, Recorder::new(&self.gpu.device, clock.as_mut(), &mut staging));
        self.frame_slots[slot].clock = clock;
        self.frame_slots[slot].staging = Some(staging);
        let commands = result.inspect_err(|_| {
            // Caches whose contents were recorded but never submitted are invalid.
            self.last_ideal = None;
            self.lens_maps.clear();
            self.zoom_maps.clear();
            self.targets.clear();
            self.copies.forget();
        })?;
        let record_ms = ms_since(start);
        let start = Instant::now();
        self.frame_slots[slot].submission = Some(self.gpu.queue.submit([commands]));
        let submit_ms = ms_since(start);
        self.frame_slots[slot].request_mapping(job.readback == Readback::Output, job.plan.truth);
        self.copies.request_mapping();
        self.gpu.check()?;
        let (out_of_order, copy) =
            self.last_ideal.map(|last_ideal| (last_ideal.out_of_order, last_ideal.copy)).unwrap_or_default();
        let truth = job.plan.truth;
        Ok(Submitted { slot, truth, copy, out_of_order, record_ms, submit_ms })
    }

    fn wait(&self, submitted: &Submitted) -> Result<(), GpuError> {
        let submission_index = self.frame_slots[submitted.slot].submission.clone();
        let wait = wgpu::PollType::Wait { submission_index, timeout: None };
        self.gpu.device.poll(wait).map_err(|error| GpuError::Device(error.to_string()))?;
        self.gpu.check()
    }

    fn output(&self, submitted: &Submitted) -> Result<(Vec<f32>, Option<Vec<Truth>>), GpuError> {
        let slot = &self.frame_slots[submitted.slot];
        let truth = slot.truth.as_ref().filter(|_| submitted.truth);
        let truth = truth.map(|truth| truth.read::<Truth>()).transpose()?;
        Ok((slot.color.read()?, truth))
    }

    fn with_copy(&self, copy: CopyHandle, read: &mut dyn FnMut(CopiedIdeal<'_>)) -> Result<(), GpuError> {
        self.copies.read(copy, read)
    }

    fn pass_times(&self, submitted: &Submitted) -> Result<Vec<PassTime>, GpuError> {
        match &self.frame_slots[submitted.slot].clock {
            Some(clock) => Ok(clock.passes(self.gpu, &readback::read_mapped(clock.cpu_buffer())?)),
            None => Ok(Vec::new()),
        }
    }

    fn read_ideal(&self, ideal: &IdealGeometry) -> Result<Option<IdealPlanes>, GpuError> {
        self.ideal_images(ideal)
    }

    fn triangles_near_edges(&self) -> Result<Option<u64>, GpuError> {
        self.edge_triangles()
    }

    fn resident_tiles(&self) -> Option<[usize; 2]> {
        self.buffers.tiles().map(|tiles| [tiles.resident().0, tiles.ground.grid.count as usize])
    }
}

impl GpuSession<'_> {
    /// Records all passes of a frame in order.
    fn record(
        &mut self,
        job: &GpuJob<'_>,
        slot: usize,
        mut recorder: Recorder<'_>,
    ) -> Result<wgpu::CommandBuffer, GpuError> {
        let has_output = job.readback == Readback::Output;
        if has_output && job.plan.ray == RayStage::LensMap {
            self.lens_inverse(&mut recorder, job);
        }
        if job.redraws || self.last_ideal.is_none() {
            self.last_ideal = Some(self.ideal(&mut recorder, job, slot)?);
        }
        if has_output {
            self.reverse(&mut recorder, job, slot)?;
            let slot = &self.frame_slots[slot];
            for output in slot.outputs(job.plan.truth) {
                output.copy(recorder.encoder());
            }
        } else if let Some(last_ideal) =
            self.last_ideal.as_mut().filter(|last_ideal| last_ideal.copy.is_none())
        {
            let target = &self.targets[last_ideal.target].ideal;
            last_ideal.copy = Some(self.copies.record(self.gpu, &mut recorder, target, &job.plan.ideal));
        }
        recorder.finish()
    }

    /// Pass 1, only when the lens has changed: the lens map.
    fn lens_inverse(&mut self, recorder: &mut Recorder<'_>, job: &GpuJob<'_>) {
        let (device, plan) = (&self.gpu.device, job.plan);
        let zoom_bits = plan.zoom.unwrap_or_default().to_bits();
        let key = plan.lens_key();
        if self.lens_maps.get(&key).is_some_and(|(of, _)| *of == zoom_bits) {
            return;
        }
        let mut map = match self.lens_maps.remove(&key) {
            Some((_, map)) => map,
            None => LensMap::new(device, plan.camera.size_px),
        };
        if !has_shader(&plan.camera.lens) {
            map.upload(device, recorder, &plan.camera);
            self.lens_maps.insert(key, (zoom_bits, map));
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
        pass.encode(device, recorder, &plan.camera, &mut map, warm);
        self.lens_maps.insert(key, (zoom_bits, map));
    }

    /// Pass 2, only when a key pose or the ideal frames' geometry has changed: the ideal frames.
    fn ideal(
        &mut self,
        recorder: &mut Recorder<'_>,
        job: &GpuJob<'_>,
        slot: usize,
    ) -> Result<LastIdeal, GpuError> {
        let (gpu, plan) = (self.gpu, job.plan);
        let target = self.target(plan);
        self.buffers.upload_textures(gpu, job.scene);
        let ideal_slots = &mut self.frame_slots[slot].ideal;
        while ideal_slots.len() < plan.keys.len() {
            ideal_slots.push(self.ideal_pass.slot(gpu, &self.buffers));
        }
        if let Some(pool) = self.buffers.tiles_mut() {
            let mut tiles: Vec<u32> =
                job.terrain.iter().flat_map(|mesh| mesh.tiles.iter().copied()).collect();
            tiles.sort_unstable();
            tiles.dedup();
            pool.make_resident(gpu, &tiles)?;
        }
        let out_of_order = self.ideal_pass.encode(
            gpu,
            recorder,
            ideal_slots,
            job.scene,
            &mut self.buffers,
            plan,
            job.terrain,
            job.models,
            &self.targets[target].ideal,
        )?;
        Ok(LastIdeal { target, slot, out_of_order, copy: None })
    }

    /// Target for the ideal frames of a plan. It becomes the last of all; the least recently used one of its
    /// kind is dropped if there are too many.
    fn target(&mut self, plan: &FramePlan) -> usize {
        let size_px = RenderTarget::size_for(plan, self.gpu.max_side_px());
        let face = plan.camera.lens.face();
        let serves = |target: &SessionTarget| target.face == face && target.ideal.serves(size_px, plan);
        let cached = self.targets.iter().position(serves);
        let target = cached.map(|index| self.targets.remove(index)).unwrap_or_else(|| {
            let has_samples = plan.edges != EdgeStage::None || plan.samples_a_pixel > 1;
            let limit = if has_samples { MAX_FINE_TARGETS } else { MAX_TARGETS };
            let is_same_kind =
                |target: &SessionTarget| target.face == face && target.ideal.has_samples() == has_samples;
            if self.targets.iter().filter(|target| is_same_kind(target)).count() >= limit {
                let longest_unused = self.targets.iter().position(is_same_kind).unwrap_or_default();
                self.targets.remove(longest_unused);
            }
            SessionTarget {
                face,
                ideal: RenderTarget::new(self.gpu, size_px, plan),
                groups: Default::default(),
            }
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
        let buffers = &mut self.frame_slots[slot];
        if buffers.poses.size() < job.rows.len() as u64 {
            buffers.poses = pose_buffer(gpu, job.rows.len() as u64);
            self.targets.iter_mut().for_each(|target| target.clear(slot));
        }
        recorder.write(&buffers.frame, 0, bytemuck::bytes_of(job.uniforms));
        recorder.write(&buffers.poses, 0, job.rows);
        let Some(target) = self.last_ideal.map(|last_ideal| &mut self.targets[last_ideal.target]) else {
            return Ok(());
        };
        let lens_map = match plan.ray {
            RayStage::LensMap => self.lens_maps.get(&plan.lens_key()).map(|(_, map)| &map.view),
            _ => None,
        };
        let lists = (plan.edges != EdgeStage::None).then(|| {
            let lists = self.lists.get_or_insert_with(|| {
                ["camsim.candidates", "camsim.filtered_candidates"]
                    .map(|label| list_buffer(gpu, label, plan.camera.size_px))
            });
            lists.iter().for_each(|list| recorder.write(list, 0, bytemuck::cast_slice(&EMPTY_LIST)));
            &*lists
        });
        let bindings = ReverseBindings {
            lists,
            frame: &buffers.frame,
            noise_table: &self.noise_table,
            color: &target.ideal.gather_color,
            depth: &target.ideal.gather_depth,
            fine: target.ideal.supersampled.as_ref(),
            poses: &buffers.poses,
            vignette: &self.vignette,
            lens_map,
            out_color: &buffers.color.gpu_buffer,
            out_truth: buffers.truth.as_ref().filter(|_| plan.truth).map(|truth| &truth.gpu_buffer),
        };
        // The other fields of the target are borrowed by the bindings.
        let groups = &mut target.groups[group_of(slot, plan.primary)];
        self.reverse_pass.encode(gpu, recorder, plan, &bindings, groups)
    }
}

/// Checks that storage buffers and textures hold the output frame.
fn check_output(gpu: &GpuContext, sequence: &Sequence, truth: bool) -> Result<(), GpuError> {
    let [width, height] = sequence.scenario.camera.size_px.map(u64::from);
    // Lens map and vignette are textures of the same size.
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

fn frame_slots(gpu: &GpuContext, sequence: &Sequence, truth: bool) -> Vec<FrameSlot> {
    (0..FRAMES_IN_FLIGHT).map(|_| FrameSlot::new(gpu, sequence, truth)).collect()
}

fn ms_since(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}
