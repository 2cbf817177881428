// A grid of reads, one or two across and as many along the longer axis as keep them square.

// Most reads along the longer axis.
const MAX_TAPS: f32 = 32.0;
// Reads along the shorter axis of a pixel that is wider than half a texel: a single read of a smaller version
// blurs over twice the pixel, and one of the picture itself not at all.
const SHORT_TAPS: f32 = 2.0;
const ONE_TAP: f32 = 0.5;

// Variance (times 12) that a version of 2^level texels adds to what the picture has between its texels: of
// the mean of so many, and of the wider ramps.
fn version_variance(level: f32) -> f32 {
    let below = floor(level);
    return 3.0 * (mix(exp2(2.0 * below), exp2(2.0 * below + 2.0), level - below) - 1.0);
}

// Length along which `taps` reads and the version that they read have the variance of a mean over `side`.
fn tap_length(side: f32, taps: f32, version: f32) -> f32 {
    return sqrt(max(side * side - version, 0.0) / max(1.0 - 1.0 / (taps * taps), 0.5));
}

fn picture_at(uv: vec2<f32>, middle: vec2<f32>) -> Texel {
    let pixel = pixel_at(uv);
    // What a read covers, texels; a direction in which a texel is two pixels wide needs no more than one.
    let short_taps = select(1.0, SHORT_TAPS, pixel.shorter > ONE_TAP);
    let covered = max(pixel.shorter / short_taps, 1.0);
    let long_taps = clamp(ceil(pixel.longer / covered - 0.1), short_taps, MAX_TAPS);
    let side = max(pixel.longer / long_taps, covered);
    // Exactly 0 needs one version instead of two.
    let level = select(0.0, log2(side), side > 1.0);
    let version = version_variance(level);
    let long_axis = pixel.along * tap_length(pixel.longer, long_taps, version) / pixel.size;
    let short_axis = vec2<f32>(-pixel.along.y, pixel.along.x) * tap_length(pixel.shorter, short_taps, version) / pixel.size;
    let long_step = long_axis / long_taps;
    // Back to the first of the next row.
    let row_step = short_axis / short_taps - (long_taps - 1.0) * long_step;
    let taps = long_taps * short_taps;
    var at = middle - 0.5 * (long_axis - long_step) - 0.5 * (1.0 - 1.0 / short_taps) * short_axis;
    var sum = Texel();
    // One loop: llvmpipe pays as much for a second one as for a read.
    for (var i = 1.0; i <= taps; i += 1.0) {
        sum += picture_read(at, level);
        at += select(long_step, row_step, i == long_taps);
    }
    return sum / taps;
}
