// Poses of a line, read where they are needed: there are too many to cache, or several keys have their own.
fn cache_line_poses(pixel: vec2<u32>) {}

// Pose `step` steps of the path after the first node.
fn pose_at_step(pixel: vec2<u32>, step: u32) -> Pose {
    return table_pose(pixel, step * frame.node_stride);
}

fn end_pose(pixel: vec2<u32>) -> Pose {
    return table_pose(pixel, frame.nodes - 1u);
}

fn mid_pose(pixel: vec2<u32>) -> Pose {
    return table_mid_pose(pixel);
}
