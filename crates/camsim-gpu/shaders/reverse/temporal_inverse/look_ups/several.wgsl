// `frame.iterations` depth look-ups, at least one.
fn look_ups(direction: vec3<f32>, shift: vec3<f32>, before: IteratedDepth, count: u32) -> IteratedDepth {
    var depth = before;
    let limit = unspecialised(count);
    for (var i = 1u; i < limit; i++) {
        depth = look_up(direction, shift, depth);
    }
    return last_look_up(direction, shift, depth);
}

fn first_look_ups(direction: vec3<f32>, shift: vec3<f32>, before: IteratedDepth) -> IteratedDepth {
    return look_ups(direction, shift, before, frame.iterations);
}

// A node that starts with the depth of another needs one less.
fn further_look_ups(direction: vec3<f32>, shift: vec3<f32>, before: IteratedDepth) -> IteratedDepth {
    return look_ups(direction, shift, before, max(frame.iterations, 2u) - 1u);
}
