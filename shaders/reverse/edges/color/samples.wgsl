// Each sample has its colour.

@group(1) @binding(5) var fine_color: texture_multisampled_2d<f32>;

// Colour of the surface that is seen at a place.
fn surface_color_at(at_px: vec2<f32>) -> vec3<f32> {
    let s = fine_sample(at_px);
    return textureLoad(fine_color, s.texel, s.index).rgb;
}
