// Depth for the constant-depth solvers: that of the nearest texel, as in the paper's program.
fn constant_depth(position_px: vec2<f32>) -> f32 {
    let last = vec2<f32>(frame.ideal_size_px) - 1.0;
    let texel = vec2<i32>(clamp(floor(position_px + 0.5), vec2<f32>(0.0), last));
    return textureLoad(ideal_depth, texel, 0).x / frame.near_m;
}
