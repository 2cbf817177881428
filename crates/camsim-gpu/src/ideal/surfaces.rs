//! What draws a key's surfaces: where they stand is written first, once for all passes that draw them.

use camsim_core::scene::{Terrain, TerrainMesh};
use glam::DVec3;

use super::{IdealSlot, PLACEMENT_STRIDE, SurfacePipelines, near_marks::Kept};
use crate::{context::GpuContext, layout::ChunkPlace, recorder::Recorder, upload::SceneBuffers};

/// Room for the indices of a few thousand triangles, bytes.
const MIN_INDEX_BYTES: u64 = 1 << 16;

/// Writes where the meshes stand from a key.
pub(super) fn place_meshes(recorder: &mut Recorder<'_>, slot: &IdealSlot, buffers: &SceneBuffers, base_ned_m: DVec3) {
    for (mesh, i) in buffers.meshes.iter().zip(0_u64..) {
        let origin = (mesh.origin_ned_m - base_ned_m).as_vec3().extend(0.0).to_array();
        recorder.write(&slot.placements, i * PLACEMENT_STRIDE, bytemuck::cast_slice(&origin));
    }
}

pub(super) fn draw_meshes(pass: &mut wgpu::RenderPass<'_>, pipelines: &SurfacePipelines, slot: &IdealSlot, buffers: &SceneBuffers) {
    if buffers.meshes.is_empty() {
        return;
    }
    pass.set_pipeline(&pipelines.mesh);
    for (mesh, group) in buffers.meshes.iter().zip(&slot.mesh_groups) {
        pass.set_bind_group(1, group, &[]);
        pass.set_vertex_buffer(0, mesh.vertices.slice(..));
        pass.set_index_buffer(mesh.indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(0..mesh.count, 0, 0..1);
    }
}

/// Writes where the chunks of a key stand and which triangles are drawn; returns the number of their indices.
pub(super) fn place_terrain(
    gpu: &GpuContext,
    recorder: &mut Recorder<'_>,
    slot: &mut IdealSlot,
    terrain: &Terrain,
    mesh: &TerrainMesh,
    base_ned_m: DVec3,
) -> u32 {
    let place = |&chunk: &u32| {
        let chunk = &terrain.chunks[chunk as usize];
        ChunkPlace { centre_from_base_m: (chunk.centre_ned_m - base_ned_m).as_vec3().to_array(), first_vertex: chunk.first_vertex }
    };
    let places: Vec<ChunkPlace> = mesh.chunks.iter().map(place).collect();
    recorder.write(&slot.chunks, 0, bytemuck::cast_slice(&places));
    let bytes: &[u8] = bytemuck::cast_slice(&mesh.indices);
    if slot.indices.size() < bytes.len() as u64 {
        slot.indices = index_buffer(gpu, bytes.len() as u64);
        slot.kept = Kept::new(gpu, slot.indices.size());
    }
    recorder.write(&slot.indices, 0, bytes);
    mesh.indices.len() as u32
}

/// Which of a key's triangles are drawn.
#[derive(Clone, Copy, Debug)]
pub(super) enum Triangles {
    /// All, of so many indices.
    All(u32),
    /// Those near marks.
    Kept,
}

/// Draws a terrain's triangles, all at once.
pub(super) fn draw_terrain(pass: &mut wgpu::RenderPass<'_>, pipelines: &SurfacePipelines, slot: &IdealSlot, triangles: Triangles) {
    let Some(group) = slot.terrain_group.as_ref() else { return };
    pass.set_pipeline(&pipelines.terrain);
    pass.set_bind_group(1, group, &[]);
    match triangles {
        Triangles::All(0) => {}
        Triangles::All(count) => {
            pass.set_index_buffer(slot.indices.slice(..), wgpu::IndexFormat::Uint32);
            pass.draw_indexed(0..count, 0, 0..1);
        }
        Triangles::Kept => {
            pass.set_index_buffer(slot.kept.indices.slice(..), wgpu::IndexFormat::Uint32);
            pass.draw_indexed_indirect(&slot.kept.arguments, 0);
        }
    }
}

/// For at least so many bytes: a power of two, so that few frames need another.
pub(super) fn index_buffer(gpu: &GpuContext, bytes: u64) -> wgpu::Buffer {
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("camsim.ideal.indices"),
        size: bytes.next_power_of_two().max(MIN_INDEX_BYTES),
        usage: wgpu::BufferUsages::INDEX | wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}
