// Two taps along the longer axis. No loop: on llvmpipe a loop costs as much as a tap.
fn filtered_texture(uv: vec2<f32>, centre_uv: vec2<f32>) -> Texel {
    let footprint = pixel_footprint(uv);
    let mip = mip_level_for(max(0.5 * footprint.longer, footprint.shorter));
    // Taps at +-x have the variance x^2, a box of length l has l^2 / 12.
    let offset_uv = footprint.direction * sqrt(
        max(footprint.longer * footprint.longer - mip.variance, 0.0)
        / 12.0
    ) / footprint.size_texels;
    return 0.5 * (
        sample_texture(centre_uv + offset_uv, mip.level)
        + sample_texture(centre_uv - offset_uv, mip.level)
    );
}
