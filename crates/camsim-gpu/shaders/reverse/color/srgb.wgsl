// The paper preset: values are sRGB-encoded through gather, fog and photometric stage, and decoded to linear
// light at the very end. Twin of the fog: camsim_core::temporal::paper::linear_fog.

fn after_gather(ray: Ray, color: vec3<f32>) -> vec3<f32> {
    if (unspecialised(u32(frame.linear_fog.w == 0.0)) == 1u) {
        return color;
    }
    let inverse_depth = constant_depth(frame.ideal_focal_px * ray.uv + frame.ideal_principal_px);
    let amount = length(vec3<f32>(ray.uv, 1.0)) * frame.linear_fog.w / max(inverse_depth, 1e-30);
    return mix(color, frame.linear_fog.rgb, clamp(amount, 0.0, 1.0));
}

// Decodes sRGB to linear light (IEC 61966-2-1). Twin: camsim_core::scene::linear_from_srgb.
fn output_color(value: vec3<f32>) -> vec3<f32> {
    let curve = pow((value + 0.055) / 1.055, vec3<f32>(2.4));
    return select(curve, value / 12.92, value <= vec3<f32>(0.04045));
}
