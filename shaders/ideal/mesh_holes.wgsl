// Triangle meshes with holes.
#import ideal/holes.wgsl

struct HoledSurface {
    @builtin(position) clip: vec4<f32>,
    @location(0) uv: vec2<f32>,
    @location(1) in_camera_m: vec3<f32>,
    @location(2) tint: vec4<f32>,
    // Where the sample is.
    @location(3) @interpolate(perspective, sample) sample_uv: vec2<f32>,
    @location(4) @interpolate(perspective, sample) sample_alpha: f32,
}

@vertex
fn vertex(@builtin(instance_index) instance: u32, @location(0) position_m: vec3<f32>, @location(1) uv: vec2<f32>, @location(2) tint: vec4<f32>) -> HoledSurface {
    let surface = project_surface(base_from_shape(instance, position_m), uv);
    return HoledSurface(surface.clip, surface.uv, surface.in_camera_m, tint, uv, tint.a);
}

@fragment
fn fragment(in: HoledSurface) -> @location(0) vec4<f32> {
    let color = mesh_color(in.uv, in.uv, in.tint, in.in_camera_m);
    if (is_hole(in.sample_uv, in.sample_alpha)) {
        discard;
    }
    return color;
}

// Where nothing but depth is drawn.
@fragment
fn fragment_depth(in: HoledSurface) {
    if (is_hole(in.sample_uv, in.sample_alpha)) {
        discard;
    }
}
