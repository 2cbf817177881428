//! The samples of an exposure.

use camsim_core::scenario::QualitySpec;

use crate::{
    ir::{sampling_plan::SamplingPlan, stages::BlurStage},
    view::exposure::ExposurePath,
};

/// Most samples on one polynomial of the path.
const MAX_SAMPLES: u32 = 512;

/// The exposure's samples where the longest path is not known yet.
pub(crate) fn unbounded_blur_stage(
    plan: &SamplingPlan,
    quality: &QualitySpec,
    exposure: Option<ExposurePath>,
) -> Option<BlurStage> {
    let max_samples = quality.blur_samples.value().unwrap_or(MAX_SAMPLES);
    exposure.map(|exposure| exposure.with_samples(plan.samples_per_px, max_samples))
}

/// The exposure's samples for paths of up to `blur_px` ideal pixels.
pub(crate) fn blur_stage(
    plan: &SamplingPlan,
    quality: &QualitySpec,
    exposure: ExposurePath,
    blur_px: f64,
) -> BlurStage {
    let stretches = exposure.stretches;
    let (samples_per_px, max_samples) = match quality.blur_samples.value() {
        Some(samples) => (f64::from(samples), samples.div_ceil(stretches)),
        None => (
            plan.samples_per_px,
            ((plan.samples_per_px.max(1.0) * blur_px).ceil() as u32 / stretches + 2).clamp(2, MAX_SAMPLES),
        ),
    };
    exposure.with_samples(samples_per_px, max_samples)
}
