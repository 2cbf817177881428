//! `[camera.auto_exposure]`: exposure time and gain that follow the pictures.

use serde::{Deserialize, Serialize};

use super::keys::{Table, Words};

/// Exposure time and gain of every frame, by the pictures before it (docs/reference/IMAGING.md).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct AutoExposureSpec {
    /// Metered part of the picture: left, top, right, bottom, as fractions of its sides.
    #[key(
        default = [0.0, 0.0, 1.0, 1.0],
        step = 0.005,
        min = 0.0,
        max = 1.0,
        hint = "give [left, top, right, bottom]",
        names = "left top right bottom"
    )]
    pub window: [f64; 4],
    /// Weights within the metered window.
    pub weights: MeterWeights,
    /// Mean that is aimed at, as a fraction of white. Of an image sensor it is a fraction of the range of its
    /// numbers above black.
    #[key(
        default = 0.18,
        step = 0.005,
        above = 0.0,
        below = 1.0,
        hint = "0 is black, 1 is white, 0.18 is a middle grey"
    )]
    pub target: f64,
    /// Shortest and longest exposure time.
    #[key(
        default = [0.02, 20.0],
        unit = "ms",
        step = 0.1,
        above = 0.0,
        hint = "give [smallest, largest], both above 0; two equal numbers fix the value",
        names = "min max"
    )]
    pub exposure_ms: [f64; 2],
    /// Smallest and largest gain on the light, or on the sensor's electrons. It divides
    /// `camera.sensor.gain_e_per_dn`.
    #[key(
        default = [1.0, 16.0],
        unit = "x",
        step = 0.05,
        above = 0.0,
        hint = "give [smallest, largest], both above 0; two equal numbers fix the value",
        names = "min max"
    )]
    pub gain: [f64; 2],
    /// Fraction of the error's logarithm that each frame corrects.
    #[key(default = 0.2, step = 0.005, above = 0.0, max = 1.0, hint = "1 corrects all of the error at once")]
    pub speed: f64,
    /// Frames from the metered picture to the one whose exposure follows from it.
    #[key(default = 1, min = 1, max = 1000, hint = "no frame is exposed by its own picture")]
    pub delay: u32,
    /// What grows first in the dark, and shrinks last in bright light.
    pub first: ExposureOrder,
    /// Exposure of frame 0.
    pub start: ExposureStart,
    /// Exposure time that makes the scene's white white with gain 1. Give it where
    /// `camera.shutter.exposure_ms` is 0, for pictures of one instant. Omitted:
    /// `camera.shutter.exposure_ms`.
    #[key(
        unit = "ms",
        step = 0.1,
        above = 0.0,
        hint = "leave it out for camera.shutter.exposure_ms",
        example = "8.0"
    )]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nominal_ms: Option<f64>,
}

/// Weights within the metered window.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, Words)]
#[serde(rename_all = "kebab-case")]
pub enum MeterWeights {
    /// The same everywhere.
    #[default]
    Even,
    /// A bell curve about the middle, whose standard deviation is a quarter of each side.
    Centre,
}

/// What grows first in the dark.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, Words)]
#[serde(rename_all = "kebab-case")]
pub enum ExposureOrder {
    /// The exposure time up to its limit, then the gain.
    #[default]
    Exposure,
    /// The gain up to its limit, then the exposure time.
    Gain,
}

/// Exposure of frame 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, Words)]
#[serde(rename_all = "kebab-case")]
pub enum ExposureStart {
    /// What the camera would settle at if it always saw the picture of frame 0.
    #[default]
    Settled,
    /// The exposure time of `nominal_ms` with gain 1, within the limits.
    Nominal,
}
