// As many look-ups as the frame asks for, one at least.
fn looks(direction: vec3<f32>, shift: vec3<f32>, before: Settled, count: u32) -> Settled {
    var settled = before;
    let enough = told(count);
    for (var i = 1u; i < enough; i++) {
        settled = look(direction, shift, settled);
    }
    return last_look(direction, shift, settled);
}

fn first_looks(direction: vec3<f32>, shift: vec3<f32>, before: Settled) -> Settled {
    return looks(direction, shift, before, frame.iterations);
}

// A node that begins with what another has found needs one less.
fn further_looks(direction: vec3<f32>, shift: vec3<f32>, before: Settled) -> Settled {
    return looks(direction, shift, before, max(frame.iterations, 2u) - 1u);
}
