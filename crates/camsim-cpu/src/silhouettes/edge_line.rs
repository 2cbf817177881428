//! Borders of two surfaces within a fine pixel, in single precision: twin of [`camsim_core::temporal::edge_lines`].

#![expect(clippy::needless_range_loop, reason = "numbers of one sample have one index in all arrays")]

use glam::{Mat3, Vec2, Vec3};

use super::DepthPlane;
use crate::simd::{
    lanes::{fast_max, fast_min},
    vectors::{VECTOR_LANES, widest},
};

/// Half lengths along which the samples must agree on a line, fine pixels, in the order in which they are tried.
const REACH: [f32; 2] = [4.0, 2.0];
/// Samples within this distance of the line take part in the fit, fine pixels.
const BAND: f32 = 0.7;
/// Largest distance of a sample on the wrong side of the line.
const SLACK: f32 = 0.05;
/// Lines farther from the centre of the pixel than this do not cross it.
const MAX_OFFSET: f32 = 0.72;
/// Ridge terms of the fit: of the normal, and of the offset.
const RIDGE: [f32; 2] = [0.03, 1e-4];
const MAX_MEMBERS: usize = 64;
/// Samples that differ by less than this, relative to the nearest, belong to one surface.
const ONE_SURFACE: f32 = 0.02;

/// Positions of a fine pixel's samples, from its centre.
const OFFSETS: [Vec2; 4] =
    [Vec2::new(-0.125, -0.375), Vec2::new(0.375, -0.125), Vec2::new(-0.375, 0.125), Vec2::new(0.125, 0.375)];

/// A border: the nearer surface is where `normal · x > offset_px`, with x in fine pixels from the centre of the
/// fine pixel.
#[derive(Clone, Copy, Debug)]
pub(super) struct EdgeLine {
    pub normal: Vec2,
    pub offset_px: f32,
    /// Depth that separates the two surfaces, in the unit of the samples.
    pub threshold: f32,
}

/// Samples of a fit, in vectors.
pub(super) struct Members {
    x: [f32; MAX_MEMBERS],
    y: [f32; MAX_MEMBERS],
    /// 1 on the nearer surface, else 0.
    nearer: [f32; MAX_MEMBERS],
    count: usize,
}

impl Members {
    pub fn new() -> Self {
        let zeros = [0.0; MAX_MEMBERS];
        Self { x: zeros, y: zeros, nearer: zeros, count: 0 }
    }

    #[inline]
    fn add(&mut self, at_px: Vec2, is_nearer: bool) {
        if self.count < MAX_MEMBERS {
            (self.x[self.count], self.y[self.count]) = (at_px.x, at_px.y);
            self.nearer[self.count] = f32::from(u8::from(is_nearer));
            self.count += 1;
        }
    }

    /// Normal and offset after `steps` steps of Newton's method; `None` without a direction.
    #[inline(always)]
    fn fitted(&self, steps: u32) -> Option<(Vec2, f32)> {
        let mut line = Vec3::ZERO;
        for _ in 0..steps {
            line = self.step(line);
        }
        let length = line.truncate().length();
        (length > 1e-9 && line.is_finite()).then(|| (line.truncate() / length, line.z / length))
    }

    /// One step of Newton's method for the logistic regression of a line n x = c, with unknowns (n, c).
    #[inline(always)]
    fn step(&self, line: Vec3) -> Vec3 {
        // Of the gradient, then of the matrix: xx, xy, x, yy, y, 1.
        let mut sums = [[0.0_f32; VECTOR_LANES]; 9];
        for first in (0..self.count).step_by(VECTOR_LANES) {
            for lane in 0..VECTOR_LANES {
                let i = first + lane;
                let (x, y) = (self.x[i], self.y[i]);
                let fraction = 1.0 / (1.0 + exp(line.z - line.x * x - line.y * y));
                let is_member = if i < self.count { 1.0 } else { 0.0 };
                let off = (fraction - self.nearer[i]) * is_member;
                let weight = fraction * (1.0 - fraction) * is_member;
                sums[0][lane] += off * x;
                sums[1][lane] += off * y;
                sums[2][lane] -= off;
                sums[3][lane] += weight * x * x;
                sums[4][lane] += weight * x * y;
                sums[5][lane] -= weight * x;
                sums[6][lane] += weight * y * y;
                sums[7][lane] -= weight * y;
                sums[8][lane] += weight;
            }
        }
        let [gx, gy, gc, xx, xy, xc, yy, yc, cc] = sums.map(|sum| sum.iter().sum::<f32>());
        let gradient = Vec3::new(gx + RIDGE[0] * line.x, gy + RIDGE[0] * line.y, gc);
        let matrix =
            Mat3::from_cols_array(&[xx + RIDGE[0], xy, xc, xy, yy + RIDGE[0], yc, xc, yc, cc + RIDGE[1]]);
        line - matrix.inverse() * gradient
    }

