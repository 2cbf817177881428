//! The ideal frame: linear colour and reversed depth of a perfect camera at the key instant (paper section
//! 4).

use std::{collections::HashMap, ops::Range};

use camsim_core::{
    scenario::Preset,
    scene::{LodTolerance, PlacedMesh, Scene},
};
use camsim_plan::{
    EdgeStage, FramePlan, SIZE_QUANTUM_PX,
    uniforms::{IdealCamera, base_ned_m, ideal_camera},
};

use crate::{
    context::GpuContext, error::PassError, layout::MeshPlacement, recorder::Recorder, shaders::ComposeError,
    upload::SceneBuffers,
};

mod drawing;
mod fine;
mod layers;
mod marks;
mod near_marks;
mod pipelines;
mod sampled;
mod surfaces;

pub(crate) use fine::whole;
pub use fine::{FINE_SAMPLES, FineTarget};
use fine::{TILE_PX, scale_of, texture};
use layers::Ordered;
use marks::MarksPass;
#[cfg(test)]
pub(crate) use marks::spread_slot;
use near_marks::NearMarksPass;
use pipelines::{SurfaceKey, SurfacePipelines};
#[cfg(test)]
#[cfg(test)]
pub(crate) use pipelines::{ground_slots, mesh_slots};
use sampled::{MiddleDepthPass, SampledTarget};
use surfaces::{TerrainSlot, Triangles, draw_meshes, draw_terrain, place_meshes, place_terrain};

/// Colour format of the ideal frame.
pub const COLOR_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;
/// Colour format of the paper preset's ideal frame: the device encodes on writing; the gather reads what is
/// stored ([`STORED_VIEW`]).
pub const STORED_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;
/// How the paper preset's gather sees it.
pub const STORED_VIEW: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
/// Depth format of the ideal frame: near / z.
pub const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
/// Uniform buffers have at least this many bytes.
const MIN_BYTES: u64 = 256;

/// Textures that an ideal frame is drawn to.
#[derive(Debug)]
pub struct IdealTarget {
    /// Allocated width, height.
    pub allocated_px: [u32; 2],
    /// Linear colour.
    pub color: wgpu::Texture,
    /// near / z.
    pub depth: wgpu::Texture,
    /// What frames with silhouettes have besides.
    pub fine: Option<FineTarget>,
    /// What frames of several samples a pixel are drawn to first.
    sampled: Option<SampledTarget>,
    /// What surfaces are drawn to with one sample a pixel.
    drawn_color: wgpu::TextureView,
    drawn_depth: wgpu::TextureView,
    /// The colour as the gather reads it.
    pub gathered_color: wgpu::TextureView,
    /// The depth as the gather reads it.
    pub gathered_depth: wgpu::TextureView,
}

impl IdealTarget {
    /// Allocated size for the ideal frames of a plan: one below the other. Rounded up, so that a few
    /// allocations serve all frames; depends on the frame alone.
    #[must_use]
    pub fn size_for(plan: &FramePlan, max_side_px: u32) -> [u32; 2] {
        let width = plan.ideal.size_px[0].next_multiple_of(SIZE_QUANTUM_PX);
        [width, key_rows(&plan.ideal) * plan.keys.len() as u32].map(|side| side.min(max_side_px))
    }

    /// Whether the ideal frames of a plan, which take this size, are drawn to it.
    #[must_use]
    pub fn serves(&self, allocated_px: [u32; 2], plan: &FramePlan) -> bool {
        self.allocated_px == allocated_px
            && self.fine.as_ref().map(|fine| fine.scale) == scale_of(plan.edges)
            && self.sampled.is_some() == (plan.samples_a_pixel > 1)
    }

    /// Whether it has textures of several samples a pixel, for whatever.
    #[must_use]
    pub fn has_samples(&self) -> bool {
        self.fine.is_some() || self.sampled.is_some()
    }

