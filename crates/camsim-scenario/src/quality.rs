//! `[quality]`: tolerances and methods.

use serde::{Deserialize, Serialize};

use super::{
    Auto, IDEAL_SAMPLES, MAX_BLUR_SAMPLES, MAX_FOOTPRINT_TAPS, MAX_FRAMES_PER_IDEAL, MAX_ITERATIONS,
    MAX_KEY_FRAMES,
    keys::{Table, Words},
};

/// Tolerances and methods.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct QualitySpec {
    /// Set of methods: camsim's own, or the paper's for comparison. With `paper`, `max_error_px` and
    /// `max_error_dn` are ignored.
    pub preset: Preset,
    /// Tolerance of the error of source coordinates: its 99th percentile over valid pixels.
    #[key(default = 0.05, unit = "px", step = 0.001, above = 0.0, hint = "0.05 is the default")]
    pub max_error_px: f64,
    /// Tolerance of the RMS picture error in DN (1/255 of the linear range). It covers resampling, exposure
    /// sampling, misregistration, the terrain's level of detail, and silhouettes.
    #[key(default = 1.0, unit = "1/255", step = 0.01, above = 0.0, hint = "1 is the default")]
    pub max_error_dn: f64,
    /// Tolerance of the displacement by the terrain's level of detail, in output pixels. Its picture error
    /// counts in `max_error_dn`.
    #[key(default = 0.25, unit = "px", step = 0.01, above = 0.0, hint = "0.25 is the default")]
    pub max_terrain_error_px: f64,
    /// Method of the temporal inverse.
    pub solver: Auto<Solver>,
    /// Depth look-ups of `solver = "reproject"`.
    #[key(
        step = 0.1,
        min = 1,
        max = MAX_ITERATIONS,
        hint = "leave it out or write \"auto\" for the planner's choice"
    )]
    pub iterations: Auto<u32>,
    /// Largest number of exposure samples, per pixel of the motion's path and per pixel of the picture. With
    /// `preset = "paper"`, each pixel has exactly so many.
    #[key(
        step = 0.1,
        min = 1,
        max = MAX_BLUR_SAMPLES,
        hint = "leave it out or write \"auto\" for the planner's choice"
    )]
    pub blur_samples: Auto<u32>,
    /// Footprint taps along each side of an output pixel, at most.
    #[key(
        step = 0.1,
        min = 1,
        max = MAX_FOOTPRINT_TAPS,
        hint = "leave it out or write \"auto\" for the planner's choice"
    )]
    pub footprint_taps: Auto<u32>,
    /// Pixels of the ideal frame per camera pixel, along a side.
    #[key(step = 0.01, min = 1.0, max = 5.0, hint = "or write \"auto\"")]
    pub ideal_scale: Auto<f64>,
    /// Samples per pixel of the ideal frame, 1 or 4. With 4, borders are located within a pixel and smoother.
    #[key(only = [1, IDEAL_SAMPLES], hint = "or write \"auto\"")]
    pub ideal_samples: Auto<u32>,
    /// Ideal frames per output frame.
    #[key(step = 0.05, min = 1, max = MAX_KEY_FRAMES, hint = "or write \"auto\"")]
    pub key_frames: Auto<u32>,
    /// Most output frames that are made from one ideal frame. That happens where it keeps the tolerances in
    /// less time.
    #[key(
        default = 8,
        step = 0.1,
        min = 1,
        max = MAX_FRAMES_PER_IDEAL,
        hint = "1 gives each frame its own; 8 is the default"
    )]
    pub frames_per_ideal: u32,
    /// Method for pixels at silhouettes, the borders of surfaces.
    pub silhouettes: Silhouettes,
}

/// Sets of methods.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Words)]
#[serde(rename_all = "kebab-case")]
pub enum Preset {
    /// The cheapest methods that keep the tolerances.
    #[default]
    Default,
    /// The methods and approximations of the paper, for comparison. The preset fixes the solver (eq. 18), one
    /// ideal frame and one sample per pixel; `blur_samples` counts the samples of an exposure (100), and the
    /// tolerances determine only the terrain's level of detail.
    Paper,
}

/// Methods for pixels at silhouettes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Words)]
#[serde(rename_all = "kebab-case")]
pub enum Silhouettes {
    /// The cheaper of `plain` and `rays` that is expected to keep `max_error_dn`; `plain` if that is 16 or more.
    #[default]
    Auto,
    /// As elsewhere: taps in the ideal frame, each of whose pixels shows one surface.
    Plain,
    /// Silhouette rays over the pixel's area and exposure, through ideal frames with several samples per
    /// pixel.
    Rays,
}

/// Methods of the temporal inverse.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Words)]
#[serde(rename_all = "kebab-case")]
pub enum Solver {
    /// One straight step at constant velocity and depth (eq. 16 of the paper).
    Linear,
    /// Heun's steps of at most 2.5 deg at constant velocity and depth (eq. 18 of the paper).
    Rk2,
    /// Exact relative pose per row and sample, depth by fixed-point iteration.
    Reproject,
    /// An exact ray on the CPU for every sample of every pixel: the reference renderer, slow.
    Reference,
}
