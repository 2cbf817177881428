// One straight step (eq. 16). Twin: camsim_core::temporal::displacement::linear.
#import reverse/temporal_inverse/constant_depth.wgsl

// Where the point now seen at uv was dt_s ago.
fn displaced(uv: vec2<f32>, w: f32, dt_s: f32) -> vec2<f32> {
    return uv - image_rate(uv, w) * dt_s;
}
