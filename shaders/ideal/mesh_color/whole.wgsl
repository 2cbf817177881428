// Of a surface that lets no light through.
fn mesh_color(uv: vec2<f32>, at: vec2<f32>, tint: vec4<f32>, in_camera_m: vec3<f32>) -> vec4<f32> {
    return in_fog(picture_at(uv, at) * tint.rgb + material.emissive_cutoff.rgb, in_camera_m);
}
