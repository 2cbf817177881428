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
const MAX_TAPS: f32 = 16.0;

// Mean of the picture over a pixel: the ellipse that stands for the pixel on the picture is covered along its longer axis by as many
// trilinear taps as its shorter axis fits in. Own code, because adapters' anisotropic filters are each their own approximation.
fn picture_at(uv: vec2<f32>) -> vec3<f32> {
    let size = vec2<f32>(textureDimensions(surface_texture));
    let dx = dpdx(uv) * size;
    let dy = dpdy(uv) * size;
    // The ellipse's half axes are the singular values of [dx dy]: eigenvalues of the symmetric [[a, b], [b, c]].
    let a = dx.x * dx.x + dy.x * dy.x;
    let b = dx.x * dx.y + dy.x * dy.y;
    let c = dx.y * dx.y + dy.y * dy.y;
    let mean = 0.5 * (a + c);
    let spread = sqrt(0.25 * (a - c) * (a - c) + b * b);
    let longer = sqrt(mean + spread);
    // A magnified direction needs no more than one tap of the picture itself.
    let shorter = max(sqrt(max(mean - spread, 0.0)), 1.0);
    let taps = clamp(ceil(longer / shorter - 0.1), 1.0, MAX_TAPS);
    let level = log2(max(longer / taps, shorter));
    // Of the two expressions of the eigenvector, the one without cancellation.
    let along_x = vec2<f32>(0.5 * (a - c) + spread, b);
    let along_y = vec2<f32>(b, 0.5 * (c - a) + spread);
    let along = select(along_y, along_x, a >= c);
    let axis = along * (longer / max(length(along), 1e-30)) / size;
    var sum = vec3<f32>(0.0);
    for (var i = 0.0; i < taps; i += 1.0) {
        let share = (i + 0.5) / taps - 0.5;
        sum += textureSampleLevel(surface_texture, surface_sampler, uv + share * axis, level).rgb;
    }
    return sum / taps;
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
