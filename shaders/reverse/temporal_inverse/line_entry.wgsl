// Order of the tables that have an entry a line and exposure node; with more than one node the mid-exposure
// entry follows them.

// First entry of the pixel's line, of the chosen key.
fn line_entry(pixel: vec2<u32>) -> u32 {
    let line = select(pixel.y, pixel.x, frame.line_axis == 1u);
    let field = select(0u, pixel.y & 1u, frame.fields == 2u);
    let stride = select(frame.nodes + 1u, 1u, frame.nodes == 1u);
    return ((key_number() * frame.fields + field) * frame.lines + line) * stride;
}
