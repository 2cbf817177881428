//! Calibrations for other programs: used by `camsim camera export` and by the
//! layouts of `exporting`.
//!
//! What a format cannot hold is named by [`export`], or refused where the calibration would be another
//! one. The readers are in [`reading`](super::reading): `import(export(x))` is x.

use camsim_core::{
    scenario::{CameraSpec, FlowInstant, Readout, Reset},
    shutter::Shutter,
};
use thiserror::Error;

pub(crate) mod exported;
mod intrinsics;
pub(crate) mod lens_names;

pub use super::CalibrationFormat;
use super::axes::Rigid;
pub use exported::{CalibrationFile, Exported, export};
pub use intrinsics::Intrinsics;

/// Why a camera cannot be written in a format.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum CalibrationError {
    /// The format cannot hold it; the message says for what, and what to do.
    #[error("{0}")]
    Refused(String),
}

/// A camera that is to be described to other programs.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// The camera.
    pub spec: CameraSpec,
    /// Camera matrix and lens.
    pub intrinsics: Intrinsics,
    pub(crate) shutter: Shutter,
}

impl Calibration {
    /// A camera with a fixed lens.
    ///
    /// # Errors
    /// The camera zooms, or its shutter is impossible.
    pub fn new(spec: &CameraSpec) -> Result<Self, CalibrationError> {
        let name = if spec.name.is_empty() { "the camera" } else { &spec.name };
        let shutter = Shutter::from_spec(&spec.shutter, spec.fps, spec.size_px)
            .map_err(|error| CalibrationError::Refused(format!("{name}: {error}")))?;
        Ok(Self { spec: spec.clone(), intrinsics: Intrinsics::of(spec)?, shutter })
    }

    /// Its name in messages.
    pub(crate) fn label(&self) -> &str {
        if self.spec.name.is_empty() { "the camera" } else { &self.spec.name }
    }

    /// Its pose in the body (forward, right, down), without vibration.
    #[must_use]
    pub fn body_from_camera(&self) -> Rigid {
        Rigid::of_mount(&self.spec.mount)
    }

    /// Time from the mid-exposure of a row to that of the next one below it, of cameras that read rows one after
    /// the other, seconds.
    #[must_use]
    pub fn line_delay_s(&self) -> Option<f64> {
        let line_s = self.shutter.readout_s() / f64::from(self.shutter.lines());
        match self.spec.shutter.readout {
            _ if line_s == 0.0 || self.shutter.reset() == Reset::Global => None,
            Readout::TopToBottom => Some(line_s),
            Readout::BottomToTop => Some(-line_s),
            Readout::LeftToRight | Readout::RightToLeft | Readout::MiddleOutward | Readout::EdgesInward => {
                None
            }
        }
    }

    /// What is added to a stamp to get the mid-exposure of the image's centre on the platform's clock, seconds.
    #[must_use]
    pub fn stamp_to_centre_s(&self) -> f64 {
        let dt_s = self.shutter.dt_instant_s(FlowInstant::Centre) - 1e-3 * self.spec.clock_offset_ms;
        // Without the sign of a zero.
        dt_s + 0.0
    }
}

/// An inertial sensor to which poses and clocks of cameras refer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuReference {
    /// Its axes in the body (forward, right, down).
    pub body_from_imu: Rigid,
    /// How much its clock is ahead of the platform's, seconds.
    pub clock_offset_s: f64,
}
