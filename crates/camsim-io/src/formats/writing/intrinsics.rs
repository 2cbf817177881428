//! Camera matrix and lens as files have them.

use camsim_core::scenario::{CameraSpec, LensModel};

use super::CalibrationError;

/// Most coefficients of a lens model.
const MOST: usize = 16;

/// A camera as others describe it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Intrinsics {
    /// Width, height.
    pub size_px: [u32; 2],
    /// Focal lengths fx, fy.
    pub focal_px: [f64; 2],
    /// Principal point; (0, 0) is the centre of the first pixel.
    pub principal_px: [f64; 2],
    /// Lens model.
    pub model: LensModel,
    /// Its coefficients in camsim's order, with zeros behind them.
    pub coefficients: [f64; MOST],
}

impl Intrinsics {
    /// Those of a camera with a fixed lens.
    ///
    /// # Errors
    /// The camera zooms: no format can hold that.
    pub fn of(spec: &CameraSpec) -> Result<Self, CalibrationError> {
        let CameraSpec { name, size_px, focal_px, principal_point_px, zoom, lens, .. } = spec;
        if !zoom.is_empty() {
            let name = if name.is_empty() { "the camera" } else { name };
            return Err(CalibrationError::Refused(format!(
                "{name} zooms (camera.zoom), and the format has one calibration for all pictures: use a camera with a \
                 fixed lens"
            )));
        }
        let centre = size_px.map(|side| 0.5 * (f64::from(side) - 1.0));
        let mut coefficients = [0.0; MOST];
        if lens.model == LensModel::Eucm {
            // The only model here whose left-out coefficient is not zero.
            coefficients[1] = 1.0;
        }
        coefficients.iter_mut().zip(&lens.coefficients).for_each(|(slot, value)| *slot = *value);
        Ok(Self {
            size_px: *size_px,
            focal_px: *focal_px,
            principal_px: principal_point_px.unwrap_or(centre),
            model: lens.model,
            coefficients,
        })
    }

    /// Whether the lens changes nothing.
    #[must_use]
    pub fn is_pinhole(&self) -> bool {
        self.of_model(LensModel::BrownConrady, 0).is_some()
    }

    /// The first coefficients of a lens model, where it is the camera's and those after them are zero. A pinhole is a
    /// Brown-Conrady lens, `k1 k2 p1 p2 k3 k4 k5 k6`, of zeros.
    #[must_use]
    pub fn of_model(&self, model: LensModel, count: usize) -> Option<&[f64]> {
        let own = if self.model == LensModel::Pinhole { LensModel::BrownConrady } else { self.model };
        let (first, rest) = self.coefficients.split_at_checked(count)?;
        (own == model && rest.iter().all(|k| *k == 0.0)).then_some(first)
    }

    /// k1 k2 k3 k4 of a Kannala-Brandt lens.
    #[must_use]
    pub fn equidistant(&self) -> Option<&[f64]> {
        self.of_model(LensModel::KannalaBrandt, 4)
    }
}
