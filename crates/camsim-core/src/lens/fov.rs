//! Field-of-view model: Devernay, Faugeras, "Straight lines have to be straight" (2001), sect. 2.3; COLMAP's FOV,
//! PTAM's and SVO's ATAN.

use std::{f64::consts::PI, ops::Bound::Excluded};

use super::facts::ModelFacts;
use super::radial::{RadialFormula, radial};

pub(super) const FACTS: ModelFacts = ModelFacts {
    coefficients: &["omega"],
    fix: "the model has one, its field of view in radians",
    shape: |k| radial(Fov { omega: k[0] }),
    ranges: &[("omega", (Excluded(-PI), Excluded(PI)), "below pi: it is the field of view in radians")],
    foreign: &["fov", "atan"],
    foreign_counts: &[1],
    point: "`atan(2 tan(t) tan(omega/2)) / omega e`",
    authority: "Devernay and Faugeras 2001; COLMAP `FOV`; PTAM, SVO `ATAN`",
    field: "360",
    ..ModelFacts::NONE
};

/// `r = atan(2 tan t tan(omega / 2)) / omega`; `tan t` where omega is 0.
#[derive(Debug)]
struct Fov {
    omega: f64,
}

/// Below this angle the model is a pinhole to the last bit.
const NO_OMEGA: f64 = 1e-8;

impl RadialFormula for Fov {
    fn radius(&self, angle: f64) -> f64 {
        if self.omega.abs() < NO_OMEGA {
            return angle.tan();
        }
        let (sin, cos) = angle.sin_cos();
        (2.0 * (0.5 * self.omega).tan() * sin).atan2(cos) / self.omega
    }

    fn slope(&self, angle: f64) -> f64 {
        let (sin, cos) = angle.sin_cos();
        if self.omega.abs() < NO_OMEGA {
            return 1.0 / (cos * cos);
        }
        let gain = 2.0 * (0.5 * self.omega).tan();
        gain / (self.omega * (cos * cos + gain * gain * sin * sin))
    }

    /// A pinhole ends at a right angle.
    fn margin(&self, angle: f64) -> f64 {
        if self.omega.abs() < NO_OMEGA { angle.cos() } else { 1.0 }
    }
}
