//! Starts of Newton's iteration: solutions on a grid of distorted points.

use glam::DVec2;
use rayon::prelude::*;

use super::{BLOCK, Block, PlaneFormula};
use crate::lens::Lens;

/// Cells along each side. Between the nodes of a real lens's picture the start is off by some 1e-4 at most, so that
/// two steps reach the last bit.
const CELLS: usize = 128;

/// Solutions on a grid, and where they are valid.
#[derive(Clone, Debug)]
pub(crate) struct Grid {
    low: DVec2,
    cells_per_unit: DVec2,
    /// Points of the formula's plane; NaN where a node has none.
    nodes: Vec<DVec2>,
    /// Radius of the plane within which every point is on the principal branch.
    pub(super) inside: f64,
}

impl Grid {
    pub(super) fn new(lens: &Lens, formula: &dyn PlaneFormula, [low, high]: [DVec2; 2], inside: f64) -> Self {
        let step = (high - low) / CELLS as f64;
        let node = |k: usize| {
            let at = low + step * DVec2::new((k % (CELLS + 1)) as f64, (k / (CELLS + 1)) as f64);
            lens.ray(at).map_or(DVec2::NAN, |ray| formula.position(ray))
        };
        let nodes = (0..(CELLS + 1) * (CELLS + 1)).into_par_iter().map(node).collect();
        Self { low, cells_per_unit: step.recip(), nodes, inside }
    }

    /// Starts of a block's points: bilinear between the nodes, NaN outside of the grid.
    #[inline(always)]
    pub(super) fn start(&self, block: &mut Block) {
        let (mut first, mut fraction) = ([0; BLOCK], [[0.0; BLOCK]; 2]);
        let [x, y] = &block.image;
        for i in 0..BLOCK {
            let (column, of_x) = cell((x[i] - self.low.x) * self.cells_per_unit.x);
            let (row, of_y) = cell((y[i] - self.low.y) * self.cells_per_unit.y);
            first[i] = row * (CELLS as u64 + 1) + column;
            (fraction[0][i], fraction[1][i]) = (of_x, of_y);
        }
        for i in 0..BLOCK {
            let start = self.between(first[i] as usize, [fraction[0][i], fraction[1][i]]);
            (block.at[0][i], block.at[1][i]) = (start.x, start.y);
        }
    }

    #[inline(always)]
    fn between(&self, first: usize, [of_x, of_y]: [f64; 2]) -> DVec2 {
        let Some(&[a, b]) = self.nodes[first..].first_chunk() else { return DVec2::NAN };
        let Some(&[c, d]) = self.nodes[first + CELLS + 1..].first_chunk() else { return DVec2::NAN };
        let (upper, lower) = (a + (b - a) * of_x, c + (d - c) * of_x);
        upper + (lower - upper) * of_y
    }
}

/// The cell of a position along a side, and the fraction of it, NaN outside. Without a conversion that
/// saturates, so that it becomes vector instructions.
#[inline(always)]
fn cell(position: f64) -> (u64, f64) {
    /// Added to a small number, it leaves the nearest integer in the lowest bits.
    const ROUND: f64 = (3_u64 << 51) as f64;
    let is_inside = (position >= 0.0) & (position < CELLS as f64);
    let cell = if is_inside { position - 0.5 } else { 0.0 } + ROUND;
    (cell.to_bits() & (CELLS as u64 - 1), if is_inside { position - (cell - ROUND) } else { f64::NAN })
}
