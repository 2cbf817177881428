//! The error of a row against the oracle, on one frame of the case.
//!
//! Coordinates are compared at every second pixel of every second row. Pictures are compared at a part of the
//! pixels, each of them converged: the oracle takes tens to hundreds of rays a pixel. The part is random over
//! the picture, and random over the neighbourhood of silhouettes, where it is denser; the overall figure
//! weighs both as they are in the whole picture.

use std::{convert::Infallible, sync::Arc};

use camsim_core::{
    frame::RenderedFrame,
    reference::{CoordErrors, CoordTruth, Oracle, RenderOptions},
    scenario::Channel,
    sequence::Sequence,
};
use camsim_engine::{Engine, Finished};

use super::{BenchError, rounds::FRAME};
use crate::cases::world::hash;

/// Coordinates of every so many pixels are compared, in both directions: 76 800 of 640x480, as many as a 99th
/// percentile needs by far.
const STEP_PX: u32 = 2;
/// Pixels of the picture that are compared, about: away from silhouettes, and within 3 px of them.
const PICTURED: [u64; 2] = [4000, 2000];
/// Seed of their choice.
const SEED: u64 = 77;
/// The oracle's pixels are refined to this standard error, 1/255: 62 dB, well above any row.
const TOLERANCE_DN: f64 = 0.2;
/// Rays of a pixel at most.
const MAX_SAMPLES: u32 = 1024;

/// What the oracle knows of a case at one size.
#[derive(Debug)]
pub struct Truth {
    coords: CoordTruth,
    picture: RenderedFrame,
    /// Pixels of the whole frame: away from silhouettes, and near them.
    whole: [u64; 2],
}

/// What is wrong with a picture.
#[derive(Clone, Copy, Debug, Default)]
pub struct PictureErrors {
    /// Over the whole picture; `None` for equal pictures.
    pub psnr_db: Option<f64>,
    /// Within 3 px of silhouettes; `None` without any.
    pub edge_psnr_db: Option<f64>,
    /// RMS of the picture away from silhouettes, 1/255 of the linear range: what the plan's levels predict.
    pub smooth_dn: Option<f64>,
    /// Pixels behind the two.
    pub pixels: u64,
}

impl Truth {
    /// Looks at the frame, and renders the chosen pixels.
    ///
    /// # Errors
    /// A camera that cannot be used.
    pub fn new(sequence: &Arc<Sequence>) -> Result<Self, BenchError> {
        let oracle = Arc::new(Oracle::new(sequence.clone())?);
        let coords = CoordTruth::new(oracle.clone(), FRAME, 0.0);
        let near = coords.near_silhouettes();
        let valid: Vec<bool> = coords.valid().collect();
        let whole = [false, true].map(|kind| {
            near.iter().zip(&valid).filter(|(near, valid)| **valid && **near == kind).count() as u64
        });
        let only = chosen(near, whole);
        let options = RenderOptions {
            max_samples: MAX_SAMPLES,
            tolerance_dn: TOLERANCE_DN,
            only: Some(only),
            ..RenderOptions::default()
        };
        let picture = oracle.render(FRAME, &options);
        Ok(Self { coords, picture, whole })
    }

    /// Renders the frame with its source coordinates as `sequence` says, and compares them.
    ///
    /// # Errors
    /// Whatever the renderer meets.
    pub fn coord_errors(
        &self,
        engine: &Engine,
        sequence: &Arc<Sequence>,
    ) -> Result<Option<CoordErrors>, BenchError> {
        let mut session = engine.session::<Infallible>(sequence.clone(), &[Channel::Coords])?;
        let mut finished = None;
        session.render::<Infallible>([FRAME], &mut |done| {
            finished = Some(done);
            Ok(())
        })?;
        Ok(finished
            .and_then(|Finished { frame, plan, .. }| self.coords.errors(&plan.ideal_view(), &frame, STEP_PX)))
    }

    /// Compares a picture of the frame.
    #[must_use]
    pub fn picture_errors(&self, frame: &RenderedFrame) -> PictureErrors {
        let squares = self.squares(frame);
        let mean = |kind: usize| squares[kind].0 / (3 * squares[kind].1.max(1)) as f64;
        let share = self.whole.map(|pixels| pixels as f64 / (self.whole[0] + self.whole[1]).max(1) as f64);
        let psnr_db = |mean_square: f64| (mean_square > 0.0).then(|| -10.0 * mean_square.log10());
        PictureErrors {
            psnr_db: psnr_db(share[0] * mean(0) + share[1] * mean(1)),
            edge_psnr_db: psnr_db(mean(1)),
            smooth_dn: (squares[0].1 > 0).then(|| 255.0 * mean(0).sqrt()),
            pixels: squares[0].1 + squares[1].1,
        }
    }

    /// Sum of squared differences of linear values, and pixels, away from silhouettes and near them. A pixel
    /// that one of the two has not counts in `falsely_valid` or `missing` instead.
    fn squares(&self, frame: &RenderedFrame) -> [(f64, u64); 2] {
        let mut sums = [(0.0, 0); 2];
        let pairs = self.picture.color_rgba.chunks_exact(4).zip(frame.color_rgba.chunks_exact(4));
        for ((truth, own), near) in pairs.zip(self.coords.near_silhouettes()) {
            if truth[3] > 0.0 && own[3] > 0.0 {
                let (sum, count) = &mut sums[usize::from(*near)];
                *sum += truth[..3]
                    .iter()
                    .zip(own)
                    .map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2))
                    .sum::<f64>();
                *count += 1;
            }
        }
        sums
    }
}

/// Pixels of each kind at random, the same on every machine.
fn chosen(near: &[bool], whole: [u64; 2]) -> Vec<bool> {
    let stride = [0, 1].map(|kind: usize| (whole[kind] / PICTURED[kind]).max(1));
    near.iter().zip(0..).map(|(near, i)| hash(SEED, i).is_multiple_of(stride[usize::from(*near)])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_pixels_of_each_kind_are_chosen_all_over_the_picture() {
        let (width, height) = (640, 480);
        let near: Vec<bool> = (0..width * height).map(|i| i % width > 600).collect();
        let whole = [false, true].map(|kind| near.iter().filter(|near| **near == kind).count() as u64);
        let only = chosen(&near, whole);
        for kind in [false, true] {
            let count = only.iter().zip(&near).filter(|(only, near)| **only && **near == kind).count() as u64;
            let wanted = PICTURED[usize::from(kind)];
            assert!((wanted / 2..2 * wanted).contains(&count), "{count}");
        }
        // Six to fifty a column: a few may be without.
        let columns = (0..width).filter(|x| (0..height).any(|y| only[y * width + x])).count();
        assert!(columns > width - 10, "{columns}");
    }
}
