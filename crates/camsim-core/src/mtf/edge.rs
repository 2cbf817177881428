//! Finds an edge in a picture, and its profile.

use glam::{DMat3, DVec2, DVec3};

use super::{BINS, EdgeError};

/// Least rows and columns.
pub(super) const LEAST_SIDE: usize = 16;
/// Least number of columns that the edge crosses.
const LEAST_CROSSED: f64 = 2.0;
/// Least distance of the edge from the sides, pixels.
const LEAST_MARGIN_PX: f64 = 4.0;
/// Least step, of the brighter side.
const LEAST_STEP: f64 = 0.01;
/// Times that the centroids are computed: first in the middle of each row, then about the edge.
const PASSES: u32 = 4;

/// A part of a picture, turned so that its edge goes from top to bottom.
pub(super) struct Region {
    values: Vec<f64>,
    width: usize,
    height: usize,
    is_transposed: bool,
}

/// Position of the edge in row y: `middle + slope t + bend t^2` with t counted from the middle row.
pub(super) struct Curve {
    pub middle: f64,
    pub slope: f64,
    pub bend: f64,
    middle_row: f64,
}

impl Curve {
    fn at(&self, row: usize) -> f64 {
        let t = row as f64 - self.middle_row;
        self.middle + t * (self.slope + t * self.bend)
    }

    /// Distance across the edge for each pixel along the row.
    fn across(&self, row: usize) -> f64 {
        let slope = self.slope + 2.0 * self.bend * (row as f64 - self.middle_row);
        1.0 / (1.0 + slope * slope).sqrt()
    }
}

impl Region {
    pub fn upright(values: &[f64], [width, height]: [usize; 2]) -> Result<Self, EdgeError> {
        if width < LEAST_SIDE || height < LEAST_SIDE || values.len() != width * height {
            return Err(EdgeError::Small(width, height));
        }
        let at = |x: usize, y: usize| values[y * width + x];
        let across: f64 = (0..height).map(|y| (at(width - 1, y) - at(0, y)).abs()).sum();
        let down: f64 = (0..width).map(|x| (at(x, height - 1) - at(x, 0)).abs()).sum();
        let most = values.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
        let step = (across / height as f64).max(down / width as f64);
        // NaN is no step.
        let is_step = step > LEAST_STEP * most && most.is_finite();
        if !is_step {
            return Err(EdgeError::Flat);
        }
        let is_transposed = down / width as f64 > across / height as f64;
        Ok(match is_transposed {
            false => Self { values: values.to_vec(), width, height, is_transposed },
            true => {
                let turned = (0..width).flat_map(|x| (0..height).map(move |y| (x, y)));
                let values = turned.map(|(x, y)| at(x, y)).collect();
                Self { values, width: height, height: width, is_transposed }
            }
        })
    }

    /// A direction of the region in the axes of the picture.
    pub fn in_picture(&self, direction: DVec2) -> DVec2 {
        if self.is_transposed { DVec2::new(direction.y, direction.x) } else { direction }
    }

    fn row(&self, y: usize) -> &[f64] {
        &self.values[y * self.width..][..self.width]
    }

    /// The curve through the centroids of the rows' derivatives.
    pub fn fit(&self) -> Result<Curve, EdgeError> {
        let middle_row = 0.5 * (self.height as f64 - 1.0);
        let mut curve = Curve { middle: 0.5 * (self.width as f64 - 1.0), slope: 0.0, bend: 0.0, middle_row };
        for _ in 0..PASSES {
            let positions: Vec<f64> = (0..self.height)
                .map(|y| centroid(self.row(y), curve.at(y)))
                .collect::<Option<_>>()
                .ok_or(EdgeError::Flat)?;
            curve = parabola(&positions, middle_row).ok_or(EdgeError::Flat)?;
        }
        if curve.slope.abs() * (self.height as f64) < LEAST_CROSSED {
            return Err(EdgeError::Parallel(curve.slope.abs().atan().to_degrees()));
        }
        Ok(curve)
    }

    /// Means of the pixels in bins by their distance from the edge.
    pub fn edge_spread(&self, curve: &Curve) -> Result<Vec<f64>, EdgeError> {
        let last = self.width as f64 - 1.0;
        let margin = (0..self.height).map(|y| {
            let at = curve.at(y);
            at.min(last - at) * curve.across(y)
        });
        let margin = margin.fold(f64::INFINITY, f64::min);
        if margin < LEAST_MARGIN_PX {
            return Err(EdgeError::AtBorder(margin));
        }
        let half = (BINS * margin).floor();
        let mut sums = vec![[0.0, 0.0]; 2 * half as usize];
        // As many rows as cross whole columns, so that the pixels are spread evenly over the bins.
        let per_column = 1.0 / curve.slope.abs();
        let rows = ((self.height as f64 / per_column).floor() * per_column).round() as usize;
        let first = (self.height - rows.min(self.height)) / 2;
        for y in first..first + rows.min(self.height) {
            let (at, across) = (curve.at(y), curve.across(y));
            for (x, value) in self.row(y).iter().enumerate() {
                let bin = ((x as f64 - at) * across * BINS + half).floor();
                if bin >= 0.0
                    && let Some(sum) = sums.get_mut(bin as usize)
                {
                    *sum = [sum[0] + value, sum[1] + 1.0];
                }
            }
        }
        let means = sums.iter().map(|[sum, count]| (*count > 0.0).then(|| sum / count));
        means.collect::<Option<_>>().ok_or(EdgeError::Gaps)
    }
}

/// Centroid of a row's derivative, in a window about a position.
fn centroid(row: &[f64], about: f64) -> Option<f64> {
    let half = about.min(row.len() as f64 - 1.0 - about);
    let (mut sum, mut moment) = (0.0, 0.0);
    for (i, pair) in row.windows(3).enumerate() {
        let x = i as f64 + 1.0;
        let fraction = (x - about) / half;
        if fraction.abs() < 1.0 {
            let window = 0.54 + 0.46 * (std::f64::consts::PI * fraction).cos();
            let slope = window * (pair[2] - pair[0]);
            sum += slope;
            moment += slope * (x - about);
        }
    }
    let position = about + moment / sum;
    position.is_finite().then_some(position)
}

/// Least squares.
fn parabola(positions: &[f64], middle_row: f64) -> Option<Curve> {
    let scale = middle_row.max(1.0);
    let (mut normal, mut right) = (DMat3::ZERO, DVec3::ZERO);
    for (row, position) in positions.iter().enumerate() {
        let t = (row as f64 - middle_row) / scale;
        let terms = DVec3::new(1.0, t, t * t);
        normal += DMat3::from_cols(terms.x * terms, terms.y * terms, terms.z * terms);
        right += *position * terms;
    }
    let fit = normal.inverse() * right;
    fit.is_finite().then(|| Curve {
        middle: fit.x,
        slope: fit.y / scale,
        bend: fit.z / (scale * scale),
        middle_row,
    })
}
