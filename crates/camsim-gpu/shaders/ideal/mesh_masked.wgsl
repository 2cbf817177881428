// Triangle meshes with alpha mask.
#import ideal/alpha_mask.wgsl

struct MaskedSurface {
    @builtin(position) clip: vec4<f32>,
    @location(0) uv: vec2<f32>,
    @location(1) in_camera_m: vec3<f32>,
    @location(2) tint: vec4<f32>,
    // At the position of the sample.
    @location(3) @interpolate(perspective, sample) sample_uv: vec2<f32>,
    @location(4) @interpolate(perspective, sample) sample_alpha: f32,
}

@vertex
fn vertex(
    @builtin(instance_index) instance: u32,
    @location(0) position_m: vec3<f32>,
    @location(1) uv: vec2<f32>,
    @location(2) tint: vec4<f32>,
) -> MaskedSurface {
    let surface = project_surface(base_from_shape(instance, position_m), uv);
    return MaskedSurface(surface.clip, surface.uv, surface.in_camera_m, tint, uv, tint.a);
}

@fragment
fn fragment(in: MaskedSurface) -> @location(0) vec4<f32> {
    let color = mesh_color(in.uv, in.uv, in.tint, in.in_camera_m);
    if (is_masked_out(in.sample_uv, in.sample_alpha)) {
        discard;
    }
    return color;
}

// Entry point of depth-only passes.
@fragment
fn fragment_depth(in: MaskedSurface) {
    if (is_masked_out(in.sample_uv, in.sample_alpha)) {
        discard;
    }
}
