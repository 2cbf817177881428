// No motion within the frame: one pose for all lines.
#import reverse/temporal_inverse/interface.wgsl

struct Pose {
    unused: f32,
}

fn table_pose(pixel: vec2<u32>, node: u32) -> Pose {
    return Pose(0.0);
}

fn table_mid_pose(pixel: vec2<u32>) -> Pose {
    return Pose(0.0);
}

fn mix_pose(a: Pose, b: Pose, t: f32) -> Pose {
    return a;
}

fn temporal_inverse(uv: vec2<f32>, pose: Pose) -> Source {
    let position_px = frame.ideal_focal_px * uv + frame.ideal_principal_px;
    return Source(position_px, 0.0, inside_ideal(position_px), position_px);
}

fn temporal_inverse_with_depth(uv: vec2<f32>, pose: Pose) -> Source {
    var source = temporal_inverse(uv, pose);
    source.inverse_depth = inverse_depth(source.position_px);
    return source;
}

// All points of a ray have the same source.
const HAS_PARALLAX: bool = false;
// The source is exact.
const IS_EXACT: bool = true;

fn point_at(uv: vec2<f32>, pose: Pose, w: f32) -> vec3<f32> {
    return vec3<f32>(uv, 1.0);
}

fn line_inverse_depth(uv: vec2<f32>, pose: Pose, key_inverse_depth: f32) -> f32 {
    return key_inverse_depth;
}
