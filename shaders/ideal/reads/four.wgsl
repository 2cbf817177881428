// Four reads: two by two where a pixel is about as wide as long, four in a row where it is longer. No loop:
// llvmpipe pays as much for one as for a read.

// Longer by this than wide (at least a texel), and one read across is enough.
const IN_A_ROW: f32 = 1.6;

fn picture_at(uv: vec2<f32>, at: vec2<f32>) -> Texel {
    let pixel = pixel_at(uv);
    let square = pixel.longer < IN_A_ROW * max(pixel.shorter, 1.0);
    let version = version_for(select(max(0.25 * pixel.longer, pixel.shorter), 0.5 * pixel.longer, square));
    // +-x has the variance x^2, and +-x with +-3 x has 5 x^2; a mean over the length l has l^2 / 12.
    let long2 = max(pixel.longer * pixel.longer - version.variance, 0.0) / 12.0;
    let short2 = max(pixel.shorter * pixel.shorter - version.variance, 0.0) / 12.0;
    let a = pixel.along * sqrt(select(0.2 * long2, long2, square)) / pixel.size;
    let b = vec2<f32>(-pixel.along.y, pixel.along.x) * sqrt(short2) / pixel.size;
    let first = select(3.0 * a, a + b, square);
    let second = select(a, a - b, square);
    let sum = picture_read(at + first, version.level) + picture_read(at - first, version.level)
        + picture_read(at + second, version.level) + picture_read(at - second, version.level);
    return 0.25 * sum;
}
