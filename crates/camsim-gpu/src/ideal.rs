//! The ideal frame: linear colour and reversed depth of a perfect camera at the key instant (paper section
//! 4).

use std::{collections::HashMap, ops::Range};

use camsim_core::{
    scenario::Preset,
    scene::{LodTolerance, PlacedMesh, Scene},
};
use camsim_plan::{
    EdgeStage, FramePlan,
    uniforms::{IdealCamera, base_ned_m, ideal_camera},
};

use crate::{
    adapter::GpuError, context::GpuContext, layout::MeshPlacement, recorder::Recorder, shaders::ComposeError,
    upload::SceneBuffers,
};

mod blended_triangles;
mod draw_state;
mod draw_surfaces;
mod edge_mask;
mod multisampled_target;
mod supersampled_target;
mod surface_pipelines;
mod target;
mod triangles_near_edges;

use blended_triangles::BlendedTriangles;
use draw_surfaces::{
    TerrainSlot, TriangleSelection, draw_meshes, draw_terrain, upload_placements, upload_terrain,
};
use edge_mask::EdgeMaskPass;
#[cfg(test)]
pub(crate) use edge_mask::thin_surfaces_slot;
use multisampled_target::ResolveDepthPass;
use supersampled_target::TILE_PX;
pub(crate) use supersampled_target::full_view;
pub use supersampled_target::{FINE_SAMPLES, SupersampledTarget};
use surface_pipelines::{SurfaceKey, SurfacePipelines};
#[cfg(test)]
pub(crate) use surface_pipelines::{mesh_slots, terrain_slots};
pub use target::RenderTarget;
use triangles_near_edges::EdgeTrianglesPass;

/// Colour format of the ideal frame.
pub const COLOR_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;
/// Colour format of the paper preset's ideal frame: the GPU encodes to sRGB on writing, and the gather reads
/// the encoded values ([`SRGB_ENCODED_VIEW`]).
pub const SRGB_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;
/// View format through which the paper preset's gather reads encoded values.
pub const SRGB_ENCODED_VIEW: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
/// Depth format of the ideal frame: near / z.
pub const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
/// Least size of uniform buffers, bytes.
const MIN_BYTES: u64 = 256;

/// Colour format with one sample per pixel.
fn color_format(preset: Preset) -> wgpu::TextureFormat {
    match preset {
        Preset::Default => COLOR_FORMAT,
        Preset::Paper => SRGB_FORMAT,
    }
}

pub use camsim_plan::uniforms::key_rows;

/// Pipelines that draw ideal frames.
#[derive(Debug)]
pub struct DrawPass {
    /// Compiled when a silhouette is first in view.
    silhouettes: Option<SilhouettePasses>,
    /// Compiled when pixels first have several samples.
    resolve_depth: Option<ResolveDepthPass>,
    camera_layout: wgpu::BindGroupLayout,
    terrain_layout: wgpu::BindGroupLayout,
    mesh_layout: wgpu::BindGroupLayout,
    placement_layout: wgpu::BindGroupLayout,
    /// Compiled when first needed.
    pipelines: HashMap<SurfaceKey, SurfacePipelines>,
    color_format: wgpu::TextureFormat,
    /// Whether the terrain's texture is split into tiles.
    has_tiles: bool,
    /// Whether the ideal frame includes the scene's fog.
    has_fog: bool,
}

/// Passes of frames with silhouettes.
#[derive(Debug)]
struct SilhouettePasses {
    mask: EdgeMaskPass,
    edge_triangles: EdgeTrianglesPass,
}

/// Buffers and bind groups of one ideal frame of a frame in flight.
#[derive(Debug)]
pub struct DrawSlot {
    camera: wgpu::Buffer,
    /// `None` without a terrain.
    terrain: Option<TerrainSlot>,
    placements: wgpu::Buffer,
    camera_group: wgpu::BindGroup,
    placement_group: wgpu::BindGroup,
    /// Texture and material by batch.
    material_groups: Vec<wgpu::BindGroup>,
    level_instances: Vec<Vec<Range<u32>>>,
    /// Blended triangles, back to front; `None` if nothing in the scene blends.
    blended: Option<BlendedTriangles>,
}

impl DrawSlot {
    /// Arguments of the indirect draw of the terrain triangles near edges; the first is the number of
    /// indices.
    pub(crate) fn edge_triangles_arguments(&self) -> Option<&wgpu::Buffer> {
        self.terrain.as_ref().map(|terrain| &terrain.selection.arguments)
    }
}

