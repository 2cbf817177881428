//! Kannala-Brandt: the equidistant polynomial of OpenCV's fisheye module.

use glam::{DMat2, DVec2};

use super::fold::{FoldCurve, MAX_FIELD_RAD, first_irregular_angle};
use super::radial_table::RadialTable;

/// With `theta = atan(r)`, `r = |(u, v)|`: `theta_d = theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4
/// theta^8)`, distorted = `(u, v) theta_d / r`.
///
/// Angles off axis range from 0 to 89 degrees (`MAX_FIELD_RAD`) or to where theta_d stops growing. An ideal
/// *plane* holds no more, so points that a wider fisheye images outside have no ideal point.
#[derive(Clone, Debug, PartialEq)]
pub struct KannalaBrandt {
    /// `k1 k2 k3 k4`.
    pub(super) coefficients: [f64; 4],
    pub(super) fold: FoldCurve,
    /// `theta / theta_d` against theta_d.
    pub(super) table: RadialTable,
    /// Largest angle of the principal branch.
    theta_max: f64,
}

impl KannalaBrandt {
    pub(super) fn new(coefficients: [f64; 4], reach: f64) -> Self {
        let fold_angle = first_irregular_angle(|theta| [theta_d_slope(&coefficients, theta), 1.0]);
        let theta_max = fold_angle.unwrap_or(MAX_FIELD_RAD);
        let table = RadialTable::new(theta_max, reach, |theta| theta_d(&coefficients, theta));
        let fold = FoldCurve::new(|_| fold_angle.map(f64::tan), true, |ideal| distort(&coefficients, ideal));
        Self { coefficients, fold, table, theta_max }
    }

    /// Largest angle off axis of the principal branch, radians.
    pub fn theta_max_rad(&self) -> f64 {
        self.theta_max
    }

    /// Distorted radius of that angle, a bound on the branch.
    pub fn distorted_max(&self) -> f64 {
        theta_d(&self.coefficients, self.theta_max)
    }

    /// Forward; the formula is that of the type.
    pub fn distort(&self, ideal: DVec2) -> DVec2 {
        distort(&self.coefficients, ideal)
    }

    /// `t I + (m - t) e e^T` with `e = (u, v)/r`, the tangential magnification `t = theta_d / r` and the
    /// meridional one `m = theta_d'(theta) / (1 + r^2)`.
    pub fn jacobian(&self, ideal: DVec2) -> DMat2 {
        let r = ideal.length();
        if r < 1e-9 {
            return DMat2::IDENTITY;
        }
        let theta = r.atan();
        let tangential = theta_d(&self.coefficients, theta) / r;
        let meridional = theta_d_slope(&self.coefficients, theta) / (1.0 + r * r);
        let e = ideal / r;
        let outer = DMat2::from_cols(e * e.x, e * e.y);
        DMat2::IDENTITY * tangential + outer * (meridional - tangential)
    }

    /// Bracketed Newton iteration in theta, started from the table; `None` beyond the largest angle.
    pub fn undistort(&self, distorted: DVec2) -> Option<DVec2> {
        let radius = distorted.length();
        if !distorted.is_finite() || radius > self.distorted_max() {
            return None;
        }
        if radius < 1e-12 {
            return Some(distorted);
        }
        let (mut low, mut high) = (0.0, self.theta_max);
        let mut theta = (radius * self.table.ratio(radius)).clamp(low, high);
        for _ in 0..60 {
            let error = theta_d(&self.coefficients, theta) - radius;
            if error > 0.0 {
                high = theta;
            } else {
                low = theta;
            }
            let newton = theta - error / theta_d_slope(&self.coefficients, theta);
            // `>=` and `<=`, not strict: once a bracket end is the root itself, a strict test would bisect
            // away from it.
            let next = if newton >= low && newton <= high { newton } else { 0.5 * (low + high) };
            let moved = (next - theta).abs();
            theta = next;
            if moved <= 2e-16 * theta {
                break;
            }
        }
        Some(distorted * (theta.tan() / radius))
    }
}

fn theta_d([k1, k2, k3, k4]: &[f64; 4], theta: f64) -> f64 {
    let t2 = theta * theta;
    theta * (1.0 + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * k4))))
}

fn theta_d_slope([k1, k2, k3, k4]: &[f64; 4], theta: f64) -> f64 {
    let t2 = theta * theta;
    1.0 + t2 * (3.0 * k1 + t2 * (5.0 * k2 + t2 * (7.0 * k3 + t2 * 9.0 * k4)))
}

fn distort(coefficients: &[f64; 4], ideal: DVec2) -> DVec2 {
    let r = ideal.length();
    // theta_d / r tends to 1 like 1 - r^2/3: below 1e-9 it is 1 to the last bit.
    if r < 1e-9 { ideal } else { ideal * (theta_d(coefficients, r.atan()) / r) }
}
