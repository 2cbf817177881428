// Four taps: two by two for a footprint that is about square, four in a row for an elongated one. No loop: on
// llvmpipe a loop costs as much as a tap.

// Ratio of the longer axis to the shorter one (at least a texel) from which the four taps form a row.
const ROW_RATIO: f32 = 1.6;

fn filtered_texture(uv: vec2<f32>, centre_uv: vec2<f32>) -> Texel {
    let footprint = pixel_footprint(uv);
    let is_square = footprint.longer < ROW_RATIO * max(footprint.shorter, 1.0);
    let mip = mip_level_for(
        select(max(0.25 * footprint.longer, footprint.shorter), 0.5 * footprint.longer, is_square)
    );
    // Taps at +-x have the variance x^2, taps at +-x and +-3 x have 5 x^2; a box of length l has l^2 / 12.
    let long2 = max(footprint.longer * footprint.longer - mip.variance, 0.0) / 12.0;
    let short2 = max(footprint.shorter * footprint.shorter - mip.variance, 0.0) / 12.0;
    let half_diagonal = footprint.direction * sqrt(select(0.2 * long2, long2, is_square))
        / footprint.size_texels;
    let half_across = vec2<f32>(-footprint.direction.y, footprint.direction.x) * sqrt(short2)
        / footprint.size_texels;
    let first = select(3.0 * half_diagonal, half_diagonal + half_across, is_square);
    let second = select(half_diagonal, half_diagonal - half_across, is_square);
    let sum = sample_texture(centre_uv + first, mip.level) + sample_texture(centre_uv - first, mip.level)
        + sample_texture(centre_uv + second, mip.level) + sample_texture(centre_uv - second, mip.level);
    return 0.25 * sum;
}
