// Edge mask of an ideal frame: the pixels that, with their neighbours, show more than one surface. Also lists
// the tiles of 8x8 pixels that have any. Twin of `steps`: camsim_core::temporal::edge_mask.
#import common/dispatch.wgsl
#import ideal/edge_tiles.wgsl

@group(0) @binding(0) var pixel_depth: texture_depth_2d;
// One word per tile of the target, in the format of ideal/dilate_tiles.wgsl.
@group(0) @binding(1) var<storage, read_write> tile_words: array<u32>;
// Width and height of an ideal frame, rows from one to the next in the target, fine pixels along a side of a
// pixel.
@group(0) @binding(2) var<uniform> ideal_layout: vec4<u32>;

struct EdgeTiles {
    // Arguments of an indirect draw: a strip of four vertices per tile.
    vertices: u32,
    count: atomic<u32>,
    first_vertex: u32,
    first_instance: u32,
    // Arguments of an indirect dispatch: one workgroup per tile, along x, then rows of MAX_GROUPS_X, and 1.
    groups_x: atomic<u32>,
    groups_y: atomic<u32>,
    groups_z: u32,
    pad: u32,
    tiles: array<EdgeTile>,
}

@group(0) @binding(3) var<storage, read_write> edge_tiles: EdgeTiles;

#import <slot:thin_surfaces>

// Depth step, relative to the nearer surface, above which a pixel is at an edge. Curved surfaces stay below
// it within a pixel.
const EDGE_STEP: f32 = 0.01;
// Threshold for supersampled frames. It is lower because the foot of a wall, where another texture begins,
// bends less.
const FINE_EDGE_STEP: f32 = 0.003;

// A workgroup processes 16x16 pixels, four tiles, and each thread 2x2 of them, so that four pixels share the
// cost of a thread, of barriers and atomics. The depths of these pixels and a border of one pixel, row by
// row:
const NEIGHBOURHOOD_PX: u32 = 18u;
var<workgroup> neighbourhood: array<f32, 324>;
// Per tile: bits of the largest depth value, and the 64 bits of its edge mask.
var<workgroup> tile_depth: array<atomic<u32>, 4>;
var<workgroup> tile_bits: array<atomic<u32>, 8>;

// Whether there is an edge along one direction, for four pixels: a second difference of depth above that of a
// smooth surface, or sky beside a surface.
fn steps(before: vec4<f32>, here: vec4<f32>, after: vec4<f32>, edge_step: f32) -> vec4<bool> {
    let high = max(before, max(here, after));
    let low = min(before, min(here, after));
    return (abs(before - 2.0 * here + after) > edge_step * high)
        | ((low == vec4<f32>(0.0)) & (high > vec4<f32>(0.0)));
}

fn neighbourhood_row(position: u32) -> vec4<f32> {
    return vec4<f32>(
        neighbourhood[position],
        neighbourhood[position + 1u],
        neighbourhood[position + 2u],
        neighbourhood[position + 3u],
    );
}

