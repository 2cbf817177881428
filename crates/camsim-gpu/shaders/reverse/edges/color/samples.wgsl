// Ideal frame with a colour per sample.

@group(1) @binding(5) var fine_color: texture_multisampled_2d<f32>;

// Colour of the surface that is visible at a position.
fn surface_color_at(position_px: vec2<f32>) -> vec3<f32> {
    let sample = fine_sample(position_px);
    return textureLoad(fine_color, sample.texel, sample.index).rgb;
}
