// A thread takes one pixel.
fn take_pixels(group: vec2<u32>, place: vec2<u32>) {
    let pixel = SIDE * group + place;
    if (is_in_picture(pixel)) {
        show(pixel);
    }
}
