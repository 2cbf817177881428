//! Which vertices a chunk uses at a level, so that it fits its neighbours. Small pure integer functions: the shader has twins of them.

/// Moves the position `i` (0..=cells) along a border to a vertex that the coarser level `level` has too: the nearest multiple of
/// 2^level, halves upwards, cut at the far end. Both ends stay where they are, so corners never move.
pub fn snap(i: u32, cells: u32, level: u8) -> u32 {
    if i >= cells {
        return cells;
    }
    let stride = 1 << level;
    ((i + stride / 2) / stride * stride).min(cells)
}

/// Vertex (i, j) of a chunk for the corner (a, b) of its grid at `level`: column a from the west, row b from the north.
/// `edge_levels` are the levels of the neighbours in the north, east, south and west; only coarser ones matter, and they may be
/// coarser by one level at most.
pub fn lod_vertex(step: [u32; 2], cells: [u32; 2], level: u8, edge_levels: [u8; 4]) -> [u32; 2] {
    let at = [(step[0] << level).min(cells[0]), (step[1] << level).min(cells[1])];
    let [north, east, south, west] = edge_levels;
    let mut vertex = at;
    if at[1] == 0 && north > level {
        vertex[0] = snap(at[0], cells[0], north);
    } else if at[1] == cells[1] && south > level {
        vertex[0] = snap(at[0], cells[0], south);
    }
    if at[0] == 0 && west > level {
        vertex[1] = snap(at[1], cells[1], west);
    } else if at[0] == cells[0] && east > level {
        vertex[1] = snap(at[1], cells[1], east);
    }
    vertex
}

/// The two triangles of cell (a, b) at a level, as chunk vertices; degenerate ones included. Corners turn north-west, south-east,
/// north-east and north-west, south-west, south-east.
pub(super) fn cell_triangles(cell: [u32; 2], cells: [u32; 2], level: u8, edge_levels: [u8; 4]) -> [[[u32; 2]; 3]; 2] {
    let [a, b] = cell;
    let [nw, ne, sw, se] = [[a, b], [a + 1, b], [a, b + 1], [a + 1, b + 1]].map(|step| lod_vertex(step, cells, level, edge_levels));
    [[nw, se, ne], [nw, sw, se]]
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::scene::terrain::LEVELS;

    /// Twice the signed area in cells.
    fn area2(t: [[u32; 2]; 3]) -> i64 {
        let [a, b, c] = t.map(|p| p.map(i64::from));
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    }

    const SIZES: [[u32; 2]; 9] = [[64, 64], [1, 1], [1, 64], [5, 3], [6, 63], [33, 17], [62, 61], [3, 7], [34, 2]];

    #[test]
    fn every_stitching_covers_the_chunk_once() {
        for cells in SIZES {
            for level in 0..LEVELS as u8 {
                for mask in 0..16u8 {
                    let edges = std::array::from_fn(|e| level + (mask >> e & 1));
                    let [nx, ny] = cells.map(|n| n.div_ceil(1 << level));
                    let mut total = 0;
                    for b in 0..ny {
                        for a in 0..nx {
                            for triangle in cell_triangles([a, b], cells, level, edges) {
                                // No triangle turns over, so equal areas mean an exact cover.
                                assert!(area2(triangle) <= 0, "{cells:?} {level} {mask} {triangle:?}");
                                total -= area2(triangle);
                            }
                        }
                    }
                    assert_eq!(total, 2 * i64::from(cells[0]) * i64::from(cells[1]), "{cells:?} level {level} mask {mask}");
                }
            }
        }
    }

    #[test]
    fn neighbours_share_their_border_vertices() {
        for cells in SIZES {
            for level in 0..LEVELS as u8 - 1 {
                // Our east border towards a coarser neighbour, and that neighbour's own west border.
                let fine: BTreeSet<_> = (0..=cells[1].div_ceil(1 << level))
                    .map(|b| lod_vertex([cells[0].div_ceil(1 << level), b], cells, level, [level, level + 1, level, level])[1])
                    .collect();
                let coarse: BTreeSet<_> = (0..=cells[1].div_ceil(2 << level))
                    .map(|b| lod_vertex([0, b], cells, level + 1, [level + 1, level + 1, level + 1, level])[1])
                    .collect();
                assert_eq!(fine, coarse, "{cells:?} level {level}");
            }
        }
    }

    #[test]
    fn snapping_keeps_the_ends() {
        for cells in 1..=64 {
            for level in 0..LEVELS as u8 {
                assert_eq!((snap(0, cells, level), snap(cells, cells, level)), (0, cells));
                for i in 0..cells {
                    assert!(snap(i, cells, level) <= snap(i + 1, cells, level));
                }
            }
        }
    }
}
