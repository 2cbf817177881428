//! Unified camera model, in the form of Usenko, Demmel, Cremers, "The Double Sphere Camera Model" (3DV 2018,
//! arXiv 1807.08957), eq. 10; basalt's `ucm`.

use super::facts::ModelFacts;
use super::radial::{RadialFormula, radial};

pub(super) const FACTS: ModelFacts = ModelFacts {
    name: "ucm",
    coefficients: &["alpha"],
    defaults: &[],
    fix: "alpha and beta are those of model \"eucm\"",
    shape: |k| radial(Ucm { alpha: k[0] }),
};

/// `sin t / (alpha + (1 - alpha) cos t)`.
#[derive(Debug)]
struct Ucm {
    alpha: f64,
}

impl RadialFormula for Ucm {
    fn radius(&self, angle: f64) -> f64 {
        angle.sin() / self.margin(angle)
    }

    fn slope(&self, angle: f64) -> f64 {
        let below = self.margin(angle);
        (self.alpha * angle.cos() + (1.0 - self.alpha)) / (below * below)
    }

    fn margin(&self, angle: f64) -> f64 {
        self.alpha + (1.0 - self.alpha) * angle.cos()
    }
}
