//! Render pipelines of the surfaces of a scene, compiled when first needed.

use std::collections::HashMap;

use camsim_plan::PrefilterTaps;

use super::{
    COLOR_FORMAT, DrawPass, FINE_SAMPLES,
    draw_state::{DrawState, WriteMode, pipeline},
};
use crate::{
    context::GpuContext,
    layout::MeshVertexData,
    shaders::{ComposeError, ShaderSlot},
    upload::{MeshBatch, MeshKind},
};

/// Slot of the texture filter.
fn prefilter_slot(reads: PrefilterTaps) -> ShaderSlot {
    let file = match reads {
        PrefilterTaps::One => "ideal/prefilter/one.wgsl",
        PrefilterTaps::Two => "ideal/prefilter/two.wgsl",
        PrefilterTaps::Four => "ideal/prefilter/four.wgsl",
        PrefilterTaps::Grid => "ideal/prefilter/grid.wgsl",
    };
    ("prefilter", file)
}

/// Slot of the surface's texture.
fn texture_slot(has_tiles: bool) -> ShaderSlot {
    ("texture", if has_tiles { "ideal/texture/tiled.wgsl" } else { "ideal/texture/opaque.wgsl" })
}

fn fog_slot(has_fog: bool) -> ShaderSlot {
    ("fog", if has_fog { "ideal/fog/exponential.wgsl" } else { "ideal/fog/none.wgsl" })
}

fn centroid_slot(samples: u32) -> ShaderSlot {
    (
        "centroid",
        if samples > 1 { "ideal/centroid/covered_samples.wgsl" } else { "ideal/centroid/pixel_centre.wgsl" },
    )
}

/// Slots of the terrain. Its surface continues beyond each triangle: centroid sampling would only blur it.
pub(crate) fn terrain_slots(reads: PrefilterTaps, has_tiles: bool, has_fog: bool) -> [ShaderSlot; 4] {
    [prefilter_slot(reads), centroid_slot(1), texture_slot(has_tiles), fog_slot(has_fog)]
}

/// Slots of a mesh.
pub(crate) fn mesh_slots(
    reads: PrefilterTaps,
    samples: u32,
    is_blended: bool,
    has_fog: bool,
) -> [ShaderSlot; 5] {
    let (texture, color) = match is_blended {
        false => (texture_slot(false), ("mesh_color", "ideal/mesh_color/opaque.wgsl")),
        true => {
            (("texture", "ideal/texture/with_alpha.wgsl"), ("mesh_color", "ideal/mesh_color/blended.wgsl"))
        }
    };
    [prefilter_slot(reads), centroid_slot(samples), texture, color, fog_slot(has_fog)]
}

/// Key of a set of surface pipelines.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum SurfaceKey {
    /// Colour and depth, one sample per pixel.
    SingleSample(PrefilterTaps),
    /// Depth, several samples per pixel.
    MultisampledDepth,
    /// Colour and depth, several samples per pixel.
    Multisampled(PrefilterTaps),
}

/// Surface pipelines for a target.
#[derive(Debug)]
pub(super) struct SurfacePipelines {
    pub terrain: wgpu::RenderPipeline,
    /// Pipelines of meshes that the scene needs. Those of blended meshes draw depth alone.
    pub meshes: HashMap<MeshKind, wgpu::RenderPipeline>,
    /// Pipelines for the colour of blended meshes; empty if only depth is drawn.
    pub blended: HashMap<MeshKind, wgpu::RenderPipeline>,
}

impl DrawPass {
    pub(super) fn surface_pipelines(
        &self,
        gpu: &GpuContext,
        key: SurfaceKey,
        batches: &[MeshBatch],
    ) -> Result<SurfacePipelines, ComposeError> {
        // Long because: one pipeline per kind of surface.
        let mesh_vertices = wgpu::VertexBufferLayout {
            array_stride: size_of::<MeshVertexData>() as u64,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x2, 2 => Unorm16x4],
        };
        let mesh_normals = wgpu::VertexBufferLayout {
            array_stride: size_of::<[f32; 3]>() as u64,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &wgpu::vertex_attr_array![3 => Float32x3],
        };
        let (reads, samples, format) = match key {
            SurfaceKey::SingleSample(reads) => (reads, 1, Some(self.color_format)),
            // Depth needs no texture, except for alpha masks.
            SurfaceKey::MultisampledDepth => (PrefilterTaps::One, FINE_SAMPLES, None),
            SurfaceKey::Multisampled(reads) => (reads, FINE_SAMPLES, Some(COLOR_FORMAT)),
        };
        let terrain_slots_of_key = terrain_slots(reads, self.has_tiles, self.has_fog);
        let terrain_layouts = [&self.camera_layout, &self.terrain_layout];
        let terrain_state = DrawState { samples, color: format, ..DrawState::default() };
        let terrain =
            pipeline(gpu, "ideal/terrain.wgsl", &terrain_slots_of_key, &terrain_layouts, &[], terrain_state)?;
        let layouts = [&self.camera_layout, &self.mesh_layout, &self.placement_layout];
        let (mut meshes, mut blended) = (HashMap::new(), HashMap::new());
        for MeshBatch { kind, .. } in batches {
            if meshes.contains_key(kind) {
                continue;
            }
            let drawing = DrawState { one_sided: kind.one_sided, masked: kind.masked, ..terrain_state };
            let vertices = [Some(mesh_vertices.clone()), Some(mesh_normals.clone())];
            let all = if kind.lit { &vertices[..] } else { &vertices[..1] };
            let slots = mesh_slots(reads, samples, false, self.has_fog);
            if !kind.blends {
                meshes.insert(*kind, pipeline(gpu, kind.shader(), &slots, &layouts, all, drawing)?);
                continue;
            }
            let depth = DrawState { masked: true, writes: WriteMode::Depth, ..drawing };
            meshes.insert(
                *kind,
                pipeline(gpu, "ideal/mesh_masked.wgsl", &slots, &layouts, &vertices[..1], depth)?,
            );
            if format.is_some() {
                let is_blended = DrawState { writes: WriteMode::Blended, ..drawing };
                blended.insert(
                    *kind,
                    pipeline(
                        gpu,
                        kind.shader(),
                        &mesh_slots(reads, samples, true, self.has_fog),
                        &layouts,
                        all,
                        is_blended,
                    )?,
                );
            }
        }
        Ok(SurfacePipelines { terrain, meshes, blended })
    }
}
