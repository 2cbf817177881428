// Marks the pixels of an ideal frame that, with their neighbours, show more than one surface, and lists the tiles of 8x8 pixels that have
// any. Twin of `steps`: camsim_core::temporal::edges.
#import common/dispatch.wgsl
#import ideal/marked_tiles.wgsl

@group(0) @binding(0) var centre_depth: texture_depth_2d;
// A word for each tile of the target, as ideal/reach.wgsl reads it.
@group(0) @binding(1) var<storage, read_write> tiles: array<u32>;
// Ideal pixels of a frame, rows from one to the next, and fine pixels along a side of a pixel.
@group(0) @binding(2) var<uniform> ideal_layout: vec4<u32>;

struct MarkedTiles {
    // Arguments of a draw of a strip of four vertices a tile.
    vertices: u32,
    count: atomic<u32>,
    first_vertex: u32,
    first_instance: u32,
    // Arguments of a dispatch of a workgroup a tile: along x, then rows of MOST_GROUPS, and 1.
    groups_x: atomic<u32>,
    groups_y: atomic<u32>,
    groups_z: u32,
    pad: u32,
    tiles: array<MarkedTile>,
}

@group(0) @binding(3) var<storage, read_write> marked: MarkedTiles;

#import <slot:spread>

// A step of depth, relative to the nearer surface, that a curved surface does not make within a pixel.
const EDGE_STEP: f32 = 0.01;
// The same in a frame that is drawn finer: a wall's foot, where another picture begins, bends less.
const FINE_EDGE_STEP: f32 = 0.003;

// The pixels of the workgroup and those around it.
var<workgroup> around: array<f32, 100>;
var<workgroup> nearest: atomic<u32>;
var<workgroup> bits: array<atomic<u32>, 2>;

// Along one direction: a second difference beyond what a smooth surface has, or sky beside a surface.
fn steps(before: f32, here: f32, after: f32, edge_step: f32) -> bool {
    let high = max(before, max(here, after));
    let low = min(before, min(here, after));
    return abs(before - 2.0 * here + after) > edge_step * high || (low == 0.0 && high > 0.0);
}

@compute @workgroup_size(8, 8)
fn marks(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_id) local: vec3<u32>, @builtin(local_invocation_index) index: u32) {
    let key_rows = i32(ideal_layout.z);
    let from_px = vec2<i32>(0, i32(group.y) * 8 / key_rows * key_rows);
    let to_px = from_px + vec2<i32>(ideal_layout.xy);
    let first = vec2<i32>(group.xy) * 8 - 1;
    for (var i = i32(index); i < 100; i += 64) {
        let at = clamp(first + vec2<i32>(i % 10, i / 10), from_px, to_px - 1);
        around[i] = textureLoad(centre_depth, at, 0);
    }
    workgroupBarrier();
    let pixel = first + 1 + vec2<i32>(local.xy);
    if (all(pixel < to_px)) {
        let at = (local.y + 1u) * 10u + local.x + 1u;
        let here = around[at];
        let edge_step = select(EDGE_STEP, FINE_EDGE_STEP, ideal_layout.w > 1u);
        let slope = abs(around[at + 1u] - around[at - 1u]) + abs(around[at + 10u] - around[at - 10u]);
        if (steps(around[at - 1u], here, around[at + 1u], edge_step)
            || steps(around[at - 10u], here, around[at + 10u], edge_step)
            || steps(around[at - 11u], here, around[at + 11u], edge_step)
            || steps(around[at - 9u], here, around[at + 9u], edge_step)
            || is_thin(pixel, slope, edge_step)) {
            atomicOr(&bits[local.y / 4u], 1u << (local.x + 8u * (local.y % 4u)));
        }
        atomicMax(&nearest, bitcast<u32>(here));
    }
    workgroupBarrier();
    if (index == 0u) {
        let found = MarkedTile(group.x | (group.y << 16u), atomicLoad(&bits[0]), atomicLoad(&bits[1]));
        let has_marks = (found.bits_low | found.bits_high) != 0u;
        let across = (textureDimensions(centre_depth).x + 7u) / 8u;
        tiles[group.y * across + group.x] = (atomicLoad(&nearest) & 0xfffffffeu) | u32(has_marks);
        if (has_marks) {
            let place = atomicAdd(&marked.count, 1u);
            marked.tiles[place] = found;
            atomicMax(&marked.groups_x, min(place, MOST_GROUPS - 1u) + 1u);
            atomicMax(&marked.groups_y, place / MOST_GROUPS + 1u);
        }
    }
}
