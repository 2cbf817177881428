// Rotation only, or so little translation that parallax stays below the tolerance: no depth needed.
#import reverse/temporal_inverse/interface.wgsl
#import reverse/temporal_inverse/pose_table.wgsl

fn temporal_inverse(uv: vec2<f32>, pose: Pose) -> Source {
    let in_key = rotate(pose, vec3<f32>(uv, 1.0));
    let at_px = ideal_px_from_point(in_key);
    return Source(at_px, 0.0, in_key.z > 0.0 && inside_ideal(at_px), at_px);
}

fn temporal_inverse_with_depth(uv: vec2<f32>, pose: Pose) -> Source {
    var source = temporal_inverse(uv, pose);
    let in_key = inverse_depth(source.at_px);
    source.inverse_depth = in_key * rotate(pose, vec3<f32>(uv, 1.0)).z / max(1.0 - translation(pose).z * in_key, 1e-3);
    return source;
}

// Depth does not matter: every point of a ray has the same source.
const HAS_PARALLAX: bool = false;
// It looks where the point truly is.
const IS_EXACT: bool = true;

fn point_at(uv: vec2<f32>, pose: Pose, w: f32) -> vec3<f32> {
    return rotate(pose, vec3<f32>(uv, 1.0));
}

fn line_inverse_depth(uv: vec2<f32>, pose: Pose, in_key: f32) -> f32 {
    return in_key;
}
