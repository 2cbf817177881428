// One read: where texels are wider than pixels there is nothing to average. Which axis is the longer one is
// not asked, so that its direction is never worked out.
fn picture_at(uv: vec2<f32>, at: vec2<f32>) -> Texel {
    return picture_read(at, version_for(pixel_at(uv).longer).level);
}
