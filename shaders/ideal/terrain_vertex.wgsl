// Vertices of the terrain, pulled from a buffer; an index names a chunk and a vertex in it.

// Bits of an index that are the vertex: camsim_core::scene::VERTEX_BITS.
const VERTEX_BITS: u32 = 13u;

struct ChunkPlace {
    // Chunk centre minus the whole-metre base: a whole number of metres, exact in f32.
    centre_from_base_m: vec3<f32>,
    first_vertex: u32,
}

// Stored as plain floats: five a vertex (offset x y z, texture u v).
@group(1) @binding(2) var<storage, read> terrain_vertices: array<f32>;
@group(1) @binding(3) var<storage, read> chunk_places: array<ChunkPlace>;

struct TerrainVertex {
    from_base_m: vec3<f32>,
    uv: vec2<f32>,
}

fn terrain_vertex(index: u32) -> TerrainVertex {
    let chunk = chunk_places[index >> VERTEX_BITS];
    let at = 5u * (chunk.first_vertex + (index & ((1u << VERTEX_BITS) - 1u)));
    let offset_m = vec3<f32>(terrain_vertices[at], terrain_vertices[at + 1u], terrain_vertices[at + 2u]);
    // Both summands are exact, so the sum is the correctly rounded position, equal in both chunks that share the vertex.
    return TerrainVertex(chunk.centre_from_base_m + offset_m, vec2<f32>(terrain_vertices[at + 3u], terrain_vertices[at + 4u]));
}
