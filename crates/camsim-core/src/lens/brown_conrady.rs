//! Brown-Conrady, polynomial or rational, with tangential terms: the paper's eqs. 8 and 9, OpenCV's default
//! model.

use glam::{DMat2, DVec2, DVec3};

use super::LensModel;
use super::bulk::PlaneFormula;
use super::class::LensClass;
use super::facts::{ModelFacts, Shape};
use super::fold::{FoldCurve, MAX_FIELD_RAD, first_irregular_angle};
use super::radial_table::RadialTable;

pub(super) const FACTS: ModelFacts = ModelFacts {
    coefficients: &["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"],
    fix: "thin-prism and tilt terms are those of model \"brown-conrady-prism\"",
    shape: |_| Shape::BrownConrady,
    foreign: &[
        "radtan",
        "radialtangential",
        "plumbbob",
        "radtan5",
        "rationalpolynomial",
        "rational",
        "radtan8",
    ],
    foreign_counts: &[0, 2, 4, 5, 8],
    point: "`(u, v) N/D + tangential`: eqs. 8 and 9 of the paper",
    authority: "OpenCV, 4, 5 or 8 coefficients; ROS `plumb_bob`, `rational_polynomial`; COLMAP `OPENCV`, `FULL_OPENCV`",
    field: "< 178",
    ..ModelFacts::NONE
};

/// Most Newton steps of the f64 inverse. Near a fold the root is nearly double and each step only halves the
/// error: 60 reach the last bit.
const MAX_STEPS: usize = 60;

/// Steps without real progress after which the iteration is given up.
const MAX_STALLS: u32 = 5;

/// Largest residual of a solution, in units of the focal length (relative beyond 1).
const MAX_RESIDUAL: f64 = 1e-9;

/// Starts are at most this fraction of the fold radius, where the Jacobian is safely regular.
const START_SHARE_OF_FOLD: f64 = 0.95;

/// With `r^2 = u^2 + v^2`:
///
/// `d = (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6)`,
/// `x = u d + 2 p1 u v + p2 (r^2 + 2 u^2)`, `y = v d + p1 (r^2 + 2 v^2) + 2 p2 u v`.
///
/// (The paper defines r as u^2 + v^2 in eq. 8 and squares it again: a misprint.)
#[derive(Clone, Debug, PartialEq)]
pub struct BrownConrady {
    /// `k1 k2 p1 p2 k3 k4 k5 k6`.
    pub(super) coefficients: [f64; 8],
    pub(super) fold: FoldCurve,
    pub(super) table: RadialTable,
}

impl BrownConrady {
    pub(super) fn new(coefficients: [f64; 8], reach: f64) -> Self {
        let formula = Formula::new(&coefficients);
        let radius_of_ray = |phi: f64| {
            let direction = DVec2::from_angle(phi);
            first_irregular_angle(|angle| formula.margins(direction * angle.tan())).map(f64::tan)
        };
        let radial_only = formula.p1 == 0.0 && formula.p2 == 0.0;
        let fold = FoldCurve::new(radius_of_ray, radial_only, |ideal| formula.distort(ideal));
        // The table covers the radial part alone, whose fold differs slightly from that of the whole model.
        let radial = Formula { p1: 0.0, p2: 0.0, ..formula };
        let radial_fold = first_irregular_angle(|angle| radial.margins(DVec2::new(angle.tan(), 0.0)))
            .unwrap_or(MAX_FIELD_RAD)
            .tan();
        let table = RadialTable::new(radial_fold, reach, 1.0, |r| radial.distort(DVec2::new(r, 0.0)).x);
        Self { coefficients, fold, table }
    }

    fn newton(&self, distorted: DVec2, start: DVec2) -> Option<DVec2> {
        let formula = Formula::new(&self.coefficients);
        let fold_radius = |ideal: DVec2| self.fold.radius(ideal.y.atan2(ideal.x));
        let start_limit = START_SHARE_OF_FOLD * fold_radius(start);
        let mut ideal =
            if start.length() > start_limit { start.normalize_or_zero() * start_limit } else { start };
        let mut error = formula.distort(ideal) - distorted;
        let mut stalls = 0;
        for _ in 0..MAX_STEPS {
            let jacobian = formula.jacobian(ideal);
            // J is symmetric: J^-1 e = adj(J) e / det.
            let (a, b, c) = (jacobian.x_axis.x, jacobian.x_axis.y, jacobian.y_axis.y);
            let det = (a * c - b * b).max(1e-12);
            let mut step = DVec2::new(b * error.y - c * error.x, b * error.x - a * error.y) / det;
            let mut next = self.inside(ideal, ideal + step);
            let mut next_error = formula.distort(next) - distorted;
            for _ in 0..20 {
                if next_error.length_squared() <= error.length_squared() {
                    break;
                }
                step *= 0.5;
                next = self.inside(ideal, ideal + step);
                next_error = formula.distort(next) - distorted;
            }
            let (before, after) = (error.length_squared(), next_error.length_squared());
            // Not even a tiny step helps: the branch comes no nearer, or the last bit is reached.
            if after >= before {
                break;
            }
            (ideal, error) = (next, next_error);
            // A root, double or not, is approached by at least a factor of four per step; slower progress
            // means that the iteration slides along the fold.
            stalls = if after > 0.9 * before { stalls + 1 } else { 0 };
            if stalls == MAX_STALLS {
                break;
            }
        }
        let good = error.length() <= MAX_RESIDUAL * (1.0 + distorted.length())
            && ideal.length() < fold_radius(ideal)
            && formula.jacobian(ideal).determinant() > 0.0;
        good.then_some(ideal)
    }

