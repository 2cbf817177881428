// Depth look-ups at mid-exposure and, starting with that result, at the first and last node; the nodes use
// the parabola through the three. Twin: camsim_core::temporal::reproject_nodes.
var<private> begin_inverse_depth: f32;
var<private> inverse_depth_slope: f32;
var<private> inverse_depth_bend: f32;
var<private> node_fraction: f32;

fn first_node(pixel: vec2<u32>, ray: Ray) -> Source {
    node_fraction = 1.0 / f32(frame.nodes - 1u);
    let middle = iterated_inverse_depth(ray.uv, mid_pose(pixel));
    begin_inverse_depth = iterated_inverse_depth_from(middle, ray.uv, pose_at_step(pixel, 0u));
    let end = iterated_inverse_depth_from(middle, ray.uv, end_pose(pixel));
    inverse_depth_slope = 4.0 * middle - 3.0 * begin_inverse_depth - end;
    inverse_depth_bend = 2.0 * begin_inverse_depth + 2.0 * end - 4.0 * middle;
    return next_node(ray, 0u, pose_at_step(pixel, 0u));
}

fn next_node(ray: Ray, node: u32, pose: Pose) -> Source {
    let fraction = f32(node) * node_fraction;
    return source_of_depth(
        ray.uv, pose, begin_inverse_depth + fraction * (inverse_depth_slope + fraction * inverse_depth_bend)
    );
}
