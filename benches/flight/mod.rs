//! The built-in flight and its variants, shared by the benchmarks.

#![allow(dead_code, reason = "each benchmark uses its part")]

use std::sync::Arc;

use camsim::{
    core::{
        mount::CameraPath,
        scenario::{LensSpec, ShutterSpec, Silhouettes},
        sequence::Sequence,
    },
    io::{
        builtin,
        load::{Loaded, load_sequence},
        scenario_file::read_scenario,
    },
};

pub mod ground;
pub mod rounds;

/// Whatever may go wrong: a benchmark stops and says so.
pub type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

/// The scenario of `camsim demo`, loaded from a folder that is gone afterwards.
pub fn load() -> Outcome<Loaded> {
    let folder = tempfile::tempdir()?;
    let scenario = read_scenario(&builtin::unpack(folder.path())?, &[], None)?;
    Ok(load_sequence(&scenario)?)
}

/// What a variant leaves out of the demo's camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Without {
    /// Nothing: the demo as it is.
    Nothing,
    /// Vignette map and noise.
    Photometric,
    /// Exposure, and with it motion blur.
    Blur,
    /// Readout: every row at the same instant, exposure stays.
    RollingShutter,
    /// Readout and exposure: nothing moves within the frame.
    Time,
    /// Distortion: a pinhole, no lens map.
    Lens,
    /// Samples at silhouettes: one a pixel, as by a tolerance that they cannot break.
    SilhouetteSamples,
    /// All of it, and the shaking mount: a perfect camera.
    Anything,
}

impl Without {
    /// The demo's sequence without it.
    pub fn of(self, demo: &Sequence) -> Outcome<Arc<Sequence>> {
        let mut sequence = demo.clone();
        let camera = &mut sequence.scenario.camera;
        if matches!(self, Self::Photometric | Self::Anything) {
            camera.photometric.vignette = None;
            camera.photometric.noise_sigma = 0.0;
            sequence.vignette = None;
        }
        match self {
            Self::Blur => camera.shutter.exposure_ms = 0.0,
            Self::RollingShutter => camera.shutter.readout_ms = 0.0,
            Self::Time | Self::Anything => camera.shutter = ShutterSpec::default(),
            Self::SilhouetteSamples => sequence.scenario.quality.silhouettes = Silhouettes::Plain,
            Self::Nothing | Self::Photometric | Self::Lens => {}
        }
        if matches!(self, Self::Lens | Self::Anything) {
            camera.lens = LensSpec::default();
        }
        if self == Self::Anything {
            camera.mount.vibration.clear();
            sequence.path = Arc::new(CameraPath::new(sequence.path.trajectory.clone(), &camera.mount)?);
        }
        Ok(Arc::new(sequence))
    }
}
