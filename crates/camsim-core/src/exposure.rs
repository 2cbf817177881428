//! Exposure of each frame: that of the scenario, or one that follows the pictures before it
//! (`[camera.auto_exposure]`).
//!
//! The controller never sees rendered pictures. It runs over the sequence from frame 0 with a meter of its own
//! (`meter`), so that a frame's exposure is a function of the scenario and the frame number, whatever is
//! rendered, in whichever order and by whom. Formulas: docs/theory/IMAGING.md.

mod controller;
mod meter;
#[cfg(test)]
mod tests;
mod track;

pub use controller::Controller;
pub use track::{ExposureError, ExposureTrack};

/// Exposure of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameExposure {
    /// Exposure time, seconds.
    pub time_s: f64,
    /// Gain of the signal.
    pub gain: f64,
    /// Exposure time times gain, relative to the nominal exposure time: what linear values are multiplied by.
    pub light: f64,
}

impl FrameExposure {
    /// An exposure without automatic control: values stay as they are.
    #[must_use]
    pub fn fixed(time_s: f64) -> Self {
        Self { time_s, gain: 1.0, light: 1.0 }
    }
}
