// Terrain triangles, selected on the CPU for this camera.
#import ideal/surface.wgsl
#import ideal/terrain_vertex.wgsl

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Surface {
    let vertex = terrain_vertex(index);
    return project_surface(vertex.from_base_m, vertex.uv);
}

@fragment
fn fragment(in: Surface, @builtin(sample_mask) mask: u32) -> @location(0) vec4<f32> {
    return apply_fog(filtered_texture(in.uv, centroid_uv(in.uv, mask)), in.in_camera_m);
}