    /// Allocates.
    #[must_use]
    pub fn new(gpu: &GpuContext, allocated_px: [u32; 2], plan: &FramePlan) -> Self {
        let fine = scale_of(plan.edges).map(|scale| FineTarget::new(gpu, allocated_px, scale));
        let sampled = (plan.samples_a_pixel > 1).then(|| SampledTarget::new(gpu, allocated_px));
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT
            | wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::COPY_SRC;
        let color = texture(gpu, "camsim.ideal.color", allocated_px, color_format(plan.preset), 1, usage);
        let depth = texture(gpu, "camsim.ideal.depth", allocated_px, DEPTH_FORMAT, 1, usage);
        let format = (color.format() == STORED_FORMAT).then_some(STORED_VIEW);
        // Not every usage of the texture is legal for a view of another format, and the gather needs one
        // only.
        let usage = Some(wgpu::TextureUsages::TEXTURE_BINDING);
        let gathered_color =
            color.create_view(&wgpu::TextureViewDescriptor { format, usage, ..Default::default() });
        let (drawn_color, drawn_depth, gathered_depth) = (whole(&color), whole(&depth), whole(&depth));
        Self {
            allocated_px,
            color,
            depth,
            fine,
            sampled,
            drawn_color,
            drawn_depth,
            gathered_color,
            gathered_depth,
        }
    }
}

/// Format that surfaces are drawn to with one sample a pixel.
fn color_format(preset: Preset) -> wgpu::TextureFormat {
    match preset {
        Preset::Default => COLOR_FORMAT,
        Preset::Paper => STORED_FORMAT,
    }
}

pub use camsim_plan::uniforms::key_rows;

/// Pipelines of the ideal render.
#[derive(Debug)]
pub struct IdealPass {
    /// Compiled when a silhouette is first in view.
    silhouettes: Option<SilhouettePasses>,
    /// Compiled when pixels first have several samples.
    resolve_depth: Option<MiddleDepthPass>,
    camera_layout: wgpu::BindGroupLayout,
    terrain_layout: wgpu::BindGroupLayout,
    mesh_layout: wgpu::BindGroupLayout,
    placement_layout: wgpu::BindGroupLayout,
    /// Compiled when first needed.
    pipelines: HashMap<SurfaceKey, SurfacePipelines>,
    color_format: wgpu::TextureFormat,
    /// Whether the ground's picture is in tiles.
    has_tiles: bool,
    /// Whether the ideal frame has the scene's fog.
    has_fog: bool,
}

/// What frames with silhouettes take besides drawing.
#[derive(Debug)]
struct SilhouettePasses {
    marks: MarksPass,
    near_marks: NearMarksPass,
}

/// Buffers of one ideal frame of a frame in flight, and their bind groups.
#[derive(Debug)]
pub struct IdealSlot {
    camera: wgpu::Buffer,
    /// None without a terrain.
    terrain: Option<TerrainSlot>,
    placements: wgpu::Buffer,
    camera_group: wgpu::BindGroup,
    placement_group: wgpu::BindGroup,
    /// By batch: what is on it, and which placements are drawn with each of its levels of detail.
    mesh_groups: Vec<wgpu::BindGroup>,
    drawn: Vec<Vec<Range<u32>>>,
    /// What is mixed, from behind to the front; none where nothing in the scene is.
    layers: Option<Ordered>,
}

impl IdealSlot {
    /// Arguments of the draw of the terrain's triangles near marks, the first of them three times their
    /// number.
    pub(crate) fn near_marks(&self) -> Option<&wgpu::Buffer> {
        self.terrain.as_ref().map(|terrain| &terrain.kept.arguments)
    }
}

