// What every surface of the ideal frame shares: camera, fog, colour.
struct IdealCamera {
    // Clip-space scale and shift: clip.xy = scale * xy + shift * z, clip.z = near, clip.w = z (reversed, infinite far).
    clip_scale: vec2<f32>,
    clip_shift: vec2<f32>,
    // Rows of camera_from_ned.
    camera_from_ned_x: vec4<f32>,
    camera_from_ned_y: vec4<f32>,
    camera_from_ned_z: vec4<f32>,
    // Camera position minus the whole-metre base that surfaces are relative to.
    camera_from_base_m: vec4<f32>,
    // Linear sky colour; w = 3.912 / visibility, 0 = no fog.
    sky: vec4<f32>,
    near_m: f32,
    pad0: f32,
    pad1: f32,
    pad2: f32,
}

@group(0) @binding(0) var<uniform> ideal_camera: IdealCamera;

struct Surface {
    @builtin(position) clip: vec4<f32>,
    // At a place that the triangle covers: beyond its border a steep triangle's texture would run far.
    @location(0) uv: vec2<f32>,
    @location(1) in_camera_m: vec3<f32>,
}

// `from_base_m`: NED metres relative to the whole-metre base near the camera.
fn project_surface(from_base_m: vec3<f32>, uv: vec2<f32>) -> Surface {
    let d = from_base_m - ideal_camera.camera_from_base_m.xyz;
    let p = vec3<f32>(
        dot(ideal_camera.camera_from_ned_x.xyz, d),
        dot(ideal_camera.camera_from_ned_y.xyz, d),
        dot(ideal_camera.camera_from_ned_z.xyz, d),
    );
    var out: Surface;
    out.clip = vec4<f32>(ideal_camera.clip_scale * p.xy + ideal_camera.clip_shift * p.z, ideal_camera.near_m, p.z);
    out.uv = uv;
    out.in_camera_m = p;
    return out;
}

// What reads the picture: the `reads` slot, with as many reads as the picture's error asks for. Own code, because adapters' anisotropic
// filters are each their own approximation. Twin: camsim_core::plan::transfer::SurfaceFilter.
@group(1) @binding(0) var surface_texture: texture_2d<f32>;
@group(1) @binding(1) var surface_sampler: sampler;

// The ellipse that stands for a pixel on the picture, texels.
struct Pixel {
    size: vec2<f32>,
    // Its axes.
    longer: f32,
    shorter: f32,
    // Direction of the longer one.
    along: vec2<f32>,
}

fn pixel_at(uv: vec2<f32>) -> Pixel {
    let size = vec2<f32>(textureDimensions(surface_texture));
    let dx = dpdx(uv) * size;
    let dy = dpdy(uv) * size;
    // The axes are the singular values of [dx dy]: roots of the eigenvalues of the symmetric [[a, b], [b, c]].
    let a = dx.x * dx.x + dy.x * dy.x;
    let b = dx.x * dx.y + dy.x * dy.y;
    let c = dx.y * dx.y + dy.y * dy.y;
    let mean = 0.5 * (a + c);
    let spread = sqrt(0.25 * (a - c) * (a - c) + b * b);
    // Of the two expressions of the eigenvector, the one without cancellation.
    let along_x = vec2<f32>(0.5 * (a - c) + spread, b);
    let along_y = vec2<f32>(b, 0.5 * (c - a) + spread);
    let both = select(along_y, along_x, a >= c);
    // A circle has no longer axis: any will do.
    let along = select(vec2<f32>(1.0, 0.0), both / max(length(both), 1e-20), spread > 1e-6 * mean);
    return Pixel(size, sqrt(mean + spread), sqrt(max(mean - spread, 0.0)), along);
}

fn picture_read(uv: vec2<f32>, level: f32) -> vec3<f32> {
    return textureSampleLevel(surface_texture, surface_sampler, uv, level).rgb;
}

// What a read is of.
struct Version {
    // Its variance (times 12) beyond what the picture has between its texels, texels^2.
    variance: f32,
    level: f32,
}

// Reads this far apart, texels, or less need no smaller version of the picture.
const CLOSE_TEXELS: f32 = 0.8;
// Variance (times 12) of the version for reads a texel apart: more than the 1 of their cell, because what a read lets through between the
// cells comes back as another wave.
const CELL_VARIANCE: f32 = 1.5;

// For reads `cell` texels apart. A version of 2^level texels has the variance 3 (4^level - 1), one between two whole levels a mixture.
fn version_for(cell: f32) -> Version {
    let close = cell <= CLOSE_TEXELS;
    let variance = select(CELL_VARIANCE * cell * cell, 0.0, close);
    let texels2 = variance / 3.0 + 1.0;
    let below = floor(0.5 * log2(texels2));
    let level = below + (texels2 * exp2(-2.0 * below) - 1.0) / 3.0;
    // Exactly 0 needs one version instead of two.
    return Version(variance, select(level, 0.0, close));
}

#import <slot:reads>

@fragment
fn fragment(in: Surface) -> @location(0) vec4<f32> {
    var color = picture_at(in.uv);
    if (ideal_camera.sky.w > 0.0) {
        let fog = 1.0 - exp(-ideal_camera.sky.w * length(in.in_camera_m));
        color = mix(color, ideal_camera.sky.rgb, fog);
    }
    return vec4<f32>(color, 1.0);
}
