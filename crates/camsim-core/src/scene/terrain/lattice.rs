//! The vertices of a chunk as a hierarchy of right triangles, each of which may be halved at the middle of
//! its longest side.
//!
//! A chunk is a lattice of 65x65 vertices, numbered row by row from the north-west. Two triangles of half a
//! chunk are halved repeatedly, 12 times until every triangle is half a cell. A vertex is the middle of the
//! longest sides of two mirrored triangles, its *diamond*; those of a vertex on the chunk's border lie in two
//! chunks. Halving both or neither leaves no gap. A triangle exists only if its ancestors were halved: a
//! vertex needs the vertices at which the ancestors of its diamond were halved.
//!
//! In every other cell the last halving gives a diagonal from north-east to south-west, where the full
//! surface has one from north-west to south-east. Turning it is one more step of the hierarchy, that of the
//! *cell*.

use std::{collections::BTreeMap, ops::RangeInclusive, sync::LazyLock};

use super::CHUNK_CELLS;

/// Vertices along a side of a chunk.
pub(super) const SIDE: u32 = CHUNK_CELLS + 1;
/// Vertices of a chunk.
pub(super) const VERTICES: usize = (SIDE * SIDE) as usize;
/// Slots for the cells whose diagonal can be turned, indexed by half the number of their north-west vertex,
/// which is odd.
pub(super) const CELLS: usize = VERTICES / 2;
/// Number of halvings after which a triangle is half a cell.
pub(super) const DEPTHS: u32 = 12;
/// Sizes of the squares for which tolerances are computed, cells along a side.
pub(super) const NODE_CELLS: [u32; 4] = [8, 16, 32, 64];
/// Depth from which a triangle lies within a square of 8x8 cells.
pub(super) const BLOCK_DEPTH: u32 = 6;

/// The two triangles of a chunk: ends of the longest side, then the corner of the right angle. All triangles
/// have the same orientation.
pub(super) const ROOTS: [[u32; 3]; 2] = {
    let [nw, ne, sw, se] = [0, CHUNK_CELLS, CHUNK_CELLS * SIDE, CHUNK_CELLS * SIDE + CHUNK_CELLS];
    [[se, nw, sw], [nw, se, ne]]
};

/// The two halves of a triangle, and the vertex between them.
pub(super) fn halves([a, b, c]: [u32; 3]) -> (u32, [[u32; 3]; 2]) {
    let middle = a.midpoint(b);
    (middle, [[c, a, middle], [b, c, middle]])
}

/// North-west vertex of the cell that holds a triangle of half a cell, if its diagonal must be turned to
/// match the full surface.
pub(super) fn cell_to_turn([a, b, _]: [u32; 3]) -> Option<u32> {
    (a.abs_diff(b) == CHUNK_CELLS).then(|| a.min(b) - 1)
}

/// Such a triangle after turning the diagonal.
pub(super) fn turned([_, _, c]: [u32; 3], cell: u32) -> [u32; 3] {
    let south_east = cell + SIDE + 1;
    if c == cell { [cell, cell + SIDE, south_east] } else { [cell, south_east, cell + 1] }
}

/// Column and row of a vertex.
pub(super) fn position(vertex: u32) -> [u32; 2] {
    [vertex % SIDE, vertex / SIDE]
}

/// Depth of a vertex; `None` for the corners of the chunk.
pub(super) fn depth_of(vertex: u32) -> Option<u32> {
    let [i, j] = position(vertex);
    let power = (i | j).trailing_zeros();
    let step = CHUNK_CELLS.trailing_zeros().checked_sub(power + 1)?;
    // At the centre of a square, or of a side of one.
    let square_tolerance = i.trailing_zeros() == j.trailing_zeros();
    Some(2 * step + u32::from(!square_tolerance))
}

/// Radius, in cells, within which the vertices that may need a vertex of a depth matter: half the side of a
/// square around its diamond and the squares of all vertices and cells that need it.
fn reach(depth: u32) -> u32 {
    let step = CHUNK_CELLS >> (depth / 2 + 1);
    if depth.is_multiple_of(2) { 3 * step - 1 } else { 2 * step - 1 }
}

