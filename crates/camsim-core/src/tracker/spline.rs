//! Spline planner. The whole log is known, so the reference can be the closest motion that the plant can
//! follow.
//!
//! The acceleration of a uniform cubic B-spline is linear between ticks and does not jump. Its coefficients c
//! minimise
//!
//! ```text
//! sum_k |(c_(k-1) + 4 c_k + c_(k+1))/6 - r_k|^2 + sum_k lambda_k |(c_(k-1) - 2 c_k + c_(k+1))/h^2|^2
//! ```
//!
//! where r is the log at the ticks. lambda starts as a constant and is raised where the
//! acceleration exceeds its limit, until it does so nowhere. The normal equations have five diagonals.
//! Attitude is treated in the same way with rotation vectors relative to the smoothed log, where they are
//! small.

use glam::DVec3;

use super::{ResolvedLimits, reference::Reference};
use crate::trajectory::so3;

/// Time constant of the unconstrained fit, lambda = tau^4. With it, a position quantum of a GNSS log (0.11 m)
/// stays below 2 g.
const TIME_CONSTANT_S: f64 = 0.05;
/// Fraction of the acceleration limit used in planning; the rest absorbs the coupling of rotation axes.
const PLANNED_SHARE: f64 = 0.97;
/// Most passes; the plant cuts what still exceeds the limits then.
const MAX_PASSES: usize = 20;

/// Motion near `raw` within the limits, as a correction of `smoothed`.
pub(crate) fn plan_spline(raw: &Reference, smoothed: Reference, limits: &ResolvedLimits) -> Reference {
    let h2 = raw.step_s * raw.step_s;
    let position = || {
        let residual: Vec<DVec3> = raw
            .position_ned_m
            .iter()
            .zip(&smoothed.position_ned_m)
            .map(|(log, smooth)| *log - *smooth)
            .collect();
        let second = second_differences(&smoothed.position_ned_m, |from, to| *to - *from);
        corrections(&residual, &second, limits.max_acceleration_m_s2 * h2, raw.step_s)
    };
    let attitude = || {
        let residual: Vec<DVec3> = raw
            .ned_from_body
            .iter()
            .zip(&smoothed.ned_from_body)
            .map(|(log, smooth)| so3::log(smooth.inverse() * *log))
            .collect();
        let second = second_differences(&smoothed.ned_from_body, |from, to| so3::log(from.inverse() * *to));
        corrections(&residual, &second, limits.max_angular_acceleration_rad_s2 * h2, raw.step_s)
    };
    let (shifts, turns) = rayon::join(position, attitude);
    let planned = Reference {
        curve: smoothed.curve,
        step_s: smoothed.step_s,
        position_ned_m: smoothed.position_ned_m.iter().zip(&shifts).map(|(at, shift)| *at + *shift).collect(),
        ned_from_body: smoothed
            .ned_from_body
            .iter()
            .zip(&turns)
            .map(|(at, turn)| (*at * so3::exp(*turn)).normalize())
            .collect(),
    };
    planned.with_resting_ends()
}

/// `difference(k, k+1) - difference(k-1, k)` for inner k, zero at both ends.
fn second_differences<T>(values: &[T], difference: impl Fn(&T, &T) -> DVec3) -> Vec<DVec3> {
    let mut second = vec![DVec3::ZERO; values.len()];
    let mut before = None;
    for (k, pair) in values.windows(2).enumerate() {
        let after = difference(&pair[0], &pair[1]);
        if let Some(before) = before {
            second[k] = after - before;
        }
        before = Some(after);
    }
    second
}

/// Corrections d of a smooth base, such that base + d is near the log. `residual` = log - base, `second` =
/// second differences of the base, `limit` applies to the second differences of the sum.
fn corrections(residual: &[DVec3], second: &[DVec3], limit: f64, step_s: f64) -> Vec<DVec3> {
    let count = residual.len();
    let mut weights = vec![(TIME_CONSTANT_S / step_s).powi(4); count];
    let mut fit = BandedFit::new(count);
    let planned_limit = PLANNED_SHARE * limit;
    for _ in 0..MAX_PASSES {
        fit.solve(residual, second, &weights);
        let mut within = true;
        for k in 1..count.saturating_sub(1) {
            let sum = second[k] + fit.solution[k - 1] - 2.0 * fit.solution[k] + fit.solution[k + 1];
            let excess2 = sum.length_squared() / (planned_limit * planned_limit);
            if excess2 > 1.0 {
                within &= excess2 < (1.0 / (PLANNED_SHARE * PLANNED_SHARE));
                // A faster growth needs as many passes and smooths more than necessary (0.12 m instead of
                // 0.10 m on a real flight).
                weights[k] *= excess2;
            }
        }
        if within {
            break;
        }
    }
    fit.solution
}

/// Least squares with five diagonals, solved by L D L^T; reused between passes.
struct BandedFit {
    diagonal: Vec<f64>,
    first: Vec<f64>,
    second: Vec<f64>,
    solution: Vec<DVec3>,
}

impl BandedFit {
    fn new(count: usize) -> Self {
        Self {
            diagonal: vec![0.0; count],
            first: vec![0.0; count],
            second: vec![0.0; count],
            solution: vec![DVec3::ZERO; count],
        }
    }

