// A thread processes several pixels of a line, a workgroup's side apart, which share the poses.
override PIXELS: u32 = 1u;

fn process_pixels(group: vec2<u32>, local_px: vec2<u32>) {
    let step = select(vec2<u32>(SIDE, 0u), vec2<u32>(0u, SIDE), frame.line_axis == 1u);
    let first = group * (SIDE + (PIXELS - 1u) * step) + local_px;
    cache_line_poses(first);
    for (var k = 0u; k < PIXELS; k++) {
        let pixel = first + k * step;
        if (!is_in_image(pixel)) {
            break;
        }
        render_pixel(pixel);
    }
}
