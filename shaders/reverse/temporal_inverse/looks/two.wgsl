// Two look-ups, written out: on llvmpipe a loop costs more than what it repeats.
fn first_looks(direction: vec3<f32>, shift: vec3<f32>, before: Settled) -> Settled {
    return last_look(direction, shift, look(direction, shift, before));
}

// A node that begins with what another has found needs one less.
fn further_looks(direction: vec3<f32>, shift: vec3<f32>, before: Settled) -> Settled {
    return last_look(direction, shift, before);
}
