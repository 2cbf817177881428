//! Draws the surfaces of a key frame. Placements and terrain triangles are uploaded once, for all passes that
//! draw them.

use camsim_core::{
    pose::CameraPose,
    scene::{LodTolerance, PlacedMesh},
};
use glam::DVec3;

use super::{DrawSlot, surface_pipelines::SurfacePipelines, triangles_near_edges::SelectedTriangles};
use crate::{
    adapter::GpuError,
    context::GpuContext,
    layout::MeshPlacement,
    recorder::Recorder,
    tiles::TilePool,
    upload::{SceneBuffers, TerrainBuffers, TerrainTexture},
};

/// Least size of a buffer, bytes: a few thousand triangles.
const MIN_BYTES: u64 = 1 << 16;

/// Uploads the placements of the meshes that may be in view from a key frame, and selects their levels of
/// detail, uploading those that are new. Returns the mesh of each placement.
pub(super) fn upload_placements(
    gpu: &GpuContext,
    recorder: &mut Recorder<'_>,
    slot: &mut DrawSlot,
    buffers: &mut SceneBuffers,
    pose: &CameraPose,
    tolerance: &LodTolerance,
    base_ned_m: DVec3,
) -> Vec<u32> {
    let (meshes_in_view, level_instances) = buffers.meshes.in_view(pose, tolerance);
    buffers.upload_levels(gpu, &level_instances);
    slot.level_instances = level_instances;
    let placement = |&i: &u32| {
        let shape = &buffers.meshes.placed[i as usize];
        let origin = (shape.origin_ned_m - base_ned_m).as_vec3();
        let row = |axis: usize| shape.ned_from_shape.row(axis).as_vec3().extend(origin[axis]).to_array();
        MeshPlacement { x: row(0), y: row(1), z: row(2) }
    };
    let placements: Vec<MeshPlacement> = meshes_in_view.iter().map(placement).collect();
    if !placements.is_empty() {
        recorder.write(&slot.placements, 0, bytemuck::cast_slice(&placements));
    }
    meshes_in_view
}

/// Draws the opaque meshes, or the depth of the blended ones.
pub(super) fn draw_meshes(
    pass: &mut wgpu::RenderPass<'_>,
    pipelines: &SurfacePipelines,
    slot: &DrawSlot,
    buffers: &SceneBuffers,
    blended: bool,
) {
    let mut bound = None;
    let batches = buffers.batches.iter().zip(&slot.material_groups).zip(&slot.level_instances);
    for ((batch, group), level_instances) in batches.filter(|((batch, _), _)| batch.kind.blends == blended) {
        let any_drawn = level_instances.iter().any(|instances| !instances.is_empty());
        let Some(pipeline) = pipelines.meshes.get(&batch.kind).filter(|_| any_drawn) else { continue };
        if bound != Some(batch.kind) {
            pass.set_pipeline(pipeline);
            pass.set_bind_group(2, &slot.placement_group, &[]);
            bound = Some(batch.kind);
        }
        pass.set_bind_group(1, group, &[]);
        pass.set_vertex_buffer(0, batch.vertices.slice(..));
        if let Some(normals) = &batch.normals {
            pass.set_vertex_buffer(1, normals.slice(..));
        }
        for (indices, instances) in
            batch.indices.iter().zip(level_instances).filter(|(_, instances)| !instances.is_empty())
        {
            pass.set_index_buffer(indices.slice(..), wgpu::IndexFormat::Uint32);
            pass.draw_indexed(0..(indices.size() / 4) as u32, 0, instances.clone());
        }
    }
}

/// Vertices and triangles of the terrain for one ideal frame; the GPU holds no others. Buffers grow when a
/// frame has more than any before.
#[derive(Debug)]
pub(super) struct TerrainSlot {
    vertices: wgpu::Buffer,
    pub indices: wgpu::Buffer,
    /// Selected triangles near edge pixels.
    pub selection: SelectedTriangles,
    /// Page table of the virtual texture, and the pool's versions that it holds.
    table: Option<(wgpu::Buffer, [u64; 2])>,
    /// Bind group of texture and vertices.
    pub group: Option<wgpu::BindGroup>,
}

