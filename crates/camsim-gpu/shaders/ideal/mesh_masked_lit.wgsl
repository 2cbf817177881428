// Illuminated triangle meshes with alpha mask.
#import ideal/alpha_mask.wgsl
#import ideal/light.wgsl

struct LitMaskedSurface {
    @builtin(position) clip: vec4<f32>,
    @location(0) uv: vec2<f32>,
    @location(1) in_camera_m: vec3<f32>,
    @location(2) tint: vec4<f32>,
    // At the position of the sample.
    @location(3) @interpolate(perspective, sample) sample_uv: vec2<f32>,
    @location(4) @interpolate(perspective, sample) sample_alpha: f32,
    @location(5) normal_ned: vec3<f32>,
}

@vertex
fn vertex(
    @builtin(instance_index) instance: u32,
    @location(0) position_m: vec3<f32>,
    @location(1) uv: vec2<f32>,
    @location(2) tint: vec4<f32>,
    @location(3) normal: vec3<f32>,
) -> LitMaskedSurface {
    let surface = project_surface(base_from_shape(instance, position_m), uv);
    return LitMaskedSurface(
        surface.clip, surface.uv, surface.in_camera_m, tint, uv, tint.a, normal_ned_of(instance, normal)
    );
}

@fragment
fn fragment(in: LitMaskedSurface, @builtin(front_facing) is_front: bool) -> @location(0) vec4<f32> {
    let color = mesh_color(in.uv, in.uv, illuminated(in.tint, in.normal_ned, is_front), in.in_camera_m);
    if (is_masked_out(in.sample_uv, in.sample_alpha)) {
        discard;
    }
    return color;
}

// Entry point of depth-only passes.
@fragment
fn fragment_depth(in: LitMaskedSurface) {
    if (is_masked_out(in.sample_uv, in.sample_alpha)) {
        discard;
    }
}
