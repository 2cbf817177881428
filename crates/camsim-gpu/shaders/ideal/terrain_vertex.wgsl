// Terrain vertices of this frame, pulled from a storage buffer.

// Five floats per vertex, as in camsim_core::scene::PlacedMesh: x y z from the base, texture u v.
@group(1) @binding(2) var<storage, read> terrain_vertices: array<f32>;

struct TerrainVertex {
    // Bitwise equal in all chunks that share the vertex.
    from_base_m: vec3<f32>,
    uv: vec2<f32>,
}

fn terrain_vertex(index: u32) -> TerrainVertex {
    let first = 5u * index;
    let from_base_m = vec3<f32>(
        terrain_vertices[first], terrain_vertices[first + 1u], terrain_vertices[first + 2u]
    );
    return TerrainVertex(from_base_m, vec2<f32>(terrain_vertices[first + 3u], terrain_vertices[first + 4u]));
}
