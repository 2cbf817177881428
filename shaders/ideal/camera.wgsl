// The key camera, and fog.
struct IdealCamera {
    // Clip-space scale and shift: clip.xy = scale * xy + shift * z, clip.z = near, clip.w = z (reversed,
    // infinite far).
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

// In the key camera, metres. `from_base_m`: NED metres relative to the whole-metre base near the camera.
fn in_ideal_camera(from_base_m: vec3<f32>) -> vec3<f32> {
    let d = from_base_m - ideal_camera.camera_from_base_m.xyz;
    return vec3<f32>(
        dot(ideal_camera.camera_from_ned_x.xyz, d),
        dot(ideal_camera.camera_from_ned_y.xyz, d),
        dot(ideal_camera.camera_from_ned_z.xyz, d),
    );
}

// Clip coordinates of a point of the key camera.
fn ideal_clip(p: vec3<f32>) -> vec4<f32> {
    return vec4<f32>(ideal_camera.clip_scale * p.xy + ideal_camera.clip_shift * p.z, ideal_camera.near_m, p.z);
}