impl IdealPass {
    /// Compiles the pipelines.
    ///
    /// # Errors
    /// Faults of the shader files.
    pub fn new(
        gpu: &GpuContext,
        preset: Preset,
        has_tiles: bool,
        fog_visibility_m: Option<f64>,
    ) -> Result<Self, ComposeError> {
        let device = &gpu.device;
        let layout = |label, entries: &[wgpu::BindGroupLayoutEntry]| {
            device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries })
        };
        let every = wgpu::ShaderStages::VERTEX_FRAGMENT | wgpu::ShaderStages::COMPUTE;
        let camera_layout =
            layout("camsim.ideal.camera", &[buffer_entry(0, every, wgpu::BufferBindingType::Uniform)]);
        let vertices = wgpu::ShaderStages::VERTEX | wgpu::ShaderStages::COMPUTE;
        let storage = wgpu::BufferBindingType::Storage { read_only: true };
        let [texture, sampler] = texture_entries(wgpu::TextureViewDimension::D2);
        let [tiles, _] = texture_entries(wgpu::TextureViewDimension::D2Array);
        let pulled = buffer_entry(2, vertices, storage);
        let terrain_layout = match has_tiles {
            true => layout(
                "camsim.ideal.terrain",
                &[tiles, sampler, pulled, buffer_entry(3, wgpu::ShaderStages::FRAGMENT, storage)],
            ),
            false => layout("camsim.ideal.terrain", &[texture, sampler, pulled]),
        };
        let material = buffer_entry(2, wgpu::ShaderStages::FRAGMENT, wgpu::BufferBindingType::Uniform);
        let mesh_layout = layout("camsim.ideal.mesh", &[texture, sampler, material]);
        let placement_layout =
            layout("camsim.ideal.placements", &[buffer_entry(0, wgpu::ShaderStages::VERTEX, storage)]);
        Ok(Self {
            silhouettes: None,
            resolve_depth: None,
            camera_layout,
            terrain_layout,
            mesh_layout,
            placement_layout,
            pipelines: HashMap::new(),
            color_format: color_format(preset),
            has_tiles,
            // The paper's fog comes after the gather.
            has_fog: fog_visibility_m.is_some() && preset != Preset::Paper,
        })
    }

    /// Buffers for one ideal frame of this scene, whose pictures are there.
    #[must_use]
    pub fn slot(&self, gpu: &GpuContext, buffers: &SceneBuffers) -> IdealSlot {
        let create = |label, size: u64, usage| {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: size.max(MIN_BYTES),
                usage: usage | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let camera =
            create("camsim.ideal.camera", size_of::<IdealCamera>() as u64, wgpu::BufferUsages::UNIFORM);
        let placement_bytes = (buffers.meshes.placed.len() * size_of::<MeshPlacement>()) as u64;
        let placements = create("camsim.ideal.placements", placement_bytes, wgpu::BufferUsages::STORAGE);
        let group = |layout, entries: &[wgpu::BindGroupEntry]| {
            gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("camsim.ideal"),
                layout,
                entries,
            })
        };
        let entry = |binding, resource| wgpu::BindGroupEntry { binding, resource };
        let camera_group = group(&self.camera_layout, &[entry(0, camera.as_entire_binding())]);
        let terrain = buffers.terrain.as_ref().map(|_| TerrainSlot::new(gpu));
        let mesh_groups = buffers.batches.iter().zip(&buffers.pictures).map(|(batch, picture)| {
            group(
                &self.mesh_layout,
                &[
                    entry(0, wgpu::BindingResource::TextureView(picture)),
                    entry(1, wgpu::BindingResource::Sampler(&batch.sampler)),
                    entry(2, batch.material.as_entire_binding()),
                ],
            )
        });
        let mesh_groups = mesh_groups.collect();
        let layers = buffers.batches.iter().any(|batch| batch.kind.blends).then(|| Ordered::new(gpu));
        let placement_group = group(&self.placement_layout, &[entry(0, placements.as_entire_binding())]);
        IdealSlot {
            camera,
            terrain,
            placements,
            camera_group,
            placement_group,
            mesh_groups,
            drawn: Vec::new(),
            layers,
        }
    }

    /// Records the ideal frames of a plan, each with its own slot and, where there is a terrain, its own
    /// triangles of it; returns how many blended triangles are out of order.
    ///
    /// # Errors
    /// Faults of the shader files; `GpuError::TooLarge` for triangles that no buffer holds.
    pub fn encode(
        &mut self,
        gpu: &GpuContext,
        recorder: &mut Recorder<'_>,
        slots: &mut [IdealSlot],
        scene: &Scene,
        buffers: &SceneBuffers,
        plan: &FramePlan,
        meshes: &[PlacedMesh],
        tolerance: &LodTolerance,
        target: &IdealTarget,
    ) -> Result<u32, PassError> {
        let plain = if target.sampled.is_some() {
            SurfaceKey::Fine(plan.surface_reads)
        } else {
            SurfaceKey::Plain(plan.surface_reads)
        };
        if target.sampled.is_some() && self.resolve_depth.is_none() {
            self.resolve_depth = Some(MiddleDepthPass::new(gpu)?);
        }
        let colored = target.fine.as_ref().map(|fine| fine.color.is_some());
        let fine =
            colored.map(
                |colored| if colored { SurfaceKey::Fine(plan.surface_reads) } else { SurfaceKey::FineDepth },
            );
        for key in [Some(plain), fine].into_iter().flatten() {
            if !self.pipelines.contains_key(&key) {
                self.pipelines.insert(key, self.surface_pipelines(gpu, key, &buffers.batches)?);
            }
        }
        if fine.is_some() && self.silhouettes.is_none() {
            let near_marks = NearMarksPass::new(gpu, &self.camera_layout, &self.terrain_layout)?;
            self.silhouettes = Some(SilhouettePasses { marks: MarksPass::new(gpu)?, near_marks });
        }
        let mut out_of_order = 0;
        let mut index_counts = Vec::new();
        for (k, (key, slot)) in plan.keys.iter().zip(slots.iter_mut()).enumerate() {
            let base_ned_m = base_ned_m(&key.pose);
            recorder.write(
                &slot.camera,
                0,
                bytemuck::bytes_of(&ideal_camera(plan, &key.pose, base_ned_m, scene)),
            );
            let mut indices = 0;
            if let (Some(terrain), Some(on_device), Some(mesh)) =
                (&mut slot.terrain, &buffers.terrain, meshes.get(k))
            {
                indices = place_terrain(gpu, recorder, terrain, mesh)?;
                terrain.bind(gpu, recorder, &self.terrain_layout, on_device, &buffers.sampler);
            }
            index_counts.push(indices);
            let seen = place_meshes(recorder, slot, buffers, &key.pose, tolerance, base_ned_m);
            if let Some(layers) = &mut slot.layers {
                layers.order(gpu, recorder, buffers, &slot.drawn, &seen, &key.pose, tolerance.tangents)?;
                out_of_order += layers.out_of_order;
            }
        }
        let (color, depth) = match &target.sampled {
            None => (color_attachment(&target.drawn_color, scene), &target.drawn_depth),
            Some(sampled) => {
                let mut color = color_attachment(&sampled.color, scene);
                color.resolve_target = Some(&target.drawn_color);
                color.ops.store = wgpu::StoreOp::Discard;
                (color, &sampled.depth)
            }
        };
        let mut pass = recorder.render_pass("ideal", Some(color), Some(depth_attachment(depth)));
        self.draw_keys(&mut pass, plain, plan, 1, buffers, slots, |k| Triangles::All(index_counts[k]));
        drop(pass);
        if let (Some(sampled), Some(resolve_depth)) = (&target.sampled, &self.resolve_depth) {
            resolve_depth.encode(gpu, recorder, sampled, depth_attachment(&target.drawn_depth));
        }
        if let (Some(fine), Some(key), Some(passes), EdgeStage::Supersampled { thin, .. }) =
            (&target.fine, fine, &self.silhouettes, plan.edges)
        {
            let SilhouettePasses { marks, near_marks } = passes;
            if !thin {
                marks.mark(gpu, recorder, plan, target, fine, false);
                near_marks.encode(
                    gpu,
                    recorder,
                    plan,
                    target.allocated_px[0].div_ceil(TILE_PX),
                    slots,
                    &index_counts,
                    fine,
                );
            }
            let color = fine.color_view.as_ref().map(|view| color_attachment(view, scene));
            let mut pass =
                recorder.render_pass("ideal_fine", color, Some(depth_attachment(&fine.depth_view)));
            self.draw_keys(&mut pass, key, plan, fine.scale, buffers, slots, |k| {
                match (thin, index_counts[k]) {
                    (false, 1..) => Triangles::Kept,
                    (_, count) => Triangles::All(count),
                }
            });
            drop(pass);
            if thin {
                marks.mark(gpu, recorder, plan, target, fine, true);
            }
            marks.stamp(gpu, recorder, target, fine);
            marks.borders(gpu, recorder, plan, target, fine);
        }
        Ok(out_of_order)
    }

    /// Draws each key's surfaces, one key below the other.
    fn draw_keys(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        key: SurfaceKey,
        plan: &FramePlan,
        scale: u32,
        buffers: &SceneBuffers,
        slots: &[IdealSlot],
        triangles: impl Fn(usize) -> Triangles,
    ) {
        let Some(pipelines) = self.pipelines.get(&key) else { return };
        let [width, height] = plan.ideal.size_px.map(|side| side * scale);
        for (k, slot) in slots.iter().take(plan.keys.len()).enumerate() {
            let first_row = key_rows(&plan.ideal) * k as u32 * scale;
            pass.set_viewport(0.0, first_row as f32, width as f32, height as f32, 0.0, 1.0);
            pass.set_scissor_rect(0, first_row, width, height);
            pass.set_bind_group(0, &slot.camera_group, &[]);
            draw_terrain(pass, pipelines, slot, triangles(k));
            draw_meshes(pass, pipelines, slot, buffers, false);
            if let Some(layers) = &slot.layers {
                layers.draw(pass, pipelines, slot, buffers);
                // Their depth last: what is mixed hides nothing that is mixed.
                draw_meshes(pass, pipelines, slot, buffers, true);
            }
        }
    }
}

