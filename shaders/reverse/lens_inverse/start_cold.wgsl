// Start of the inverse: the radial table.

fn start_of(pixel: vec2u, distorted: vec2f) -> vec2f {
    return table_start(distorted);
}
