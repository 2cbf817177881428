// Depth look-ups at every node of the exposure, each starting with the result of the node before. Twin:
// camsim_core::temporal::reproject_nodes.
var<private> last_inverse_depth: f32;

fn first_node(pixel: vec2<u32>, ray: Ray) -> Source {
    let pose = pose_at_step(pixel, 0u);
    last_inverse_depth = iterated_inverse_depth(ray.uv, pose);
    return source_of_depth(ray.uv, pose, last_inverse_depth);
}

fn next_node(ray: Ray, node: u32, pose: Pose) -> Source {
    last_inverse_depth = iterated_inverse_depth_from(last_inverse_depth, ray.uv, pose);
    return source_of_depth(ray.uv, pose, last_inverse_depth);
}
