// Each node of the exposure looks its depth up itself.
fn exposure_depth(pixel: vec2<u32>, ray: Ray) -> f32 {
    return 0.0;
}

fn node_source(pixel: vec2<u32>, ray: Ray, node: u32, depth: f32) -> Source {
    return temporal_inverse(ray.uv, pose_at_node(pixel, node));
}
