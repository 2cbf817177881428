// One ideal frame, that of the mid-window camera.
#import reverse/keys/one.wgsl

// What a key camera sees at an ideal pixel and inverse depth (1/m), in the mid-window camera: its ray, with
// the inverse depth times the same factor.
fn reference_point(at_px: vec2<f32>, in_key: f32) -> vec4<f32> {
    return vec4<f32>((at_px - frame.ideal_principal_px) / frame.ideal_focal_px, 1.0, in_key);
}

fn reference_px(at_px: vec2<f32>, in_key: f32) -> vec2<f32> {
    return at_px;
}
