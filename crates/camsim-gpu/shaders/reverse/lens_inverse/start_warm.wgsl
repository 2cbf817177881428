// Initial value of the inverse: the same pixel of a lens map of nearby zoom; the radial table where that map
// is invalid.

@group(0) @binding(3) var warm_map: texture_2d<f32>;

fn initial_value(pixel: vec2u, distorted: vec2f) -> vec2f {
    let warm = textureLoad(warm_map, pixel, 0).xy;
    if warm.x >= INVALID_UV {
        return table_initial_value(distorted);
    }
    return warm;
}
