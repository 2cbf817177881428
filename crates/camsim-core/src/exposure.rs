//! Exposure of each frame: that of the scenario, or one that follows the pictures before it.

use std::fmt::Debug;

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

/// Exposures of the frames of a camera, where they follow the pictures.
pub trait FrameExposures: Debug + Send + Sync {
    /// Exposure of a frame of any number.
    fn of(&self, frame: u64) -> FrameExposure;
}
