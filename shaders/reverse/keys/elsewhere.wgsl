// One ideal frame, at another instant than the middle of the window.
#import reverse/keys/one.wgsl

// Pose of the key camera in the mid-window camera: it follows those of the lines.
fn reference_point(at_px: vec2<f32>, in_key: f32) -> vec4<f32> {
    let stride = select(frame.nodes + 1u, 1u, frame.nodes == 1u);
    let pose = poses[frame.fields * frame.lines * stride];
    let ray = vec3<f32>((at_px - frame.ideal_principal_px) / frame.ideal_focal_px, 1.0);
    return vec4<f32>(rotate(pose, ray) + in_key * translation(pose), in_key);
}

fn reference_px(at_px: vec2<f32>, in_key: f32) -> vec2<f32> {
    return ideal_px_from_point(reference_point(at_px, in_key).xyz);
}
