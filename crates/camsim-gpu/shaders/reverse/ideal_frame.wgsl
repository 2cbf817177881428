// Access to the ideal frame: linear colour and reversed depth d = near / z.
@group(1) @binding(0) var ideal_color: texture_2d<f32>;
@group(1) @binding(1) var ideal_sampler: sampler;
// Nearest-texel sampler.
@group(1) @binding(9) var texel_sampler: sampler;
@group(1) @binding(2) var ideal_depth: texture_2d<f32>;

// Returns `count`, but makes it depend on a texture, for numbers that control flow: trip counts and
// conditions. lavapipe (Mesa) specialises a kernel for values that follow from uniforms alone, and compiles
// it anew when they change, which takes half a second per frame.
fn unspecialised(count: u32) -> u32 {
    return min(count, 65536u * textureDimensions(ideal_color).x);
}

// Exposure phase at which source coordinates are reported.
fn coords_phase() -> f32 {
    return f32(unspecialised(1u)) * frame.coords_phase;
}

// Projection of a point or direction in the key camera (any positive scale) to ideal pixels.
fn ideal_px_from_point(point_in_key: vec3<f32>) -> vec2<f32> {
    return frame.ideal_focal_px * (point_in_key.xy * (1.0 / point_in_key.z)) + frame.ideal_principal_px;
}

fn inside_ideal(position_px: vec2<f32>) -> bool {
    return all(position_px >= vec2<f32>(-0.5)) && all(position_px <= vec2<f32>(frame.ideal_size_px) - 0.5);
}

// The 2x2 texels around a position: the first and the last one, and the interpolation weights.
struct TexelNeighbourhood {
    first: vec2<i32>,
    last: vec2<i32>,
    t: vec2<f32>,
}

// Texels of the selected ideal frame; positions outside are clamped to its border.
fn texel_neighbourhood(position_px: vec2<f32>) -> TexelNeighbourhood {
    let last = vec2<f32>(frame.ideal_size_px) - 1.0;
    let clamped = clamp(position_px, vec2<f32>(0.0), last);
    let base = min(floor(clamped), max(last - 1.0, vec2<f32>(0.0)));
    let origin = vec2<i32>(0, key_row());
    let first = origin + vec2<i32>(base);
    return TexelNeighbourhood(first, min(first + 1, origin + vec2<i32>(last)), clamped - base);
}

// Inverse planar depth, 1/m: bilinear, which is exact on planes; the nearest texel where the four belong to
// different surfaces.
fn inverse_depth(position_px: vec2<f32>) -> f32 {
    let neighbourhood = texel_neighbourhood(position_px);
    let first = neighbourhood.first;
    let last = neighbourhood.last;
    let t = neighbourhood.t;
    let texels = textureGather(
        0,
        ideal_depth,
        texel_sampler,
        vec2<f32>(first + 1) * (1.0 / vec2<f32>(textureDimensions(ideal_depth))),
    );
    let d00 = texels.w;
    let d10 = texels.z;
    let d01 = texels.x;
    let d11 = texels.y;
    let low = min(min(d00, d10), min(d01, d11));
    let high = max(max(d00, d10), max(d01, d11));
    let mixed = mix(mix(d00, d10, t.x), mix(d01, d11, t.x), t.y);
    let nearest = select(select(d00, d10, t.x > 0.5), select(d01, d11, t.x > 0.5), t.y > 0.5);
    let one_surface = low > 0.9 * high;
    return select(nearest, mixed, one_surface) * (1.0 / frame.near_m);
}

// Linear colour, bilinear; alpha is below 1 where an edge pixel contributes.
fn ideal_color_at(position_px: vec2<f32>) -> vec4<f32> {
    let size = vec2<f32>(textureDimensions(ideal_color));
    let last = vec2<f32>(frame.ideal_size_px) - 1.0;
    let clamped = clamp(position_px, vec2<f32>(0.0), last) + vec2<f32>(0.5, 0.5 + f32(key_row()));
    // Multiplied by a reciprocal, which the compiler hoists: a division per sample is a twentieth of the
    // kernel's time on llvmpipe.
    return textureSampleLevel(ideal_color, ideal_sampler, clamped * (1.0 / size), 0.0);
}

// A cubic spline over 4x4 texels as five bilinear reads, without the corners, whose weights are at most 0.4 %
// at softness 0 and 0.8 % at 0.5. Holds the columns and rows of the reads before, at and after the position,
// and their weights. Softness 0 is Catmull-Rom, which does not blur as a bilinear read between pixels does; 1
// is the cubic B-spline, with a variance of a third of a square pixel. Twin:
// camsim_core::temporal::ColorImage::spline.
struct Spline {
    before: vec2<f32>,
    between: vec2<f32>,
    after: vec2<f32>,
    weight_before: vec2<f32>,
    weight_between: vec2<f32>,
    weight_after: vec2<f32>,
}

const SPLINE_READS: u32 = 5u;

fn spline_at(position_px: vec2<f32>, softness: vec2<f32>) -> Spline {
    let base = floor(position_px);
    let f = position_px - base;
    let g = 1.0 - f;
    let w0 = mix(f * (-0.5 + f * (1.0 - 0.5 * f)), g * g * g / 6.0, softness);
    let w1 = mix(1.0 + f * f * (-2.5 + 1.5 * f), (4.0 + f * f * (3.0 * f - 6.0)) / 6.0, softness);
    let w2 = mix(f * (0.5 + f * (2.0 - 1.5 * f)), (4.0 + g * g * (3.0 * g - 6.0)) / 6.0, softness);
    let w3 = mix(f * f * (-0.5 + 0.5 * f), f * f * f / 6.0, softness);
    let w12 = w1 + w2;
    // Normalises the five weights: the corners are missing.
    let all = w12.x * w12.y + w12.x * (w0.y + w3.y) + w12.y * (w0.x + w3.x);
    let normalisation = inverseSqrt(all);
    return Spline(
        base - 1.0, base + w2 / w12, base + 2.0, normalisation * w0, normalisation * w12, normalisation * w3
    );
}

struct WeightedRead {
    position_px: vec2<f32>,
    weight: f32,
}

// Reads in the order: centre, above, below, left, right.
fn spline_read(spline: Spline, read: u32) -> WeightedRead {
    let before = vec2<bool>(read == 3u, read == 1u);
    let after = vec2<bool>(read == 4u, read == 2u);
    let position_px = select(select(spline.between, spline.before, before), spline.after, after);
    let weight = select(
        select(spline.weight_between, spline.weight_before, before), spline.weight_after, after
    );
    return WeightedRead(position_px, weight.x * weight.y);
}

fn ideal_color_by_spline(position_px: vec2<f32>, softness: vec2<f32>) -> vec4<f32> {
    let spline = spline_at(position_px, softness);
    return weighted_color(spline_read(spline, 0u))
        + weighted_color(spline_read(spline, 1u))
        + weighted_color(spline_read(spline, 2u))
        + weighted_color(spline_read(spline, 3u))
        + weighted_color(spline_read(spline, 4u));
}

fn weighted_color(read: WeightedRead) -> vec4<f32> {
    return read.weight * ideal_color_at(read.position_px);
}
