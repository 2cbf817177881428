// The depth that a constant-depth solver takes: the nearest texel's, as in the paper's program.
fn constant_depth(at_px: vec2<f32>) -> f32 {
    let last = vec2<f32>(frame.ideal_size_px) - 1.0;
    let texel = vec2<i32>(clamp(floor(at_px + 0.5), vec2<f32>(0.0), last));
    return textureLoad(ideal_depth, texel, 0).x / frame.near_m;
}
