// One ideal frame, at another instant than mid-window.
#import reverse/keys/one.wgsl

// The pose of the key camera relative to the mid-window camera follows those of the lines in the pose table.
fn reference_point(position_px: vec2<f32>, key_inverse_depth: f32) -> vec4<f32> {
    let stride = select(frame.nodes + 1u, 1u, frame.nodes == 1u);
    let pose = poses[frame.fields * frame.lines * stride];
    let ray = vec3<f32>((position_px - frame.ideal_principal_px) / frame.ideal_focal_px, 1.0);
    return vec4<f32>(rotate(pose, ray) + key_inverse_depth * translation(pose), key_inverse_depth);
}

fn reference_px(position_px: vec2<f32>, key_inverse_depth: f32) -> vec2<f32> {
    return ideal_px_from_point(reference_point(position_px, key_inverse_depth).xyz);
}
