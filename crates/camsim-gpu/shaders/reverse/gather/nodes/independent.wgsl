// Each node of the exposure is solved independently.
fn first_node(pixel: vec2<u32>, ray: Ray) -> Source {
    return temporal_inverse(ray.uv, pose_at_step(pixel, 0u));
}

fn next_node(ray: Ray, node: u32, pose: Pose) -> Source {
    return temporal_inverse(ray.uv, pose);
}
