// Terrain triangles as the host chose them for this camera.
#import ideal/surface.wgsl
#import ideal/terrain_vertex.wgsl

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Surface {
    let at = terrain_vertex(index);
    return project_surface(at.from_base_m, at.uv);
}
