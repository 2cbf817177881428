// Poses of a line, read where they are needed: there are many of them, or several keys have their own.
fn hold_line(pixel: vec2<u32>) {}

// The pose k steps of the path after a node.
fn pose_of_step(pixel: vec2<u32>, node: u32, k: u32) -> Pose {
    return pose_at_node(pixel, node + k * frame.node_stride);
}

fn pose_of_end(pixel: vec2<u32>) -> Pose {
    return pose_at_node(pixel, frame.nodes - 1u);
}

fn pose_of_mid(pixel: vec2<u32>) -> Pose {
    return pose_mid(pixel);
}
