// One sample per pixel, or surfaces whose texture continues beyond the triangle: the pixel centre.
fn centroid_uv(uv: vec2<f32>, mask: u32) -> vec2<f32> {
    return uv;
}
