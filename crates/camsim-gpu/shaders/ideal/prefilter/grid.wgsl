// Grid of taps: one or two across, and as many along the longer axis as keep the cells square.

// Maximum number of taps along the longer axis.
const MAX_TAPS: f32 = 32.0;
// Taps along the shorter axis of a footprint wider than ONE_TAP texels. A single tap of a coarser mip level
// would blur over two pixels, one of the finest level not at all.
const SHORT_TAPS: f32 = 2.0;
const ONE_TAP_TEXELS: f32 = 0.5;

// Variance (times 12) of a mip level beyond that of bilinear texels, texels^2, blended between whole levels.
fn mip_variance(level: f32) -> f32 {
    let below = floor(level);
    return 3.0 * (mix(exp2(2.0 * below), exp2(2.0 * below + 2.0), level - below) - 1.0);
}

// Length over which `taps` taps of that mip level have the variance of a box of length `cell`.
fn tap_length(cell: f32, taps: f32, mip: f32) -> f32 {
    return sqrt(max(cell * cell - mip, 0.0) / max(1.0 - 1.0 / (taps * taps), 0.5));
}

fn filtered_texture(uv: vec2<f32>, centre_uv: vec2<f32>) -> Texel {
    let footprint = pixel_footprint(uv);
    // Texels per tap. Along an axis on which a texel spans two pixels one tap is enough.
    let short_taps = select(1.0, SHORT_TAPS, footprint.shorter > ONE_TAP_TEXELS);
    let texels_per_tap = max(footprint.shorter / short_taps, 1.0);
    let long_taps = clamp(ceil(footprint.longer / texels_per_tap - 0.1), short_taps, MAX_TAPS);
    let cell = max(footprint.longer / long_taps, texels_per_tap);
    // Exactly 0 reads one level instead of two.
    let level = select(0.0, log2(cell), cell > 1.0);
    let mip = mip_variance(level);
    let long_axis = footprint.direction * tap_length(footprint.longer, long_taps, mip)
        / footprint.size_texels;
    let short_axis = vec2<f32>(
        -footprint.direction.y, footprint.direction.x
    ) * tap_length(footprint.shorter, short_taps, mip) / footprint.size_texels;
    let long_step = long_axis / long_taps;
    // From the last tap of a row to the first of the next.
    let row_step = short_axis / short_taps - (long_taps - 1.0) * long_step;
    let taps = long_taps * short_taps;
    var tap_uv = centre_uv - 0.5 * (long_axis - long_step) - 0.5 * (1.0 - 1.0 / short_taps) * short_axis;
    var sum = Texel();
    // A single loop: on llvmpipe a second one costs as much as a tap.
    for (var i = 1.0; i <= taps; i += 1.0) {
        sum += sample_texture(tap_uv, level);
        tap_uv += select(long_step, row_step, i == long_taps);
    }
    return sum / taps;
}
