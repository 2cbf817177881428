//! The pipelines that draw surfaces: of each kind that a scene has, made when it is first needed.

use std::collections::HashMap;

use camsim_plan::PrefilterTaps;

use super::{
    COLOR_FORMAT, FINE_SAMPLES, IdealPass,
    drawing::{Drawing, Writes, pipeline},
};
use crate::{
    context::GpuContext,
    layout::MeshVertexData,
    shaders::{ComposeError, Slot},
    upload::{MeshBatch, MeshKind},
};

/// What fills the surfaces' slot.
fn reads_slot(reads: PrefilterTaps) -> Slot {
    let file = match reads {
        PrefilterTaps::One => "ideal/reads/one.wgsl",
        PrefilterTaps::Two => "ideal/reads/two.wgsl",
        PrefilterTaps::Four => "ideal/reads/four.wgsl",
        PrefilterTaps::Grid => "ideal/reads/grid.wgsl",
    };
    ("reads", file)
}

/// What fills the slot of the surface's picture.
fn picture_slot(has_tiles: bool) -> Slot {
    ("picture", if has_tiles { "ideal/picture/tiles.wgsl" } else { "ideal/picture/whole.wgsl" })
}

fn fog_slot(has_fog: bool) -> Slot {
    ("fog", if has_fog { "ideal/fog/some.wgsl" } else { "ideal/fog/none.wgsl" })
}

fn covered_slot(samples: u32) -> Slot {
    ("covered", if samples > 1 { "ideal/covered/samples.wgsl" } else { "ideal/covered/whole.wgsl" })
}

/// What fills the slots of the ground. It goes on beyond its triangles: reads in the middles of their parts
/// would only blur it.
pub(crate) fn ground_slots(reads: PrefilterTaps, has_tiles: bool, has_fog: bool) -> [Slot; 4] {
    [reads_slot(reads), covered_slot(1), picture_slot(has_tiles), fog_slot(has_fog)]
}

/// What fills the slots of a mesh.
pub(crate) fn mesh_slots(reads: PrefilterTaps, samples: u32, mixed: bool, has_fog: bool) -> [Slot; 5] {
    let (picture, color) = match mixed {
        false => (picture_slot(false), ("mesh_color", "ideal/mesh_color/whole.wgsl")),
        true => (("picture", "ideal/picture/mixed.wgsl"), ("mesh_color", "ideal/mesh_color/mixed.wgsl")),
    };
    [reads_slot(reads), covered_slot(samples), picture, color, fog_slot(has_fog)]
}

/// Which pipelines draw surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum SurfaceKey {
    /// Colour and depth, one sample a pixel.
    Plain(PrefilterTaps),
    /// Depth, several samples a pixel.
    FineDepth,
    /// Colour and depth, several samples a pixel.
    Fine(PrefilterTaps),
}

/// What draws surfaces to a target of a given number of samples.
#[derive(Debug)]
pub(super) struct SurfacePipelines {
    pub terrain: wgpu::RenderPipeline,
    /// Those that the scene needs; of what is mixed they draw depth alone.
    pub meshes: HashMap<MeshKind, wgpu::RenderPipeline>,
    /// Of what is mixed, its colour; none where there is only depth.
    pub layers: HashMap<MeshKind, wgpu::RenderPipeline>,
}

impl IdealPass {
    pub(super) fn surface_pipelines(
        &self,
        gpu: &GpuContext,
        key: SurfaceKey,
        batches: &[MeshBatch],
    ) -> Result<SurfacePipelines, ComposeError> {
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
            SurfaceKey::Plain(reads) => (reads, 1, Some(self.color_format)),
            // Nothing is read for depth, but for holes.
            SurfaceKey::FineDepth => (PrefilterTaps::One, FINE_SAMPLES, None),
            SurfaceKey::Fine(reads) => (reads, FINE_SAMPLES, Some(COLOR_FORMAT)),
        };
        let of_ground = ground_slots(reads, self.has_tiles, self.has_fog);
        let ground = [&self.camera_layout, &self.terrain_layout];
        let on_ground = Drawing { samples, color: format, ..Drawing::default() };
        let terrain = pipeline(gpu, "ideal/terrain.wgsl", &of_ground, &ground, &[], on_ground)?;
        let layouts = [&self.camera_layout, &self.mesh_layout, &self.placement_layout];
        let (mut meshes, mut layers) = (HashMap::new(), HashMap::new());
        for MeshBatch { kind, .. } in batches {
            if meshes.contains_key(kind) {
                continue;
            }
            let drawing = Drawing { one_sided: kind.one_sided, holes: kind.holes, ..on_ground };
            let vertices = [Some(mesh_vertices.clone()), Some(mesh_normals.clone())];
            let all = if kind.lit { &vertices[..] } else { &vertices[..1] };
            let slots = mesh_slots(reads, samples, false, self.has_fog);
            if !kind.blends {
                meshes.insert(*kind, pipeline(gpu, kind.shader(), &slots, &layouts, all, drawing)?);
                continue;
            }
            let depth = Drawing { holes: true, writes: Writes::Depth, ..drawing };
            meshes.insert(
                *kind,
                pipeline(gpu, "ideal/mesh_holes.wgsl", &slots, &layouts, &vertices[..1], depth)?,
            );
            if format.is_some() {
                let mixed = Drawing { writes: Writes::Mixed, ..drawing };
                layers.insert(
                    *kind,
                    pipeline(
                        gpu,
                        kind.shader(),
                        &mesh_slots(reads, samples, true, self.has_fog),
                        &layouts,
                        all,
                        mixed,
                    )?,
                );
            }
        }
        Ok(SurfacePipelines { terrain, meshes, layers })
    }
}
