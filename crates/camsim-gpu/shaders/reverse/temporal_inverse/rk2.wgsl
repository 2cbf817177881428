// Heun steps of at most `frame.rk2_step_rad` of rotation (eq. 18). Twin:
// camsim_core::temporal::displacement::rk2.
#import reverse/temporal_inverse/constant_depth.wgsl

// As camsim_core::temporal::displacement::RK2_MAX_STEPS.
const MAX_STEPS: f32 = 4096.0;

// Position dt_s ago of the point now at uv.
fn displaced_uv(uv: vec2<f32>, w: f32, dt_s: f32) -> vec2<f32> {
    let steps = u32(min(abs(dt_s) * frame.key_rate_rad_s.w / frame.rk2_step_rad, MAX_STEPS - 1.0)) + 1u;
    let step_s = dt_s / f32(steps);
    var uv_now = uv;
    for (var i = 0u; i < steps; i++) {
        let rate_begin = image_rate(uv_now, w);
        let rate_end = image_rate(uv_now - rate_begin * step_s, w);
        uv_now -= 0.5 * step_s * (rate_begin + rate_end);
    }
    return uv_now;
}
