//! No distortion.

use glam::{DMat2, DVec2};

use super::class::LensClass;
use super::facts::{ModelFacts, Shape};

pub(super) const FACTS: ModelFacts = ModelFacts {
    fix: "leave them out, or set lens.model to the model they belong to",
    shape: |_| Shape::Pinhole,
    point: "`(u, v)`",
    field: "< 180 degrees",
    ..ModelFacts::NONE
};

/// The ideal camera: distorted = ideal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pinhole;

impl LensClass for Pinhole {
    fn distort(&self, ideal: DVec2) -> DVec2 {
        ideal
    }

    fn jacobian(&self, _ideal: DVec2) -> DMat2 {
        DMat2::IDENTITY
    }

    fn undistort(&self, distorted: DVec2) -> Option<DVec2> {
        distorted.is_finite().then_some(distorted)
    }
}