impl TerrainSlot {
    pub fn new(gpu: &GpuContext) -> Self {
        let indices = index_buffer(gpu, 0);
        let selection = SelectedTriangles::new(gpu, indices.size());
        Self { vertices: vertex_buffer(gpu, 0), indices, selection, table: None, group: None }
    }

    /// Creates the bind group if texture or vertices are new, and uploads the page table if it has changed.
    pub fn bind(
        &mut self,
        gpu: &GpuContext,
        recorder: &mut Recorder<'_>,
        layout: &wgpu::BindGroupLayout,
        terrain: &TerrainBuffers,
        sampler: &wgpu::Sampler,
    ) {
        let view = match &terrain.texture {
            TerrainTexture::Whole(view) => view.as_ref(),
            TerrainTexture::Tiles(tiles) => {
                self.upload_page_table(gpu, recorder, tiles);
                tiles.array_view()
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

    fn upload_page_table(&mut self, gpu: &GpuContext, recorder: &mut Recorder<'_>, tiles: &TilePool) {
        let (table, uploaded) = self.table.get_or_insert_with(|| {
            (create(gpu, "camsim.ideal.tiles", tiles.table_bytes(), wgpu::BufferUsages::STORAGE), [0; 2])
        });
        let current = tiles.versions();
        if *uploaded != current {
            tiles.write_table(recorder, table);
        }
        if uploaded[1] != current[1] {
            self.group = None;
        }
        *uploaded = current;
    }
}

const FEWER_TRIANGLES: &str = "allow larger quality.max_terrain_error_px and quality.max_error_dn, or use a \
                               coarser DEM in scene.terrain.dem";

/// Uploads vertices and triangles of a key frame. Returns the number of indices.
pub(super) fn upload_terrain(
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
        gpu.check_storage(what, buffer_capacity(bytes.len() as u64), FEWER_TRIANGLES)?;
    }
    if slot.vertices.size() < vertices.len() as u64 {
        slot.vertices = vertex_buffer(gpu, vertices.len() as u64);
        slot.group = None;
    }
    if slot.indices.size() < indices.len() as u64 {
        slot.indices = index_buffer(gpu, indices.len() as u64);
        slot.selection = SelectedTriangles::new(gpu, slot.indices.size());
    }
    recorder.write(&slot.vertices, 0, vertices);
    recorder.write(&slot.indices, 0, indices);
    Ok(mesh.indices.len() as u32)
}

/// Selection of terrain triangles to draw.
#[derive(Clone, Copy, Debug)]
pub(super) enum TriangleSelection {
    /// All, with their number of indices.
    All(u32),
    /// Those near edge pixels.
    NearEdges,
}

/// Draws the terrain in one call.
pub(super) fn draw_terrain(
    pass: &mut wgpu::RenderPass<'_>,
    pipelines: &SurfacePipelines,
    slot: &DrawSlot,
    triangles: TriangleSelection,
) {
    let Some(terrain) = slot.terrain.as_ref() else { return };
    let Some(group) = terrain.group.as_ref() else { return };
    pass.set_pipeline(&pipelines.terrain);
    pass.set_bind_group(1, group, &[]);
    match triangles {
        TriangleSelection::All(0) => {}
        TriangleSelection::All(count) => {
            pass.set_index_buffer(terrain.indices.slice(..), wgpu::IndexFormat::Uint32);
            pass.draw_indexed(0..count, 0, 0..1);
        }
        TriangleSelection::NearEdges => {
            pass.set_index_buffer(terrain.selection.indices.slice(..), wgpu::IndexFormat::Uint32);
            pass.draw_indexed_indirect(&terrain.selection.arguments, 0);
        }
    }
}

/// Capacity of a buffer: a power of two, so that few frames need a larger one.
fn buffer_capacity(bytes: u64) -> u64 {
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
        size: buffer_capacity(bytes),
        usage: usage | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}
