// Fits the borders of two surfaces within the fine pixels of edge pixels: one workgroup per tile that has
// any.
#import ideal/edge_tiles.wgsl
#import ideal/sample_count.wgsl
#import ideal/edge_lines.wgsl

struct EdgeTiles {
    draw: vec4<u32>,
    dispatch: vec4<u32>,
    tiles: array<EdgeTile>,
}

@group(0) @binding(0) var fine_depth: texture_depth_multisampled_2d;
@group(0) @binding(1) var<storage, read> edge_tiles: EdgeTiles;
// Layout of the ideal frames, as in ideal/edge_mask.wgsl.
@group(0) @binding(2) var<uniform> ideal_layout: vec4<u32>;
// Written for edge pixels only; other texels are undefined.
@group(0) @binding(3) var lines: texture_storage_2d<rg32uint, write>;

// Index of the k-th set bit, by bisection.
fn nth_set_bit(bits: vec2<u32>, n: u32) -> u32 {
    let low_count = countOneBits(bits.x);
    let is_high = n >= low_count;
    var bits_left = select(bits.x, bits.y, is_high);
    var index_left = select(n, n - low_count, is_high);
    var bit_index = select(0u, 32u, is_high);
    for (var width = 16u; width > 0u; width /= 2u) {
        let low = bits_left & ((1u << width) - 1u);
        let count = countOneBits(low);
        let is_upper_half = index_left >= count;
        bits_left = select(low, bits_left >> width, is_upper_half);
        index_left = select(index_left, index_left - count, is_upper_half);
        bit_index += select(0u, width, is_upper_half);
    }
    return bit_index;
}

// Edge pixels are few. They are dealt out to consecutive threads, so that all lanes of a processor are busy.
@compute @workgroup_size(64)
fn find_edge_lines(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) index: u32,
) {
    let bit_index = group.y * groups.x + group.x;
    if (bit_index >= edge_tiles.draw.y) {
        return;
    }
    let tile = edge_tiles.tiles[bit_index];
    let bits = vec2<u32>(tile.bits_low, tile.bits_high);
    let tile_px = 8 * vec2<i32>(vec2<u32>(tile.tile_xy & 0xffffu, tile.tile_xy >> 16u));
    let key_rows = i32(ideal_layout.z);
    let scale = i32(ideal_layout.w);
    let from_px = vec2<i32>(0, tile_px.y / key_rows * key_rows) * scale;
    let to_px = from_px + vec2<i32>(ideal_layout.xy) * scale;
    let fine_pixels = u32(scale * scale);
    let count = (countOneBits(bits.x) + countOneBits(bits.y)) * fine_pixels;
    for (var i = index; i < count; i += 64u) {
        let pixel_in_tile = i32(nth_set_bit(bits, i / fine_pixels));
        let subpixel = i32(i % fine_pixels);
        let fine_pixel = (tile_px + vec2<i32>(pixel_in_tile % 8, pixel_in_tile / 8)) * scale
            + vec2<i32>(subpixel % scale, subpixel / scale);
        textureStore(lines, fine_pixel, vec4<u32>(edge_line(fine_pixel, from_px, to_px), 0u, 0u));
    }
}
