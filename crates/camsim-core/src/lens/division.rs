//! Division model: Fitzgibbon, "Simultaneous linear estimation of multiple view geometry and lens distortion"
//! (CVPR 2001); COLMAP's SIMPLE_DIVISION and DIVISION.

use std::ops::Bound::Included;

use super::facts::ModelFacts;
use super::radial::{RadialFormula, radial};

pub(super) const FACTS: ModelFacts = ModelFacts {
    coefficients: &["k"],
    fix: "the model has one; more are those of \"brown-conrady\"",
    shape: |k| radial(Division { k: k[0] }),
    ranges: &[(
        "k",
        // Far more than any lens has.
        (Included(-100.0), Included(100.0)),
        "-100 to 100: it belongs to radii in units of the focal length; multiply the k of pixels by the square of \
         focal_px, HALCON's kappa by that of its focus",
    )],
    foreign: &["division", "simpledivision"],
    foreign_counts: &[1],
    point: "the p with `(u, v) = p / (1 + k \\|p\\|^2)`",
    authority: "Fitzgibbon 2001; COLMAP `DIVISION`",
    field: "360",
    ..ModelFacts::NONE
};

/// `tan t = r / (1 + k r^2)`, that is `r = 2 sin t / (cos t + sqrt(cos^2 t - 4 k sin^2 t))`.
#[derive(Debug)]
struct Division {
    k: f64,
}

impl RadialFormula for Division {
    fn radius(&self, angle: f64) -> f64 {
        let (sin, cos) = angle.sin_cos();
        2.0 * sin / (cos + self.under_root(angle).sqrt())
    }

    /// From `r cos t = (1 + k r^2) sin t`.
    fn slope(&self, angle: f64) -> f64 {
        let (sin, cos) = angle.sin_cos();
        let r = self.radius(angle);
        ((1.0 + self.k * r * r) * cos + r * sin) / (cos - 2.0 * self.k * r * sin)
    }

    fn margin(&self, angle: f64) -> f64 {
        let root = self.under_root(angle);
        if root > 0.0 { angle.cos() + root.sqrt() } else { root }
    }
}

impl Division {
    fn under_root(&self, angle: f64) -> f64 {
        let (sin, cos) = angle.sin_cos();
        cos * cos - 4.0 * self.k * sin * sin
    }
}
