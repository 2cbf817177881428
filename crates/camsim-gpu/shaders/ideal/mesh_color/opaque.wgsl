// Colour of an opaque surface.
fn mesh_color(uv: vec2<f32>, centroid: vec2<f32>, tint: vec4<f32>, in_camera_m: vec3<f32>) -> vec4<f32> {
    return apply_fog(filtered_texture(uv, centroid) * tint.rgb + material.emissive_cutoff.rgb, in_camera_m);
}
