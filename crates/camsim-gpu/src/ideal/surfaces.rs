//! What draws a key's surfaces: where they stand is written first, once for all passes that draw them.

use camsim_core::{
    pose::CameraPose,
    scene::{LodTolerance, PlacedMesh},
};
use glam::DVec3;

use super::{IdealSlot, near_marks::Kept, pipelines::SurfacePipelines};
use crate::{
    context::{GpuContext, GpuError},
    layout::MeshPlacement,
    recorder::Recorder,
    tiles::TilePool,
    upload::{GroundPicture, SceneBuffers, TerrainBuffers},
};

/// Room for a few thousand triangles, bytes.
const MIN_BYTES: u64 = 1 << 16;

/// Writes where the meshes stand that may be in view from a key, which of each batch they are and with how
/// much detail; gives whose place each is.
pub(super) fn place_meshes(
    recorder: &mut Recorder<'_>,
    slot: &mut IdealSlot,
    buffers: &SceneBuffers,
    pose: &CameraPose,
    tolerance: &LodTolerance,
    base_ned_m: DVec3,
) -> Vec<u32> {
    let (seen, drawn) = buffers.meshes.in_view(pose, tolerance);
    slot.drawn = drawn;
    let placement = |&i: &u32| {
        let shape = &buffers.meshes.placed[i as usize];
        let origin = (shape.origin_ned_m - base_ned_m).as_vec3();
        let row = |axis: usize| shape.ned_from_shape.row(axis).as_vec3().extend(origin[axis]).to_array();
        MeshPlacement { x: row(0), y: row(1), z: row(2) }
    };
    let placements: Vec<MeshPlacement> = seen.iter().map(placement).collect();
    if !placements.is_empty() {
        recorder.write(&slot.placements, 0, bytemuck::cast_slice(&placements));
    }
    seen
}

/// Draws the meshes, or the depth of those that are mixed with what is behind them.
pub(super) fn draw_meshes(
    pass: &mut wgpu::RenderPass<'_>,
    pipelines: &SurfacePipelines,
    slot: &IdealSlot,
    buffers: &SceneBuffers,
    blended: bool,
) {
    let mut last = None;
    let batches = buffers.batches.iter().zip(&slot.mesh_groups).zip(&slot.drawn);
    for ((batch, group), drawn) in batches.filter(|((batch, _), _)| batch.kind.blends == blended) {
        let some = drawn.iter().any(|instances| !instances.is_empty());
        let Some(pipeline) = pipelines.meshes.get(&batch.kind).filter(|_| some) else { continue };
        if last != Some(batch.kind) {
            pass.set_pipeline(pipeline);
            pass.set_bind_group(2, &slot.placement_group, &[]);
            last = Some(batch.kind);
        }
        pass.set_bind_group(1, group, &[]);
        pass.set_vertex_buffer(0, batch.vertices.slice(..));
        if let Some(normals) = &batch.normals {
            pass.set_vertex_buffer(1, normals.slice(..));
        }
        pass.set_index_buffer(batch.indices.slice(..), wgpu::IndexFormat::Uint32);
        for (indices, instances) in
            batch.ranges.iter().zip(drawn).filter(|(_, instances)| !instances.is_empty())
        {
            pass.draw_indexed(indices.clone(), 0, instances.clone());
        }
    }
}

/// Vertices and triangles of a terrain that one ideal frame draws: no others are on the device. Buffers are
/// replaced by larger ones when a frame has more than any before.
#[derive(Debug)]
pub(super) struct TerrainSlot {
    vertices: wgpu::Buffer,
    pub indices: wgpu::Buffer,
    /// Those of the triangles that are near marks.
    pub kept: Kept,
    /// Where tiles of the picture are, and the state of theirs that it tells.
    table: Option<(wgpu::Buffer, [u64; 2])>,
    /// Picture and vertices.
    pub group: Option<wgpu::BindGroup>,
}

impl TerrainSlot {
    pub fn new(gpu: &GpuContext) -> Self {
        let indices = index_buffer(gpu, 0);
        let kept = Kept::new(gpu, indices.size());
        Self { vertices: vertex_buffer(gpu, 0), indices, kept, table: None, group: None }
    }

