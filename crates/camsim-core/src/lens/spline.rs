//! A smooth function on a regular grid: the cubic spline through its values.

use glam::{DMat2, DVec2};

/// Fewest nodes along an axis.
pub(super) const LEAST_NODES: usize = 4;

/// A bicubic spline in B-spline form, with continuous second derivatives, that takes the given values at its
/// nodes. At the ends the third derivative does not jump either ("not a knot"), so cubics are met exactly.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Spline {
    first: DVec2,
    step: DVec2,
    count: [usize; 2],
    /// Coefficients, with one more row and column on each side.
    coefficients: Vec<DVec2>,
}

impl Spline {
    /// Through values in rows, at `first + (i, j) * step`. `None` with fewer than [`LEAST_NODES`] along an axis.
    pub(super) fn new(first: DVec2, step: DVec2, count: [usize; 2], values: &[DVec2]) -> Option<Self> {
        let [columns, rows] = count;
        if columns < LEAST_NODES || rows < LEAST_NODES || values.len() != columns * rows {
            return None;
        }
        let along_rows: Vec<Vec<DVec2>> = values.chunks_exact(columns).map(filtered).collect();
        let mut coefficients = vec![DVec2::ZERO; (columns + 2) * (rows + 2)];
        for i in 0..columns + 2 {
            let column: Vec<DVec2> = along_rows.iter().map(|row| row[i]).collect();
            for (j, value) in filtered(&column).into_iter().enumerate() {
                coefficients[j * (columns + 2) + i] = value;
            }
        }
        Some(Self { first, step, count, coefficients })
    }

    /// Smallest distance to the border of the grid, in nodes; negative outside.
    pub(super) fn inside(&self, at: DVec2) -> f64 {
        let node = (at - self.first) / self.step;
        let last = DVec2::new((self.count[0] - 1) as f64, (self.count[1] - 1) as f64);
        node.min(last - node).min_element()
    }

    /// Largest distance of a corner of the grid from the origin.
    pub(super) fn reach(&self) -> f64 {
        let last =
            self.first + self.step * DVec2::new((self.count[0] - 1) as f64, (self.count[1] - 1) as f64);
        self.first.abs().max(last.abs()).length()
    }

    /// Value and derivatives (one column an axis); beyond the grid the outermost polynomial goes on.
    pub(super) fn at(&self, at: DVec2) -> (DVec2, DMat2) {
        let node = (at - self.first) / self.step;
        let cell = |value: f64, count: usize| (value.max(0.0) as usize).min(count - 2);
        let [i, j] = [cell(node.x, self.count[0]), cell(node.y, self.count[1])];
        let (wx, dx) = weights(node.x - i as f64);
        let (wy, dy) = weights(node.y - j as f64);
        let (mut value, mut along_x, mut along_y) = (DVec2::ZERO, DVec2::ZERO, DVec2::ZERO);
        for (row, (wy, dy)) in wy.into_iter().zip(dy).enumerate() {
            let start = (j + row) * (self.count[0] + 2) + i;
            let four = &self.coefficients[start..start + 4];
            let (mut of_row, mut slope) = (DVec2::ZERO, DVec2::ZERO);
            for (coefficient, (wx, dx)) in four.iter().zip(wx.into_iter().zip(dx)) {
                of_row += *coefficient * wx;
                slope += *coefficient * dx;
            }
            value += of_row * wy;
            along_x += slope * wy;
            along_y += of_row * dy;
        }
        (value, DMat2::from_cols(along_x / self.step.x, along_y / self.step.y))
    }
}

/// Weights of four neighbouring coefficients and their derivatives, at a fraction of the interval from the
/// second to the third.
fn weights(t: f64) -> ([f64; 4], [f64; 4]) {
    let (t2, s) = (t * t, 1.0 - t);
    let t3 = t2 * t;
    (
        [s * s * s / 6.0, (3.0 * t3 - 6.0 * t2 + 4.0) / 6.0, (3.0 * (t - t3 + t2) + 1.0) / 6.0, t3 / 6.0],
        [-0.5 * s * s, 1.5 * t2 - 2.0 * t, 0.5 + t - 1.5 * t2, 0.5 * t2],
    )
}

/// Coefficients c of n values f, one more on each side: `(c[i-1] + 4 c[i] + c[i+1]) / 6 = f[i]`, and fourth
/// differences of zero at both ends. These make the second coefficient `(8 f[1] - f[0] - f[2]) / 6`; what is
/// between is a tridiagonal system.
fn filtered(f: &[DVec2]) -> Vec<DVec2> {
    let n = f.len();
    // c[i + 1] belongs to f[i].
    let mut c = vec![DVec2::ZERO; n + 2];
    let near_end = |a: DVec2, b: DVec2, d: DVec2| (8.0 * b - a - d) / 6.0;
    c[2] = near_end(f[0], f[1], f[2]);
    c[n - 1] = near_end(f[n - 1], f[n - 2], f[n - 3]);
    // Thomas's algorithm for f[2] .. f[n - 3].
    let mut upper = vec![0.0; n + 2];
    for i in 3..n - 1 {
        let before = if i == 3 { c[2] } else { DVec2::ZERO };
        let (carry, value) = if i == 3 { (0.0, DVec2::ZERO) } else { (upper[i - 1], c[i - 1]) };
        let pivot = 4.0 - carry;
        upper[i] = 1.0 / pivot;
        c[i] = (6.0 * f[i - 1] - before - value) / pivot;
    }
    for i in (3..n - 1).rev() {
        let next = c[i + 1];
        c[i] -= upper[i] * next;
    }
    c[1] = 6.0 * f[1] - 4.0 * c[2] - c[3];
    c[n] = 6.0 * f[n - 2] - 4.0 * c[n - 1] - c[n - 2];
    c[0] = 6.0 * f[0] - 4.0 * c[1] - c[2];
    c[n + 1] = 6.0 * f[n - 1] - 4.0 * c[n] - c[n - 1];
    c
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn cubics_are_met_exactly_with_their_derivatives() {
        let cubic = |p: DVec2| {
            DVec2::new(
                1.0 - p.x + 0.5 * p.x * p.x * p.y - 0.2 * p.x.powi(3) * p.y.powi(2),
                p.y.powi(3) + p.x * p.y,
            )
        };
        for count in [[4, 4], [5, 7], [12, 6]] {
            let (first, step) = (DVec2::new(-1.0, -0.7), DVec2::new(0.3, 0.25));
            let node = |k: usize| first + step * DVec2::new((k % count[0]) as f64, (k / count[0]) as f64);
            let values: Vec<DVec2> = (0..count[0] * count[1]).map(|k| cubic(node(k))).collect();
            let spline = Spline::new(first, step, count, &values).unwrap();
            for at in [DVec2::new(-0.9, -0.6), DVec2::new(-0.11, 0.04), DVec2::new(-1.0, 0.05)] {
                let (value, jacobian) = spline.at(at);
                assert!((value - cubic(at)).length() < 1e-12, "{count:?} {at}: {value} {}", cubic(at));
                let h = 1e-6;
                for (axis, column) in [(DVec2::X, jacobian.x_axis), (DVec2::Y, jacobian.y_axis)] {
                    let slope = (cubic(at + h * axis) - cubic(at - h * axis)) / (2.0 * h);
                    assert!((slope - column).length() < 1e-8, "{count:?} {at}: {column} {slope}");
                }
            }
        }
        assert!(Spline::new(DVec2::ZERO, DVec2::ONE, [3, 9], &[DVec2::ZERO; 27]).is_none());
    }
}
