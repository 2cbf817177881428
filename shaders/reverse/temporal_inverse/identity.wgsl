// Nothing moves within the frame: one pose for every line.
#import reverse/temporal_inverse/interface.wgsl

struct Pose {
    unused: f32,
}

fn pose_at_node(pixel: vec2<u32>, node: u32) -> Pose {
    return Pose(0.0);
}

fn pose_mid(pixel: vec2<u32>) -> Pose {
    return Pose(0.0);
}

fn mix_pose(a: Pose, b: Pose, t: f32) -> Pose {
    return a;
}

fn temporal_inverse(uv: vec2<f32>, pose: Pose) -> Source {
    let at_px = frame.ideal_focal_px * uv + frame.ideal_principal_px;
    return Source(at_px, 0.0, inside_ideal(at_px), at_px);
}

fn temporal_inverse_with_depth(uv: vec2<f32>, pose: Pose) -> Source {
    var source = temporal_inverse(uv, pose);
    source.inverse_depth = inverse_depth(source.at_px);
    return source;
}

// Depth does not matter: every point of a ray has the same source.
const HAS_PARALLAX: bool = false;
// It looks where the point truly is.
const IS_EXACT: bool = true;

fn point_at(uv: vec2<f32>, pose: Pose, w: f32) -> vec3<f32> {
    return vec3<f32>(uv, 1.0);
}

fn line_inverse_depth(uv: vec2<f32>, pose: Pose, in_key: f32) -> f32 {
    return in_key;
}
