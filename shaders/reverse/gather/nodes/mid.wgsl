// All nodes of the exposure take the key frame's depth that mid-exposure finds. Twin: camsim_core::temporal::reproject_nodes.
var<private> exposure_depth: f32;

fn first_node(pixel: vec2<u32>, ray: Ray) -> Source {
    exposure_depth = settled_inverse_depth(ray.uv, pose_mid(pixel));
    return next_node(pixel, ray, 0u);
}

fn next_node(pixel: vec2<u32>, ray: Ray, node: u32) -> Source {
    return source_of_depth(ray.uv, pose_at_node(pixel, node), exposure_depth);
}
