//! A function of one variable as a table of polynomials.

use std::f64::consts::PI;

/// Cells of a table.
const CELLS: usize = 256;
/// Coefficients of a cell.
const TERMS: usize = 8;
/// Where a cell is tested, from -1 to 1.
const TESTED: [f64; 6] = [-1.0, -0.92, -0.45, 0.12, 0.64, 1.0];

/// A function on `0..=end`, a polynomial of degree 7 in each of equal cells.
#[derive(Clone, Debug)]
pub(super) struct Polynomials {
    cells_per_unit: f64,
    /// Powers of the position in the cell, -1 to 1. NaN: a cell without a polynomial, such as the one beyond the end.
    cells: Vec<[f64; TERMS]>,
}

impl Polynomials {
    /// Through the function's values at Chebyshev's nodes of each cell.
    pub(super) fn new(end: f64, function: impl Fn(f64) -> f64) -> Self {
        let width = end / CELLS as f64;
        let cell = |i: usize| fit(|position| function((i as f64 + 0.5 + 0.5 * position) * width));
        let cells = (0..CELLS).map(cell).chain([[f64::NAN; TERMS]]).collect();
        Self { cells_per_unit: width.recip(), cells }
    }

    /// The value; NaN outside.
    #[inline]
    pub(super) fn at(&self, x: f64) -> f64 {
        let position = x * self.cells_per_unit;
        let i = (position as usize).min(CELLS);
        let local = 2.0 * (position - i as f64) - 1.0;
        let [c0, c1, c2, c3, c4, c5, c6, c7] = self.cells[i];
        let square = local * local;
        let (low, high) =
            ((c0 + c1 * local) + (c2 + c3 * local) * square, (c4 + c5 * local) + (c6 + c7 * local) * square);
        low + high * (square * square)
    }

    /// Removes cells in which any of some positions fails a test.
    pub(super) fn keep(&mut self, is_good: impl Fn(&Self, f64) -> bool) {
        for i in 0..CELLS {
            let position = |local: f64| {
                // Not the first of the next cell.
                let fraction = (0.5 + 0.5 * local).clamp(1e-9, 1.0 - 1e-9);
                (i as f64 + fraction) / self.cells_per_unit
            };
            if !TESTED.iter().all(|local| is_good(self, position(*local))) {
                self.cells[i] = [f64::NAN; TERMS];
            }
        }
    }
}

/// Powers of the polynomial through a function's values at Chebyshev's nodes on -1 to 1.
fn fit(function: impl Fn(f64) -> f64) -> [f64; TERMS] {
    let angle = |node: usize| PI * (node as f64 + 0.5) / TERMS as f64;
    let values: [f64; TERMS] = std::array::from_fn(|node| function(angle(node).cos()));
    // Of the differences, so that roundings of the weights do not count.
    let base = values[TERMS / 2];
    // Chebyshev's polynomials T and their weights.
    let weight = |k: usize| {
        let sum: f64 = (0..TERMS).map(|node| (values[node] - base) * (k as f64 * angle(node)).cos()).sum();
        sum * if k == 0 { 1.0 } else { 2.0 } / TERMS as f64
    };
    let mut powers = [0.0; TERMS];
    let (mut before, mut now) = ([0.0; TERMS], [0.0; TERMS]);
    (before[0], now[1]) = (1.0, 1.0);
    for k in 0..TERMS {
        let fraction = weight(k);
        for (power, term) in powers.iter_mut().zip(before) {
            *power += fraction * term;
        }
        // T(k + 1) = 2 x T(k) - T(k - 1), here with T(k) as `before`.
        let mut next = [0.0; TERMS];
        for i in 0..TERMS {
            next[i] = -before[i] + if i > 0 { 2.0 * now[i - 1] } else { 0.0 };
        }
        (before, now) = (now, next);
    }
    powers[0] += base;
    powers
}
