// One tap, where texels are wider than pixels. The direction of the longer axis is not used, so the compiler
// drops its computation.
fn filtered_texture(uv: vec2<f32>, centre_uv: vec2<f32>) -> Texel {
    return sample_texture(centre_uv, mip_level_for(pixel_footprint(uv).longer).level);
}
