//! Omnidirectional model of Mei, Rives, "Single View Point Omnidirectional Camera Calibration from Planar Grids"
//! (ICRA 2007): OpenCV's `omnidir`, CamOdoCal's MEI, Kalibr's omni-radtan.

use std::ops::Bound::{Excluded, Unbounded};

use glam::{DMat2, DVec2, DVec3};

use super::brown_conrady::Formula;
use super::bulk::PlaneFormula;
use super::direction::{DirectionFormula, direction};
use super::facts::ModelFacts;

pub(super) const FACTS: ModelFacts = ModelFacts {
    coefficients: &["xi", "k1", "k2", "p1", "p2"],
    fix: "xi, two radial and two tangential terms; the focal length is camera.focal_px",
    shape: |k| {
        let formula = Formula::new(&[k[1], k[2], k[3], k[4], 0.0, 0.0, 0.0, 0.0]);
        direction(Mei { xi: k[0], formula })
    },
    ranges: &[("xi", (Excluded(-1.0), Unbounded), "above -1; a pinhole has 0")],
    foreign: &["omni", "omniradtan", "mei", "omnidir"],
    foreign_counts: &[1, 5],
    point: "brown-conrady of `(x, y) / (z + xi \\|ray\\|)`",
    authority: "OpenCV `omnidir`; CamOdoCal `MEI`; Kalibr `omni` with `radtan`",
    field: "360",
    ..ModelFacts::NONE
};

/// Brown-Conrady of `(x, y) / (z + xi |ray|)`.
#[derive(Debug)]
struct Mei {
    xi: f64,
    formula: Formula,
}

impl Mei {
    fn below(&self, ray: DVec3) -> f64 {
        ray.z + self.xi * ray.length()
    }
}

impl DirectionFormula for Mei {
    fn image(&self, ray: DVec3) -> DVec2 {
        self.formula.distort(self.position(ray))
    }

    fn gradient(&self, ray: DVec3) -> [DVec2; 3] {
        let (below, unit) = (self.below(ray), ray / ray.length());
        let mirrored = ray.truncate() / below;
        let of_lens: DMat2 = self.formula.jacobian(mirrored);
        let rate = DVec3::new(self.xi * unit.x, self.xi * unit.y, 1.0 + self.xi * unit.z);
        [
            of_lens * ((DVec2::X - mirrored * rate.x) / below),
            of_lens * ((DVec2::Y - mirrored * rate.y) / below),
            of_lens * (-mirrored * (rate.z / below)),
        ]
    }

    fn margin(&self, ray: DVec3) -> f64 {
        self.below(ray)
    }

    fn plane(&self) -> Option<&dyn PlaneFormula> {
        Some(self)
    }
}

/// The plane is that of the mirrored point.
impl PlaneFormula for Mei {
    #[inline(always)]
    fn value_and_jacobian(&self, at: DVec2) -> (DVec2, DMat2) {
        self.formula.value_and_jacobian(at)
    }

    fn position(&self, ray: DVec3) -> DVec2 {
        ray.truncate() / self.below(ray)
    }

    /// The unit sphere's farther meeting with the line through the mirrored point.
    #[inline(always)]
    fn ray(&self, at: DVec2) -> DVec3 {
        let r2 = at.length_squared();
        let along = (self.xi + (1.0 + (1.0 - self.xi * self.xi) * r2).sqrt()) / (1.0 + r2);
        (at * along).extend(along - self.xi)
    }
}
