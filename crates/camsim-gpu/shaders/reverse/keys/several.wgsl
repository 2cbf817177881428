// Several ideal frames, at the middles of equal parts of the window, one below the other in the same
// textures. Functions that read them or the poses use the key that was selected last. Twin:
// camsim_core::temporal::silhouette_rays::nearest_first.

var<private> selected_key: u32 = 0u;

fn key_count() -> u32 {
    return unspecialised(frame.keys);
}

// Mid-exposure of the pixel's line and its exposure time, as fractions of the window.
fn window_fractions(pixel: vec2<u32>) -> vec2<f32> {
    let line = select(pixel.y, pixel.x, frame.line_axis == 1u);
    let field = select(0u, pixel.y & 1u, frame.fields == 2u);
    let stride = select(frame.nodes + 1u, 1u, frame.nodes == 1u);
    return poses[frame.keys * (frame.fields * frame.lines * stride + 1u) + field * frame.lines + line].x.xy;
}

// The nearest key is that of the part of the window that contains the fraction; the others follow by their
// distance.
fn select_rank(fraction: f32, rank: u32) {
    var used_keys = 0u;
    for (var i = 0u; i <= rank; i++) {
        var least_distance = 1e30;
        for (var key = 0u; key < key_count(); key++) {
            let distance = abs(fraction * f32(frame.keys) - f32(key) - 0.5);
            if (distance < least_distance && (used_keys & (1u << key)) == 0u) {
                least_distance = distance;
                selected_key = key;
            }
        }
        used_keys |= 1u << selected_key;
    }
}

fn select_key_of_line(pixel: vec2<u32>) {
    select_rank(window_fractions(pixel).x, 0u);
}

fn select_key_of_rank(pixel: vec2<u32>, exposure_fraction: f32, rank: u32) {
    let fractions = window_fractions(pixel);
    select_rank(fractions.x + (exposure_fraction - 0.5) * fractions.y, rank);
}

fn key_index() -> u32 {
    return selected_key;
}

fn key_row() -> i32 {
    return i32(selected_key * frame.key_rows);
}

fn reference_point(position_px: vec2<f32>, key_inverse_depth: f32) -> vec4<f32> {
    let stride = select(frame.nodes + 1u, 1u, frame.nodes == 1u);
    let pose = poses[frame.keys * frame.fields * frame.lines * stride + selected_key];
    let ray = vec3<f32>((position_px - frame.ideal_principal_px) / frame.ideal_focal_px, 1.0);
    return vec4<f32>(rotate(pose, ray) + key_inverse_depth * translation(pose), key_inverse_depth);
}

fn reference_px(position_px: vec2<f32>, key_inverse_depth: f32) -> vec2<f32> {
    return ideal_px_from_point(reference_point(position_px, key_inverse_depth).xyz);
}
