// Ideal frame with colours at pixel centres.

// Depths that differ by less than this, relative to the nearest, belong to one surface.
const ONE_SURFACE: f32 = 0.02;
// Least bilinear weight of the pixels of a surface with which their mean is its colour: below it rounding of
// positions far from the origin dominates.
const LEAST_WEIGHT: f32 = 1e-3;

// Inverse depth at the centre of a pixel, 1/m.
fn centre_inverse_depth(texel: vec2<i32>) -> f32 {
    return textureLoad(ideal_depth, texel, 0).x / frame.near_m;
}

// Colour of the surface that is visible at a position: bilinear between the four pixels around it. Where
// those show two surfaces, only the pixels on the position's side of their mid-depth count; if there are
// none, the pixel nearest in depth among the sixteen around.
fn surface_color_at(position_px: vec2<f32>) -> vec3<f32> {
    let depth = surface_inverse_depth(position_px);
    let neighbourhood = texel_neighbourhood(position_px);
    var depths: vec4<f32>;
    for (var k = 0; k < 4; k++) {
        depths[k] = centre_inverse_depth(
            min(neighbourhood.first + vec2<i32>(k & 1, k >> 1u), neighbourhood.last)
        );
    }
    let low = min(min(depths.x, depths.y), min(depths.z, depths.w));
    let high = max(max(depths.x, depths.y), max(depths.z, depths.w));
    let mid_depth = 0.5 * (low + high);
    let one_surface = low > (1.0 - ONE_SURFACE) * high;
    var color_sum = vec3<f32>(0.0);
    var weight_sum = 0.0;
    for (var k = 0; k < 4; k++) {
        if (one_surface || (depths[k] > mid_depth) == (depth > mid_depth)) {
            let offset = vec2<i32>(k & 1, k >> 1u);
            let axis_weights = mix(1.0 - neighbourhood.t, neighbourhood.t, vec2<f32>(offset));
            let weight = axis_weights.x * axis_weights.y;
            color_sum += weight
                * textureLoad(ideal_color, min(neighbourhood.first + offset, neighbourhood.last), 0).rgb;
            weight_sum += weight;
        }
    }
    if (weight_sum > LEAST_WEIGHT) {
        return color_sum / weight_sum;
    }
    let origin = vec2<i32>(0, key_row());
    let border = origin + vec2<i32>(frame.ideal_size_px) - 1;
    var nearest_texel = neighbourhood.first;
    var least_difference = 1e30;
    for (var i = 0; i < 16; i++) {
        let texel = clamp(neighbourhood.first + vec2<i32>(i % 4 - 1, i / 4 - 1), origin, border);
        let difference = abs(centre_inverse_depth(texel) - depth);
        if (difference < least_difference) {
            least_difference = difference;
            nearest_texel = texel;
        }
    }
    return textureLoad(ideal_color, nearest_texel, 0).rgb;
}
