// The depth of each pixel of an ideal frame that was drawn with four samples a pixel. Twin of
// camsim-core/src/temporal/multisample.rs.

@group(0) @binding(0) var samples: texture_depth_multisampled_2d;

// Where samples are from the pixel's middle on.
const ACROSS = vec4f(-0.125, 0.375, -0.375, 0.125);
const DOWN = vec4f(-0.375, -0.125, 0.125, 0.375);
// Inverse depths that differ by no more than this part of the nearest one are of one surface.
const ONE_SURFACE: f32 = 0.02;

// A triangle over everything.
@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    let corner = vec2f(f32(index & 1u), f32(index >> 1u));
    return vec4f(4.0 * corner - 1.0, 0.0, 1.0);
}

fn highest(all: vec4f) -> f32 {
    return max(max(all.x, all.y), max(all.z, all.w));
}

fn is_one(all: vec4f, most: f32) -> bool {
    return highest(all) + highest(-all) <= ONE_SURFACE * most;
}

// Mean and number of the samples of the surface that one shows, from it on.
fn mean_from(all: vec4f, first: f32) -> vec2f {
    let is_alike = (all >= vec4f((1.0 - ONE_SURFACE) * first)) & (all <= vec4f(first));
    let weights = select(vec4f(0.0), vec4f(1.0), is_alike);
    let count = dot(weights, vec4f(1.0));
    return vec2f(dot(weights, all) / count, count);
}

fn middle_depth(all: vec4f, slopes: vec2f) -> f32 {
    let most = highest(all);
    if is_one(all - slopes.x * ACROSS - slopes.y * DOWN, most) || is_one(all, most) {
        return 0.25 * ((all.x + all.w) + (all.y + all.z));
    }
    let near = mean_from(all, most);
    if near.y > 1.0 {
        return near.x;
    }
    let behind = select(vec4f(0.0), all, all < vec4f((1.0 - ONE_SURFACE) * most));
    return mean_from(all, highest(behind)).x;
}

// The smaller one of the changes on both sides: the other one may go over a border.
fn slope(before: f32, here: f32, after: f32) -> f32 {
    let changes = vec2f(here - before, after - here);
    return select(changes.y, changes.x, abs(changes.x) < abs(changes.y));
}

@fragment
fn fragment(@builtin(position) position: vec4f) -> @builtin(frag_depth) f32 {
    let px = vec2i(position.xy);
    let last = vec2i(textureDimensions(samples)) - 1;
    let all = vec4f(textureLoad(samples, px, 0), textureLoad(samples, px, 1), textureLoad(samples, px, 2), textureLoad(samples, px, 3));
    let left = textureLoad(samples, vec2i(max(px.x - 1, 0), px.y), 0);
    let right = textureLoad(samples, vec2i(min(px.x + 1, last.x), px.y), 0);
    let above = textureLoad(samples, vec2i(px.x, max(px.y - 1, 0)), 0);
    let below = textureLoad(samples, vec2i(px.x, min(px.y + 1, last.y)), 0);
    return middle_depth(all, vec2f(slope(left, all.x, right), slope(above, all.x, below)));
}
