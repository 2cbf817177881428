// The key frame's depth is looked up in each node of the exposure, beginning with what the node before has
// found. Twin: camsim_core::temporal::reproject_nodes.
var<private> found_depth: f32;

fn first_node(pixel: vec2<u32>, ray: Ray) -> Source {
    let pose = pose_of_step(pixel, 0u);
    found_depth = settled_inverse_depth(ray.uv, pose);
    return source_of_depth(ray.uv, pose, found_depth);
}

fn next_node(ray: Ray, node: u32, pose: Pose) -> Source {
    found_depth = settled_inverse_depth_from(found_depth, ray.uv, pose);
    return source_of_depth(ray.uv, pose, found_depth);
}
