// Vertices of the terrain, pulled from a buffer that holds those of this frame.

// Stored as plain floats, five a vertex: camsim_core::scene::PlacedMesh (from the base x y z, texture u v).
@group(1) @binding(2) var<storage, read> terrain_vertices: array<f32>;

struct TerrainVertex {
    // The same bits in all chunks that share the vertex.
    from_base_m: vec3<f32>,
    uv: vec2<f32>,
}

fn terrain_vertex(index: u32) -> TerrainVertex {
    let at = 5u * index;
    let from_base_m = vec3<f32>(terrain_vertices[at], terrain_vertices[at + 1u], terrain_vertices[at + 2u]);
    return TerrainVertex(from_base_m, vec2<f32>(terrain_vertices[at + 3u], terrain_vertices[at + 4u]));
}