    /// Adds `weight |stencil . d - value|^2` centred at `k`.
    fn add(&mut self, k: usize, stencil: [f64; 3], weight: f64, value: DVec3) {
        let [a, b, c] = stencil;
        self.diagonal[k - 1] += weight * a * a;
        self.diagonal[k] += weight * b * b;
        self.diagonal[k + 1] += weight * c * c;
        self.first[k] += weight * a * b;
        self.first[k + 1] += weight * b * c;
        self.second[k + 1] += weight * a * c;
        self.solution[k - 1] += value * (weight * a);
        self.solution[k] += value * (weight * b);
        self.solution[k + 1] += value * (weight * c);
    }

    fn solve(&mut self, residual: &[DVec3], second: &[DVec3], weights: &[f64]) {
        self.assemble(residual, second, weights);
        let count = self.diagonal.len();
        // In place: `first[i]`, `second[i]` become L(i, i-1), L(i, i-2).
        for i in 0..count {
            if i >= 2 {
                let below = self.second[i];
                self.second[i] = below / self.diagonal[i - 2];
                self.diagonal[i] -= self.second[i] * below;
                self.first[i] -= below * self.first[i - 1];
                self.solution[i] = self.solution[i] - self.second[i] * self.solution[i - 2];
            }
            if i >= 1 {
                let below = self.first[i];
                self.first[i] = below / self.diagonal[i - 1];
                self.diagonal[i] -= self.first[i] * below;
                self.solution[i] = self.solution[i] - self.first[i] * self.solution[i - 1];
            }
        }
        for i in (0..count).rev() {
            let mut value = self.solution[i] / self.diagonal[i];
            if i + 1 < count {
                value -= self.first[i + 1] * self.solution[i + 1];
            }
            if i + 2 < count {
                value -= self.second[i + 2] * self.solution[i + 2];
            }
            self.solution[i] = value;
        }
    }

    fn assemble(&mut self, residual: &[DVec3], second: &[DVec3], weights: &[f64]) {
        let count = residual.len();
        self.diagonal.fill(0.0);
        self.first.fill(0.0);
        self.second.fill(0.0);
        self.solution.fill(DVec3::ZERO);
        for k in [0, count - 1] {
            self.diagonal[k] += 1.0;
            self.solution[k] += residual[k];
        }
        for k in 1..count.saturating_sub(1) {
            // The base's own value of the spline at a tick is base + second/6.
            self.add(k, [1.0 / 6.0, 2.0 / 3.0, 1.0 / 6.0], 1.0, residual[k] - second[k] / 6.0);
            self.add(k, [1.0, -2.0, 1.0], weights[k], -second[k]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(k: usize) -> DVec3 {
        let t = k as f64;
        DVec3::new((0.7 * t).sin(), (0.31 * t).cos() + 0.1 * t, if k > 20 { 5.0 } else { 0.0 })
    }

    #[test]
    fn banded_solution_is_the_minimum() {
        let count = 40;
        let residual: Vec<DVec3> = (0..count).map(wave).collect();
        let second: Vec<DVec3> = (0..count).map(|k| 0.1 * wave(3 * k)).collect();
        let weights: Vec<f64> = (0..count).map(|k| 1.0 + 50.0 * (k % 7) as f64).collect();
        let mut fit = BandedFit::new(count);
        fit.solve(&residual, &second, &weights);
        let cost = |d: &[DVec3]| {
            let inner: f64 = (1..count - 1)
                .map(|k| {
                    let value = (d[k - 1] + 4.0 * d[k] + d[k + 1] + second[k]) / 6.0 - residual[k];
                    let bend = d[k - 1] - 2.0 * d[k] + d[k + 1] + second[k];
                    value.length_squared() + weights[k] * bend.length_squared()
                })
                .sum();
            inner
                + (d[0] - residual[0]).length_squared()
                + (d[count - 1] - residual[count - 1]).length_squared()
        };
        let least = cost(&fit.solution);
        for k in 0..count {
            for axis in DVec3::AXES {
                let slope = [1e-3, -1e-3].map(|step| {
                    let mut moved = fit.solution.clone();
                    moved[k] += axis * step;
                    cost(&moved) - least
                });
                // A quadratic rises equally on both sides of its minimum, up to rounding of a cost of order
                // 100.
                assert!(slope[0] > 0.0 && (slope[0] - slope[1]).abs() < 1e-10, "{k}: {slope:?}");
            }
        }
    }

    #[test]
    fn corrections_keep_the_acceleration_limit() {
        // A step of 5 m in a 400 Hz log, limit 19.6 m/s^2.
        let (step_s, limit) = (1.0 / 400.0, 19.6 / 160_000.0);
        let residual: Vec<DVec3> =
            (0..2000).map(|k| if k < 1000 { DVec3::ZERO } else { DVec3::Y * 5.0 }).collect();
        let second = vec![DVec3::ZERO; residual.len()];
        let d = corrections(&residual, &second, limit, step_s);
        let used =
            second_differences(&d, |from, to| *to - *from).iter().map(|a| a.length()).fold(0.0, f64::max);
        assert!(used <= limit, "{}", used / limit);
        assert!(d[100].length() < 0.01 && (d[1900] - DVec3::Y * 5.0).length() < 0.01);
    }
}
