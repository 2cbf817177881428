// Two reads along the longer axis. No loop: llvmpipe pays as much for one as for a read.
fn picture_at(uv: vec2<f32>, at: vec2<f32>) -> Texel {
    let pixel = pixel_at(uv);
    let version = version_for(max(0.5 * pixel.longer, pixel.shorter));
    // +-x has the variance x^2, a mean over the length l has l^2 / 12.
    let off = pixel.along * sqrt(max(pixel.longer * pixel.longer - version.variance, 0.0) / 12.0) / pixel.size;
    return 0.5 * (picture_read(at + off, version.level) + picture_read(at - off, version.level));
}
