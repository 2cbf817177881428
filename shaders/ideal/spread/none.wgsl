// Surfaces are no thinner than a pixel: what is at the middles of pixels tells where they end.

fn are_thin(pixel: vec2<i32>, within: vec4<bool>, slope: vec4<f32>, edge_step: f32) -> vec4<bool> {
    return vec4<bool>(false);
}
