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

@group(1) @binding(0) var surface_texture: texture_2d<f32>;
@group(1) @binding(1) var surface_sampler: sampler;

// Most taps along the longer axis of a pixel's footprint.
const MAX_TAPS: f32 = 32.0;
// Taps along the shorter axis of a footprint that is wider than half a texel: a single tap of a smaller version blurs over twice the pixel,
// and one of the picture itself not at all.
const SHORT_TAPS: f32 = 2.0;
const ONE_TAP: f32 = 0.5;

// Variance (times 12) that a version of 2^level texels adds to what the picture has between its texels: of the mean of so many, and of the
// wider ramps.
fn version_variance(level: f32) -> f32 {
    let below = floor(level);
    return 3.0 * (mix(exp2(2.0 * below), exp2(2.0 * below + 2.0), level - below) - 1.0);
}

// Length along which `taps` taps and the version that they read have the variance of a mean over `side`.
fn tap_length(side: f32, taps: f32, version: f32) -> f32 {
    return sqrt(max(side * side - version, 0.0) / max(1.0 - 1.0 / (taps * taps), 0.5));
}

// Mean of the picture over a pixel: the ellipse that stands for the pixel on the picture is covered by a grid of trilinear taps, as many
// along its longer axis as keep them square. Own code, because adapters' anisotropic filters are each their own approximation.
fn picture_at(uv: vec2<f32>) -> vec3<f32> {
    let size = vec2<f32>(textureDimensions(surface_texture));
    let dx = dpdx(uv) * size;
    let dy = dpdy(uv) * size;
    // The ellipse's axes are the singular values of [dx dy]: roots of the eigenvalues of the symmetric [[a, b], [b, c]].
    let a = dx.x * dx.x + dy.x * dy.x;
    let b = dx.x * dx.y + dy.x * dy.y;
    let c = dx.y * dx.y + dy.y * dy.y;
    let mean = 0.5 * (a + c);
    let spread = sqrt(0.25 * (a - c) * (a - c) + b * b);
    let longer = sqrt(mean + spread);
    let shorter = sqrt(max(mean - spread, 0.0));
    // What a tap covers, texels; a direction in which a texel is two pixels wide needs no more than one tap.
    let short_taps = select(1.0, SHORT_TAPS, shorter > ONE_TAP);
    let covered = max(shorter / short_taps, 1.0);
    let long_taps = clamp(ceil(longer / covered - 0.1), short_taps, MAX_TAPS);
    let level = log2(max(longer / long_taps, covered));
    // Of the two expressions of the eigenvector, the one without cancellation.
    let along_x = vec2<f32>(0.5 * (a - c) + spread, b);
    let along_y = vec2<f32>(b, 0.5 * (c - a) + spread);
    let both = select(along_y, along_x, a >= c);
    // A circle has no longer axis: any will do.
    let along = select(vec2<f32>(1.0, 0.0), both / max(length(both), 1e-20), spread > 1e-6 * mean);
    let version = version_variance(level);
    let long_axis = along * tap_length(longer, long_taps, version) / size;
    let short_axis = vec2<f32>(-along.y, along.x) * tap_length(shorter, short_taps, version) / size;
    var sum = vec3<f32>(0.0);
    for (var j = 0.0; j < short_taps; j += 1.0) {
        for (var i = 0.0; i < long_taps; i += 1.0) {
            let at = uv + ((i + 0.5) / long_taps - 0.5) * long_axis + ((j + 0.5) / short_taps - 0.5) * short_axis;
            sum += textureSampleLevel(surface_texture, surface_sampler, at, level).rgb;
        }
    }
    return sum / (long_taps * short_taps);
}

@fragment
fn fragment(in: Surface) -> @location(0) vec4<f32> {
    var color = picture_at(in.uv);
    if (ideal_camera.sky.w > 0.0) {
        let fog = 1.0 - exp(-ideal_camera.sky.w * length(in.in_camera_m));
        color = mix(color, ideal_camera.sky.rgb, fog);
    }
    return vec4<f32>(color, 1.0);
}