    /// Whether every sample lies on its own side, with at least one on each.
    fn are_separated(&self, normal: Vec2, offset_px: f32) -> bool {
        let mut nearer = 0.0;
        for i in 0..self.count {
            let distance = normal.x * self.x[i] + normal.y * self.y[i] - offset_px;
            if (2.0 * self.nearer[i] - 1.0) * distance <= -SLACK {
                return false;
            }
            nearer += self.nearer[i];
        }
        nearer > 0.0 && nearer < self.count as f32
    }
}

/// e to a power within +-87, with a relative error of at most 1e-5 (`the_exponential`).
#[inline(always)]
fn exp(power: f32) -> f32 {
    /// Adding it rounds to a whole number, which is then in the lowest bits.
    const ROUND: f32 = (3_u32 << 22) as f32;
    let log2 = fast_min(fast_max(power * std::f32::consts::LOG2_E, -125.0), 125.0);
    let rounded = log2 + ROUND;
    let t = (log2 - (rounded - ROUND)) * std::f32::consts::LN_2;
    let series = 1.0 + t * (1.0 + t * (0.5 + t * (1.0 / 6.0 + t * (1.0 / 24.0 + t * (1.0 / 120.0)))));
    series * f32::from_bits((rounded.to_bits().wrapping_sub(ROUND.to_bits()).wrapping_add(127)) << 23)
}

/// The border through a fine pixel. `None` if there is one surface, more than two, or a corner. `members` is
/// overwritten.
pub(super) fn edge_line(
    samples: &DepthPlane<'_>,
    [x, y]: [i64; 2],
    size_px: [i64; 2],
    members: &mut Members,
) -> Option<EdgeLine> {
    // The samples of the fine pixels around are rows of the plane.
    let first = [x, y].map(|at| 2 * (at - 1).max(0) as usize);
    let last = [(x, size_px[0]), (y, size_px[1])].map(|(at, size)| 2 * (at + 2).min(size) as usize);
    let (mut low, mut high) = (f32::INFINITY, 0.0);
    for row in first[1]..last[1] {
        for &w in &samples.values[row * samples.stride..][first[0]..last[0]] {
            (low, high) = (fast_min(w, low), fast_max(w, high));
        }
    }
    if low >= (1.0 - ONE_SURFACE) * high || high == 0.0 {
        return None;
    }
    let threshold = 0.5 * (low + high);
    let each_sample = |[right, down]: [i64; 2], visit: &mut dyn FnMut(Vec2, bool)| {
        let at = [x + right, y + down];
        if at[0] >= 0 && at[1] >= 0 && at[0] < size_px[0] && at[1] < size_px[1] {
            let position = Vec2::new(right as f32, down as f32);
            for (k, offset) in OFFSETS.into_iter().enumerate() {
                visit(position + offset, samples.sample(at, k) > threshold);
            }
        }
    };
    let fit = |members: &Members, steps: u32| widest!(_vectors => members.fitted(steps));
    members.count = 0;
    (0..9).for_each(|k| each_sample([k % 3 - 1, k / 3 - 1], &mut |at_px, nearer| members.add(at_px, nearer)));
    let (normal, offset_px) = fit(members, 3).filter(|line| line.1.abs() <= 1.0)?;
    let along = |reach: f32| {
        members.count = 0;
        each_along(normal, offset_px, reach as i64, |step| {
            each_sample(step, &mut |at_px, nearer| {
                let is_beside =
                    (normal.dot(at_px) - offset_px).abs() < BAND && normal.perp_dot(at_px).abs() < reach;
                if is_beside || step == [0, 0] {
                    members.add(at_px, nearer);
                }
            });
        });
        let (normal, offset_px) = fit(members, 4)?;
        members.are_separated(normal, offset_px).then_some(EdgeLine { normal, offset_px, threshold })
    };
    REACH.into_iter().find_map(along).filter(|line| line.offset_px.abs() < MAX_OFFSET)
}

