// What is thinner than a pixel may miss the middles of all pixels around: their samples are asked too.
#import ideal/fine.wgsl

@group(0) @binding(4) var fine_depth: texture_depth_multisampled_2d;

// Whether the samples of a pixel lie farther apart than the slope around it explains.
fn is_thin(pixel: vec2<i32>, slope: f32, edge_step: f32) -> bool {
    let scale = i32(textureDimensions(fine_depth).x) / i32(textureDimensions(centre_depth).x);
    var low = 1e30;
    var high = 0.0;
    for (var y = 0; y < scale; y++) {
        for (var x = 0; x < scale; x++) {
            for (var i = 0; i < SAMPLES; i++) {
                let d = textureLoad(fine_depth, pixel * scale + vec2<i32>(x, y), i);
                low = min(low, d);
                high = max(high, d);
            }
        }
    }
    return (low == 0.0 && high > 0.0) || high - low > slope + edge_step * high;
}

// Of 2x2 pixels, as in ideal/marks.wgsl.
fn are_thin(pixel: vec2<i32>, within: vec4<bool>, slope: vec4<f32>, edge_step: f32) -> vec4<bool> {
    var thin = vec4<bool>(false);
    for (var k = 0; k < 4; k++) {
        thin[k] = within[k] && is_thin(pixel + vec2<i32>(k & 1, k >> 1u), slope[k], edge_step);
    }
    return thin;
}
