//! The built-in flight and its variants, shared by the benchmarks.

#![allow(dead_code, reason = "each benchmark uses its part")]

use std::sync::Arc;

use camsim::{
    core::{
        mount::CameraPath,
        scenario::{LensSpec, Preset, ShutterSpec, Silhouettes},
        sequence::Sequence,
    },
    io::{
        builtin,
        load::{Loaded, load_sequence},
        scenario_file::read_scenario,
    },
};

pub mod comparison;
pub mod ground;
pub mod rounds;

/// Result of a benchmark's function; any error ends the benchmark.
pub type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

/// Loads the scenario of `camsim demo` from a temporary folder.
pub fn load() -> Outcome<Loaded> {
    let folder = tempfile::tempdir()?;
    let scenario = read_scenario(&builtin::unpack(folder.path())?, &[], None)?;
    Ok(load_sequence(&scenario)?)
}

/// The sequence with the paper's preset.
pub fn with_paper_preset(sequence: &Sequence) -> Arc<Sequence> {
    let mut sequence = sequence.clone();
    sequence.scenario.quality.preset = Preset::Paper;
    Arc::new(sequence)
}

/// Effects that a camera lacks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ablation {
    /// None: the camera as it is.
    None,
    /// Vignette map and noise.
    Photometric,
    /// Exposure, and with it motion blur.
    Blur,
    /// Readout: every row has the same instant; the exposure stays.
    RollingShutter,
    /// Readout and exposure: nothing moves within a frame.
    Time,
    /// Distortion: a pinhole without lens map.
    Lens,
    /// Silhouette rays: one source per pixel.
    SilhouetteRays,
    /// All effects, and the vibration of the mount: a perfect camera.
    All,
}

impl Ablation {
    /// The sequence without these effects.
    pub fn apply(self, sequence: &Sequence) -> Outcome<Arc<Sequence>> {
        let mut sequence = sequence.clone();
        let camera = &mut sequence.scenario.camera;
        if matches!(self, Self::Photometric | Self::All) {
            camera.photometric.vignette = None;
            camera.photometric.noise_sigma = 0.0;
            sequence.vignette = None;
        }
        match self {
            Self::Blur => camera.shutter.exposure_ms = 0.0,
            Self::RollingShutter => camera.shutter.readout_ms = 0.0,
            Self::Time | Self::All => camera.shutter = ShutterSpec::default(),
            Self::SilhouetteRays => sequence.scenario.quality.silhouettes = Silhouettes::Plain,
            Self::None | Self::Photometric | Self::Lens => {}
        }
        if matches!(self, Self::Lens | Self::All) {
            camera.lens = LensSpec::default();
        }
        if self == Self::All {
            camera.mount.vibration.clear();
            sequence.path = Arc::new(CameraPath::new(sequence.path.trajectory.clone(), &camera.mount)?);
        }
        Ok(Arc::new(sequence))
    }
}
