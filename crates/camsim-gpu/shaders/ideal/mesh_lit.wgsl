// Illuminated triangle meshes without alpha mask.
#import ideal/light.wgsl

struct LitSurface {
    @builtin(position) clip: vec4<f32>,
    @location(0) uv: vec2<f32>,
    @location(1) in_camera_m: vec3<f32>,
    @location(2) tint: vec4<f32>,
    @location(3) normal_ned: vec3<f32>,
}

@vertex
fn vertex(
    @builtin(instance_index) instance: u32,
    @location(0) position_m: vec3<f32>,
    @location(1) uv: vec2<f32>,
    @location(2) tint: vec4<f32>,
    @location(3) normal: vec3<f32>,
) -> LitSurface {
    let surface = project_surface(base_from_shape(instance, position_m), uv);
    return LitSurface(surface.clip, surface.uv, surface.in_camera_m, tint, normal_ned_of(instance, normal));
}

@fragment
fn fragment(
    in: LitSurface,
    @builtin(front_facing) is_front: bool,
    @builtin(sample_mask) mask: u32,
) -> @location(0) vec4<f32> {
    return mesh_color(
        in.uv, centroid_uv(in.uv, mask), illuminated(in.tint, in.normal_ned, is_front), in.in_camera_m
    );
}
