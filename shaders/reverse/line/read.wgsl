// Poses of a line, read where they are needed: there are many of them, or several keys have their own.
fn hold_line(pixel: vec2<u32>) {}

// The pose so many steps of the path after the first.
fn pose_of_step(pixel: vec2<u32>, step: u32) -> Pose {
    return pose_at_node(pixel, step * frame.node_stride);
}

fn pose_of_end(pixel: vec2<u32>) -> Pose {
    return pose_at_node(pixel, frame.nodes - 1u);
}

fn pose_of_mid(pixel: vec2<u32>) -> Pose {
    return pose_mid(pixel);
}
