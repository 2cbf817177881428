// A thread processes one pixel.
fn process_pixels(group: vec2<u32>, local_px: vec2<u32>) {
    let pixel = SIDE * group + local_px;
    if (is_in_image(pixel)) {
        render_pixel(pixel);
    }
}
