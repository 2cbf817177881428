//! `[camera.auto_exposure]`: exposure time and gain that follow the pictures.

use serde::{Deserialize, Serialize};

/// Automatic exposure. Every frame's exposure time and gain follow from the pictures before it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AutoExposureSpec {
    /// Metered part of the picture: left, top, right and bottom as shares of its sides.
    pub window: [f64; 4],
    /// What counts how much within the window.
    pub weights: MeterWeights,
    /// Mean that is aimed at: a share of white, or of the range of the sensor's digital numbers above black.
    pub target: f64,
    /// Shortest and longest exposure time.
    pub exposure_ms: [f64; 2],
    /// Smallest and largest gain.
    pub gain: [f64; 2],
    /// Share of the error's logarithm that each frame corrects.
    pub speed: f64,
    /// How many frames before its own the picture is that a frame's exposure follows from.
    pub delay: u32,
    /// What grows first in the dark, and shrinks last in bright light.
    pub first: ExposureOrder,
    /// Exposure of frame 0.
    pub start: ExposureStart,
    /// Exposure time that makes the scene's white white, with gain 1; else `camera.shutter.exposure_ms`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nominal_ms: Option<f64>,
}

impl Default for AutoExposureSpec {
    fn default() -> Self {
        Self {
            window: [0.0, 0.0, 1.0, 1.0],
            weights: MeterWeights::Even,
            target: 0.18,
            exposure_ms: [0.02, 20.0],
            gain: [1.0, 16.0],
            speed: 0.2,
            delay: 1,
            first: ExposureOrder::Exposure,
            start: ExposureStart::Settled,
            nominal_ms: None,
        }
    }
}

/// Weights within the metered window.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MeterWeights {
    /// The same everywhere.
    #[default]
    Even,
    /// A bell curve about the middle, whose standard deviation is a quarter of each side.
    Centre,
}

/// What grows first in the dark.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ExposureOrder {
    /// The exposure time up to its limit, then the gain.
    #[default]
    Exposure,
    /// The gain up to its limit, then the exposure time.
    Gain,
}

/// Exposure of frame 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ExposureStart {
    /// What the camera would settle at if it always saw the picture of frame 0.
    #[default]
    Settled,
    /// The nominal exposure time with gain 1, within the limits.
    Nominal,
}
