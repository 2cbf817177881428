// Of one sample a pixel, and of what goes on beyond a triangle: the pixel's middle.
fn covered_uv(uv: vec2<f32>, mask: u32) -> vec2<f32> {
    return uv;
}
