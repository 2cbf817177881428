// What the rays of a pixel may meet: the largest depth value, and whether there is a mark, over the tiles of
// 8x8 pixels within reach of each tile. First along rows, then along columns. A tile's word: the bits of its
// largest depth value, the lowest one replaced by its mark. Positive floats are ordered as their bits are.

@group(0) @binding(0) var<storage, read> tiles_in: array<u32>;
@group(0) @binding(1) var<storage, read_write> tiles_out: array<u32>;
// Tiles across and down, reach in tiles; w is not used.
@group(0) @binding(2) var<uniform> tile_layout: vec4<u32>;

fn joined(a: u32, b: u32) -> u32 {
    return (max(a, b) & 0xfffffffeu) | ((a | b) & 1u);
}

// Over the tiles within reach along one axis: a tile's own place on it, its length, the distance of
// neighbours in the buffer.
fn within_reach(tile: u32, place: u32, length: u32, stride: u32) -> u32 {
    let first = max(place, tile_layout.z) - tile_layout.z;
    let last = min(place + tile_layout.z, length - 1u);
    var found = 0u;
    for (var i = first; i <= last; i++) {
        found = joined(found, tiles_in[tile - place * stride + i * stride]);
    }
    return found;
}

@compute @workgroup_size(64)
fn along_rows(@builtin(global_invocation_id) id: vec3<u32>) {
    let tile = id.x;
    if (tile < tile_layout.x * tile_layout.y) {
        tiles_out[tile] = within_reach(tile, tile % tile_layout.x, tile_layout.x, 1u);
    }
}

@compute @workgroup_size(64)
fn along_columns(@builtin(global_invocation_id) id: vec3<u32>) {
    let tile = id.x;
    if (tile < tile_layout.x * tile_layout.y) {
        tiles_out[tile] = within_reach(tile, tile / tile_layout.x, tile_layout.y, tile_layout.x);
    }
}
