// Borders of surfaces within the fine pixels of marked pixels: a workgroup a tile that has any.
#import ideal/marked_tiles.wgsl
#import ideal/fine.wgsl
#import ideal/lines.wgsl

struct MarkedTiles {
    draw: vec4<u32>,
    dispatch: vec4<u32>,
    tiles: array<MarkedTile>,
}

@group(0) @binding(0) var fine_depth: texture_depth_multisampled_2d;
@group(0) @binding(1) var<storage, read> marked: MarkedTiles;
// As in ideal/marks.wgsl.
@group(0) @binding(2) var<uniform> ideal_layout: vec4<u32>;
// Written, and to be read, in marked pixels only.
@group(0) @binding(3) var lines: texture_storage_2d<rg32uint, write>;

// Number of the k-th bit that is set, by halving.
fn set_bit(bits: vec2<u32>, k: u32) -> u32 {
    let low_count = countOneBits(bits.x);
    let high = k >= low_count;
    var word = select(bits.x, bits.y, high);
    var left = select(k, k - low_count, high);
    var number = select(0u, 32u, high);
    for (var width = 16u; width > 0u; width /= 2u) {
        let low = word & ((1u << width) - 1u);
        let count = countOneBits(low);
        let beyond = left >= count;
        word = select(low, word >> width, beyond);
        left = select(left, left - count, beyond);
        number += select(0u, width, beyond);
    }
    return number;
}

// Marked pixels are few: they are dealt out to neighbouring threads, which keeps a processor's lanes busy.
@compute @workgroup_size(64)
fn borders(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) index: u32,
) {
    let number = group.y * groups.x + group.x;
    if (number >= marked.draw.y) {
        return;
    }
    let tile = marked.tiles[number];
    let bits = vec2<u32>(tile.bits_low, tile.bits_high);
    let first_px = 8 * vec2<i32>(vec2<u32>(tile.place & 0xffffu, tile.place >> 16u));
    let key_rows = i32(ideal_layout.z);
    let scale = i32(ideal_layout.w);
    let from_px = vec2<i32>(0, first_px.y / key_rows * key_rows) * scale;
    let to_px = from_px + vec2<i32>(ideal_layout.xy) * scale;
    let fine_pixels = u32(scale * scale);
    let count = (countOneBits(bits.x) + countOneBits(bits.y)) * fine_pixels;
    for (var i = index; i < count; i += 64u) {
        let at = i32(set_bit(bits, i / fine_pixels));
        let within = i32(i % fine_pixels);
        let fine_pixel = (first_px + vec2<i32>(at % 8, at / 8)) * scale + vec2<i32>(within % scale, within / scale);
        textureStore(lines, fine_pixel, vec4<u32>(edge_line(fine_pixel, from_px, to_px), 0u, 0u));
    }
}
