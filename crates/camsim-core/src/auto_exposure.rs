//! Exposures that follow the pictures (`[camera.auto_exposure]`).
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
