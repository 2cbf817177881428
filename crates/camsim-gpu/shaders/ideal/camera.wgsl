// The key camera, and fog.
struct IdealCamera {
    // Clip-space scale and shift: clip.xy = scale * xy + shift * z, clip.z = near, clip.w = z (reversed,
    // infinite far).
    clip_scale: vec2<f32>,
    clip_shift: vec2<f32>,
    // Rows of the rotation camera_from_ned.
    camera_from_ned_x: vec4<f32>,
    camera_from_ned_y: vec4<f32>,
    camera_from_ned_z: vec4<f32>,
    // Position of the camera relative to the base: a whole-metre NED position near it, to which all vertices
    // are relative.
    camera_from_base_m: vec4<f32>,
    // Linear colour of the sky; in w the extinction coefficient of fog, 3.912 / visibility, 1/m, 0 = no fog.
    sky: vec4<f32>,
    near_m: f32,
    pad0: f32,
    pad1: f32,
    pad2: f32,
}

@group(0) @binding(0) var<uniform> ideal_camera: IdealCamera;

// Position in the axes of the key camera, metres. `from_base_m`: NED position relative to the base, metres.
fn key_camera_from_base(from_base_m: vec3<f32>) -> vec3<f32> {
    let offset_m = from_base_m - ideal_camera.camera_from_base_m.xyz;
    return vec3<f32>(
        dot(ideal_camera.camera_from_ned_x.xyz, offset_m),
        dot(ideal_camera.camera_from_ned_y.xyz, offset_m),
        dot(ideal_camera.camera_from_ned_z.xyz, offset_m),
    );
}

// Clip coordinates of a point in the axes of the key camera.
fn ideal_clip(point_m: vec3<f32>) -> vec4<f32> {
    return vec4<f32>(
        ideal_camera.clip_scale * point_m.xy + ideal_camera.clip_shift * point_m.z,
        ideal_camera.near_m,
        point_m.z,
    );
}
