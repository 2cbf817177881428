//! Measured errors of frames beside the predicted ones: frames are rendered as for a user, and compared with the
//! reference renderer.

mod measure;
mod report;

use std::{convert::Infallible, sync::Arc};

use camsim_core::{
    reference::ReferenceError,
    scenario::{Auto, Solver},
    sequence::Sequence,
};
use camsim_plan::Planner;

use crate::{Engine, RenderError};
pub use measure::MOST_INSTANTS;
use measure::Measuring;
pub use report::{
    FlowReport, FrameReport, JudgedBy, Kept, Measured, PictureReport, PlaneReport, VerifyReport,
};

/// Number of frames to verify by default.
const DEFAULT_FRAMES: u64 = 5;

/// Why frames cannot be verified.
#[derive(Debug, thiserror::Error)]
pub enum VerifyError {
    /// The reference renderer would be compared with itself.
    #[error(
        "quality.solver is \"reference\", which this command compares with: leave it out, or add --set \
         quality.solver=auto"
    )]
    Solver,
    /// Coordinates, which are always rendered here, do not fit.
    #[error(
        "camera.size_px = [{}, {}] is {} pixels, and this adapter can measure at most {most} in one frame: make \
         camera.size_px smaller, and camera.focal_px and camera.principal_point_px in proportion",
        .size_px[0], .size_px[1], pixels(*.size_px)
    )]
    TooLarge {
        /// Size of the frames.
        size_px: [u32; 2],
        /// Largest number of pixels of which the adapter holds the truth.
        most: u64,
    },
    /// The reference renderer cannot be built.
    #[error(transparent)]
    Reference(#[from] ReferenceError),
    /// A frame cannot be planned or rendered.
    #[error(transparent)]
    Render(#[from] RenderError<Infallible>),
    /// A frame has nothing that is measured.
    #[error("frame {0} has no source coordinates")]
    NoCoords(u64),
}

/// How far a verification is.
#[derive(Clone, Copy, Debug)]
pub enum Progress<'a> {
    /// A face begins, of a field that is divided among several.
    Face(&'static str),
    /// What is measured next.
    Step(&'a str),
    /// A frame is measured.
    Frame(&'a FrameReport),
}

/// Frames to verify, and by what.
#[derive(Debug)]
pub struct Verification<'e> {
    engine: &'e Engine,
    planner: Planner,
    frames: Vec<u64>,
    with_pictures: bool,
}

impl<'e> Verification<'e> {
    /// Of the given frames, or of five, evenly spread; `with_pictures` measures the error of their pictures too, by
    /// many rays of each pixel.
    ///
    /// # Errors
    /// The sequence is that of the reference renderer, does not fit the adapter, or cannot be planned.
    pub fn new(
        engine: &'e Engine,
        sequence: &Arc<Sequence>,
        frames: Option<Vec<u64>>,
        with_pictures: bool,
    ) -> Result<Self, VerifyError> {
        let scenario = &sequence.scenario;
        if scenario.quality.solver == Auto::Value(Solver::Reference) {
            return Err(VerifyError::Solver);
        }
        check_size(scenario.camera.size_px, engine.most_pixels_with_truth())?;
        let channels = &scenario.output.channels;
        let planner =
            Planner::new(sequence.clone(), channels, engine.max_side_px()).map_err(RenderError::Plan)?;
        let frames = frames.unwrap_or_else(|| spread(sequence.frames));
        Ok(Self { engine, planner, frames, with_pictures })
    }

    /// Number of pictures to measure: one of each frame, or of each of its faces.
    #[must_use]
    pub fn pictures(&self) -> usize {
        self.frames.len() * self.planner.lanes()
    }

    /// Measures all frames, and tells how far it is.
    ///
    /// # Errors
    /// What cannot be rendered, and errors of `on`.
    pub fn run<E: From<VerifyError>>(
        &self,
        on: &mut dyn FnMut(Progress<'_>) -> Result<(), E>,
    ) -> Result<VerifyReport, E> {
        let quality = &self.planner.sequence().scenario.quality;
        let mut report = VerifyReport {
            adapter: self.engine.to_string(),
            tolerance_px: quality.max_error_px,
            tolerance_dn: quality.max_error_dn,
            kept: true,
            frames: Vec::new(),
        };
        // A face is verified as the camera that it is, in its own ideal frame.
        for lane in 0..self.planner.lanes() {
            let sequence = self.planner.lane(lane).sequence();
            let mut measuring = Measuring::new(self.engine, sequence, self.with_pictures)?;
            if let Some(face) = measuring.face() {
                on(Progress::Face(face))?;
            }
            for &frame in &self.frames {
                let measured = measuring.frame(frame, on)?;
                on(Progress::Frame(&measured))?;
                report.kept &= measured.keeps_all();
                report.frames.push(measured);
            }
        }
        Ok(report)
    }
}

fn pixels(size_px: [u32; 2]) -> u64 {
    u64::from(size_px[0]) * u64::from(size_px[1])
}

/// Checks the number of pixels. Coordinates are always rendered here, regardless of `output.channels`.
fn check_size(size_px: [u32; 2], most: u64) -> Result<(), VerifyError> {
    if pixels(size_px) <= most { Ok(()) } else { Err(VerifyError::TooLarge { size_px, most }) }
}

/// Evenly spread frames, including the first and the last.
fn spread(frames: u64) -> Vec<u64> {
    let count = frames.min(DEFAULT_FRAMES);
    (0..count).map(|i| if count > 1 { i * (frames - 1) / (count - 1) } else { 0 }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn too_large_frames_are_refused_with_the_limit() {
        assert!(check_size([2048, 2048], 4_194_304).is_ok());
        let error = check_size([4000, 3000], 4_194_304).expect_err("it is too large").to_string();
        assert!(
            error.contains("12000000 pixels")
                && error.contains("at most 4194304")
                && !error.contains("output.channels"),
            "{error}"
        );
    }

    #[test]
    fn frames_are_spread_from_the_first_to_the_last() {
        assert_eq!(spread(1), [0]);
        assert_eq!(spread(3), [0, 1, 2]);
        assert_eq!(spread(101), [0, 25, 50, 75, 100]);
    }
}
