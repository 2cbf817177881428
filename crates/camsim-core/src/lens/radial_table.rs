//! Start values of the lens inverse.

/// Entries of a start table.
pub const RADIAL_TABLE_LEN: usize = 257;

/// `undistorted / distorted` radius, tabulated over `s = sqrt(1 - distorted / distorted_max)`, uniform in s.
///
/// Near a fold the inverse behaves like `fold - c sqrt(distorted_max - distorted)`, which is smooth in s but
/// has an infinite slope in the radius.
#[derive(Clone, Debug, PartialEq)]
pub struct RadialTable {
    distorted_max: f64,
    ratios: Vec<f64>,
}

impl RadialTable {
    /// Tabulates the inverse of `forward`, which increases on `0..=undistorted_max`, up to `reach` at most.
    /// `at_axis` is the ratio on the axis.
    pub(super) fn new(undistorted_max: f64, reach: f64, at_axis: f64, forward: impl Fn(f64) -> f64) -> Self {
        let at_end = forward(undistorted_max);
        let distorted_max = if at_end < reach { at_end } else { reach };
        let solve = |distorted: f64| {
            let (mut low, mut high) = (0.0, undistorted_max);
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if forward(middle) <= distorted {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            0.5 * (low + high)
        };
        let ratios = (0..RADIAL_TABLE_LEN)
            .map(|i| {
                let s = i as f64 / (RADIAL_TABLE_LEN - 1) as f64;
                let distorted = distorted_max * (1.0 - s * s);
                if distorted > 0.0 { solve(distorted) / distorted } else { at_axis }
            })
            .collect();
        Self { distorted_max, ratios }
    }

    /// `undistorted / distorted` at a distorted radius, linear in s; beyond the table its last value.
    pub fn ratio(&self, distorted: f64) -> f64 {
        let s = (1.0 - distorted / self.distorted_max).max(0.0).sqrt();
        let position = s * (RADIAL_TABLE_LEN - 1) as f64;
        let below = (position as usize).min(RADIAL_TABLE_LEN - 2);
        let fraction = position - below as f64;
        self.ratios[below] + (self.ratios[below + 1] - self.ratios[below]) * fraction
    }

    /// The distorted radius at s = 0.
    pub fn distorted_max(&self) -> f64 {
        self.distorted_max
    }

    /// The entries, by ascending s.
    pub fn ratios(&self) -> &[f64] {
        &self.ratios
    }
}
