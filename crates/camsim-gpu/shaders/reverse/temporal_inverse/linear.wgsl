// One straight step (eq. 16). Twin: camsim_core::temporal::displacement::linear.
#import reverse/temporal_inverse/constant_depth.wgsl

// Position dt_s ago of the point now at uv.
fn displaced_uv(uv: vec2<f32>, w: f32, dt_s: f32) -> vec2<f32> {
    return uv - image_rate(uv, w) * dt_s;
}
