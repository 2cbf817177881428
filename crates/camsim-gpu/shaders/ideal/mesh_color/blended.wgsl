// Colour of a blended surface: premultiplied colour and alpha. Fog is blended like a colour, so that each
// layer may have its own.
fn mesh_color(uv: vec2<f32>, centroid: vec2<f32>, tint: vec4<f32>, in_camera_m: vec3<f32>) -> vec4<f32> {
    let texel = filtered_texture(uv, centroid);
    // At pixels whose centre is outside of the triangle the extrapolated alpha may exceed 1.
    let tint_alpha = clamp(tint.a, 0.0, 1.0);
    let color = (texel.rgb * tint.rgb + material.emissive_cutoff.rgb * texel.a) / max(texel.a, 1e-6);
    let alpha = texel.a * tint_alpha;
    return vec4<f32>(alpha * apply_fog(color, in_camera_m).rgb, alpha);
}
