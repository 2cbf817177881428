// Four samples per pixel: texture coordinates at the centroid of the covered samples (centroid sampling),
// since those at the pixel centre may lie outside of the triangle. Twin:
// `camsim-cpu/src/ideal/multisample.rs`.

// Sample positions from the pixel centre, pixels: camsim_core::temporal::SAMPLE_POSITIONS. The centroid of
// all four is the pixel centre.
const SAMPLE_OFFSETS_X = vec4<f32>(-0.125, 0.375, -0.375, 0.125);
const SAMPLE_OFFSETS_Y = vec4<f32>(-0.375, -0.125, 0.125, 0.375);

fn centroid_uv(uv: vec2<f32>, mask: u32) -> vec2<f32> {
    let is_covered = (vec4<u32>(mask) & vec4<u32>(1u, 2u, 4u, 8u)) != vec4<u32>(0u);
    let weights = select(vec4<f32>(0.0), vec4<f32>(1.0), is_covered);
    let offset_px = vec2<f32>(dot(weights, SAMPLE_OFFSETS_X), dot(weights, SAMPLE_OFFSETS_Y))
        / max(dot(weights, vec4<f32>(1.0)), 1.0);
    return uv + offset_px.x * dpdx(uv) + offset_px.y * dpdy(uv);
}
