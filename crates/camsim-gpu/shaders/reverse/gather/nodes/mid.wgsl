// Depth look-up at mid-exposure only; all nodes use its result. Twin: camsim_core::temporal::reproject_nodes.
var<private> mid_inverse_depth: f32;

fn first_node(pixel: vec2<u32>, ray: Ray) -> Source {
    mid_inverse_depth = iterated_inverse_depth(ray.uv, mid_pose(pixel));
    return next_node(ray, 0u, pose_at_step(pixel, 0u));
}

fn next_node(ray: Ray, node: u32, pose: Pose) -> Source {
    return source_of_depth(ray.uv, pose, mid_inverse_depth);
}
