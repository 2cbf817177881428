//! Division model: Fitzgibbon, "Simultaneous linear estimation of multiple view geometry and lens distortion"
//! (CVPR 2001); COLMAP's SIMPLE_DIVISION and DIVISION.

use super::facts::ModelFacts;
use super::radial::{RadialFormula, radial};

pub(super) const FACTS: ModelFacts = ModelFacts {
    name: "division",
    coefficients: &["k"],
    defaults: &[],
    fix: "the model has one; more are those of \"brown-conrady\"",
    shape: |k| radial(Division { k: k[0] }),
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
