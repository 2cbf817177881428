// Tiles of 8x8 pixels that have marks, as later passes read them; ideal/marks.wgsl fills the list.

struct MarkedTile {
    // Column, and row << 16, of the tile.
    place: u32,
    // A bit for each pixel of it, row by row from the lowest.
    bits_low: u32,
    bits_high: u32,
}
