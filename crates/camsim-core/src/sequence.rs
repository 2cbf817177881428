//! A loaded scenario: all inputs of rendering, in memory and checked.

use std::sync::Arc;

use crate::{
    mount::CameraPath,
    scenario::{Face, Primary, Scenario, TwinSpec},
    scene::Scene,
    shutter::ShutterError,
    vignetting::pixel_weights,
};

/// All inputs of a run, loaded and validated. Immutable; shared between threads.
#[derive(Clone, Debug)]
pub struct Sequence {
    /// The resolved scenario.
    pub scenario: Scenario,
    /// Camera pose at any instant of path time: seconds since the first good row of the log, after
    /// `flight.speed`.
    pub path: Arc<CameraPath>,
    /// Time of the camera's stamps at path time 0, nanoseconds: on the log's clock, or that of
    /// `output.stamps`, with `camera.clock_offset_ms`.
    pub epoch_ns: i64,
    /// Path time at which the period of frame 0 begins, seconds (the begin of `flight.window_s`).
    pub start_s: f64,
    /// Number of frames in the window.
    pub frames: u64,
    /// The scene.
    pub scene: Arc<Scene>,
    /// Vignette map, values 0..=1, row-major; `None` without one.
    pub vignette: Option<Arc<GrayImage>>,
    /// `(t_s, zoom)` rows by path time.
    pub zoom_track: Vec<(f64, f64)>,
}

impl Sequence {
    /// The sequence of a twin's pictures, as [`Scenario::twin`]: of the same path and scene, with the same
    /// frame numbers.
    ///
    /// # Errors
    /// A shutter that cannot be used.
    pub fn twin(&self, twin: &TwinSpec, instant: Option<u32>) -> Result<Self, ShutterError> {
        let scenario = self.scenario.twin(twin, instant)?;
        let has_vignette = scenario.camera.photometric.vignette.is_some();
        let vignette = self.vignette.clone().filter(|_| has_vignette);
        Ok(Self { scenario, vignette, ..self.clone() })
    }

    /// The sequence of one face of the camera ([`Face`]): the pixels of the same frames that it makes.
    #[must_use]
    pub fn face(&self, face: Face) -> Self {
        let mut sequence = self.clone();
        sequence.scenario.camera.face = Some(face);
        sequence.path = Arc::new(self.path.turned(face.camera_from_face()));
        sequence
    }

    /// The sequence of one primary of a chromatic camera: what its lens shows of the same frames.
    #[must_use]
    pub fn primary(&self, primary: Primary) -> Self {
        let mut sequence = self.clone();
        sequence.scenario.camera = self.scenario.camera.of_primary(primary);
        sequence
    }

    /// Stamp of a frame of any number, beyond the sequence as well: path time, seconds.
    #[must_use]
    pub fn stamp_s(&self, frame: f64) -> f64 {
        let camera = &self.scenario.camera;
        self.start_s + (frame + camera.phase) / camera.fps
    }

    /// Time of the platform's clock at path time 0, nanoseconds: that of trajectories.
    #[must_use]
    pub fn platform_epoch_ns(&self) -> i64 {
        self.epoch_ns.saturating_sub(self.scenario.camera.clock_offset_ns())
    }

    /// Weights of light at every pixel in the passes, and the size of their picture; a single 1 without any, and
    /// where they come later.
    #[must_use]
    pub fn vignette_weights(&self) -> ([u32; 2], Vec<f32>) {
        let camera = &self.scenario.camera;
        let weights = match camera.is_finished_late() {
            true => None,
            false => pixel_weights(camera, self.vignette.as_deref(), Primary::Green),
        };
        weights.map_or(([1, 1], vec![1.0]), |weights| (camera.size_px, weights))
    }
}

/// A single-channel image.
#[derive(Clone, Debug, PartialEq)]
pub struct GrayImage {
    /// Width, height.
    pub size_px: [u32; 2],
    /// Row-major values.
    pub values: Vec<f32>,
}
