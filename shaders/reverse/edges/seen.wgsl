// What the centre of a pixel sees at one instant, for depth and coordinates.
struct Seen {
    // Source in the mid-window ideal frame, pixels.
    reference_px: vec2<f32>,
    // Inverse planar depth in the line's own camera, 1/m; 0 = sky.
    inverse_depth: f32,
    // The point in the mid-window camera times w, and w (1/m; 0 = at infinity).
    point: vec4<f32>,
}

fn seen_from(at_px: vec2<f32>, in_line: f32, in_key: f32) -> Seen {
    return Seen(reference_px(at_px, in_key), in_line, reference_point(at_px, in_key));
}

// Where one surface is around, the solution of the temporal inverse stands, on the very path that `gather` samples.
fn smooth_px_at_phase(pixel: vec2<u32>, ray: Ray, phase: f32) -> vec2<f32> {
    let at_px = source_at_phase(pixel, ray, phase).at_px;
    return reference_px(at_px, inverse_depth(at_px));
}

fn smooth_mid(pixel: vec2<u32>, ray: Ray) -> Seen {
    let mid = temporal_inverse_with_depth(ray.uv, pose_of_mid(pixel));
    return seen_from(mid.at_px, mid.inverse_depth, inverse_depth(mid.at_px));
}
