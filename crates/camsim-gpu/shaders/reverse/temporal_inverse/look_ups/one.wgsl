// One depth look-up, without a loop: on llvmpipe a loop costs more than its body.
fn first_look_ups(direction: vec3<f32>, shift: vec3<f32>, before: IteratedDepth) -> IteratedDepth {
    return last_look_up(direction, shift, before);
}

// For a node that starts with the depth of another.
fn further_look_ups(direction: vec3<f32>, shift: vec3<f32>, before: IteratedDepth) -> IteratedDepth {
    return last_look_up(direction, shift, before);
}
