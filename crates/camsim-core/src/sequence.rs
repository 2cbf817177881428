//! A loaded scenario: all inputs of rendering, in memory and checked.

use std::sync::Arc;

use crate::{
    exposure::{FrameExposure, FrameExposures},
    mount::CameraPath,
    noise::camera_seed,
    photometric::GrayImage,
    scenario::{Face, Primary, Reset, Scenario, TwinSpec},
    scene::Scene,
    shutter::{Shutter, ShutterError},
    timing_faults::{TimingFaults, picture_of},
    twin::scenario_of,
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
    /// Exposures of the frames, where they follow the pictures. Twins and faces have those of their camera.
    pub exposures: Option<Arc<dyn FrameExposures>>,
}

impl Sequence {
    /// A sequence in memory, whose frame 0 begins at path time 0; without vignette, zoom and exposure control.
    #[must_use]
    pub fn in_memory(scenario: Scenario, path: CameraPath, scene: Scene, frames: u64) -> Self {
        Self {
            scenario,
            path: Arc::new(path),
            epoch_ns: 0,
            start_s: 0.0,
            frames,
            scene: Arc::new(scene),
            vignette: None,
            zoom_track: Vec::new(),
            exposures: None,
        }
    }

    /// The sequence of a twin's pictures, as [`scenario_of`]: of the same path and scene, with the same
    /// frame numbers.
    ///
    /// # Errors
    /// A shutter that cannot be used.
    pub fn twin(&self, twin: &TwinSpec, instant: Option<u32>) -> Result<Self, ShutterError> {
        let scenario = scenario_of(&self.scenario, twin, instant)?;
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

    /// Instant to which the row times of a frame of any number refer, beyond the sequence as well: path time,
    /// seconds. Without `[camera.timing]` it is the frame's stamp; else the trigger of the picture that the
    /// frame shows.
    #[must_use]
    pub fn stamp_s(&self, frame: f64) -> f64 {
        let camera = &self.scenario.camera;
        match self.timing_faults() {
            None => self.start_s + (frame + camera.phase) / camera.fps,
            Some(faults) => self.start_s + faults.trigger_s(frame.round() as i64),
        }
    }

    /// Stamp of a frame as the camera writes it, nanoseconds on its clock.
    #[must_use]
    pub fn stamp_ns(&self, frame: u64) -> i64 {
        let t_s = match self.timing_faults() {
            None => self.stamp_s(frame as f64),
            Some(faults) => self.start_s + faults.stamp_s(frame as i64),
        };
        self.epoch_ns.saturating_add((t_s * 1e9).round() as i64)
    }

    /// What goes wrong with triggers, stamps and delivery; `None` without `[camera.timing]`.
    #[must_use]
    pub fn timing_faults(&self) -> Option<TimingFaults<'_>> {
        TimingFaults::new(&self.scenario.camera, self.scenario.seed)
    }

    /// Whether a frame arrives: dropped and missed ones have a number but no picture.
    #[must_use]
    pub fn arrives(&self, frame: u64) -> bool {
        self.timing_faults().is_none_or(|faults| !faults.is_lost(frame))
    }

    /// Number of the frame whose picture a frame shows: its own, but for doubled frames.
    #[must_use]
    pub fn picture(&self, frame: u64) -> u64 {
        picture_of(&self.scenario.camera, self.scenario.seed, frame)
    }

    /// Seed of the camera's noise, from the scenario's seed and the camera's name.
    #[must_use]
    pub fn noise_seed(&self) -> u64 {
        camera_seed(self.scenario.seed, &self.scenario.camera.name)
    }

    /// Exposure of a frame, if it follows the pictures; else it is the scenario's.
    #[must_use]
    pub fn exposure(&self, frame: u64) -> Option<FrameExposure> {
        self.exposures.as_ref().map(|track| track.of(self.picture(frame)))
    }

    /// Time for which each row of a frame is exposed to motion, seconds: 0 where pictures are of one instant,
    /// however long they collect light.
    #[must_use]
    pub fn blurred_s(&self, frame: u64) -> f64 {
        let nominal_s = 1e-3 * self.scenario.camera.shutter.exposure_ms;
        let own = self.exposures.as_ref().filter(|_| nominal_s > 0.0);
        own.map_or(nominal_s, |track| track.of(self.picture(frame)).time_s)
    }

    /// Time of the platform's clock at path time 0, nanoseconds: that of trajectories.
    #[must_use]
    pub fn platform_epoch_ns(&self) -> i64 {
        self.epoch_ns.saturating_sub(self.scenario.camera.clock_offset_ns())
    }

    /// Weights of the light at every pixel in the passes, and the size of their picture; a single 1 without any,
    /// and where they come later ([`crate::scenario::CameraSpec::defers_photometric`]).
    #[must_use]
    pub fn vignette_weights(&self) -> ([u32; 2], Vec<f32>) {
        let camera = &self.scenario.camera;
        let weights = match camera.defers_photometric() {
            true => None,
            false => self.light_weights(Primary::Green),
        };
        weights.map_or(([1, 1], vec![1.0]), |weights| (camera.size_px, weights))
    }

    /// Weights of the light of a primary at every pixel, row-major: of the vignette, times what rows collect that
    /// are exposed for longer ([`Self::light_gains`]). `None` where all are 1.
    #[must_use]
    pub fn light_weights(&self, primary: Primary) -> Option<Vec<f32>> {
        let camera = &self.scenario.camera;
        let weights = pixel_weights(camera, self.vignette.as_deref(), primary);
        let Some(shutter) = self.light_gains() else { return weights };
        let [width, height] = camera.size_px.map(|side| side as usize);
        let mut weights = weights.unwrap_or_else(|| vec![1.0; width * height]);
        for (row, y) in weights.chunks_mut(width).zip(0..) {
            row.iter_mut().zip(0..).for_each(|(weight, x)| *weight *= shutter.light_gain(x, y) as f32);
        }
        Some(weights)
    }

    /// The shutter, where rows collect more light than others ([`Shutter::light_gain`]) and no image sensor
    /// counts it.
    #[must_use]
    pub fn light_gains(&self) -> Option<Shutter> {
        let camera = &self.scenario.camera;
        let differs = camera.shutter.reset == Reset::Global && camera.sensor.is_none();
        differs.then(|| Shutter::from_spec(&camera.shutter, camera.fps, camera.size_px).ok()).flatten()
    }
}
