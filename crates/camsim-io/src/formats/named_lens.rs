//! Lens models by the names that a format gives to them and to their coefficients.

use camsim_core::scenario::LensModel;

use super::writing::lens_names::no_such_lens;
use super::writing::{Calibration, CalibrationError};

/// A model, with keys and values of its coefficients.
pub(crate) type HeldLens = (&'static NamedLens, Vec<(&'static str, f64)>);

/// A lens model of a format.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NamedLens {
    pub(crate) name: &'static str,
    pub(crate) model: LensModel,
    /// Keys of its coefficients in camsim's order, separated by blanks; those behind them are zero.
    coefficients: &'static str,
}

impl NamedLens {
    pub(crate) const fn new(name: &'static str, model: LensModel, coefficients: &'static str) -> Self {
        Self { name, model, coefficients }
    }

    /// Keys of its coefficients.
    pub(crate) fn coefficients(&self) -> Vec<&'static str> {
        self.coefficients.split_whitespace().collect()
    }

    /// The model of a name.
    pub(crate) fn named(all: &'static [Self], name: &str) -> Option<&'static Self> {
        all.iter().find(|lens| lens.name == name)
    }

    /// The first of a format's models that holds the lens of a camera, with the names and values of its coefficients.
    ///
    /// # Errors
    /// The format does not have the lens.
    pub(crate) fn that_holds(
        all: &'static [Self],
        camera: &Calibration,
        format: &str,
    ) -> Result<HeldLens, CalibrationError> {
        let held = |lens: &'static Self| {
            let keys = lens.coefficients();
            let values = camera.intrinsics.of_model(lens.model, keys.len())?;
            Some((lens, keys.into_iter().zip(values.iter().copied()).collect()))
        };
        all.iter().find_map(held).ok_or_else(|| no_such_lens(camera, format))
    }
}
