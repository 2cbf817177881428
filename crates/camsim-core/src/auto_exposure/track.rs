//! Exposures of the frames of a sequence, found in order and kept.

use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use rayon::prelude::*;

use super::{
    Controller,
    meter::{Meter, MeterLens, MeteredLight},
};
use crate::{
    camera::CameraError,
    exposure::{FrameExposure, FrameExposures},
    imaging::sensor_range,
    scenario::{AutoExposureSpec, ExposureStart},
    sequence::Sequence,
    shutter::{Shutter, ShutterError},
};

/// Pictures that are metered at once.
const AT_ONCE: u64 = 256;

/// Why a sequence cannot be metered.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ExposureError {
    /// The camera or an entry of its zoom table.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// The shutter.
    #[error(transparent)]
    Shutter(#[from] ShutterError),
}

/// Exposures of the frames of a sequence with automatic exposure. Found as they are asked for, each from those
/// before it; what was found is kept.
#[derive(Debug)]
pub struct ExposureTrack {
    sequence: Arc<Sequence>,
    spec: AutoExposureSpec,
    controller: Controller,
    /// Level of white at the nominal exposure, and of the full well at gain 1: fractions of the largest value.
    white: f64,
    full_well: f64,
    /// Checked parts of the meter, which is made when it is needed first.
    shutter: Shutter,
    meter: OnceLock<Arc<Meter>>,
    /// Logarithms of the exposures of the first frames.
    known: Mutex<Vec<f64>>,
}

impl FrameExposures for ExposureTrack {
    fn of(&self, frame: u64) -> FrameExposure {
        self.controller.exposure(self.log_of(frame))
    }
}

impl ExposureTrack {
    /// The exposures of the frames of `sequence`; `None` where they are not automatic.
    ///
    /// # Errors
    /// A camera or shutter that cannot be used.
    pub fn new(sequence: &Sequence) -> Result<Option<Self>, ExposureError> {
        let camera = &sequence.scenario.camera;
        let Some(spec) = &camera.auto_exposure else { return Ok(None) };
        let nominal_s = 1e-3 * camera.nominal_exposure_ms();
        MeterLens::new(sequence)?;
        let shutter = Shutter::from_spec(&camera.shutter, camera.fps, camera.size_px)?;
        let [white, full_well] =
            camera.sensor.as_ref().map_or([1.0, f64::INFINITY], |sensor| sensor_range(sensor, nominal_s));
        // Of the simple model the level is that of the picture.
        let gain = if camera.sensor.is_some() { 1.0 } else { camera.photometric.light };
        Ok(Some(Self {
            sequence: Arc::new(Sequence { exposures: None, ..sequence.clone() }),
            spec: spec.clone(),
            controller: Controller::new(spec, nominal_s),
            white: gain * white,
            full_well,
            shutter,
            meter: OnceLock::new(),
            known: Mutex::default(),
        }))
    }

    /// Level that the meter finds in the picture of a frame, with the exposure that it has: a fraction of the
    /// largest value. `camera.auto_exposure.target` is what it should be.
    #[must_use]
    pub fn level(&self, frame: u64) -> f64 {
        let x = self.log_of(frame);
        self.meter().map_or(0.0, |meter| self.level_of(&meter.light(frame), x))
    }

    fn level_of(&self, light: &MeteredLight, x: f64) -> f64 {
        // The full well is reached before the largest number where the gain is small.
        let most = (self.full_well * self.controller.exposure(x).gain).min(1.0);
        light.level(self.white * x.exp(), most)
    }

    fn log_of(&self, frame: u64) -> f64 {
        let Some(meter) = self.meter() else { return self.controller.nominal() };
        loop {
            let first = {
                let known = self.known();
                if let Some(x) = known.get(frame as usize) {
                    return *x;
                }
                known.len() as u64
            };
            let end = (frame + 1).min(first + AT_ONCE);
            // The lock is not held meanwhile: metering is parallel, and a thread that waits for its parts may take
            // up another frame.
            let seen =
                (first..end).into_par_iter().map(|of| self.picture_for(&meter, of)).collect::<Vec<_>>();
            let mut known = self.known();
            // Another thread may have found them in the meantime.
            if known.len() as u64 == first {
                seen.into_iter().for_each(|light| {
                    let next = self.next(&known, light.as_ref());
                    known.push(next);
                });
            }
        }
    }

    /// The picture that a frame's exposure follows from.
    fn picture_for(&self, meter: &Meter, frame: u64) -> Option<MeteredLight> {
        let is_first = frame == 0 && self.spec.start == ExposureStart::Settled;
        let picture = if is_first { Some(0) } else { frame.checked_sub(self.controller.delay()) };
        picture.map(|picture| meter.light(picture))
    }

    /// The exposure after `known`, from a picture of one of those.
    fn next(&self, known: &[f64], light: Option<&MeteredLight>) -> f64 {
        let (Some(before), frame) = (known.last(), known.len()) else {
            let settled = |light| self.controller.settled(|x| self.level_of(light, x));
            return light.map_or_else(|| self.controller.nominal(), settled);
        };
        let metered = frame.checked_sub(self.spec.delay as usize).and_then(|of| known.get(of));
        match (light, metered) {
            (Some(light), Some(&x)) => self.controller.next(*before, x, self.level_of(light, x)),
            // No picture of this sequence has been seen yet.
            _ => *before,
        }
    }

    fn known(&self) -> std::sync::MutexGuard<'_, Vec<f64>> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn meter(&self) -> Option<Arc<Meter>> {
        if let Some(meter) = self.meter.get() {
            return Some(meter.clone());
        }
        // As in `log_of`: nothing waits while it is made.
        let lens = MeterLens::new(&self.sequence).ok()?;
        let made = Arc::new(Meter::new(self.sequence.clone(), &self.spec, lens, self.shutter));
        Some(self.meter.get_or_init(|| made).clone())
    }
}
