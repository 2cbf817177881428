// Poses of a line, read once for all pixels that a thread processes along it: llvmpipe reads a buffer lane by
// lane, and reading them per pixel took up to two fifths of the kernel's time (docs/theory/DECISIONS.md, "Gpu
// renderer").
const CACHED_STEPS: u32 = SEGMENT_STEPS * SEGMENTS;

var<private> cached_poses: array<Pose, CACHED_STEPS + 1u>;
var<private> cached_mid_pose: Pose;

fn cache_line_poses(pixel: vec2<u32>) {
    for (var k = 0u; k <= CACHED_STEPS; k++) {
        cached_poses[k] = table_pose(pixel, k * frame.node_stride);
    }
    cached_mid_pose = table_mid_pose(pixel);
}

// Pose `step` steps of the path after the first node.
fn pose_at_step(pixel: vec2<u32>, step: u32) -> Pose {
    return cached_poses[step];
}

fn end_pose(pixel: vec2<u32>) -> Pose {
    return cached_poses[CACHED_STEPS];
}

fn mid_pose(pixel: vec2<u32>) -> Pose {
    return cached_mid_pose;
}
