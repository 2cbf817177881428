// The depth that a constant-depth solver takes: as the other stages read it.
fn constant_depth(at_px: vec2<f32>) -> f32 {
    return inverse_depth(at_px);
}