/// Index into [`NODE_CELLS`] for vertices of a depth: a square of the vertex's radius overlaps at most three
/// of these along a side.
pub(super) fn node_size(depth: u32) -> usize {
    let reach = reach(depth);
    NODE_CELLS.iter().position(|&cells| cells >= reach).unwrap_or(NODE_CELLS.len() - 1)
}

/// A set of squares, the strictest of which decides about a vertex.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Squares {
    /// Index into [`NODE_CELLS`].
    pub size: usize,
    /// First and last column, relative to the chunk's first: -1 is the neighbouring chunk's last.
    pub columns: [i32; 2],
    pub rows: [i32; 2],
}

impl Squares {
    pub fn columns(&self) -> RangeInclusive<i32> {
        self.columns[0]..=self.columns[1]
    }

    pub fn rows(&self) -> RangeInclusive<i32> {
        self.rows[0]..=self.rows[1]
    }

    fn around(position: [u32; 2], depth: u32) -> Self {
        let size = node_size(depth);
        let (reach, cells) = (reach(depth) as i32, NODE_CELLS[size] as i32);
        let along = |at: u32| {
            [(at as i32 - reach).div_euclid(cells), (at as i32 + reach + cells - 1).div_euclid(cells) - 1]
        };
        Self { size, columns: along(position[0]), rows: along(position[1]) }
    }

    fn of_cell(position: [u32; 2]) -> Self {
        let along = |at: u32| [(at / NODE_CELLS[0]) as i32; 2];
        Self { size: 0, columns: along(position[0]), rows: along(position[1]) }
    }
}

/// The squares that decide about each vertex and cell; equal for all chunks.
pub(super) struct Lattice {
    /// The distinct sets.
    pub sets: Vec<Squares>,
    /// Index of each vertex's set; unused for the corners of the chunk.
    pub set_of_vertex: Vec<u16>,
    /// Index of each cell's set.
    pub set_of_cell: Vec<u16>,
    /// Vertices by depth: middles of the longest sides of triangles halved so many times.
    pub by_depth: [Vec<u32>; DEPTHS as usize],
}

pub(super) static LATTICE: LazyLock<Lattice> = LazyLock::new(Lattice::new);