impl DrawPass {
    /// Creates the layouts; pipelines are compiled when needed.
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
            // The paper preset applies its fog after the gather.
            has_fog: fog_visibility_m.is_some() && preset != Preset::Paper,
        })
    }

    /// Creates the buffers for one ideal frame of this scene, whose textures have been uploaded.
    #[must_use]
    pub fn slot(&self, gpu: &GpuContext, buffers: &SceneBuffers) -> DrawSlot {
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
        let material_groups = buffers.batches.iter().zip(&buffers.textures).map(|(batch, texture)| {
            group(
                &self.mesh_layout,
                &[
                    entry(0, wgpu::BindingResource::TextureView(texture)),
                    entry(1, wgpu::BindingResource::Sampler(&batch.sampler)),
                    entry(2, batch.material.as_entire_binding()),
                ],
            )
        });
        let material_groups = material_groups.collect();
        let blended =
            buffers.batches.iter().any(|batch| batch.kind.blends).then(|| BlendedTriangles::new(gpu));
        let placement_group = group(&self.placement_layout, &[entry(0, placements.as_entire_binding())]);
        DrawSlot {
            camera,
            terrain,
            placements,
            camera_group,
            placement_group,
            material_groups,
            level_instances: Vec::new(),
            blended,
        }
    }

    /// Records the ideal frames of a plan, each with its own slot and, if there is a terrain, its own
    /// triangles of it. Returns how many blended triangles are out of order.
    ///
    /// # Errors
    /// Faults of the shader files; `GpuError::TooLarge` for triangles that no buffer holds.
    pub fn encode(
        &mut self,
        gpu: &GpuContext,
        recorder: &mut Recorder<'_>,
        slots: &mut [DrawSlot],
        scene: &Scene,
        buffers: &mut SceneBuffers,
        plan: &FramePlan,
        meshes: &[PlacedMesh],
        tolerance: &LodTolerance,
        target: &RenderTarget,
    ) -> Result<u32, GpuError> {
        let (base_key, supersampled_key) = self.compile(gpu, buffers, plan, target)?;
        let (index_counts, out_of_order) =
            self.upload_keys(gpu, recorder, slots, scene, buffers, plan, meshes, tolerance)?;
        let (color, depth) = match &target.multisampled {
            None => (color_attachment(&target.color_attachment_view, scene), &target.depth_attachment_view),
            Some(multisampled) => {
                let mut color = color_attachment(&multisampled.color, scene);
                color.resolve_target = Some(&target.color_attachment_view);
                color.ops.store = wgpu::StoreOp::Discard;
                (color, &multisampled.depth)
            }
        };
        let mut pass = recorder.render_pass("ideal", Some(color), Some(depth_attachment(depth)));
        self.draw_keys(&mut pass, base_key, plan, 1, buffers, slots, |k| {
            TriangleSelection::All(index_counts[k])
        });
        drop(pass);
        if let (Some(multisampled), Some(resolve_depth)) = (&target.multisampled, &self.resolve_depth) {
            let depth = depth_attachment(&target.depth_attachment_view);
            resolve_depth.encode(gpu, recorder, multisampled, depth);
        }
        if let Some(key) = supersampled_key {
            self.encode_supersampled(gpu, recorder, key, slots, scene, buffers, plan, &index_counts, target);
        }
        Ok(out_of_order)
    }

    /// Compiles what a plan needs. Returns the pipelines of the frame itself and of its supersampled version.
    fn compile(
        &mut self,
        gpu: &GpuContext,
        buffers: &SceneBuffers,
        plan: &FramePlan,
        target: &RenderTarget,
    ) -> Result<(SurfaceKey, Option<SurfaceKey>), ComposeError> {
        let base_key = if target.multisampled.is_some() {
            SurfaceKey::Multisampled(plan.surface_reads)
        } else {
            SurfaceKey::SingleSample(plan.surface_reads)
        };
        if target.multisampled.is_some() && self.resolve_depth.is_none() {
            self.resolve_depth = Some(ResolveDepthPass::new(gpu)?);
        }
        let supersampled_key = target.supersampled.as_ref().map(|supersampled| match supersampled.color {
            Some(_) => SurfaceKey::Multisampled(plan.surface_reads),
            None => SurfaceKey::MultisampledDepth,
        });
        for key in [Some(base_key), supersampled_key].into_iter().flatten() {
            if !self.pipelines.contains_key(&key) {
                self.pipelines.insert(key, self.surface_pipelines(gpu, key, &buffers.batches)?);
            }
        }
        if supersampled_key.is_some() && self.silhouettes.is_none() {
            let edge_triangles = EdgeTrianglesPass::new(gpu, &self.camera_layout, &self.terrain_layout)?;
            self.silhouettes = Some(SilhouettePasses { mask: EdgeMaskPass::new(gpu)?, edge_triangles });
        }
        Ok((base_key, supersampled_key))
    }

    /// Uploads camera, terrain and placements of all key frames. Returns the number of terrain indices of
    /// each key frame, and how many blended triangles are out of order.
    fn upload_keys(
        &self,
        gpu: &GpuContext,
        recorder: &mut Recorder<'_>,
        slots: &mut [DrawSlot],
        scene: &Scene,
        buffers: &mut SceneBuffers,
        plan: &FramePlan,
        meshes: &[PlacedMesh],
        tolerance: &LodTolerance,
    ) -> Result<(Vec<u32>, u32), GpuError> {
        let mut out_of_order = 0;
        let mut index_counts = Vec::new();
        for (k, (key, slot)) in plan.keys.iter().zip(slots.iter_mut()).enumerate() {
            let base_ned_m = base_ned_m(&key.pose);
            let camera = ideal_camera(plan, &key.pose, base_ned_m, scene);
            recorder.write(&slot.camera, 0, bytemuck::bytes_of(&camera));
            let mut indices = 0;
            if let (Some(terrain), Some(terrain_buffers), Some(mesh)) =
                (&mut slot.terrain, &buffers.terrain, meshes.get(k))
            {
                indices = upload_terrain(gpu, recorder, terrain, mesh)?;
                terrain.bind(gpu, recorder, &self.terrain_layout, terrain_buffers, &buffers.sampler);
            }
            index_counts.push(indices);
            let meshes_in_view =
                upload_placements(gpu, recorder, slot, buffers, &key.pose, tolerance, base_ned_m);
            if let Some(blended) = &mut slot.blended {
                let instances = &slot.level_instances;
                let tangents = tolerance.tangents;
                blended.sort(gpu, recorder, buffers, instances, &meshes_in_view, &key.pose, tangents)?;
                out_of_order += blended.out_of_order;
            }
        }
        Ok((index_counts, out_of_order))
    }

    /// Records edge mask, samples and borders of frames with silhouettes.
    fn encode_supersampled(
        &self,
        gpu: &GpuContext,
        recorder: &mut Recorder<'_>,
        key: SurfaceKey,
        slots: &[DrawSlot],
        scene: &Scene,
        buffers: &SceneBuffers,
        plan: &FramePlan,
        index_counts: &[u32],
        target: &RenderTarget,
    ) {
        let (Some(supersampled), Some(passes), EdgeStage::Supersampled { thin, .. }) =
            (&target.supersampled, &self.silhouettes, plan.edges)
        else {
            return;
        };
        let SilhouettePasses { mask, edge_triangles } = passes;
        if !thin {
            mask.compute_mask(gpu, recorder, plan, target, supersampled, false);
            let tiles_across = target.allocated_px[0].div_ceil(TILE_PX);
            edge_triangles.encode(gpu, recorder, plan, tiles_across, slots, index_counts, supersampled);
        }
        let color = supersampled.color_view.as_ref().map(|view| color_attachment(view, scene));
        let depth = depth_attachment(&supersampled.depth_view);
        let mut pass = recorder.render_pass("ideal_fine", color, Some(depth));
        self.draw_keys(&mut pass, key, plan, supersampled.scale, buffers, slots, |k| {
            match (thin, index_counts[k]) {
                (false, 1..) => TriangleSelection::NearEdges,
                (_, count) => TriangleSelection::All(count),
            }
        });
        drop(pass);
        if thin {
            mask.compute_mask(gpu, recorder, plan, target, supersampled, true);
        }
        mask.write_alpha(gpu, recorder, target, supersampled);
        mask.edge_lines(gpu, recorder, plan, target, supersampled);
    }

    /// Draws the surfaces of all key frames, one key frame below the other.
    fn draw_keys(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        key: SurfaceKey,
        plan: &FramePlan,
        scale: u32,
        buffers: &SceneBuffers,
        slots: &[DrawSlot],
        triangles: impl Fn(usize) -> TriangleSelection,
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
            if let Some(blended) = &slot.blended {
                blended.draw(pass, pipelines, slot, buffers);
                // Their depth comes last: blended surfaces do not occlude blended surfaces.
                draw_meshes(pass, pipelines, slot, buffers, true);
            }
        }
    }
}

/// Colour attachment, cleared to the sky.
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

/// Depth attachment, cleared to 0: infinitely far in reversed depth.
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
