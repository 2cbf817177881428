//! Extended unified camera model: Khomutenko, Garcia, Martinet, "An Enhanced Unified Camera Model" (RA-L 2016);
//! in the form of Usenko, Demmel, Cremers (arXiv 1807.08957), eq. 14; Kalibr's and basalt's `eucm`.

use std::ops::Bound::{Excluded, Included, Unbounded};

use super::facts::ModelFacts;
use super::radial::{RadialFormula, radial};

pub(super) const FACTS: ModelFacts = ModelFacts {
    coefficients: &["alpha", "beta"],
    defaults: &[0.0, 1.0],
    fix: "only alpha and beta belong to the model; the focal length is camera.focal_px",
    shape: |k| radial(Eucm { alpha: k[0], beta: k[1] }),
    ranges: &[
        ("alpha", (Included(0.0), Included(1.0)), "0 to 1"),
        ("beta", (Excluded(0.0), Unbounded), "above 0"),
    ],
    foreign: &["eucm", "extendedunified", "extendedunifiedcameramodel"],
    foreign_counts: &[2],
    point: "`(x, y) / (alpha d + (1 - alpha) z)`, `d = sqrt(beta (x^2 + y^2) + z^2)`",
    authority: "arXiv 1807.08957; Kalibr and basalt `eucm`; COLMAP `EUCM`",
    field: "360",
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
