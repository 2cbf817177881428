// Poses of a line, read once for all of the pixels that a thread takes along it: llvmpipe reads a buffer lane
// by lane, and where each pixel did so it took up to two fifths of the kernel (docs/DECISIONS.md,
// "Gpu renderer").
const HELD_STEPS: u32 = STEPS * STRETCHES;

var<private> held: array<Pose, HELD_STEPS + 1u>;
var<private> held_mid: Pose;

fn hold_line(pixel: vec2<u32>) {
    for (var k = 0u; k <= HELD_STEPS; k++) {
        held[k] = pose_at_node(pixel, k * frame.node_stride);
    }
    held_mid = pose_mid(pixel);
}

// The pose so many steps of the path after the first.
fn pose_of_step(pixel: vec2<u32>, step: u32) -> Pose {
    return held[step];
}

fn pose_of_end(pixel: vec2<u32>) -> Pose {
    return held[HELD_STEPS];
}

fn pose_of_mid(pixel: vec2<u32>) -> Pose {
    return held_mid;
}
