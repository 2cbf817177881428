// The key frame's depth is looked up at mid-exposure and, beginning with what that has found, in the first
// and the last node; nodes take the parabola through the three. Twin: camsim_core::temporal::reproject_nodes.
var<private> begin_depth: f32;
var<private> depth_slope: f32;
var<private> depth_bend: f32;
var<private> node_share: f32;

fn first_node(pixel: vec2<u32>, ray: Ray) -> Source {
    node_share = 1.0 / f32(frame.nodes - 1u);
    let middle = settled_inverse_depth(ray.uv, pose_of_mid(pixel));
    begin_depth = settled_inverse_depth_from(middle, ray.uv, pose_of_step(pixel, 0u));
    let end = settled_inverse_depth_from(middle, ray.uv, pose_of_end(pixel));
    depth_slope = 4.0 * middle - 3.0 * begin_depth - end;
    depth_bend = 2.0 * begin_depth + 2.0 * end - 4.0 * middle;
    return next_node(ray, 0u, pose_of_step(pixel, 0u));
}

fn next_node(ray: Ray, node: u32, pose: Pose) -> Source {
    let share = f32(node) * node_share;
    return source_of_depth(ray.uv, pose, begin_depth + share * (depth_slope + share * depth_bend));
}
