// Colours are known at the middles of pixels.

// Depths this near to each other, relative to the nearer one, are of one surface.
const SURFACE_STEP: f32 = 0.005;
// A slope has the mean of two depths half-way between their places, a step one of the two: off by half of their difference. Samples stand up to
// half a fine pixel beside the places that they speak for, so a slope is off by some too.
const HALF_WAY: f32 = 0.35;
// Bilinear weight from which pixels of the same surface give its colour: less is lost in the rounding of places far out in the frame.
const LEAST_WEIGHT: f32 = 1e-3;

// Inverse depth at the middle of a pixel, 1/m.
fn centre_inverse_depth(texel: vec2<i32>) -> f32 {
    return textureLoad(ideal_depth, texel, 0).x / frame.near_m;
}

// Whether a place of the inverse depth `depth` and a pixel with `other` show one surface: there is no step on the way.
fn one_surface(at_px: vec2<f32>, depth: f32, pixel: vec2<f32>, other: f32) -> bool {
    let off = abs(other - depth);
    if (off <= SURFACE_STEP * max(other, depth)) {
        return true;
    }
    return abs(surface_inverse_depth(0.5 * (at_px + pixel)) - 0.5 * (other + depth)) < HALF_WAY * off;
}

// Colour of the surface that is seen at a place: bilinear between the pixels around it that show the surface that is seen at the place;
// where none does, that of the nearest in depth of the sixteen around it.
fn surface_color_at(at_px: vec2<f32>) -> vec3<f32> {
    let depth = surface_inverse_depth(at_px);
    let origin = vec2<i32>(0, key_row());
    let around = texels_around(at_px);
    let base = vec2<f32>(around.first - origin);
    let at = base + around.t;
    var sum = vec3<f32>(0.0);
    var weight = 0.0;
    for (var k = 0; k < 4; k++) {
        let step = vec2<f32>(f32(k & 1), f32(k >> 1u));
        let texel = min(around.first + vec2<i32>(step), around.last);
        if (one_surface(at, depth, base + step, centre_inverse_depth(texel))) {
            let sides = mix(1.0 - around.t, around.t, step);
            let share = sides.x * sides.y;
            sum += share * textureLoad(ideal_color, texel, 0).rgb;
            weight += share;
        }
    }
    if (weight > LEAST_WEIGHT) {
        return sum / weight;
    }
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
