// From the depth samples of an ideal frame to one depth a pixel, as the plain gather reads it; colour stays, but its alpha is 0 where a
// pixel and its neighbours show more than one surface. Twin of `steps`: camsim_core::temporal::edges.
#import ideal/fine.wgsl
#import ideal/lines.wgsl

@group(0) @binding(0) var fine_depth: texture_depth_multisampled_2d;
// Colour at the middle of each pixel.
@group(0) @binding(1) var centre_color: texture_2d<f32>;
@group(0) @binding(2) var color: texture_storage_2d<rgba16float, write>;
@group(0) @binding(3) var depth: texture_storage_2d<r32float, write>;
// A word for each 8x8 pixels of the target, as ideal/reach.wgsl reads it.
@group(0) @binding(4) var<storage, read_write> tiles: array<u32>;
// Ideal pixels of a frame, and rows from one to the next; w is not used.
@group(0) @binding(5) var<uniform> ideal_layout: vec4<u32>;
// Borders of surfaces within fine pixels; written, and to be read, in marked pixels only.
@group(0) @binding(6) var lines: texture_storage_2d<rg32uint, write>;

// A step of depth, relative to the nearer surface, that a curved surface does not make within a pixel.
const EDGE_STEP: f32 = 0.01;
// The same where the frame is drawn finer, for the sake of a tight tolerance: a wall's foot, where another picture begins, bends less.
const FINE_EDGE_STEP: f32 = 0.003;

// One sample of each pixel of the workgroup and of the pixels around it: at the same place in each, so linear on a plane.
var<workgroup> around: array<f32, 100>;
var<workgroup> group_nearest: atomic<u32>;
// Pixels of the workgroup that are marked.
var<workgroup> marked: array<u32, 64>;
var<workgroup> marked_count: atomic<u32>;

// Samples of a pixel that differ by less than this, relative to the nearest, are averaged as one surface.
const ONE_SURFACE: f32 = 0.02;

struct Spread {
    mean: f32,
    low: f32,
    high: f32,
}

// Over the samples of a pixel that are not below `at_least`.
fn pixel_spread(pixel: vec2<i32>, scale: i32, at_least: f32) -> Spread {
    var found = Spread(0.0, 1e30, 0.0);
    var count = 0.0;
    for (var y = 0; y < scale; y++) {
        for (var x = 0; x < scale; x++) {
            for (var i = 0; i < SAMPLES; i++) {
                let d = textureLoad(fine_depth, pixel * scale + vec2<i32>(x, y), i);
                if (d >= at_least) {
                    found.mean += d;
                    found.low = min(found.low, d);
                    found.high = max(found.high, d);
                    count += 1.0;
                }
            }
        }
    }
    found.mean /= max(count, 1.0);
    return found;
}

// Along one direction: a second difference beyond what a smooth surface has, or sky beside a surface.
fn steps(before: f32, here: f32, after: f32, edge_step: f32) -> bool {
    let high = max(before, max(here, after));
    let low = min(before, min(here, after));
    return abs(before - 2.0 * here + after) > edge_step * high || (low == 0.0 && high > 0.0);
}

@compute @workgroup_size(8, 8)
fn resolve(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_id) local: vec3<u32>, @builtin(local_invocation_index) index: u32) {
    let size = vec2<i32>(textureDimensions(color));
    let scale = i32(textureDimensions(fine_depth).x) / size.x;
    let first = vec2<i32>(group.xy) * 8 - 1;
    for (var i = i32(index); i < 100; i += 64) {
        let at = clamp(first + vec2<i32>(i % 10, i / 10), vec2<i32>(0), size - 1);
        around[i] = textureLoad(fine_depth, at * scale, 0);
    }
    workgroupBarrier();
    let pixel = first + 1 + vec2<i32>(local.xy);
    if (all(pixel < size)) {
        let spread = pixel_spread(pixel, scale, 0.0);
        let at = (local.y + 1u) * 10u + local.x + 1u;
        let here = around[at];
        let edge_step = select(EDGE_STEP, FINE_EDGE_STEP, scale > 1);
        var edge = spread.low == 0.0 && spread.high > 0.0;
        edge = edge || steps(around[at - 1u], here, around[at + 1u], edge_step);
        edge = edge || steps(around[at - 10u], here, around[at + 10u], edge_step);
        edge = edge || steps(around[at - 11u], here, around[at + 11u], edge_step);
        edge = edge || steps(around[at - 9u], here, around[at + 9u], edge_step);
        // What is thinner than a pixel may miss all the places above.
        let slope = abs(around[at + 1u] - around[at - 1u]) + abs(around[at + 10u] - around[at - 10u]);
        edge = edge || spread.high - spread.low > slope + edge_step * spread.high;
        // The middle of one surface, or the nearer part where there are several.
        var surface = spread.mean;
        if (edge && spread.low < (1.0 - ONE_SURFACE) * spread.high) {
            surface = pixel_spread(pixel, scale, 0.5 * (spread.low + spread.high)).mean;
        }
        textureStore(color, pixel, vec4<f32>(textureLoad(centre_color, pixel, 0).rgb, select(1.0, 0.0, edge)));
        textureStore(depth, pixel, vec4<f32>(surface));
        if (edge) {
            marked[atomicAdd(&marked_count, 1u)] = local.x + 8u * local.y;
        }
        atomicMax(&group_nearest, bitcast<u32>(spread.high));
    }
    workgroupBarrier();
    // Marked pixels are few: their lines are dealt out to neighbouring threads, which keeps a processor's lanes busy.
    let from_px = vec2<i32>(0, i32(group.y) * 8 / i32(ideal_layout.z) * i32(ideal_layout.z)) * scale;
    let to_px = from_px + vec2<i32>(ideal_layout.xy) * scale;
    let fine_pixels = u32(scale * scale);
    for (var i = index; i < atomicLoad(&marked_count) * fine_pixels; i += 64u) {
        let at = vec2<i32>(i32(marked[i / fine_pixels] % 8u), i32(marked[i / fine_pixels] / 8u));
        let within = i32(i % fine_pixels);
        let fine_pixel = (first + 1 + at) * scale + vec2<i32>(within % scale, within / scale);
        textureStore(lines, fine_pixel, vec4<u32>(edge_line(fine_pixel, from_px, to_px), 0u, 0u));
    }
    if (index == 0u) {
        let across = u32(size.x + 7) / 8u;
        tiles[group.y * across + group.x] = (atomicLoad(&group_nearest) & 0xfffffffeu) | u32(atomicLoad(&marked_count) > 0u);
    }
}
