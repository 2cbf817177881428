//! Double sphere camera model: Usenko, Demmel, Cremers (3DV 2018, arXiv 1807.08957), eqs. 40 to 42; Kalibr's and
//! basalt's `ds`.

use std::ops::Bound::{Excluded, Included, Unbounded};

use super::facts::ModelFacts;
use super::radial::{RadialFormula, radial};

pub(super) const FACTS: ModelFacts = ModelFacts {
    coefficients: &["xi", "alpha"],
    fix: "only xi and alpha belong to the model; the focal length is camera.focal_px",
    shape: |k| radial(DoubleSphere { xi: k[0], alpha: k[1] }),
    ranges: &[
        ("xi", (Excluded(-1.0), Unbounded), "above -1"),
        ("alpha", (Included(0.0), Included(1.0)), "0 to 1; the order is xi alpha"),
    ],
    foreign: &["ds", "doublesphere"],
    foreign_counts: &[2],
    point: "`(x, y) / (alpha d2 + (1 - alpha)(xi d1 + z))`, `d2 = hypot(x, y, xi d1 + z)`, d1 = \\|ray\\|",
    authority: "arXiv 1807.08957; Kalibr and basalt `ds`",
    field: "360",
    ..ModelFacts::NONE
};

/// `sin t / (alpha d + (1 - alpha)(xi + cos t))`, `d = sqrt(sin^2 t + (xi + cos t)^2)`.
#[derive(Debug)]
struct DoubleSphere {
    xi: f64,
    alpha: f64,
}

impl RadialFormula for DoubleSphere {
    fn radius(&self, angle: f64) -> f64 {
        angle.sin() / self.margin(angle)
    }

    fn slope(&self, angle: f64) -> f64 {
        let (sin, cos) = angle.sin_cos();
        let shifted = self.xi + cos;
        let d = sin.hypot(shifted);
        let below = self.alpha * d + (1.0 - self.alpha) * shifted;
        let below_slope = -sin * (self.alpha * self.xi / d + (1.0 - self.alpha));
        (cos * below - sin * below_slope) / (below * below)
    }

    fn margin(&self, angle: f64) -> f64 {
        let (sin, cos) = angle.sin_cos();
        let shifted = self.xi + cos;
        self.alpha * sin.hypot(shifted) + (1.0 - self.alpha) * shifted
    }
}