    /// `to`, or if that is outside of the fold, the point in its direction midway between the radius of
    /// `from` and the fold.
    fn inside(&self, from: DVec2, to: DVec2) -> DVec2 {
        let fold_radius = self.fold.radius(to.y.atan2(to.x));
        if to.length() < fold_radius {
            return to;
        }
        to.normalize_or_zero() * (0.5 * (from.length().min(fold_radius) + fold_radius))
    }
}

impl LensClass for BrownConrady {
    fn model(&self) -> LensModel {
        LensModel::BrownConrady
    }

    fn coefficients(&self) -> &[f64] {
        &self.coefficients
    }

    fn distort(&self, ideal: DVec2) -> DVec2 {
        Formula::new(&self.coefficients).distort(ideal)
    }

    /// `[[a, b], [b, c]]` with `a = d + s u^2 + 2 p1 v + 6 p2 u`, `b = s u v + 2 p1 u + 2 p2 v`, `c = d + s
    /// v^2 + 6 p1 v + 2 p2 u`, where `s = 2 dd/d(r^2) = 2 (N' - D' d) / D`.
    fn jacobian(&self, ideal: DVec2) -> DMat2 {
        Formula::new(&self.coefficients).jacobian(ideal)
    }

    /// Guarded Newton iteration. It starts from the radial table; each step is pulled back where it would
    /// leave the principal branch, and halved where the residual grew. A result must reproduce the distorted
    /// point, lie inside the fold and have a positive determinant. On a branch whose border is a simple curve
    /// these conditions exclude every wrong root.
    fn undistort(&self, distorted: DVec2) -> Option<DVec2> {
        let radius = distorted.length();
        if !distorted.is_finite() || radius > self.fold.distorted_max() {
            return None;
        }
        let from_table = distorted * self.table.ratio(radius);
        // The second start is for strong tangential terms, where the radial table is a poor guess.
        self.newton(distorted, from_table).or_else(|| self.newton(distorted, 0.5 * distorted))
    }

    fn angle_max_rad(&self) -> f64 {
        self.fold.range().1.atan()
    }

    fn fold_curve(&self) -> Option<&FoldCurve> {
        Some(&self.fold)
    }

    fn radial_table(&self) -> Option<&RadialTable> {
        Some(&self.table)
    }

    fn distorted_max(&self) -> f64 {
        self.fold.distorted_max()
    }
}

/// The formula without a domain.
#[derive(Clone, Copy, Debug)]
pub(super) struct Formula {
    k1: f64,
    k2: f64,
    k3: f64,
    k4: f64,
    k5: f64,
    k6: f64,
    p1: f64,
    p2: f64,
}

impl Formula {
    pub(super) fn new(&[k1, k2, p1, p2, k3, k4, k5, k6]: &[f64; 8]) -> Self {
        Self { k1, k2, k3, k4, k5, k6, p1, p2 }
    }

    #[inline(always)]
    fn numerator(&self, r2: f64) -> f64 {
        1.0 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3))
    }

    #[inline(always)]
    pub(super) fn denominator(&self, r2: f64) -> f64 {
        1.0 + r2 * (self.k4 + r2 * (self.k5 + r2 * self.k6))
    }

    #[inline(always)]
    pub(super) fn distort(&self, DVec2 { x: u, y: v }: DVec2) -> DVec2 {
        let r2 = u * u + v * v;
        let d = self.numerator(r2) / self.denominator(r2);
        DVec2::new(
            u * d + 2.0 * self.p1 * u * v + self.p2 * (r2 + 2.0 * u * u),
            v * d + self.p1 * (r2 + 2.0 * v * v) + 2.0 * self.p2 * u * v,
        )
    }

    #[inline(always)]
    pub(super) fn jacobian(&self, DVec2 { x: u, y: v }: DVec2) -> DMat2 {
        let r2 = u * u + v * v;
        let denominator = self.denominator(r2);
        let d = self.numerator(r2) / denominator;
        let numerator_slope = self.k1 + r2 * (2.0 * self.k2 + r2 * 3.0 * self.k3);
        let denominator_slope = self.k4 + r2 * (2.0 * self.k5 + r2 * 3.0 * self.k6);
        let s = 2.0 * (numerator_slope - denominator_slope * d) / denominator;
        let a = d + s * u * u + 2.0 * self.p1 * v + 6.0 * self.p2 * u;
        let b = s * u * v + 2.0 * self.p1 * u + 2.0 * self.p2 * v;
        let c = d + s * v * v + 6.0 * self.p1 * v + 2.0 * self.p2 * u;
        DMat2::from_cols(DVec2::new(a, b), DVec2::new(b, c))
    }

    /// Quantities that are positive on the principal branch: the determinant (with the sign of the trace, so
    /// that a second sheet with two negative eigenvalues is excluded) and the denominator.
    fn margins(&self, ideal: DVec2) -> [f64; 2] {
        let jacobian = self.jacobian(ideal);
        let det = jacobian.determinant();
        let trace = jacobian.x_axis.x + jacobian.y_axis.y;
        [if trace > 0.0 { det } else { -det.abs() }, self.denominator(ideal.length_squared())]
    }
}

impl PlaneFormula for Formula {
    #[inline(always)]
    fn value_and_jacobian(&self, at: DVec2) -> (DVec2, DMat2) {
        (self.distort(at), self.jacobian(at))
    }

    #[inline(always)]
    fn position(&self, ray: DVec3) -> DVec2 {
        ray.truncate() / ray.z
    }

    #[inline(always)]
    fn ray(&self, at: DVec2) -> DVec3 {
        at.extend(1.0)
    }
}
