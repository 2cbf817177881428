// All nodes of the exposure take the key frame's depth that mid-exposure finds. Twin: camsim_core::temporal::reproject_with.
fn exposure_depth(pixel: vec2<u32>, ray: Ray) -> f32 {
    return settled_inverse_depth(ray.uv, pose_mid(pixel));
}

fn node_source(pixel: vec2<u32>, ray: Ray, node: u32, depth: f32) -> Source {
    return source_of_depth(ray.uv, pose_at_node(pixel, node), depth);
}
