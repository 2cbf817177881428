// Surfaces are not thinner than a pixel: the depths at pixel centres suffice.

fn are_thin_surfaces(
    pixel: vec2<i32>,
    is_in_frame: vec4<bool>,
    slope: vec4<f32>,
    edge_step: f32,
) -> vec4<bool> {
    return vec4<bool>(false);
}
