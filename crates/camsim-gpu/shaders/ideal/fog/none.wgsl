// No fog.
fn apply_fog(color: vec3<f32>, in_camera_m: vec3<f32>) -> vec4<f32> {
    return vec4<f32>(color, 1.0);
}
