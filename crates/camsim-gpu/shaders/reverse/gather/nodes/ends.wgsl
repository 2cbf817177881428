// Depth look-ups at the first and last node of the exposure; the nodes in between interpolate linearly. The
// second look-up starts with the result of the first. Twin: camsim_core::temporal::reproject_nodes.
var<private> first_inverse_depth: f32;
var<private> inverse_depth_step: f32;

fn first_node(pixel: vec2<u32>, ray: Ray) -> Source {
    let last = frame.nodes - 1u;
    first_inverse_depth = iterated_inverse_depth(ray.uv, pose_at_step(pixel, 0u));
    let last_inverse_depth = iterated_inverse_depth_from(first_inverse_depth, ray.uv, end_pose(pixel));
    inverse_depth_step = (last_inverse_depth - first_inverse_depth) / f32(last);
    return next_node(ray, 0u, pose_at_step(pixel, 0u));
}

fn next_node(ray: Ray, node: u32, pose: Pose) -> Source {
    return source_of_depth(ray.uv, pose, first_inverse_depth + f32(node) * inverse_depth_step);
}
