//! What resampling and the samples of the exposure cost in the picture.
//!
//! At a few positions of the image (`texture_probes.rs`) the surface in view, its texture's power spectrum
//! (`texture_spectra.rs`) and the two maps from the texture over the ideal frame to the output pixel are
//! known. What each stage leaves of a wave of the texture has a closed form (`transfer.rs`): the filter of
//! the ideal frame's surfaces, the reads between its pixels with what they alias, the grid of reads, the
//! samples over the exposure. The exact pixel is the mean over its area and over the exposure. The squared
//! difference of the two, weighed by the spectrum, is the expected squared error. Not a bound: textures are
//! taken to have the same spectrum in all directions, and silhouettes are not in it. Measured against the
//! reference's pictures away from silhouettes: docs/theory/ACCURACY.md.

use std::sync::{Arc, PoisonError};

use camsim_core::{
    scene::Prefilter,
    temporal::{Footprint, TapStage},
};
use glam::DVec2;
use rayon::prelude::*;

use super::{
    resampling_cache::{ResamplingParts, known},
    texture_probes::{TextureProbe, TextureProbes},
    transfer::{ReadSpan, SampledPath, TextureWaves, error2},
};
use crate::ir::{
    margins,
    sampling_plan::{ResamplingError, SamplingPlan},
    stages::{BlurStage, PrefilterTaps, sample_count},
};

/// Probes that one thread takes at a time: fewer are not worth another.
const AT_ONCE: usize = 8;
/// Eight-bit textures, their smaller versions and the filter's weights, 1/255 of the linear range.
const FORMAT_DN: f64 = 0.12;

impl TextureProbes<'_> {
    /// Expected error of a sampling plan.
    pub fn expected(&self, sampling: &SamplingPlan, blur: Option<BlurStage>) -> ResamplingError {
        self.expected_at(1, sampling, blur)
    }

    /// Expected error of a sampling plan, from one probe in `every`.
    pub fn expected_at(
        &self,
        every: usize,
        sampling: &SamplingPlan,
        blur: Option<BlurStage>,
    ) -> ResamplingError {
        let exact = self.exact2(every, sampling, blur.is_some());
        let sampled = blur.map_or(exact, |blur| self.sampled2(every, sampling, blur));
        ResamplingError {
            resampling_dn: dn(exact),
            blur_dn: margins::TEXTURES * 255.0 * (sampled - exact).max(0.0).sqrt(),
        }
    }

    /// Mean squared error of a sampling plan with the exposure exact.
    pub fn exact2(
        &self,
        every: usize,
        &SamplingPlan { scale, surface_reads, taps, .. }: &SamplingPlan,
        exposed: bool,
    ) -> f64 {
        self.mean_square(every, |probe| probe.exact2(scale, surface_reads, taps, exposed, self.principal_px))
    }

    /// Mean squared error of a sampling plan with the samples of its exposure.
    fn sampled2(
        &self,
        every: usize,
        &SamplingPlan { scale, surface_reads, taps, .. }: &SamplingPlan,
        blur: BlurStage,
    ) -> f64 {
        self.mean_square(every, |probe| {
            let sides = scale * probe.camera_from_px;
            let area = Footprint::new(sides.x_axis, sides.y_axis, taps);
            let samples = probe.distinct_samples(sample_count(&blur, scale * probe.path_px, &area));
            probe.sampled2(scale, surface_reads, taps, samples, self.principal_px)
        })
    }

    /// Mean over the picture, from one probe in `every`.
    fn mean_square(&self, every: usize, square: impl Fn(&TextureProbe<'_>) -> f64 + Sync) -> f64 {
        let weighted =
            |probe: &TextureProbe<'_>| [probe.weight, probe.weight * probe.gain * probe.gain * square(probe)];
        // Summed in their order: a plan does not depend on how threads share work.
        let squares: Vec<[f64; 2]> =
            self.probes.par_iter().step_by(every).with_min_len(AT_ONCE).map(weighted).collect();
        let [weight, square] =
            squares.iter().fold([0.0; 2], |sum, square| [0, 1].map(|k: usize| sum[k] + square[k]));
        square / (weight / self.weight() * self.counted as f64).max(1.0)
    }

    /// Weight of all probes.
    pub(crate) fn weight(&self) -> f64 {
        self.probes.iter().map(|probe| probe.weight).sum::<f64>().max(1e-9)
    }
}

pub(crate) fn dn(square: f64) -> f64 {
    (margins::TEXTURES * 255.0 * square.sqrt()).hypot(FORMAT_DN)
}

impl TextureProbe<'_> {
    /// Expected squared error of a pixel here with so many samples of an exposure.
    pub fn sampled2(
        &self,
        scale: f64,
        reads: PrefilterTaps,
        taps: TapStage,
        samples: u32,
        principal_px: DVec2,
    ) -> f64 {
        self.error2(
            scale,
            (reads, taps),
            ReadSpan::Samples(SampledPath { along: scale * self.path, samples }),
            principal_px,
        )
    }

    /// Expected squared error of a pixel here with an exact exposure, or with none.
    pub fn exact2(
        &self,
        scale: f64,
        reads: PrefilterTaps,
        taps: TapStage,
        exposed: bool,
        principal_px: DVec2,
    ) -> f64 {
        self.error2(
            scale,
            (reads, taps),
            if exposed { ReadSpan::All(scale * self.path) } else { ReadSpan::Instant },
            principal_px,
        )
    }

    /// [`error2`] with its parts from the cache; `principal_px` is the camera's.
    fn error2(
        &self,
        scale: f64,
        (reads, taps): (PrefilterTaps, TapStage),
        over: ReadSpan,
        principal_px: DVec2,
    ) -> f64 {
        let sides = scale * self.camera_from_px;
        let texel_from_ideal = self.texel_from_key * scale.recip();
        let (along, samples) = match over {
            ReadSpan::Instant => (None, None),
            ReadSpan::All(along) => (Some(along), None),
            ReadSpan::Samples(path) => (Some(path.along), Some(path.samples)),
        };
        let frame = (scale.to_bits(), along.is_some());
        // One thread at a time works on a probe; what is cached is replaced whole.
        let mut parts = self.cache.0.lock().unwrap_or_else(PoisonError::into_inner);
        let ResamplingParts { waves, filtered, read } = &mut *parts;
        let waves = known(waves, frame, || {
            Arc::new(TextureWaves::new(self.spectrum, texel_from_ideal, self.key_from_camera * sides, along))
        });
        let filtered = known(filtered, (frame, reads), || {
            waves.filtered(&Prefilter::new(texel_from_ideal, reads)).into()
        });
        let read = known(read, (frame, taps, samples), || {
            let area = Footprint::new(sides.x_axis, sides.y_axis, taps);
            let beside_px = (scale * self.key_px + principal_px).fract_gl();
            waves.read(&area, over, beside_px).into()
        });
        error2(&waves, &filtered, &read)
    }
}
