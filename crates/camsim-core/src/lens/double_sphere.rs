//! Double sphere camera model: Usenko, Demmel, Cremers (3DV 2018, arXiv 1807.08957), eqs. 40 to 42; Kalibr's and
//! basalt's `ds`.

use super::facts::ModelFacts;
use super::radial::{RadialFormula, radial};

pub(super) const FACTS: ModelFacts = ModelFacts {
    name: "double-sphere",
    coefficients: &["xi", "alpha"],
    defaults: &[],
    fix: "only xi and alpha belong to the model; the focal length is camera.focal_px",
    shape: |k| radial(DoubleSphere { xi: k[0], alpha: k[1] }),
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