@compute @workgroup_size(8, 8)
fn edge_mask(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_id) local: vec3<u32>,
    @builtin(local_invocation_index) index: u32,
) {
    let key_rows = i32(ideal_layout.z);
    let from_px = vec2<i32>(0, i32(group.y) * 16 / key_rows * key_rows);
    let to_px = from_px + vec2<i32>(ideal_layout.xy);
    let first_px = vec2<i32>(group.xy) * 16 - 1;
    if (index < 8u) {
        atomicStore(&tile_bits[index], 0u);
        atomicStore(&tile_depth[index / 2u], 0u);
    }
    for (var i = index; i < NEIGHBOURHOOD_PX * NEIGHBOURHOOD_PX; i += 64u) {
        let position = clamp(
            first_px + vec2<i32>(vec2<u32>(i % NEIGHBOURHOOD_PX, i / NEIGHBOURHOOD_PX)), from_px, to_px - 1
        );
        neighbourhood[i] = textureLoad(pixel_depth, position, 0);
    }
    workgroupBarrier();
    // The pixels of a thread are the middle ones of four rows of four: upper left and right, lower left and
    // right.
    let position = 2u * (local.y * NEIGHBOURHOOD_PX + local.x);
    let r0 = neighbourhood_row(position);
    let r1 = neighbourhood_row(position + NEIGHBOURHOOD_PX);
    let r2 = neighbourhood_row(position + 2u * NEIGHBOURHOOD_PX);
    let r3 = neighbourhood_row(position + 3u * NEIGHBOURHOOD_PX);
    let here = vec4<f32>(r1.yz, r2.yz);
    let left = vec4<f32>(r1.xy, r2.xy);
    let right = vec4<f32>(r1.zw, r2.zw);
    let above = vec4<f32>(r0.yz, r1.yz);
    let below = vec4<f32>(r2.yz, r3.yz);
    let edge_step = select(EDGE_STEP, FINE_EDGE_STEP, ideal_layout.w > 1u);
    let pixel_px = first_px + 1 + 2 * vec2<i32>(local.xy);
    let is_column_in_frame = vec2<bool>(pixel_px.x < to_px.x, pixel_px.x + 1 < to_px.x);
    let is_in_frame = vec4<bool>(
        is_column_in_frame & vec2<bool>(pixel_px.y < to_px.y),
        is_column_in_frame & vec2<bool>(pixel_px.y + 1 < to_px.y),
    );
    let is_edge = is_in_frame & (steps(left, here, right, edge_step)
        | steps(above, here, below, edge_step)
        | steps(vec4<f32>(r0.xy, r1.xy), here, vec4<f32>(r2.zw, r3.zw), edge_step)
        | steps(vec4<f32>(r0.zw, r1.zw), here, vec4<f32>(r2.xy, r3.xy), edge_step)
        | are_thin_surfaces(pixel_px, is_in_frame, abs(right - left) + abs(below - above), edge_step));
    // The bits of the two pixels of a row are adjacent; those of the row below are 8 bits higher.
    let thread_bits = select(vec4<u32>(0u), vec4<u32>(1u, 2u, 0x100u, 0x200u), is_edge);
    let tile = local.x / 4u + 2u * (local.y / 4u);
    let word = thread_bits.x | thread_bits.y | thread_bits.z | thread_bits.w;
    if (word != 0u) {
        atomicOr(
            &tile_bits[2u * tile + (local.y % 4u) / 2u], word << (2u * (local.x % 4u) + 16u * (local.y % 2u))
        );
    }
    let depths_inside = select(vec4<f32>(0.0), here, is_in_frame);
    atomicMax(
        &tile_depth[tile],
        bitcast<u32>(max(max(depths_inside.x, depths_inside.y), max(depths_inside.z, depths_inside.w))),
    );
    workgroupBarrier();
    if (index < 4u) {
        let tile_xy = 2u * group.xy + vec2<u32>(index % 2u, index / 2u);
        let edge_tile = EdgeTile(
            tile_xy.x | (tile_xy.y << 16u),
            atomicLoad(&tile_bits[2u * index]),
            atomicLoad(&tile_bits[2u * index + 1u]),
        );
        let has_edge_pixels = (edge_tile.bits_low | edge_tile.bits_high) != 0u;
        let tiles_across = (textureDimensions(pixel_depth).x + 7u) / 8u;
        tile_words[tile_xy.y * tiles_across + tile_xy.x] =
            (atomicLoad(&tile_depth[index]) & 0xfffffffeu) | u32(has_edge_pixels);
        if (has_edge_pixels) {
            let list_index = atomicAdd(&edge_tiles.count, 1u);
            edge_tiles.tiles[list_index] = edge_tile;
            atomicMax(&edge_tiles.groups_x, min(list_index, MAX_GROUPS_X - 1u) + 1u);
            atomicMax(&edge_tiles.groups_y, list_index / MAX_GROUPS_X + 1u);
        }
    }
}
