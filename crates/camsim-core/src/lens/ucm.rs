//! Unified camera model, in the form of Usenko, Demmel, Cremers, "The Double Sphere Camera Model" (3DV 2018,
//! arXiv 1807.08957), eq. 10; basalt's `ucm`.

use std::ops::Bound::Included;

use super::facts::ModelFacts;
use super::radial::{RadialFormula, radial};

pub(super) const FACTS: ModelFacts = ModelFacts {
    coefficients: &["alpha"],
    fix: "alpha and beta are those of model \"eucm\"",
    shape: |k| radial(Ucm { alpha: k[0] }),
    ranges: &[(
        "alpha",
        (Included(0.0), Included(1.0)),
        "0 to 1; xi of model \"mei\" is alpha / (1 - alpha)",
    )],
    foreign: &["ucm", "unified"],
    foreign_counts: &[1],
    point: "eucm with beta = 1",
    authority: "arXiv 1807.08957; basalt `ucm`",
    field: "360",
    ..ModelFacts::NONE
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
