// Depth for the constant-depth solvers: interpolated, as in the other stages.
fn constant_depth(position_px: vec2<f32>) -> f32 {
    return inverse_depth(position_px);
}
