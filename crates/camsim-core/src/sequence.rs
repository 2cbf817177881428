//! A loaded scenario: everything that rendering needs, in memory and checked.

use std::sync::Arc;

use crate::{mount::CameraPath, scenario::Scenario, scene::Scene};

/// Everything that one run needs, loaded and validated. Immutable; shared between threads.
#[derive(Clone, Debug)]
pub struct Sequence {
    /// The resolved scenario.
    pub scenario: Scenario,
    /// Camera pose at any instant; its time is seconds since the first good row of the log (after
    /// `flight.speed`).
    pub path: Arc<CameraPath>,
    /// What written stamps show at path time 0, nanoseconds: the log's clock, or that of `output.stamps`.
    pub epoch_ns: i64,
    /// Path time of frame 0's period, seconds (the beginning of `flight.window_s`).
    pub start_s: f64,
    /// Number of frames that the window holds.
    pub frames: u64,
    /// Terrain, pattern, sky.
    pub scene: Arc<Scene>,
    /// Vignette map, values 0..=1, row-major, with its size; `None` if there is none.
    pub vignette: Option<Arc<GrayImage>>,
    /// `(t_s, zoom)` rows, by path time.
    pub zoom_track: Vec<(f64, f64)>,
}

/// A single-channel picture.
#[derive(Clone, Debug, PartialEq)]
pub struct GrayImage {
    /// Width, height.
    pub size_px: [u32; 2],
    /// Row-major values.
    pub values: Vec<f32>,
}