/// Linear colour, cleared to the sky's.
fn color_attachment<'a>(view: &'a wgpu::TextureView, scene: &Scene) -> wgpu::RenderPassColorAttachment<'a> {
    let [r, g, b] = scene.sky_linear.map(f64::from);
    wgpu::RenderPassColorAttachment {
        view,
        depth_slice: None,
        resolve_target: None,
        ops: wgpu::Operations {
            load: wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a: 1.0 }),
            store: wgpu::StoreOp::Store,
        },
    }
}

/// Reversed depth, cleared: 0 is infinitely far.
fn depth_attachment(view: &wgpu::TextureView) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    wgpu::RenderPassDepthStencilAttachment {
        view,
        depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store }),
        stencil_ops: None,
    }
}

fn buffer_entry(
    binding: u32,
    visibility: wgpu::ShaderStages,
    ty: wgpu::BufferBindingType,
) -> wgpu::BindGroupLayoutEntry {
    let ty = wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None }
}

fn texture_entries(view_dimension: wgpu::TextureViewDimension) -> [wgpu::BindGroupLayoutEntry; 2] {
    let visibility = wgpu::ShaderStages::FRAGMENT;
    let texture = wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable: true },
        view_dimension,
        multisampled: false,
    };
    let sampler = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
    [
        wgpu::BindGroupLayoutEntry { binding: 0, visibility, ty: texture, count: None },
        wgpu::BindGroupLayoutEntry { binding: 1, visibility, ty: sampler, count: None },
    ]
}
