// All nodes of the exposure take the key frame's depth that mid-exposure finds. Twin:
// camsim_core::temporal::reproject_nodes.
var<private> exposure_depth: f32;

fn first_node(pixel: vec2<u32>, ray: Ray) -> Source {
    exposure_depth = settled_inverse_depth(ray.uv, pose_of_mid(pixel));
    return next_node(ray, 0u, pose_of_step(pixel, 0u));
}

fn next_node(ray: Ray, node: u32, pose: Pose) -> Source {
    return source_of_depth(ray.uv, pose, exposure_depth);
}
