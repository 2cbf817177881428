// Of four samples a pixel: the middle of those that a triangle covers. What it shows beyond its border is not
// on it. Twin: the host's, in ideal/host/samples.rs.

// Where samples are from the pixel's middle on: camsim_core::temporal::SAMPLE_PLACES. All four of them have
// their middle there.
const SAMPLES_ACROSS = vec4<f32>(-0.125, 0.375, -0.375, 0.125);
const SAMPLES_DOWN = vec4<f32>(-0.375, -0.125, 0.125, 0.375);

fn covered_uv(uv: vec2<f32>, mask: u32) -> vec2<f32> {
    let is_covered = (vec4<u32>(mask) & vec4<u32>(1u, 2u, 4u, 8u)) != vec4<u32>(0u);
    let weights = select(vec4<f32>(0.0), vec4<f32>(1.0), is_covered);
    let beside = vec2<f32>(dot(weights, SAMPLES_ACROSS), dot(weights, SAMPLES_DOWN)) / max(dot(weights, vec4<f32>(1.0)), 1.0);
    return uv + beside.x * dpdx(uv) + beside.y * dpdy(uv);
}
