//! The stages that take whole frames.

use camsim_core::{
    deferred_photometric::DeferredPhotometric,
    exposure::FrameExposure,
    frame::RenderedFrame,
    imaging::{ImageSensor, Optics},
    scenario::Scenario,
    sequence::Sequence,
};

/// What is made of the light of a whole frame, where the camera states it: weights of colours, the lens's blur,
/// the image sensor.
#[derive(Debug)]
pub(crate) struct WholeFrame {
    late: Option<DeferredPhotometric>,
    optics: Option<Optics>,
    sensor: Option<ImageSensor>,
}

impl WholeFrame {
    pub(crate) fn new(sequence: &Sequence) -> Self {
        let mut stages = Self { late: None, optics: None, sensor: None };
        stages.renew(sequence);
        stages
    }

    /// Turns to another sequence; what stays the same is kept.
    pub(crate) fn renew(&mut self, sequence: &Sequence) {
        let Scenario { camera, seed, .. } = &sequence.scenario;
        self.late = DeferredPhotometric::new(sequence);
        self.optics = Optics::renewed(self.optics.take(), camera, *seed);
        self.sensor = ImageSensor::renewed(self.sensor.take(), camera, *seed);
    }

    /// Without the weights of colours, which a renderer of undivided frames applies itself.
    pub(crate) fn without_weights(self) -> Self {
        Self { late: None, ..self }
    }

    /// Applies the stages to a frame with this stamp in path time.
    pub(crate) fn finish(&self, frame: &mut RenderedFrame, stamp_s: f64, exposure: Option<&FrameExposure>) {
        if let Some(late) = &self.late {
            late.finish(frame, exposure);
        }
        if let Some(optics) = &self.optics {
            optics.expose(frame, exposure);
        }
        if let Some(sensor) = &self.sensor {
            sensor.expose(frame, stamp_s, exposure);
        }
    }

    /// Whether a pixel has light that fell on others.
    pub(crate) fn spreads_light(&self) -> bool {
        self.optics.is_some()
    }
}
