//! Extended unified camera model: Khomutenko, Garcia, Martinet, "An Enhanced Unified Camera Model" (RA-L 2016);
//! in the form of Usenko, Demmel, Cremers (arXiv 1807.08957), eq. 14; Kalibr's and basalt's `eucm`.

use super::facts::ModelFacts;
use super::radial::{RadialFormula, radial};

pub(super) const FACTS: ModelFacts = ModelFacts {
    name: "eucm",
    coefficients: &["alpha", "beta"],
    defaults: &[0.0, 1.0],
    fix: "only alpha and beta belong to the model; the focal length is camera.focal_px",
    shape: |k| radial(Eucm { alpha: k[0], beta: k[1] }),
};

/// `sin t / (alpha d + (1 - alpha) cos t)`, `d = sqrt(beta sin^2 t + cos^2 t)`.
#[derive(Debug)]
struct Eucm {
    alpha: f64,
    beta: f64,
}

impl Eucm {
    fn distance(&self, sin: f64, cos: f64) -> f64 {
        (self.beta * sin * sin + cos * cos).sqrt()
    }
}

impl RadialFormula for Eucm {
    fn radius(&self, angle: f64) -> f64 {
        angle.sin() / self.margin(angle)
    }

    fn slope(&self, angle: f64) -> f64 {
        let (sin, cos) = angle.sin_cos();
        let d = self.distance(sin, cos);
        let below = self.alpha * d + (1.0 - self.alpha) * cos;
        let below_slope = self.alpha * (self.beta - 1.0) * sin * cos / d - (1.0 - self.alpha) * sin;
        (cos * below - sin * below_slope) / (below * below)
    }

    fn margin(&self, angle: f64) -> f64 {
        let (sin, cos) = angle.sin_cos();
        self.alpha * self.distance(sin, cos) + (1.0 - self.alpha) * cos
    }
}
