// Dilation of the tiles of 8x8 pixels: for each tile, the largest depth value, and whether there is an edge
// pixel, over all tiles within the distance that a ray's parallax can span. Separable: first along rows, then
// along columns. Word of a tile: bits of its largest depth value, with the lowest bit replaced by the edge
// flag. Positive floats are ordered like their bits.

@group(0) @binding(0) var<storage, read> tiles_in: array<u32>;
@group(0) @binding(1) var<storage, read_write> tiles_out: array<u32>;
// Tiles along x and y, radius in tiles; w is not used.
@group(0) @binding(2) var<uniform> tile_layout: vec4<u32>;

fn joined(a: u32, b: u32) -> u32 {
    return (max(a, b) & 0xfffffffeu) | ((a | b) & 1u);
}

// Dilation along one axis: `index_on_axis` is the tile's index on that axis, `length` the number of tiles,
// `stride` the distance of neighbours in the buffer.
fn dilated(tile: u32, index_on_axis: u32, length: u32, stride: u32) -> u32 {
    let first_index = max(index_on_axis, tile_layout.z) - tile_layout.z;
    let last_index = min(index_on_axis + tile_layout.z, length - 1u);
    var word = 0u;
    for (var i = first_index; i <= last_index; i++) {
        word = joined(word, tiles_in[tile - index_on_axis * stride + i * stride]);
    }
    return word;
}

@compute @workgroup_size(64)
fn along_rows(@builtin(global_invocation_id) id: vec3<u32>) {
    let tile = id.x;
    if (tile < tile_layout.x * tile_layout.y) {
        tiles_out[tile] = dilated(tile, tile % tile_layout.x, tile_layout.x, 1u);
    }
}

@compute @workgroup_size(64)
fn along_columns(@builtin(global_invocation_id) id: vec3<u32>) {
    let tile = id.x;
    if (tile < tile_layout.x * tile_layout.y) {
        tiles_out[tile] = dilated(tile, tile / tile_layout.x, tile_layout.y, tile_layout.x);
    }
}
