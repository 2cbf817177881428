// Exponential fog (Koschmieder): linear light that reaches the camera from a surface of this colour.
fn apply_fog(color: vec3<f32>, in_camera_m: vec3<f32>) -> vec4<f32> {
    let fog = 1.0 - exp(-ideal_camera.sky.w * length(in_camera_m));
    return vec4<f32>(mix(color, ideal_camera.sky.rgb, fog), 1.0);
}
