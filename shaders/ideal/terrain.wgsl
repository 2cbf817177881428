// Terrain triangles as the host chose them for this camera.
#import ideal/surface.wgsl
#import ideal/terrain_vertex.wgsl

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Surface {
    let at = terrain_vertex(index);
    return project_surface(at.from_base_m, at.uv);
}

@fragment
fn fragment(in: Surface, @builtin(sample_mask) mask: u32) -> @location(0) vec4<f32> {
    return in_fog(picture_at(in.uv, covered_uv(in.uv, mask)), in.in_camera_m);
}
