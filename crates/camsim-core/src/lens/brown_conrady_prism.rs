//! Brown-Conrady with thin prism and a tilted sensor: OpenCV's 12 and 14 coefficients (`calib3d`, section
//! "Detailed Description": s1 to s4, and tau_x, tau_y of Louhichi et al. 2007).

use std::{
    f64::consts::FRAC_PI_4,
    ops::Bound::{self, Included},
};

use glam::{DMat2, DMat3, DVec2, DVec3};

use super::brown_conrady::Formula;
use super::bulk::PlaneFormula;
use super::direction::{DirectionFormula, direction, gradient_of_plane};
use super::facts::ModelFacts;
use super::fold::MAX_FIELD_RAD;

pub(super) const FACTS: ModelFacts = ModelFacts {
    coefficients: &["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4", "tau_x", "tau_y"],
    fix: "OpenCV has no more than 14",
    shape: |k| direction(Prism::new(k)),
    ranges: &[("tau_x", TILT, TILT_HINT), ("tau_y", TILT, TILT_HINT)],
    foreign: &["radtan12", "radtan14", "thinprism", "thinprismmodel", "tilted", "fullopencv14"],
    foreign_counts: &[12, 14],
    point: "brown-conrady `+ (s1 r^2 + s2 r^4, s3 r^2 + s4 r^4)`, then the tilt of the sensor by tau_x and tau_y \
            (radians)",
    authority: "OpenCV, 12 or 14 coefficients",
    field: "< 178",
    ..ModelFacts::NONE
};

/// Far more than any sensor is tilted.
const TILT: (Bound<f64>, Bound<f64>) = (Included(-FRAC_PI_4), Included(FRAC_PI_4));
const TILT_HINT: &str = "-pi/4 to pi/4: a tilt is in radians";

/// `(x, y)` of Brown-Conrady plus `(s1 r^2 + s2 r^4, s3 r^2 + s4 r^4)`, then the tilt.
///
/// The tilt is the homography of `[[R33, 0, -R13], [0, R33, -R23], [0, 0, 1]] R` with `R = Ry(tau_y) Rx(tau_x)`.
#[derive(Debug)]
struct Prism {
    formula: Formula,
    prism: [f64; 4],
    tilt: DMat3,
}

impl Prism {
    fn new(k: &[f64]) -> Self {
        let formula = Formula::new(&[k[0], k[1], k[2], k[3], k[4], k[5], k[6], k[7]]);
        Self { formula, prism: [k[8], k[9], k[10], k[11]], tilt: tilt(k[12], k[13]) }
    }

    /// Before the tilt, with the Jacobian.
    #[inline(always)]
    fn flat(&self, ideal: DVec2) -> (DVec2, DMat2) {
        let [s1, s2, s3, s4] = self.prism;
        let r2 = ideal.length_squared();
        let added = DVec2::new(s1 + s2 * r2, s3 + s4 * r2) * r2;
        // d/d(r^2) of the added part; d(r^2) = 2 (u, v).
        let rate = 2.0 * DVec2::new(s1 + 2.0 * s2 * r2, s3 + 2.0 * s4 * r2);
        let jacobian = self.formula.jacobian(ideal) + DMat2::from_cols(rate * ideal.x, rate * ideal.y);
        (self.formula.distort(ideal) + added, jacobian)
    }

    /// The denominator of the homography.
    fn depth(&self, flat: DVec2) -> f64 {
        (self.tilt * flat.extend(1.0)).z
    }
}

fn tilt(tau_x: f64, tau_y: f64) -> DMat3 {
    // OpenCV's rotations turn the other way about than glam's.
    let r = DMat3::from_rotation_y(-tau_y) * DMat3::from_rotation_x(-tau_x);
    let (r13, r23, r33) = (r.z_axis.x, r.z_axis.y, r.z_axis.z);
    let project =
        DMat3::from_cols(DVec3::new(r33, 0.0, 0.0), DVec3::new(0.0, r33, 0.0), DVec3::new(-r13, -r23, 1.0));
    project * r
}

impl DirectionFormula for Prism {
    fn image(&self, ray: DVec3) -> DVec2 {
        self.value_and_jacobian(self.position(ray)).0
    }

    fn gradient(&self, ray: DVec3) -> [DVec2; 3] {
        gradient_of_plane(self.value_and_jacobian(self.position(ray)).1, ray)
    }

    fn margin(&self, ray: DVec3) -> f64 {
        let ideal = ray.truncate() / ray.z;
        let rational = self.formula.denominator(ideal.length_squared());
        rational.min(self.depth(self.flat(ideal).0)).min(ray.z)
    }

    fn angle_max(&self) -> f64 {
        MAX_FIELD_RAD
    }

    fn plane(&self) -> Option<&dyn PlaneFormula> {
        Some(self)
    }
}

impl PlaneFormula for Prism {
    #[inline(always)]
    fn value_and_jacobian(&self, at: DVec2) -> (DVec2, DMat2) {
        let (flat, jacobian) = self.flat(at);
        let tilted = self.tilt * flat.extend(1.0);
        let image = tilted.truncate() / tilted.z;
        let column = |axis: DVec3| (axis.truncate() - image * axis.z) / tilted.z;
        let of_tilt = DMat2::from_cols(column(self.tilt.x_axis), column(self.tilt.y_axis));
        (image, of_tilt * jacobian)
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
