// Marks the pixels of an ideal frame that, with their neighbours, show more than one surface, and lists the
// tiles of 8x8 pixels that have any. Twin of `steps`: camsim_core::temporal::edge_mask.
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

@group(0) @binding(3) var<storage, read_write> marked_tiles: MarkedTiles;

#import <slot:spread>

// A step of depth, relative to the nearer surface, that a curved surface does not make within a pixel.
const EDGE_STEP: f32 = 0.01;
// The same in a frame that is drawn finer: a wall's foot, where another picture begins, bends less.
const FINE_EDGE_STEP: f32 = 0.003;

// A workgroup takes 16x16 pixels, four tiles, and each of its threads 2x2: what workgroups, barriers and
// atomics cost is shared by four pixels. Those pixels and the ones around them, row by row.
const AROUND: u32 = 18u;
var<workgroup> around: array<f32, 324>;
// Of each tile: the bits of the largest depth value, and 64 bits for its pixels.
var<workgroup> nearest: array<atomic<u32>, 4>;
var<workgroup> bits: array<atomic<u32>, 8>;

// Along one direction: a second difference beyond what a smooth surface has, or sky beside a surface. For
// four pixels.
fn steps(before: vec4<f32>, here: vec4<f32>, after: vec4<f32>, edge_step: f32) -> vec4<bool> {
    let high = max(before, max(here, after));
    let low = min(before, min(here, after));
    return (abs(before - 2.0 * here + after) > edge_step * high) | ((low == vec4<f32>(0.0)) & (high > vec4<f32>(0.0)));
}

fn row_around(at: u32) -> vec4<f32> {
    return vec4<f32>(around[at], around[at + 1u], around[at + 2u], around[at + 3u]);
}

@compute @workgroup_size(8, 8)
fn marks(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_id) local: vec3<u32>, @builtin(local_invocation_index) index: u32) {
    let key_rows = i32(ideal_layout.z);
    let from_px = vec2<i32>(0, i32(group.y) * 16 / key_rows * key_rows);
    let to_px = from_px + vec2<i32>(ideal_layout.xy);
    let first = vec2<i32>(group.xy) * 16 - 1;
    if (index < 8u) {
        atomicStore(&bits[index], 0u);
        atomicStore(&nearest[index / 2u], 0u);
    }
    for (var i = index; i < AROUND * AROUND; i += 64u) {
        let at = clamp(first + vec2<i32>(vec2<u32>(i % AROUND, i / AROUND)), from_px, to_px - 1);
        around[i] = textureLoad(centre_depth, at, 0);
    }
    workgroupBarrier();
    // The pixels of a thread are those in the middle of four rows of four: left and right above, left and
    // right below.
    let at = 2u * (local.y * AROUND + local.x);
    let r0 = row_around(at);
    let r1 = row_around(at + AROUND);
    let r2 = row_around(at + 2u * AROUND);
    let r3 = row_around(at + 3u * AROUND);
    let here = vec4<f32>(r1.yz, r2.yz);
    let left = vec4<f32>(r1.xy, r2.xy);
    let right = vec4<f32>(r1.zw, r2.zw);
    let above = vec4<f32>(r0.yz, r1.yz);
    let below = vec4<f32>(r2.yz, r3.yz);
    let edge_step = select(EDGE_STEP, FINE_EDGE_STEP, ideal_layout.w > 1u);
    let pixel = first + 1 + 2 * vec2<i32>(local.xy);
    let is_in = vec2<bool>(pixel.x < to_px.x, pixel.x + 1 < to_px.x);
    let within = vec4<bool>(is_in & vec2<bool>(pixel.y < to_px.y), is_in & vec2<bool>(pixel.y + 1 < to_px.y));
    let marked = within & (steps(left, here, right, edge_step)
        | steps(above, here, below, edge_step)
        | steps(vec4<f32>(r0.xy, r1.xy), here, vec4<f32>(r2.zw, r3.zw), edge_step)
        | steps(vec4<f32>(r0.zw, r1.zw), here, vec4<f32>(r2.xy, r3.xy), edge_step)
        | are_thin(pixel, within, abs(right - left) + abs(below - above), edge_step));
    // The two pixels of a row stand side by side, and those below them 8 bits further on.
    let found = select(vec4<u32>(0u), vec4<u32>(1u, 2u, 0x100u, 0x200u), marked);
    let tile = local.x / 4u + 2u * (local.y / 4u);
    let word = found.x | found.y | found.z | found.w;
    if (word != 0u) {
        atomicOr(&bits[2u * tile + (local.y % 4u) / 2u], word << (2u * (local.x % 4u) + 16u * (local.y % 2u)));
    }
    let inside = select(vec4<f32>(0.0), here, within);
    atomicMax(&nearest[tile], bitcast<u32>(max(max(inside.x, inside.y), max(inside.z, inside.w))));
    workgroupBarrier();
    if (index < 4u) {
        let place = 2u * group.xy + vec2<u32>(index % 2u, index / 2u);
        let found = MarkedTile(place.x | (place.y << 16u), atomicLoad(&bits[2u * index]), atomicLoad(&bits[2u * index + 1u]));
        let has_marks = (found.bits_low | found.bits_high) != 0u;
        let across = (textureDimensions(centre_depth).x + 7u) / 8u;
        tiles[place.y * across + place.x] = (atomicLoad(&nearest[index]) & 0xfffffffeu) | u32(has_marks);
        if (has_marks) {
            let number = atomicAdd(&marked_tiles.count, 1u);
            marked_tiles.tiles[number] = found;
            atomicMax(&marked_tiles.groups_x, min(number, MOST_GROUPS - 1u) + 1u);
            atomicMax(&marked_tiles.groups_y, number / MOST_GROUPS + 1u);
        }
    }
}
