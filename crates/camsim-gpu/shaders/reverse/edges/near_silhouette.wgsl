// Whether the rays of a pixel may hit several surfaces.

// One word per 8x8 ideal pixels, made by ideal/dilate_tiles.wgsl, about what is within reach of a ray whose
// infinitely far point projects there: bits of the largest depth value, with the lowest bit replaced by
// whether there is an edge pixel.
@group(1) @binding(8) var<storage, read> dilated_tiles: array<u32>;

// Maximum number of look-ups along the parallax of a ray.
const MAX_LOOK_UPS: u32 = 128u;

// Word of the tile that holds the infinitely far point of a ray.
fn dilated_tile(far_px: vec2<f32>) -> u32 {
    let texel = vec2<u32>(clamp(far_px + 0.5, vec2<f32>(0.0), vec2<f32>(frame.ideal_size_px) - 1.0))
        + vec2<u32>(0u, u32(key_row()));
    return dilated_tiles[(texel.y / 8u) * ((textureDimensions(ideal_color).x + 7u) / 8u) + texel.x / 8u];
}

// Inverse depth in the line's camera of the nearest surface within reach, 1/m.
fn nearest_inverse_depth(uv: vec2<f32>, pose: Pose, tile_word: u32) -> f32 {
    let key_inverse_depth = 1.02 * bitcast<f32>(tile_word & 0xfffffffeu) / frame.near_m;
    // Bounded: for a camera that almost touches the surface the march would not end.
    return min(line_inverse_depth(uv, pose, key_inverse_depth), 4.0 * key_inverse_depth);
}

// Whether a segment of the ideal frame crosses an edge pixel.
fn crosses_edge(a_px: vec2<f32>, b_px: vec2<f32>) -> bool {
    let look_ups = clamp(u32(ceil(distance(a_px, b_px))), 1u, MAX_LOOK_UPS);
    for (var i = 0u; i <= look_ups; i++) {
        if (ideal_color_at(mix(a_px, b_px, f32(i) / f32(look_ups))).a < 1.0) {
            return true;
        }
    }
    return false;
}

// Whether the pixel's rays of one pose may hit several surfaces: their epipolar segment crosses a silhouette.
fn is_near_silhouette(uv: vec2<f32>, pose: Pose) -> bool {
    let far_point = point_at(uv, pose, 0.0);
    let far_px = ideal_px_from_point(far_point);
    let tile_word = dilated_tile(far_px);
    if (far_point.z <= 0.0 || (tile_word & 1u) == 0u) {
        return false;
    }
    let near_point = point_at(uv, pose, nearest_inverse_depth(uv, pose, tile_word));
    return near_point.z > 0.0 && crosses_edge(ideal_px_from_point(near_point), far_px);
}
