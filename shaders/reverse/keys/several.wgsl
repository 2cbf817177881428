// Several ideal frames, at the middles of equal parts of the window, one below the other in the same
// textures. Every function that reads them or the poses goes to the key that was chosen last. Twin:
// camsim_core::temporal::silhouette_rays::nearest_key.

var<private> chosen_key: u32 = 0u;

fn key_count() -> u32 {
    return told(frame.keys);
}

// Mid-exposure of the pixel's line as a share of the window.
fn line_share(pixel: vec2<u32>) -> f32 {
    let line = select(pixel.y, pixel.x, frame.line_axis == 1u);
    let field = select(0u, pixel.y & 1u, frame.fields == 2u);
    let stride = select(frame.nodes + 1u, 1u, frame.nodes == 1u);
    return poses[frame.keys * (frame.fields * frame.lines * stride + 1u) + field * frame.lines + line].x.x;
}

// The nearest key is that of the part that holds the share; the others follow by their distance.
fn use_rank(share: f32, rank: u32) {
    var used = 0u;
    for (var i = 0u; i <= rank; i++) {
        var least = 1e30;
        for (var key = 0u; key < key_count(); key++) {
            let away = abs(share * f32(frame.keys) - f32(key) - 0.5);
            if (away < least && (used & (1u << key)) == 0u) {
                least = away;
                chosen_key = key;
            }
        }
        used |= 1u << chosen_key;
    }
}

fn use_key_of_line(pixel: vec2<u32>) {
    use_rank(line_share(pixel), 0u);
}

fn use_key_of_rank(pixel: vec2<u32>, along: f32, rank: u32) {
    use_rank(line_share(pixel) + (along - 0.5) * frame.exposure_share, rank);
}

fn key_number() -> u32 {
    return chosen_key;
}

fn key_row() -> i32 {
    return i32(chosen_key * frame.key_rows);
}

fn reference_point(at_px: vec2<f32>, in_key: f32) -> vec4<f32> {
    let stride = select(frame.nodes + 1u, 1u, frame.nodes == 1u);
    let pose = poses[frame.keys * frame.fields * frame.lines * stride + chosen_key];
    let ray = vec3<f32>((at_px - frame.ideal_principal_px) / frame.ideal_focal_px, 1.0);
    return vec4<f32>(rotate(pose, ray) + in_key * translation(pose), in_key);
}

fn reference_px(at_px: vec2<f32>, in_key: f32) -> vec2<f32> {
    return ideal_px_from_point(reference_point(at_px, in_key).xyz);
}
