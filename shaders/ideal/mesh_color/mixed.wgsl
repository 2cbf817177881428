// Of a surface that is mixed with what is behind it: colour times alpha, and alpha. Fog is mixed like a
// colour, so that each layer may have its own.
fn mesh_color(uv: vec2<f32>, at: vec2<f32>, tint: vec4<f32>, in_camera_m: vec3<f32>) -> vec4<f32> {
    let seen = picture_at(uv, at);
    // A pixel whose centre is beside its triangle may have more than there is.
    let of_tint = clamp(tint.a, 0.0, 1.0);
    let color = (seen.rgb * tint.rgb + material.emissive_cutoff.rgb * seen.a) / max(seen.a, 1e-6);
    let alpha = seen.a * of_tint;
    return vec4<f32>(alpha * in_fog(color, in_camera_m).rgb, alpha);
}
