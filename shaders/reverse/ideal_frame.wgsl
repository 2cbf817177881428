// Access to the ideal frame: linear colour and reversed depth d = near / z.
@group(1) @binding(0) var ideal_color: texture_2d<f32>;
@group(1) @binding(1) var ideal_sampler: sampler;
@group(1) @binding(9) var depth_sampler: sampler;
@group(1) @binding(2) var ideal_depth: texture_2d<f32>;

// A number of the frame that says where the kernel goes: how often a loop turns, whether there is something to do. What follows from uniforms alone makes
// Mesa's lavapipe compile the kernel anew, for one frame after the other, half a second each time; what also depends on a texture it leaves alone.
fn told(count: u32) -> u32 {
    return min(count, 65536u * textureDimensions(ideal_color).x);
}

// Phase of the exposure at which coordinates are asked for.
fn coords_phase() -> f32 {
    return f32(told(1u)) * frame.coords_phase;
}

// A direction seen from the key camera (any positive scale) to ideal pixels.
fn ideal_px_from_point(in_key: vec3<f32>) -> vec2<f32> {
    return frame.ideal_focal_px * (in_key.xy / in_key.z) + frame.ideal_principal_px;
}

fn inside_ideal(at_px: vec2<f32>) -> bool {
    return all(at_px >= vec2<f32>(-0.5)) && all(at_px <= vec2<f32>(frame.ideal_size_px) - 0.5);
}

// The four texels around a place: the first one, the last one, and how far the place is from the first to the last.
struct Around {
    first: vec2<i32>,
    last: vec2<i32>,
    t: vec2<f32>,
}

// Of the ideal frame in use; places outside go to its border.
fn texels_around(at_px: vec2<f32>) -> Around {
    let last = vec2<f32>(frame.ideal_size_px) - 1.0;
    let at = clamp(at_px, vec2<f32>(0.0), last);
    let base = min(floor(at), max(last - 1.0, vec2<f32>(0.0)));
    let origin = vec2<i32>(0, key_row());
    let first = origin + vec2<i32>(base);
    return Around(first, min(first + 1, origin + vec2<i32>(last)), at - base);
}

// Inverse planar depth 1/z, 1/m: bilinear in 1/z, which is exact on planes; the nearest texel where the four belong to different surfaces.
fn inverse_depth(at_px: vec2<f32>) -> f32 {
    let around = texels_around(at_px);
    let b = around.first;
    let top = around.last;
    let t = around.t;
    let four = textureGather(0, ideal_depth, depth_sampler, vec2<f32>(b + 1) / vec2<f32>(textureDimensions(ideal_depth)));
    let d00 = four.w;
    let d10 = four.z;
    let d01 = four.x;
    let d11 = four.y;
    let low = min(min(d00, d10), min(d01, d11));
    let high = max(max(d00, d10), max(d01, d11));
    let mixed = mix(mix(d00, d10, t.x), mix(d01, d11, t.x), t.y);
    let nearest = select(select(d00, d10, t.x > 0.5), select(d01, d11, t.x > 0.5), t.y > 0.5);
    let one_surface = low > 0.9 * high;
    return select(nearest, mixed, one_surface) / frame.near_m;
}

// Linear colour, bilinear; alpha below 1 where a silhouette is marked.
fn ideal_color_at(at_px: vec2<f32>) -> vec4<f32> {
    let size = vec2<f32>(textureDimensions(ideal_color));
    let last = vec2<f32>(frame.ideal_size_px) - 1.0;
    let at = clamp(at_px, vec2<f32>(0.0), last) + vec2<f32>(0.5, 0.5 + f32(key_row()));
    return textureSampleLevel(ideal_color, ideal_sampler, at / size, 0.0);
}

// The same by a cubic spline: a bilinear read between pixels blurs. Softness 0 is Catmull-Rom's, which does not; 1 is the B-spline, with a
// variance of a third of a square pixel. Its 4x4 texels are five bilinear reads; without the corners, whose weights are at most 0.4 % at
// softness 0 and 0.8 % at 0.5. Twin: camsim_core::temporal::ColorImage::spline.
fn ideal_color_by_spline(at_px: vec2<f32>, softness: vec2<f32>) -> vec4<f32> {
    let base = floor(at_px);
    let f = at_px - base;
    let g = 1.0 - f;
    let w0 = mix(f * (-0.5 + f * (1.0 - 0.5 * f)), g * g * g / 6.0, softness);
    let w1 = mix(1.0 + f * f * (-2.5 + 1.5 * f), (4.0 + f * f * (3.0 * f - 6.0)) / 6.0, softness);
    let w2 = mix(f * (0.5 + f * (2.0 - 1.5 * f)), (4.0 + g * g * (3.0 * g - 6.0)) / 6.0, softness);
    let w3 = mix(f * f * (-0.5 + 0.5 * f), f * f * f / 6.0, softness);
    let w12 = w1 + w2;
    let before = base - 1.0;
    let between = base + w2 / w12;
    let after = base + 2.0;
    let centre = w12.x * w12.y;
    let sum = centre * ideal_color_at(between)
        + w12.x * w0.y * ideal_color_at(vec2<f32>(between.x, before.y))
        + w0.x * w12.y * ideal_color_at(vec2<f32>(before.x, between.y))
        + w3.x * w12.y * ideal_color_at(vec2<f32>(after.x, between.y))
        + w12.x * w3.y * ideal_color_at(vec2<f32>(between.x, after.y));
    return sum / (centre + w12.x * (w0.y + w3.y) + w12.y * (w0.x + w3.x));
}
