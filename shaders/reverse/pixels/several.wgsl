// A thread takes several pixels of a line, a workgroup's side apart: what they share is read once.
override PIXELS: u32 = 1u;

fn take_pixels(group: vec2<u32>, place: vec2<u32>) {
    let step = select(vec2<u32>(SIDE, 0u), vec2<u32>(0u, SIDE), frame.line_axis == 1u);
    let first = group * (SIDE + (PIXELS - 1u) * step) + place;
    hold_line(first);
    for (var k = 0u; k < PIXELS; k++) {
        let pixel = first + k * step;
        if (!is_in_picture(pixel)) {
            break;
        }
        show(pixel);
    }
}
