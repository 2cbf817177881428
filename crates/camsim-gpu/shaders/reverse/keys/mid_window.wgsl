// One ideal frame, of the mid-window camera.
#import reverse/keys/one.wgsl

// Homogeneous point in the mid-window camera of what the key camera sees at a position and inverse depth
// (1/m).
fn reference_point(position_px: vec2<f32>, key_inverse_depth: f32) -> vec4<f32> {
    return vec4<f32>((position_px - frame.ideal_principal_px) / frame.ideal_focal_px, 1.0, key_inverse_depth);
}

fn reference_px(position_px: vec2<f32>, key_inverse_depth: f32) -> vec2<f32> {
    return position_px;
}
