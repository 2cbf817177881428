// Rotation only, or so little translation that parallax is below the tolerance: no depth needed.
#import reverse/temporal_inverse/interface.wgsl
#import reverse/temporal_inverse/pose_table.wgsl

fn temporal_inverse(uv: vec2<f32>, pose: Pose) -> Source {
    let point_in_key = rotate(pose, vec3<f32>(uv, 1.0));
    let position_px = ideal_px_from_point(point_in_key);
    return Source(position_px, 0.0, point_in_key.z > 0.0 && inside_ideal(position_px), position_px);
}

fn temporal_inverse_with_depth(uv: vec2<f32>, pose: Pose) -> Source {
    var source = temporal_inverse(uv, pose);
    let key_inverse_depth = inverse_depth(source.position_px);
    source.inverse_depth = key_inverse_depth * rotate(pose, vec3<f32>(uv, 1.0)).z
        / max(1.0 - translation(pose).z * key_inverse_depth, 1e-3);
    return source;
}

// All points of a ray have the same source.
const HAS_PARALLAX: bool = false;
// The source is exact.
const IS_EXACT: bool = true;

fn point_at(uv: vec2<f32>, pose: Pose, w: f32) -> vec3<f32> {
    return rotate(pose, vec3<f32>(uv, 1.0));
}

fn line_inverse_depth(uv: vec2<f32>, pose: Pose, key_inverse_depth: f32) -> f32 {
    return key_inverse_depth;
}
