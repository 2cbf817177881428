// Poses of a line, read once for all of the pixels that a thread takes along it: llvmpipe reads a buffer lane by lane, and where each pixel did so it took
// up to two fifths of the kernel (docs/PERFORMANCE.md, "Reads of buffers").
var<private> held: array<Pose, STEPS + 1u>;
var<private> held_mid: Pose;

fn hold_line(pixel: vec2<u32>) {
    for (var k = 0u; k <= STEPS; k++) {
        held[k] = pose_at_node(pixel, k * frame.node_stride);
    }
    held_mid = pose_mid(pixel);
}

// The pose k steps of the path after a node, of which there is none but the first.
fn pose_of_step(pixel: vec2<u32>, node: u32, k: u32) -> Pose {
    return held[k];
}

fn pose_of_end(pixel: vec2<u32>) -> Pose {
    return held[STEPS];
}

fn pose_of_mid(pixel: vec2<u32>) -> Pose {
    return held_mid;
}
