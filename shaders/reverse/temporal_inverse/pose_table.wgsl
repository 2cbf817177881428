// Relative poses: x_key = R x_line + t, one entry a key, line and exposure node, made in f64 on the CPU.
struct Pose {
    // Rows of R, with t in w.
    x: vec4<f32>,
    y: vec4<f32>,
    z: vec4<f32>,
}

@group(1) @binding(3) var<storage, read> poses: array<Pose>;

// First entry of the pixel's line.
fn line_entry(pixel: vec2<u32>) -> u32 {
    let line = select(pixel.y, pixel.x, frame.line_axis == 1u);
    let field = select(0u, pixel.y & 1u, frame.fields == 2u);
    let stride = select(frame.nodes + 1u, 1u, frame.nodes == 1u);
    return ((key_number() * frame.fields + field) * frame.lines + line) * stride;
}

fn pose_at_node(pixel: vec2<u32>, node: u32) -> Pose {
    return poses[line_entry(pixel) + node];
}

fn pose_mid(pixel: vec2<u32>) -> Pose {
    return poses[line_entry(pixel) + select(frame.nodes, 0u, frame.nodes == 1u)];
}

fn mix_pose(a: Pose, b: Pose, t: f32) -> Pose {
    return Pose(mix(a.x, b.x, t), mix(a.y, b.y, t), mix(a.z, b.z, t));
}

fn rotate(pose: Pose, v: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(dot(pose.x.xyz, v), dot(pose.y.xyz, v), dot(pose.z.xyz, v));
}

fn translation(pose: Pose) -> vec3<f32> {
    return vec3<f32>(pose.x.w, pose.y.w, pose.z.w);
}
