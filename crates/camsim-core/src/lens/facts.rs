//! What is known of each lens model before there is a lens: its name, its coefficients, its formula.

use std::sync::Arc;

use glam::DMat2;

use super::{
    LensModel, brown_conrady, brown_conrady_prism, direction::DirectionFormula, division, double_sphere,
    equirectangular, eucm, f_theta, fisheye624, fov, kannala_brandt, mei, pinhole, radial::RadialFormula,
    table, ucm,
};

/// Facts of a lens model.
#[derive(Clone, Copy, Debug)]
pub struct ModelFacts {
    /// Name in files.
    pub name: &'static str,
    /// Names of the coefficients, in order.
    pub coefficients: &'static [&'static str],
    /// Values of coefficients that are left out; empty: zeros.
    pub(super) defaults: &'static [f64],
    /// What to do with more coefficients than these.
    pub fix: &'static str,
    /// How the lens is computed, from all coefficients.
    pub(super) shape: fn(&[f64]) -> Shape,
}

/// The classes of lenses that share an inverse.
#[derive(Debug)]
pub(super) enum Shape {
    Pinhole,
    BrownConrady,
    /// Rotation-symmetric, and a linear map of the image after it.
    Radial(Arc<dyn RadialFormula>, DMat2),
    /// Any other function of the ray.
    Direction(Arc<dyn DirectionFormula>),
    /// Needs a file.
    Table,
}

impl ModelFacts {
    /// What is known of a model.
    #[must_use]
    pub const fn of(model: LensModel) -> &'static Self {
        match model {
            LensModel::Pinhole => &pinhole::FACTS,
            LensModel::BrownConrady => &brown_conrady::FACTS,
            LensModel::KannalaBrandt => &kannala_brandt::FACTS,
            LensModel::BrownConradyPrism => &brown_conrady_prism::FACTS,
            LensModel::Fisheye624 => &fisheye624::FACTS,
            LensModel::FTheta => &f_theta::FACTS,
            LensModel::FThetaInverse => &f_theta::INVERSE_FACTS,
            LensModel::DoubleSphere => &double_sphere::FACTS,
            LensModel::Eucm => &eucm::FACTS,
            LensModel::Ucm => &ucm::FACTS,
            LensModel::Mei => &mei::FACTS,
            LensModel::Division => &division::FACTS,
            LensModel::Fov => &fov::FACTS,
            LensModel::Equirectangular => &equirectangular::FACTS,
            LensModel::Table => &table::FACTS,
        }
    }
    /// The names of the coefficients in one line.
    #[must_use]
    pub fn order(&self) -> String {
        if self.coefficients.is_empty() { "none".to_owned() } else { self.coefficients.join(" ") }
    }

    /// All coefficients: those given, and the defaults of the others. `None` if too many are given.
    pub(super) fn complete(&self, given: &[f64]) -> Option<Vec<f64>> {
        let all = || (0..self.coefficients.len()).map(|i| self.or_default(given, i)).collect();
        (given.len() <= self.coefficients.len()).then(all)
    }

    /// A coefficient, or its default where it is left out.
    pub(crate) fn or_default(&self, given: &[f64], i: usize) -> f64 {
        given.get(i).or(self.defaults.get(i)).copied().unwrap_or(0.0)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use serde::{
        Deserialize,
        de::{IntoDeserializer, value::Error},
    };

    use super::*;

    #[test]
    fn names_are_those_of_files() {
        for &model in LensModel::ALL {
            assert_eq!(model.name(), ModelFacts::of(model).name);
            let name = IntoDeserializer::<Error>::into_deserializer(ModelFacts::of(model).name);
            assert_eq!(LensModel::deserialize(name).unwrap(), model);
        }
    }
}
