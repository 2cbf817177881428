//! The predicted source error from pixel to pixel: the dry runs of the temporal inverse that a plan has
//! chosen, probe by probe. A plan keeps no more than their largest.

use camsim_core::scene::TerrainDetail;
use rayon::prelude::*;

use super::{exact_sources::ExactSources, temporal_method::TemporalMethod};
use crate::{
    ir::{
        error_map::{ErrorMap, PixelError, SourceError},
        margins,
    },
    view::probes::grid,
};

/// The errors of a method at the probes of a frame.
pub(crate) fn error_map(
    sources: &ExactSources<'_>,
    detail: Option<&TerrainDetail<'_>>,
    method: TemporalMethod,
) -> ErrorMap {
    let reach = sources.reach;
    let forecast = sources.forecast(detail);
    let everywhere_px =
        margins::SOURCE_ERROR * forecast.between_px(method) + forecast.path_miss(method.blur).largest_px;
    // What all probes need is worked out in parallel itself: a thread that waits for its parts would take up
    // a position that waits for it.
    forecast.prepare(method);
    let known = sources.probes.par_iter().zip(&forecast.errors).enumerate().with_min_len(16).map(
        |(i, (probe, errors))| {
            let px = margins::SOURCE_ERROR * forecast.error_px(i, method)
                + forecast.rounding(probe, errors, method.temporal).total_px();
            let error =
                if sources.is_apart(probe) { SourceError::Silhouette } else { SourceError::Within(px) };
            (probe.number, error)
        },
    );
    let known: Vec<(usize, SourceError)> = known.collect();
    let mut pixels: Vec<PixelError> = reach
        .probes
        .iter()
        .map(|probe| PixelError { pixel: probe.pixel, error: SourceError::NoSource })
        .collect();
    for (number, error) in known {
        if let Some(pixel) = pixels.get_mut(number) {
            pixel.error = error;
        }
    }
    ErrorMap { pixels, everywhere_px, grid: grid(&reach.camera), reach_px: reach.probe_px }
}
