// Each node of the exposure is solved for itself.
fn first_node(pixel: vec2<u32>, ray: Ray) -> Source {
    return temporal_inverse(ray.uv, pose_at_node(pixel, 0u));
}

fn next_node(pixel: vec2<u32>, ray: Ray, node: u32) -> Source {
    return temporal_inverse(ray.uv, pose_at_node(pixel, node));
}
