// Triangle meshes without alpha mask.
#import ideal/mesh_surface.wgsl

@vertex
fn vertex(
    @builtin(instance_index) instance: u32,
    @location(0) position_m: vec3<f32>,
    @location(1) uv: vec2<f32>,
    @location(2) tint: vec4<f32>,
) -> MeshSurface {
    let surface = project_surface(base_from_shape(instance, position_m), uv);
    return MeshSurface(surface.clip, surface.uv, surface.in_camera_m, tint);
}

struct MeshSurface {
    @builtin(position) clip: vec4<f32>,
    @location(0) uv: vec2<f32>,
    @location(1) in_camera_m: vec3<f32>,
    @location(2) tint: vec4<f32>,
}

@fragment
fn fragment(in: MeshSurface, @builtin(sample_mask) mask: u32) -> @location(0) vec4<f32> {
    return mesh_color(in.uv, centroid_uv(in.uv, mask), in.tint, in.in_camera_m);
}
