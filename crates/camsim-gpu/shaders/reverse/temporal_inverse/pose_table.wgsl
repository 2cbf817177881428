// Relative poses x_key = R x_line + t, one entry per key, line and exposure node, made in f64 on the CPU.
#import reverse/temporal_inverse/line_entry.wgsl

struct Pose {
    // Rows of R, with t in w.
    x: vec4<f32>,
    y: vec4<f32>,
    z: vec4<f32>,
}

@group(1) @binding(3) var<storage, read> poses: array<Pose>;

fn table_pose(pixel: vec2<u32>, node: u32) -> Pose {
    return poses[line_entry(pixel) + node];
}

fn table_mid_pose(pixel: vec2<u32>) -> Pose {
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