/// Fine pixels along a line, and one on each side of it.
fn each_along(normal: Vec2, offset_px: f32, last: i64, mut visit: impl FnMut([i64; 2])) {
    let is_flat = normal.y.abs() >= normal.x.abs();
    let major = if is_flat { normal } else { Vec2::new(normal.y, normal.x) };
    for along in -last..=last {
        let middle = ((offset_px - major.x * along as f32) / major.y).round() as i64;
        for across in middle - 1..=middle + 1 {
            visit(if is_flat { [along, across] } else { [across, along] });
        }
    }
}

#[cfg(test)]
mod tests {
    use camsim_core::temporal::{SAMPLE_POSITIONS, edge_lines};
    use glam::DVec2;

    use super::*;

    #[test]
    fn the_exponential() {
        for k in -8000..=8000 {
            let power = k as f32 * 0.01;
            let exact = f64::from(power).exp();
            assert!((f64::from(exp(power)) / exact - 1.0).abs() < 1e-5, "{power}: {} {exact}", exp(power));
        }
    }

    /// Straight borders, strips and corners at random, also at the border of the frame.
    #[test]
    fn borders_are_those_of_the_twin() {
        const SIDE: i64 = 13;
        let (mut lines, mut without, mut differing) = (0, 0, 0);
        for k in 0..3000 {
            let fraction = |step: f64| (f64::from(k) * step).fract();
            let [one, other] = [0.754_878, 0.569_841].map(|step| DVec2::from_angle(6.3 * fraction(step)));
            let (offset, kind) = (1.3 * fraction(0.618_034) - 0.65, k % 5);
            let texel = if k % 7 == 0 { [0, i64::from(k) % SIDE] } else { [SIDE / 2; 2] };
            let depth = |at: [i64; 2], sample: usize| {
                let at_px = DVec2::new((at[0] - texel[0]) as f64, (at[1] - texel[1]) as f64)
                    + SAMPLE_POSITIONS[sample];
                let is_nearer = match kind {
                    0 => one.dot(at_px).abs() < 0.4,
                    1 => one.dot(at_px) > offset && other.dot(at_px) > 0.0,
                    _ => one.dot(at_px) > offset,
                };
                (if is_nearer { 1.0 / 40.0 } else { 1.0 / 60.0_f32 }) * (1.0 + 0.001 * at_px.x as f32)
            };
            let mut values = vec![0.0; (4 * SIDE * SIDE) as usize];
            for i in 0..4 * SIDE * SIDE {
                let [x, y] = [i % (2 * SIDE), i / (2 * SIDE)];
                values[i as usize] = depth([x / 2, y / 2], (x % 2 + 2 * (y % 2)) as usize);
            }
            let plane = DepthPlane { values: &values, stride: 2 * SIDE as usize, per_m: 1.0 };
            let found = edge_line(&plane, texel, [SIDE; 2], &mut Members::new());
            let exact = edge_lines::edge_line(texel, [SIDE; 2], &|at, sample| f64::from(depth(at, sample)));
            match (found, exact) {
                (Some(found), Some(exact)) => {
                    lines += 1;
                    let off = (found.normal.as_dvec2() - exact.normal).length()
                        + (f64::from(found.offset_px) - exact.offset_px).abs();
                    assert!(
                        off < 1e-3 && (f64::from(found.threshold) - exact.threshold).abs() < 1e-6,
                        "{k}: {off}"
                    );
                }
                (None, None) => without += 1,
                // A sample at the slack may be on either side of it.
                _ => differing += 1,
            }
        }
        assert!(lines > 1000 && without > 300 && differing < 3, "{lines} {without} {differing}");
    }
}
