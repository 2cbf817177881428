// The key frame's depth is looked up in the first and the last node of the exposure; nodes in between take
// what lies between. The second look-up begins with what the first has found. Twin:
// camsim_core::temporal::reproject_nodes.
var<private> first_depth: f32;
var<private> depth_step: f32;

fn first_node(pixel: vec2<u32>, ray: Ray) -> Source {
    let last = frame.nodes - 1u;
    first_depth = settled_inverse_depth(ray.uv, pose_of_step(pixel, 0u));
    let last_depth = settled_inverse_depth_from(first_depth, ray.uv, pose_of_end(pixel));
    depth_step = (last_depth - first_depth) / f32(last);
    return next_node(ray, 0u, pose_of_step(pixel, 0u));
}

fn next_node(ray: Ray, node: u32, pose: Pose) -> Source {
    return source_of_depth(ray.uv, pose, first_depth + f32(node) * depth_step);
}
