//! No distortion.

use glam::{DMat2, DVec2};

use super::facts::{ModelFacts, Shape};

pub(super) const FACTS: ModelFacts = ModelFacts {
    name: "pinhole",
    coefficients: &[],
    defaults: &[],
    fix: "leave them out, or set lens.model to the model they belong to",
    shape: |_| Shape::Pinhole,
};

/// The ideal camera: distorted = ideal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pinhole;

impl Pinhole {
    /// The identity.
    pub fn distort(self, ideal: DVec2) -> DVec2 {
        ideal
    }

    /// The unit matrix.
    pub fn jacobian(self, _ideal: DVec2) -> DMat2 {
        DMat2::IDENTITY
    }

    /// The identity; `None` for what is not finite.
    pub fn undistort(self, distorted: DVec2) -> Option<DVec2> {
        distorted.is_finite().then_some(distorted)
    }
}
