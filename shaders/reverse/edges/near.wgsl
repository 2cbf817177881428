// Whether the rays of a pixel may meet several surfaces.

// A word for each 8x8 ideal pixels, made by ideal/reach.wgsl: what is within reach of a ray that would come
// from there were it infinitely far. The bits of the largest depth value, the lowest one replaced by whether
// there is a marked pixel.
@group(1) @binding(8) var<storage, read> within_reach: array<u32>;

// Looks along the parallax of a ray, at most.
const MAX_LOOKS: u32 = 128u;

// What a ray may meet that comes from here if it is infinitely far.
fn reach_of(far_px: vec2<f32>) -> u32 {
    let at = vec2<u32>(clamp(far_px + 0.5, vec2<f32>(0.0), vec2<f32>(frame.ideal_size_px) - 1.0)) + vec2<u32>(0u, u32(key_row()));
    return within_reach[(at.y / 8u) * ((textureDimensions(ideal_color).x + 7u) / 8u) + at.x / 8u];
}

// Of the nearest surface within reach, as a line's own camera sees it.
fn nearest_inverse_depth(uv: vec2<f32>, pose: Pose, reach: u32) -> f32 {
    let in_key = 1.02 * bitcast<f32>(reach & 0xfffffffeu) / frame.near_m;
    // A camera that all but reaches the surface would stretch the search without end.
    return min(line_inverse_depth(uv, pose, in_key), 4.0 * in_key);
}

// Whether a stretch of the ideal frame passes a silhouette.
fn passes_edge(a_px: vec2<f32>, b_px: vec2<f32>) -> bool {
    let looks = clamp(u32(ceil(distance(a_px, b_px))), 1u, MAX_LOOKS);
    for (var i = 0u; i <= looks; i++) {
        if (ideal_color_at(mix(a_px, b_px, f32(i) / f32(looks))).a < 1.0) {
            return true;
        }
    }
    return false;
}

// Whether the pixel's rays of one pose may meet several surfaces: their parallax passes a silhouette.
fn near_edge(uv: vec2<f32>, pose: Pose) -> bool {
    let far = point_at(uv, pose, 0.0);
    let far_px = ideal_px_from_point(far);
    let reach = reach_of(far_px);
    if (far.z <= 0.0 || (reach & 1u) == 0u) {
        return false;
    }
    let near = point_at(uv, pose, nearest_inverse_depth(uv, pose, reach));
    return near.z > 0.0 && passes_edge(ideal_px_from_point(near), far_px);
}
