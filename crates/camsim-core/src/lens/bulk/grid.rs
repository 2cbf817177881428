//! Starts of Newton's iteration: solutions on a grid of distorted points.

use glam::DVec2;

use super::{BLOCK, Block, PlaneFormula};
use crate::lens::Lens;

/// Cells along each side. Between the nodes of a real lens's picture the start is off by some 1e-4 at most, so that
/// two steps reach the last bit.
const CELLS: usize = 128;
/// Steps before the first test, and steps in all.
const STEPS: [usize; 2] = [2, 4];

/// Solutions on a grid, and where they are valid.
#[derive(Clone, Debug)]
pub(crate) struct Grid {
    low: DVec2,
    cells_per_unit: DVec2,
    /// Points of the formula's plane; NaN where a node has none.
    nodes: Vec<DVec2>,
    /// Radius of the plane within which every point is on the principal branch.
    inside: f64,
}

impl Grid {
    pub(super) fn new(lens: &Lens, formula: &dyn PlaneFormula, [low, high]: [DVec2; 2], inside: f64) -> Self {
        let step = (high - low) / CELLS as f64;
        let node = |k: usize| {
            let at = low + step * DVec2::new((k % (CELLS + 1)) as f64, (k / (CELLS + 1)) as f64);
            lens.ray(at).map_or(DVec2::NAN, |ray| formula.place(ray))
        };
        let nodes = (0..(CELLS + 1) * (CELLS + 1)).map(node).collect();
        Self { low, cells_per_unit: step.recip(), nodes, inside }
    }

    /// Bilinear between the nodes; NaN outside of the grid.
    fn start(&self, image: DVec2) -> DVec2 {
        let place = (image - self.low) * self.cells_per_unit;
        // Also false for NaN.
        let is_inside = place.x >= 0.0 && place.y >= 0.0 && place.x < CELLS as f64 && place.y < CELLS as f64;
        if !is_inside {
            return DVec2::NAN;
        }
        let (x, y) = (place.x as usize, place.y as usize);
        let share = place - DVec2::new(x as f64, y as f64);
        let first = y * (CELLS + 1) + x;
        let Some(&[a, b]) = self.nodes[first..].first_chunk() else { return DVec2::NAN };
        let Some(&[c, d]) = self.nodes[first + CELLS + 1..].first_chunk() else { return DVec2::NAN };
        let (upper, lower) = (a + (b - a) * share.x, c + (d - c) * share.x);
        upper + (lower - upper) * share.y
    }

    /// Solutions in the formula's plane.
    fn solve(&self, formula: &dyn PlaneFormula, block: &mut Block) {
        for i in 0..BLOCK {
            let start = self.start(DVec2::new(block.image[0][i], block.image[1][i]));
            (block.at[0][i], block.at[1][i]) = (start.x, start.y);
        }
        let mut is_solved = false;
        for step in 0..STEPS[1] {
            if step < STEPS[0] || !is_solved {
                formula.step(block);
            }
            if step + 1 >= STEPS[0] && !is_solved {
                is_solved = formula.certify(block, self.inside);
            }
        }
    }

    pub(super) fn ideal(&self, formula: &dyn PlaneFormula, block: &mut Block) {
        self.solve(formula, block);
        formula.finish_ideal(block);
    }

    pub(super) fn rays(&self, formula: &dyn PlaneFormula, block: &mut Block) {
        self.solve(formula, block);
        formula.finish_rays(block);
    }
}
