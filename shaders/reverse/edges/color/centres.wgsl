// Colours are known at the middles of pixels.

// Depths this near to each other, relative to the nearest, are of one surface.
const ONE_SURFACE: f32 = 0.02;
// Bilinear weight from which pixels of the same surface give its colour: less is lost in the rounding of
// places far out in the frame.
const LEAST_WEIGHT: f32 = 1e-3;

// Inverse depth at the middle of a pixel, 1/m.
fn centre_inverse_depth(texel: vec2<i32>) -> f32 {
    return textureLoad(ideal_depth, texel, 0).x / frame.near_m;
}

// Colour of the surface that is seen at a place: bilinear between the pixels around it, or, where those show
// two surfaces, between those on the place's side of the mean of their depths; where that is none, the
// nearest in depth of the sixteen around it.
fn surface_color_at(at_px: vec2<f32>) -> vec3<f32> {
    let depth = surface_inverse_depth(at_px);
    let around = texels_around(at_px);
    var depths: vec4<f32>;
    for (var k = 0; k < 4; k++) {
        depths[k] = centre_inverse_depth(min(around.first + vec2<i32>(k & 1, k >> 1u), around.last));
    }
    let low = min(min(depths.x, depths.y), min(depths.z, depths.w));
    let high = max(max(depths.x, depths.y), max(depths.z, depths.w));
    let between = 0.5 * (low + high);
    let one_surface = low > (1.0 - ONE_SURFACE) * high;
    var sum = vec3<f32>(0.0);
    var weight = 0.0;
    for (var k = 0; k < 4; k++) {
        if (one_surface || (depths[k] > between) == (depth > between)) {
            let step = vec2<i32>(k & 1, k >> 1u);
            let sides = mix(1.0 - around.t, around.t, vec2<f32>(step));
            let share = sides.x * sides.y;
            sum += share * textureLoad(ideal_color, min(around.first + step, around.last), 0).rgb;
            weight += share;
        }
    }
    if (weight > LEAST_WEIGHT) {
        return sum / weight;
    }
    let origin = vec2<i32>(0, key_row());
    let border = origin + vec2<i32>(frame.ideal_size_px) - 1;
    var best = around.first;
    var least = 1e30;
    for (var i = 0; i < 16; i++) {
        let texel = clamp(around.first + vec2<i32>(i % 4 - 1, i / 4 - 1), origin, border);
        let off = abs(centre_inverse_depth(texel) - depth);
        if (off < least) {
            least = off;
            best = texel;
        }
    }
    return textureLoad(ideal_color, best, 0).rgb;
}
