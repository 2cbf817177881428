// Access to the ideal frame: linear colour and reversed depth d = near / z.
@group(1) @binding(0) var ideal_color: texture_2d<f32>;
@group(1) @binding(1) var ideal_sampler: sampler;
// Of one texel, that at the place.
@group(1) @binding(9) var texel_sampler: sampler;
@group(1) @binding(2) var ideal_depth: texture_2d<f32>;

// A number of the frame that says where the kernel goes: how often a loop turns, whether there is something
// to do. What follows from uniforms alone makes Mesa's lavapipe compile the kernel anew, for one frame after
// the other, half a second each time; what also depends on a texture it leaves alone.
fn told(count: u32) -> u32 {
    return min(count, 65536u * textureDimensions(ideal_color).x);
}

// Phase of the exposure at which coordinates are asked for.
fn coords_phase() -> f32 {
    return f32(told(1u)) * frame.coords_phase;
}

// A direction seen from the key camera (any positive scale) to ideal pixels.
fn ideal_px_from_point(in_key: vec3<f32>) -> vec2<f32> {
    return frame.ideal_focal_px * (in_key.xy * (1.0 / in_key.z)) + frame.ideal_principal_px;
}

fn inside_ideal(at_px: vec2<f32>) -> bool {
    return all(at_px >= vec2<f32>(-0.5)) && all(at_px <= vec2<f32>(frame.ideal_size_px) - 0.5);
}

// The four texels around a place: the first one, the last one, and how far the place is from the first to the
// last.
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

// Inverse planar depth 1/z, 1/m: bilinear in 1/z, which is exact on planes; the nearest texel where the four
// belong to different surfaces.
fn inverse_depth(at_px: vec2<f32>) -> f32 {
    let around = texels_around(at_px);
    let b = around.first;
    let top = around.last;
    let t = around.t;
    let four = textureGather(0, ideal_depth, texel_sampler, vec2<f32>(b + 1) * (1.0 / vec2<f32>(textureDimensions(ideal_depth))));
    let d00 = four.w;
    let d10 = four.z;
    let d01 = four.x;
    let d11 = four.y;
    let low = min(min(d00, d10), min(d01, d11));
    let high = max(max(d00, d10), max(d01, d11));
    let mixed = mix(mix(d00, d10, t.x), mix(d01, d11, t.x), t.y);
    let nearest = select(select(d00, d10, t.x > 0.5), select(d01, d11, t.x > 0.5), t.y > 0.5);
    let one_surface = low > 0.9 * high;
    return select(nearest, mixed, one_surface) * (1.0 / frame.near_m);
}

// Linear colour, bilinear; alpha below 1 where a silhouette is marked.
fn ideal_color_at(at_px: vec2<f32>) -> vec4<f32> {
    let size = vec2<f32>(textureDimensions(ideal_color));
    let last = vec2<f32>(frame.ideal_size_px) - 1.0;
    let at = clamp(at_px, vec2<f32>(0.0), last) + vec2<f32>(0.5, 0.5 + f32(key_row()));
    // Times a reciprocal, which is worked out once: a division a sample is a twentieth of the kernel on
    // llvmpipe.
    return textureSampleLevel(ideal_color, ideal_sampler, at * (1.0 / size), 0.0);
}

// A cubic spline's 4x4 texels as five bilinear reads, without the corners, whose weights are at most 0.4 % at
// softness 0 and 0.8 % at 0.5: columns and rows of the reads, from before the place to after it, and their
// weights. Softness 0 is Catmull-Rom's, which does not blur as a bilinear read between pixels does; 1 is the
// B-spline, with a variance of a third of a square pixel. Twin: camsim_core::temporal::ColorImage::spline.
struct Spline {
    before: vec2<f32>,
    between: vec2<f32>,
    after: vec2<f32>,
    weight_before: vec2<f32>,
    weight_between: vec2<f32>,
    weight_after: vec2<f32>,
}

const SPLINE_READS: u32 = 5u;

fn spline_around(at_px: vec2<f32>, softness: vec2<f32>) -> Spline {
    let base = floor(at_px);
    let f = at_px - base;
    let g = 1.0 - f;
    let w0 = mix(f * (-0.5 + f * (1.0 - 0.5 * f)), g * g * g / 6.0, softness);
    let w1 = mix(1.0 + f * f * (-2.5 + 1.5 * f), (4.0 + f * f * (3.0 * f - 6.0)) / 6.0, softness);
    let w2 = mix(f * (0.5 + f * (2.0 - 1.5 * f)), (4.0 + g * g * (3.0 * g - 6.0)) / 6.0, softness);
    let w3 = mix(f * f * (-0.5 + 0.5 * f), f * f * f / 6.0, softness);
    let w12 = w1 + w2;
    // All five together: nothing is lost with the corners.
    let all = w12.x * w12.y + w12.x * (w0.y + w3.y) + w12.y * (w0.x + w3.x);
    let part = inverseSqrt(all);
    return Spline(base - 1.0, base + w2 / w12, base + 2.0, part * w0, part * w12, part * w3);
}

struct WeighedRead {
    at_px: vec2<f32>,
    weight: f32,
}

// The one between, the ones above and below it, the ones left and right of it.
fn spline_read(spline: Spline, read: u32) -> WeighedRead {
    let before = vec2<bool>(read == 3u, read == 1u);
    let after = vec2<bool>(read == 4u, read == 2u);
    let at_px = select(select(spline.between, spline.before, before), spline.after, after);
    let weight = select(select(spline.weight_between, spline.weight_before, before), spline.weight_after, after);
    return WeighedRead(at_px, weight.x * weight.y);
}

fn ideal_color_by_spline(at_px: vec2<f32>, softness: vec2<f32>) -> vec4<f32> {
    let spline = spline_around(at_px, softness);
    return color_of(spline_read(spline, 0u))
        + color_of(spline_read(spline, 1u))
        + color_of(spline_read(spline, 2u))
        + color_of(spline_read(spline, 3u))
        + color_of(spline_read(spline, 4u));
}

fn color_of(read: WeighedRead) -> vec4<f32> {
    return read.weight * ideal_color_at(read.at_px);
}