impl Lattice {
    fn new() -> Self {
        let mut known = BTreeMap::new();
        let mut sets = Vec::new();
        let mut number = |squares: Squares| {
            *known.entry(squares.clone()).or_insert_with(|| {
                sets.push(squares);
                (sets.len() - 1) as u16
            })
        };
        let of_vertex = |vertex| depth_of(vertex).map(|depth| Squares::around(position(vertex), depth));
        let set_of_vertex =
            (0..VERTICES as u32).map(|vertex| of_vertex(vertex).map_or(0, &mut number)).collect();
        let cell = |half: u32| {
            let [i, j] = position(2 * half + 1);
            // The last column and row have no cells.
            Squares::of_cell([i.min(CHUNK_CELLS - 1), j.min(CHUNK_CELLS - 1)])
        };
        let set_of_cell = (0..CELLS as u32).map(|half| number(cell(half))).collect();
        let vertices_at = |depth: usize| {
            (0..VERTICES as u32).filter(move |&vertex| depth_of(vertex) == Some(depth as u32)).collect()
        };
        Self { sets, set_of_vertex, set_of_cell, by_depth: std::array::from_fn(vertices_at) }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    /// Twice the signed area in cells.
    fn area2(t: [u32; 3]) -> i64 {
        let [a, b, c] = t.map(|p| position(p).map(i64::from));
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    }

    fn all(triangle: [u32; 3], depth: u32, visit: &mut impl FnMut([u32; 3], u32)) {
        visit(triangle, depth);
        if depth < DEPTHS {
            for half in halves(triangle).1 {
                all(half, depth + 1, visit);
            }
        }
    }

    #[test]
    fn halves_cover_their_triangle_down_to_half_cells() {
        for root in ROOTS {
            assert_eq!(area2(root), -64 * 64);
            all(root, 0, &mut |triangle, depth| {
                assert_eq!(area2(triangle), (-64 * 64) >> depth, "{triangle:?}");
                if depth < DEPTHS {
                    assert_eq!(depth_of(halves(triangle).0), Some(depth));
                    let [at, ends @ ..] = [halves(triangle).0, triangle[0], triangle[1]].map(position);
                    assert!((0..2).all(|k| 2 * at[k] == ends[0][k] + ends[1][k]));
                } else if let Some(cell) = cell_to_turn(triangle) {
                    assert_eq!((area2(turned(triangle, cell)), cell % 2), (-1, 1));
                    assert!(turned(triangle, cell).contains(&triangle[2]));
                    assert_eq!(
                        turned(triangle, cell)
                            .map(|v| v.wrapping_sub(cell))
                            .iter()
                            .filter(|&&v| v == 0 || v == 66)
                            .count(),
                        2
                    );
                }
            });
        }
        // Every vertex but the corners occurs once.
        assert_eq!(LATTICE.by_depth.iter().map(Vec::len).sum::<usize>(), VERTICES - 4);
    }

    #[test]
    fn squares_of_a_vertex_contain_those_of_vertices_that_need_it() {
        let lattice = &*LATTICE;
        let cells = |set: u16| {
            let squares = &lattice.sets[usize::from(set)];
            let size = NODE_CELLS[squares.size] as i32;
            let along = |[first, last]: [i32; 2]| first * size..(last + 1) * size;
            [along(squares.columns), along(squares.rows)]
        };
        let mut compared = 0;
        for root in ROOTS {
            all(root, 0, &mut |triangle, depth| {
                if depth == DEPTHS {
                    return;
                }
                let (middle, parts) = halves(triangle);
                let [columns, rows] = cells(lattice.set_of_vertex[middle as usize]);
                assert!(columns.len() <= 3 * 64 && rows.len() <= 3 * 64);
                let mut inner = Vec::new();
                for part in parts {
                    if depth + 1 < DEPTHS {
                        inner.push(lattice.set_of_vertex[halves(part).0 as usize]);
                    } else if let Some(cell) = cell_to_turn(part) {
                        inner.push(lattice.set_of_cell[cell as usize / 2]);
                    }
                }
                for set in inner {
                    let [inner_columns, inner_rows] = cells(set);
                    assert!(
                        columns.start <= inner_columns.start && columns.end >= inner_columns.end,
                        "{triangle:?}"
                    );
                    assert!(rows.start <= inner_rows.start && rows.end >= inner_rows.end, "{triangle:?}");
                    compared += 1;
                }
                for corner in triangle.map(position) {
                    assert!(columns.contains(&(corner[0] as i32)) || columns.end == corner[0] as i32);
                    assert!(rows.contains(&(corner[1] as i32)) || rows.end == corner[1] as i32);
                }
            });
        }
        assert!(compared > 10_000);
    }

    #[test]
    fn shared_vertices_have_equal_squares_in_both_chunks() {
        let lattice = &*LATTICE;
        let squares = |vertex: u32| lattice.sets[usize::from(lattice.set_of_vertex[vertex as usize])].clone();
        for j in 1..CHUNK_CELLS {
            let (ours, theirs) = (squares(j * SIDE + CHUNK_CELLS), squares(j * SIDE));
            let shift = (CHUNK_CELLS / NODE_CELLS[ours.size]) as i32;
            assert_eq!((ours.size, ours.rows), (theirs.size, theirs.rows));
            assert_eq!(ours.columns, theirs.columns.map(|column| column + shift));
            // The southern border of one chunk as the northern border of another.
            let (ours, theirs) = (squares(CHUNK_CELLS * SIDE + j), squares(j));
            assert_eq!((ours.columns, ours.rows), (theirs.columns, theirs.rows.map(|row| row + shift)));
        }
    }
}
