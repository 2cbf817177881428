// Layout of the tables with one entry per key, field, line and exposure node. With more than one node the
// mid-exposure entry follows them.

// First entry of the pixel's line for the selected key.
fn line_entry(pixel: vec2<u32>) -> u32 {
    let line = select(pixel.y, pixel.x, frame.line_axis == 1u);
    let field = select(0u, pixel.y & 1u, frame.fields == 2u);
    let stride = select(frame.nodes + 1u, 1u, frame.nodes == 1u);
    return ((key_index() * frame.fields + field) * frame.lines + line) * stride;
}
