//! How finely a frame is sampled, and the picture error that this leaves.

use camsim_core::temporal::TapStage;

use super::stages::PrefilterTaps;

/// Expected picture error of a sampling plan, RMS over the picture, 1/255 of the linear range.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct ResamplingError {
    pub resampling_dn: f64,
    pub blur_dn: f64,
}

impl ResamplingError {
    pub fn total_dn(self) -> f64 {
        self.resampling_dn.hypot(self.blur_dn)
    }
}

/// How finely a frame is sampled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SamplingPlan {
    /// Ideal pixels for each of the camera's.
    pub scale: f64,
    pub surface_reads: PrefilterTaps,
    /// Samples of each ideal pixel.
    pub samples_a_pixel: u32,
    pub taps: TapStage,
    pub samples_per_px: f64,
    pub expected: ResamplingError,
}

impl SamplingPlan {
    /// A plan whose error is not known yet.
    pub fn new(scale: f64, surface_reads: PrefilterTaps, taps: TapStage) -> Self {
        Self {
            scale,
            surface_reads,
            samples_a_pixel: 1,
            taps,
            samples_per_px: 0.0,
            expected: ResamplingError::default(),
        }
    }

    /// A plan by its ideal frame, which is read bilinearly.
    pub fn of_ideal(scale: f64, surface_reads: PrefilterTaps, samples_a_pixel: u32) -> Self {
        Self { samples_a_pixel, ..Self::new(scale, surface_reads, TapStage::Bilinear) }
    }

    /// The paper's plan: one bilinear read a sample.
    pub fn of_paper() -> Self {
        Self::new(1.0, PrefilterTaps::Grid, TapStage::Bilinear)
    }
}
