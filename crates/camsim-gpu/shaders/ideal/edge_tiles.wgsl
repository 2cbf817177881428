// Tiles of 8x8 pixels that have edge pixels. ideal/edge_mask.wgsl fills the list.

struct EdgeTile {
    // Column of the tile, and its row << 16.
    tile_xy: u32,
    // Edge mask of the tile: one bit per pixel, row by row from the lowest bit.
    bits_low: u32,
    bits_high: u32,
}
