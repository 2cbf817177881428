//! The reference of a camera whose frames may be made of parts.

use std::sync::Arc;

use camsim_core::{
    frame::RenderedFrame,
    reference::{RaySample, ReferenceError, ReferenceRenderer, RenderOptions},
    scenario::{Channel, Primary},
    sequence::Sequence,
};
use camsim_plan::faces;
use glam::DVec2;

use crate::{
    Finished,
    lane::{blacken_invalid, copy_part, join_parts},
    whole_frame::WholeFrame,
};

/// The reference renderers of a camera: one; or one of each face that a wide field is divided among, or one of
/// each colour of each face.
///
/// # Examples
/// ```
/// use std::sync::Arc;
///
/// use camsim_core::{scenario::Channel, sequence::Sequence};
/// use camsim_engine::CameraReference;
/// use glam::DVec2;
///
/// /// Distance to what the middle of frame 0 shows; `None` for the sky.
/// fn range_m(sequence: Arc<Sequence>) -> Option<f64> {
///     let middle = sequence.scenario.camera.size_px.map(|side| side / 2);
///     let reference = CameraReference::new(sequence, &[Channel::Color]).ok()?;
///     let sample = reference.sample(0, middle, DVec2::ZERO, 0.0)?;
///     sample.hit.map(|hit| hit.point_ned_m.distance(sample.pose.position_ned_m))
/// }
/// ```
#[derive(Debug)]
pub struct CameraReference {
    sequence: Arc<Sequence>,
    parts: Vec<ReferenceRenderer>,
    stages: WholeFrame,
}

impl CameraReference {
    /// Prepares the reference of a sequence, of which these channels are wanted.
    ///
    /// # Errors
    /// A camera or shutter that cannot be used.
    pub fn new(sequence: Arc<Sequence>, channels: &[Channel]) -> Result<Self, ReferenceError> {
        Self::renewed(None, sequence, channels)
    }

    /// As [`Self::new`]; what `before` has prepared of the scene is kept if it is the same [`Arc`].
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn renewed(
        before: Option<&Self>,
        sequence: Arc<Sequence>,
        channels: &[Channel],
    ) -> Result<Self, ReferenceError> {
        let faces = faces(&sequence, channels)?;
        let sequences = match faces.as_slice() {
            [] => vec![sequence.clone()],
            faces => faces.iter().flat_map(|face| colors(sequence.face(*face))).collect(),
        };
        let mut parts: Vec<ReferenceRenderer> = Vec::new();
        for sequence in sequences {
            let known = parts.first().or(before.and_then(|before| before.parts.first()));
            parts.push(ReferenceRenderer::renewed(known, sequence)?);
        }
        let stages = WholeFrame::new(&sequence);
        let stages = if parts.len() > 1 { stages } else { stages.without_weights() };
        Ok(Self { sequence, parts, stages })
    }

    /// The sequence of the whole camera.
    #[must_use]
    pub fn sequence(&self) -> &Arc<Sequence> {
        &self.sequence
    }

    /// The renderers, in the order of the plans of a frame and their colours.
    #[must_use]
    pub fn parts(&self) -> &[ReferenceRenderer] {
        &self.parts
    }

    /// Whether frames are made of the faces of a cube.
    #[must_use]
    pub fn has_faces(&self) -> bool {
        self.parts[0].sequence().scenario.camera.face.is_some()
    }

    /// The frame that all parts have made, with the stages that take whole frames. A renderer of undivided frames
    /// has applied them itself.
    #[must_use]
    pub fn joined(&self, parts: impl IntoIterator<Item = Finished>) -> Option<Finished> {
        let mut whole = join_parts(parts)?;
        if self.parts.len() > 1 {
            self.expose(&mut whole.frame);
        }
        Some(whole)
    }

    /// Linear R G B A of some pixels of a frame, row-major, before the stages that take whole frames
    /// ([`Self::expose`]). The others are 0.
    #[must_use]
    pub fn light(&self, frame: u64, only: &[bool], options: &RenderOptions) -> Vec<f32> {
        let options =
            RenderOptions { channels: vec![Channel::Color], only: Some(only.to_vec()), ..options.clone() };
        let mut whole = vec![0.0; 4 * only.len()];
        for part in &self.parts {
            let primary = part.sequence().scenario.camera.primary;
            copy_part(&mut whole, part.render(frame, &options).color_rgba(), primary);
        }
        blacken_invalid(&mut whole);
        whole
    }

    /// Applies the stages that take whole frames: weights of colours, the lens's blur, the image sensor.
    pub fn expose(&self, frame: &mut RenderedFrame) {
        let exposure = self.sequence.exposure(frame.index);
        self.stages.finish(frame, self.stamp_s(frame.index), exposure.as_ref());
    }

    /// Whether a pixel has light that fell on others, so that only whole frames are complete.
    #[must_use]
    pub fn spreads_light(&self) -> bool {
        self.stages.spreads_light()
    }

    /// What an image position sees, as [`ReferenceRenderer::sample`]: pose, ray and depth of the sample are in the
    /// axes of the face that shows it.
    #[must_use]
    pub fn sample(&self, frame: u64, pixel: [u32; 2], offset_px: DVec2, phase: f64) -> Option<RaySample> {
        let is_of_truth = |part: &&ReferenceRenderer| {
            matches!(part.sequence().scenario.camera.primary, None | Some(Primary::Green))
        };
        self.parts.iter().filter(is_of_truth).find_map(|part| part.sample(frame, pixel, offset_px, phase))
    }

    /// Stamp of a frame, path time, seconds.
    #[must_use]
    pub fn stamp_s(&self, frame: u64) -> f64 {
        self.parts[0].stamp_s(frame)
    }

    /// Mid-exposure of a pixel of a frame, path time, seconds.
    #[must_use]
    pub fn mid_s(&self, frame: u64, pixel: [u32; 2]) -> f64 {
        self.parts[0].view(frame).mid_s(pixel)
    }

    /// Exposure time of a pixel of a frame, seconds.
    #[must_use]
    pub fn exposure_s(&self, frame: u64, pixel: [u32; 2]) -> f64 {
        self.parts[0].exposure_s(frame, pixel)
    }
}

/// The sequences of all colours of a face, whose borders are where each colour's lens has them.
fn colors(face: Sequence) -> Vec<Arc<Sequence>> {
    match face.scenario.camera.is_chromatic() {
        true => Primary::ALL.map(|primary| Arc::new(face.primary(primary))).into(),
        false => vec![Arc::new(face)],
    }
}