    /// Makes what binds picture and vertices, if they are new, and writes where the picture's tiles are, if
    /// that has changed.
    pub fn bind(
        &mut self,
        gpu: &GpuContext,
        recorder: &mut Recorder<'_>,
        layout: &wgpu::BindGroupLayout,
        terrain: &TerrainBuffers,
        sampler: &wgpu::Sampler,
    ) {
        let view = match &terrain.picture {
            GroundPicture::Whole(view) => view.as_ref(),
            GroundPicture::Tiles(tiles) => {
                self.tell_tiles(gpu, recorder, tiles);
                tiles.view()
            }
        };
        let Some(view) = view else { return };
        self.group.get_or_insert_with(|| {
            let entry = |binding, resource| wgpu::BindGroupEntry { binding, resource };
            let mut entries = vec![
                entry(0, wgpu::BindingResource::TextureView(view)),
                entry(1, wgpu::BindingResource::Sampler(sampler)),
                entry(2, self.vertices.as_entire_binding()),
            ];
            entries.extend(self.table.as_ref().map(|(table, _)| entry(3, table.as_entire_binding())));
            gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("camsim.ideal.terrain"),
                layout,
                entries: &entries,
            })
        });
    }

    fn tell_tiles(&mut self, gpu: &GpuContext, recorder: &mut Recorder<'_>, tiles: &TilePool) {
        let (table, told) = self.table.get_or_insert_with(|| {
            (create(gpu, "camsim.ideal.tiles", tiles.table_bytes(), wgpu::BufferUsages::STORAGE), [0; 2])
        });
        let now = tiles.changes();
        if *told != now {
            tiles.write_table(recorder, table);
        }
        if told[1] != now[1] {
            self.group = None;
        }
        *told = now;
    }
}

const FEWER_TRIANGLES: &str = "allow larger quality.max_terrain_error_px and quality.max_error_dn, or use a coarser DEM in scene.terrain.dem";

/// Writes the vertices and triangles of a key; returns the number of indices.
pub(super) fn place_terrain(
    gpu: &GpuContext,
    recorder: &mut Recorder<'_>,
    slot: &mut TerrainSlot,
    mesh: &PlacedMesh,
) -> Result<u32, GpuError> {
    let (vertices, indices): (&[u8], &[u8]) =
        (bytemuck::cast_slice(&mesh.vertices), bytemuck::cast_slice(&mesh.indices));
    for (bytes, what) in [
        (vertices, "the vertices of the terrain in one frame"),
        (indices, "the triangles of the terrain in one frame"),
    ] {
        gpu.check_storage(what, room(bytes.len() as u64), FEWER_TRIANGLES)?;
    }
    if slot.vertices.size() < vertices.len() as u64 {
        slot.vertices = vertex_buffer(gpu, vertices.len() as u64);
        slot.group = None;
    }
    if slot.indices.size() < indices.len() as u64 {
        slot.indices = index_buffer(gpu, indices.len() as u64);
        slot.kept = Kept::new(gpu, slot.indices.size());
    }
    recorder.write(&slot.vertices, 0, vertices);
    recorder.write(&slot.indices, 0, indices);
    Ok(mesh.indices.len() as u32)
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
pub(super) fn draw_terrain(
    pass: &mut wgpu::RenderPass<'_>,
    pipelines: &SurfacePipelines,
    slot: &IdealSlot,
    triangles: Triangles,
) {
    let Some(terrain) = slot.terrain.as_ref() else { return };
    let Some(group) = terrain.group.as_ref() else { return };
    pass.set_pipeline(&pipelines.terrain);
    pass.set_bind_group(1, group, &[]);
    match triangles {
        Triangles::All(0) => {}
        Triangles::All(count) => {
            pass.set_index_buffer(terrain.indices.slice(..), wgpu::IndexFormat::Uint32);
            pass.draw_indexed(0..count, 0, 0..1);
        }
        Triangles::Kept => {
            pass.set_index_buffer(terrain.kept.indices.slice(..), wgpu::IndexFormat::Uint32);
            pass.draw_indexed_indirect(&terrain.kept.arguments, 0);
        }
    }
}

/// What a buffer for so many bytes takes: a power of two, so that few frames need another.
fn room(bytes: u64) -> u64 {
    bytes.next_power_of_two().max(MIN_BYTES)
}

fn vertex_buffer(gpu: &GpuContext, bytes: u64) -> wgpu::Buffer {
    create(gpu, "camsim.ideal.vertices", bytes, wgpu::BufferUsages::STORAGE)
}

pub(super) fn index_buffer(gpu: &GpuContext, bytes: u64) -> wgpu::Buffer {
    create(gpu, "camsim.ideal.indices", bytes, wgpu::BufferUsages::INDEX | wgpu::BufferUsages::STORAGE)
}

fn create(gpu: &GpuContext, label: &str, bytes: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: room(bytes),
        usage: usage | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}
