// Initial value of the inverse: the radial table.

fn initial_value(pixel: vec2u, distorted: vec2f) -> vec2f {
    return table_initial_value(distorted);
}
