// Terrain chunks of 64x64 cells at one of seven strides. Vertices are pulled from a buffer; a border that meets a coarser
// neighbour uses the neighbour's own vertices, so there are no cracks. Twin of the snapping: camsim_core::scene::snap.
#import ideal/surface.wgsl

const CHUNK_CELLS: u32 = 64u;

struct ChunkDraw {
    // Chunk centre minus the whole-metre base: a whole number of metres, exact in f32.
    centre_from_base_m: vec3<f32>,
    first_vertex: u32,
    cells: vec2<u32>,
    // Level, and the neighbours' levels where they are coarser: 4 bits each, level | north << 4 | east << 8 | south << 12 | west << 16.
    levels: u32,
    pad: u32,
}

// Stored as plain floats: five a vertex (offset x y z, texture u v).
@group(1) @binding(2) var<storage, read> terrain_vertices: array<f32>;
@group(1) @binding(3) var<storage, read> chunk_draws: array<ChunkDraw>;

fn snap(i: u32, cells: u32, level: u32) -> u32 {
    if (i >= cells) {
        return cells;
    }
    let stride = 1u << level;
    return min((i + stride / 2u) / stride * stride, cells);
}

@vertex
fn vertex(@builtin(vertex_index) index: u32, @builtin(instance_index) instance: u32) -> Surface {
    let chunk = chunk_draws[instance];
    // Indices address the full 65x65 lattice; smaller chunks clamp, which makes the surplus triangles degenerate.
    var i = min(index % (CHUNK_CELLS + 1u), chunk.cells.x);
    var j = min(index / (CHUNK_CELLS + 1u), chunk.cells.y);
    let level = chunk.levels & 15u;
    if (level > 0u || chunk.levels > 0u) {
        let north = (chunk.levels >> 4u) & 15u;
        let east = (chunk.levels >> 8u) & 15u;
        let south = (chunk.levels >> 12u) & 15u;
        let west = (chunk.levels >> 16u) & 15u;
        if (j == 0u && north > level) { i = snap(i, chunk.cells.x, north); }
        if (j == chunk.cells.y && south > level) { i = snap(i, chunk.cells.x, south); }
        if (i == 0u && west > level) { j = snap(j, chunk.cells.y, west); }
        if (i == chunk.cells.x && east > level) { j = snap(j, chunk.cells.y, east); }
    }
    let at = 5u * (chunk.first_vertex + j * (chunk.cells.x + 1u) + i);
    let offset_m = vec3<f32>(terrain_vertices[at], terrain_vertices[at + 1u], terrain_vertices[at + 2u]);
    // Both summands are exact, so the sum is the correctly rounded position, equal in both chunks that share the vertex.
    return project_surface(chunk.centre_from_base_m + offset_m, vec2<f32>(terrain_vertices[at + 3u], terrain_vertices[at + 4u]));
}
