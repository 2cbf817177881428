//! Errors of a row against the reference renderer, on one frame of the case.
//!
//! Source coordinates are compared at every second pixel of every second row. Pictures are compared at random
//! pixels, which the reference renderer refines with tens to hundreds of rays each. Near silhouettes the
//! pixels are denser; the overall figure weights both kinds by their fractions of the whole picture.

use std::{convert::Infallible, sync::Arc};

use camsim_core::{
    frame::RenderedFrame,
    reference::{CoordErrors, CoordTruth, ReferenceRenderer, RenderOptions},
    scenario::Channel,
    sequence::Sequence,
};
use camsim_engine::{Engine, Finished};

use super::{BenchError, rounds::FRAME};
use crate::cases::hash;

/// Step of the pixels whose coordinates are compared, in x and y: 76 800 of 640x480, far more than a 99th
/// percentile needs.
const STEP_PX: u32 = 2;
/// Approximate numbers of pixels whose colours are compared: away from silhouettes, and within 3 px of them.
const COMPARED_PIXELS: [u64; 2] = [4000, 2000];
/// Seed of the choice of these pixels.
const SEED: u64 = 77;
/// Standard error of the reference pixels, DN: 62 dB, well above the PSNR of any row.
const TOLERANCE_DN: f64 = 0.2;
/// Most rays per pixel.
const MAX_SAMPLES: u32 = 1024;

/// Reference coordinates and picture of a case at one size.
#[derive(Debug)]
pub struct Truth {
    coords: CoordTruth,
    picture: RenderedFrame,
    /// Numbers of valid pixels in the whole frame: away from silhouettes, and near them.
    valid_pixels: [u64; 2],
}

/// Errors of a picture.
#[derive(Clone, Copy, Debug, Default)]
pub struct PictureErrors {
    /// PSNR over the whole picture; `None` for equal pictures.
    pub psnr_db: Option<f64>,
    /// PSNR within 3 px of silhouettes; `None` without silhouettes.
    pub edge_psnr_db: Option<f64>,
    /// RMS error away from silhouettes, DN, which the plan predicts.
    pub smooth_dn: Option<f64>,
    /// Number of compared pixels.
    pub pixels: u64,
}

impl Truth {
    /// Computes the reference coordinates and renders the reference pixels.
    ///
    /// # Errors
    /// A camera that cannot be used.
    pub fn new(sequence: &Arc<Sequence>) -> Result<Self, BenchError> {
        let reference = Arc::new(ReferenceRenderer::new(sequence.clone())?);
        let coords = CoordTruth::new(reference.clone(), FRAME, 0.0);
        let near = coords.near_silhouettes();
        let valid: Vec<bool> = coords.valid().collect();
        let valid_pixels = [false, true].map(|kind| {
            near.iter().zip(&valid).filter(|(near, valid)| **valid && **near == kind).count() as u64
        });
        let only = pixel_mask(near, valid_pixels);
        let options = RenderOptions {
            max_samples: MAX_SAMPLES,
            tolerance_dn: TOLERANCE_DN,
            only: Some(only),
            ..RenderOptions::default()
        };
        let picture = reference.render(FRAME, &options);
        Ok(Self { coords, picture, valid_pixels })
    }

    /// Renders the source coordinates of the frame and compares them.
    ///
    /// # Errors
    /// Any error of rendering.
    pub fn coord_errors(
        &self,
        engine: &Engine,
        sequence: &Arc<Sequence>,
    ) -> Result<Option<CoordErrors>, BenchError> {
        let mut session = engine.session::<Infallible>(sequence.clone(), &[Channel::Coords])?;
        session.set_looked_up_coords(true);
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
        let squares = self.squared_errors(frame);
        let mean = |kind: usize| squares[kind].0 / (3 * squares[kind].1.max(1)) as f64;
        let fraction = self
            .valid_pixels
            .map(|pixels| pixels as f64 / (self.valid_pixels[0] + self.valid_pixels[1]).max(1) as f64);
        let psnr_db = |mean_square: f64| (mean_square > 0.0).then(|| -10.0 * mean_square.log10());
        PictureErrors {
            psnr_db: psnr_db(fraction[0] * mean(0) + fraction[1] * mean(1)),
            edge_psnr_db: psnr_db(mean(1)),
            smooth_dn: (squares[0].1 > 0).then(|| 255.0 * mean(0).sqrt()),
            pixels: squares[0].1 + squares[1].1,
        }
    }

    /// Sums of squared differences of linear values and numbers of pixels, away from silhouettes and near
    /// them. A pixel that is invalid in one picture counts in `falsely_valid` or `missing` instead.
    fn squared_errors(&self, frame: &RenderedFrame) -> [(f64, u64); 2] {
        let mut sums = [(0.0, 0); 2];
        let pairs = self.picture.color_rgba().chunks_exact(4).zip(frame.color_rgba().chunks_exact(4));
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

/// Random pixels of each kind to compare, the same on every machine.
fn pixel_mask(near: &[bool], valid_pixels: [u64; 2]) -> Vec<bool> {
    let stride = [0, 1].map(|kind: usize| (valid_pixels[kind] / COMPARED_PIXELS[kind]).max(1));
    near.iter().zip(0..).map(|(near, i)| hash(SEED, i).is_multiple_of(stride[usize::from(*near)])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn compared_pixels_are_spread_over_the_picture() {
        let (width, height) = (640, 480);
        let near: Vec<bool> = (0..width * height).map(|i| i % width > 600).collect();
        let whole = [false, true].map(|kind| near.iter().filter(|near| **near == kind).count() as u64);
        let only = pixel_mask(&near, whole);
        for kind in [false, true] {
            let count = only.iter().zip(&near).filter(|(only, near)| **only && **near == kind).count() as u64;
            let wanted = COMPARED_PIXELS[usize::from(kind)];
            assert!((wanted / 2..2 * wanted).contains(&count), "{count}");
        }
        // There are 6 to 50 pixels in a column, so a few columns may have none.
        let columns = (0..width).filter(|x| (0..height).any(|y| only[y * width + x])).count();
        assert!(columns > width - 10, "{columns}");
    }
}
