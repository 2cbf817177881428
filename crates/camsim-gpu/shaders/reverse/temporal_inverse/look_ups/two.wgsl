// Two depth look-ups, unrolled: on llvmpipe a loop costs more than its body.
fn first_look_ups(direction: vec3<f32>, shift: vec3<f32>, before: IteratedDepth) -> IteratedDepth {
    return last_look_up(direction, shift, look_up(direction, shift, before));
}

// A node that starts with the depth of another needs one less.
fn further_look_ups(direction: vec3<f32>, shift: vec3<f32>, before: IteratedDepth) -> IteratedDepth {
    return last_look_up(direction, shift, before);
}
