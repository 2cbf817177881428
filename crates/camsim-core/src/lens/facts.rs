//! What is known of each lens model before there is a lens: its coefficients, its formula, its names elsewhere.

use std::{ops::Bound, sync::Arc};

use glam::DMat2;

use super::{direction::DirectionFormula, radial::RadialFormula};

/// The values of a coefficient that a model is defined for: its name, the interval, the interval in words with a hint.
pub(crate) type Domain = (&'static str, (Bound<f64>, Bound<f64>), &'static str);

/// Facts of a lens model.
#[derive(Clone, Copy, Debug)]
pub struct ModelFacts {
    /// Names of the coefficients, in order.
    pub coefficients: &'static [&'static str],
    /// Values of coefficients that are omitted; empty: zeros.
    pub(super) defaults: &'static [f64],
    /// What to do with more coefficients than these.
    pub fix: &'static str,
    /// Coefficients that the model is not defined for all values of.
    pub(crate) ranges: &'static [Domain],
    /// How the lens is computed, from all coefficients.
    pub(super) shape: fn(&[f64]) -> Shape,
    /// Names in calibration files: letters and digits alone, in lower case.
    pub(super) foreign: &'static [&'static str],
    /// The counts of parameters that such a file may give, in the order of the coefficients.
    pub(super) foreign_counts: &'static [usize],
    /// The distorted point as docs/reference/LENSES.md writes it.
    pub point: &'static str,
    /// Who defines it.
    pub authority: &'static str,
    /// Largest field of view, degrees.
    pub field: &'static str,
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
    /// What a model leaves out.
    pub(super) const NONE: Self = Self {
        coefficients: &[],
        defaults: &[],
        fix: "",
        ranges: &[],
        shape: |_| Shape::Pinhole,
        foreign: &[],
        foreign_counts: &[],
        point: "",
        authority: "",
        field: "",
    };

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

    /// A coefficient, or its default where it is omitted.
    pub(crate) fn or_default(&self, given: &[f64], i: usize) -> f64 {
        given.get(i).or(self.defaults.get(i)).copied().unwrap_or(0.0)
    }
}

#[cfg(test)]
mod listing {
    #![allow(clippy::unwrap_used)]

    use std::{env, fs, path::Path};

    use super::ModelFacts;
    use crate::scenario::LensModel;

    const HEAD: &str =
        "| model | coefficients | distorted point | authority | field |\n|---|---|---|---|---|\n";

    /// `CAMSIM_BLESS=1 cargo test --workspace --lib listing` writes it.
    #[test]
    fn the_table_of_models_is_up_to_date() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/reference/LENSES.md");
        let page = fs::read_to_string(&path).unwrap();
        let (before, rest) = page.split_once(HEAD).unwrap();
        let (_, after) = rest.split_once("\n\n").unwrap();
        let mut wanted = before.to_owned() + HEAD;
        for model in LensModel::ALL {
            let facts = ModelFacts::of(*model);
            let names = facts.order();
            let names = if facts.coefficients.is_empty() { names } else { format!("`{names}`") };
            let cells = [&format!("`{}`", model.name()), &names, facts.point, facts.authority, facts.field];
            wanted += &format!("| {} |\n", cells.join(" | ")).replace("  ", " ");
        }
        wanted = wanted + "\n" + after;
        if env::var_os("CAMSIM_BLESS").is_some_and(|bless| bless == "1") {
            fs::write(&path, &wanted).unwrap();
        }
        assert!(fs::read_to_string(&path).unwrap() == wanted, "LENSES.md: write it with CAMSIM_BLESS=1");
    }
}
