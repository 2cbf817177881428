//! Slopes and borders of the terrain, in a tree.

use camsim_core::scene::{Aabb, CHUNK_CELLS, Terrain};
use glam::DVec3;
use rayon::prelude::*;

/// Cells along the side of a block that shares one slope bound.
const BLOCK_CELLS: u32 = 8;

/// A piece of terrain.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Patch {
    pub bounds: Aabb,
    /// Largest tangent of the angle between a triangle's normal and the vertical.
    pub slope: f64,
    /// Whether the terrain ends here.
    pub rim: bool,
}

impl Patch {
    const EMPTY: Self = Self { bounds: Aabb::EMPTY, slope: 0.0, rim: false };

    fn join(self, other: Self) -> Self {
        Self {
            bounds: self.bounds.union(&other.bounds),
            slope: self.slope.max(other.slope),
            rim: self.rim || other.rim,
        }
    }
}

/// Patches of 8x8 cells, and above them patches of 2x2 of the level below, up to one. A condition that holds
/// of no patch unless it holds of all those around it is tested only where it may hold.
#[derive(Debug, Default)]
pub(crate) struct PatchTree {
    pub levels: Vec<PatchLevel>,
}

#[derive(Debug)]
pub(crate) struct PatchLevel {
    /// Patches from west to east and from north to south.
    pub size: [u32; 2],
    pub patches: Vec<Patch>,
}

/// Level of the patches that are chunks.
pub(crate) const CHUNK_LEVEL: usize = (CHUNK_CELLS / BLOCK_CELLS).trailing_zeros() as usize;

impl PatchTree {
    pub fn new(terrain: &Terrain) -> Self {
        let size = terrain.cells.map(|cells| cells.div_ceil(BLOCK_CELLS));
        let patches = (0..size[0] * size[1])
            .into_par_iter()
            .map(|i| block(terrain, [i % size[0], i / size[0]]))
            .collect();
        let mut levels = vec![PatchLevel { size, patches }];
        while let Some(below) = levels.last().filter(|level| level.size != [1, 1]) {
            let size = below.size.map(|n| n.div_ceil(2));
            let joined = |i: u32| {
                below
                    .children([i % size[0], i / size[0]])
                    .map(|at| below.get(at))
                    .fold(Patch::EMPTY, Patch::join)
            };
            let patches = (0..size[0] * size[1]).map(joined).collect();
            levels.push(PatchLevel { size, patches });
        }
        Self { levels }
    }

    /// Whether `holds` for a patch of the level (or the last one) and for all those around it.
    pub fn any(&self, level: usize, holds: &dyn Fn(&Patch) -> bool) -> bool {
        let Some(last) = self.levels.len().checked_sub(1) else { return false };
        let mut stack = vec![(last, [0, 0])];
        while let Some((at_level, at)) = stack.pop() {
            if holds(&self.levels[at_level].get(at)) {
                match at_level.checked_sub(1) {
                    Some(below) if at_level > level => {
                        stack.extend(self.levels[below].children(at).map(|at| (below, at)))
                    }
                    _ => return true,
                }
            }
        }
        false
    }
}

impl PatchLevel {
    fn get(&self, [column, row]: [u32; 2]) -> Patch {
        self.patches[(row * self.size[0] + column) as usize]
    }

    /// Patches of this level within one of the next.
    fn children(&self, [column, row]: [u32; 2]) -> impl Iterator<Item = [u32; 2]> {
        let [columns, rows] = self.size;
        let four = [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[i, j]| [2 * column + i, 2 * row + j]);
        four.into_iter().filter(move |at| at[0] < columns && at[1] < rows)
    }
}

/// The patch of 8x8 cells in a column and row of such.
fn block(terrain: &Terrain, at: [u32; 2]) -> Patch {
    let [west, north] = at.map(|n| n * BLOCK_CELLS);
    let [columns, rows] = terrain.cells;
    let mut block = Patch::EMPTY;
    for row in north..(north + BLOCK_CELLS).min(rows) {
        for column in west..(west + BLOCK_CELLS).min(columns) {
            let (chunk, [i, j]) = terrain.chunk_of_cell([column, row]);
            let corners =
                [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[a, b]| terrain.position_ned_m(chunk, i + a, j + b));
            let at_rim = column == 0 || row == 0 || column + 1 == columns || row + 1 == rows;
            block = block.join(cell(corners, at_rim));
        }
    }
    block
}

/// Both ways of cutting the cell into triangles: the terrain's own is one of them.
fn cell(corners: [DVec3; 4], at_rim: bool) -> Patch {
    let mut patch = Patch { rim: at_rim, ..Patch::EMPTY };
    for point in corners {
        if point.is_finite() {
            patch.bounds.include(point);
        } else {
            patch.rim = true;
        }
    }
    for k in 0..4 {
        let [a, b, c] = [k, k + 1, k + 2].map(|n| corners[n % 4]);
        let normal = (b - a).cross(c - a);
        if normal.is_finite() {
            patch.slope = patch.slope.max(normal.truncate().length() / normal.z.abs());
        }
    }
    patch
}
