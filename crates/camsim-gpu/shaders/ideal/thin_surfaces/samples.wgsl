// Surfaces thinner than a pixel may miss all pixel centres around: their samples are tested too.
#import ideal/sample_count.wgsl

@group(0) @binding(4) var fine_depth: texture_depth_multisampled_2d;

// Whether the range of a pixel's sample depths exceeds what the slope around it explains.
fn is_thin_surface(pixel: vec2<i32>, slope: f32, edge_step: f32) -> bool {
    let scale = i32(textureDimensions(fine_depth).x) / i32(textureDimensions(pixel_depth).x);
    var low = 1e30;
    var high = 0.0;
    for (var y = 0; y < scale; y++) {
        for (var x = 0; x < scale; x++) {
            for (var i = 0; i < SAMPLES; i++) {
                let depth = textureLoad(fine_depth, pixel * scale + vec2<i32>(x, y), i);
                low = min(low, depth);
                high = max(high, depth);
            }
        }
    }
    return (low == 0.0 && high > 0.0) || high - low > slope + edge_step * high;
}

// For 2x2 pixels, as in ideal/edge_mask.wgsl.
fn are_thin_surfaces(
    pixel: vec2<i32>,
    is_in_frame: vec4<bool>,
    slope: vec4<f32>,
    edge_step: f32,
) -> vec4<bool> {
    var is_thin = vec4<bool>(false);
    for (var k = 0; k < 4; k++) {
        is_thin[k] = is_in_frame[k]
            && is_thin_surface(pixel + vec2<i32>(k & 1, k >> 1u), slope[k], edge_step);
    }
    return is_thin;
}
