//! How far the curves between the exposure's nodes miss what they stand for.

use super::exact_sources::{ExactSources, ProbeSource};
use crate::{
    ir::{
        margins,
        stages::{BlurStage, NodeDepths},
    },
    view::exposure::{may_alias, miss_at_px, miss_px},
};

/// RMS over time of what a polynomial misses between its nodes, of the most: 0.73 of what straight lines miss
/// of a parabola, 0.72 of what parabolas miss of a cubic.
const OVER_TIME: f64 = 0.72;
/// Instants of each probe at which a path is tried whose nodes may all meet a vibration alike: multiples
/// of the golden ratio are in step with nothing.
const ALIASED_INSTANTS: usize = 4;
const GOLDEN: f64 = 0.618_033_988_749_895;
/// Probes whose exposure is tried.
const MISS_PROBES: usize = 32;
/// Polynomials of the path that are tried for each of them.
const MISSED_STRETCHES: u32 = 8;

/// How far the curves between the exposure's nodes miss what they stand for, ideal pixels: the largest miss
/// with a margin, and RMS over probes and time.
#[derive(Clone, Copy, Default)]
pub(crate) struct PathMiss {
    pub largest_px: f64,
    pub rms_px: f64,
}

impl ExactSources<'_> {
    /// Misses of the curves between the exposure's nodes: for a surface at one depth, and where each node
    /// finds its own, along what the rays meet.
    pub fn path_miss(&self, blur: Option<BlurStage>) -> PathMiss {
        let Some(blur) = blur else { return PathMiss::default() };
        let ExactSources { dry_run, probes, .. } = self;
        let stretches = blur.stretches();
        let tried = MISSED_STRETCHES.min(stretches);
        let every = probes.len().div_ceil(MISS_PROBES).max(1);
        let miss = |(i, ProbeSource { probe, source, .. }): (usize, &ProbeSource)| {
            let of_stretch =
                |k| miss_px(blur.path, stretches, k, |fraction| dry_run.source_px(probe, source, fraction));
            let at_one_depth = (0..tried).map(|k| of_stretch(k * stretches / tried)).fold(0.0, f64::max);
            let follows = blur.depths == NodeDepths::Each;
            let along_surfaces = follows
                .then(|| dry_run.miss_along_surfaces_px(probe, blur.path, stretches, i as u32 % stretches));
            along_surfaces.map_or(at_one_depth, |px| px.max(at_one_depth))
        };
        let misses: Vec<f64> = probes.iter().step_by(every).enumerate().map(miss).collect();
        let between = PathMiss { largest_px: largest(&misses), rms_px: OVER_TIME * rms(&misses) };
        let longest_s = dry_run.shutter.longest_exposure_s();
        if !may_alias(blur.solved() - 1, dry_run.path.highest_vibration_hz() * longest_s) {
            return between;
        }
        // Nodes and the middles between them may be whole periods apart.
        let instants = |(i, probe)| {
            (0..ALIASED_INSTANTS)
                .map(move |n| (probe, (GOLDEN * (i * ALIASED_INSTANTS + n + 1) as f64).fract()))
        };
        let miss_at = |(ProbeSource { probe, source, .. }, fraction): (&ProbeSource, f64)| {
            miss_at_px(blur.path, stretches, fraction, |fraction| dry_run.source_px(probe, source, fraction))
        };
        let misses: Vec<f64> =
            probes.iter().step_by(every).enumerate().flat_map(instants).map(miss_at).collect();
        PathMiss {
            largest_px: between.largest_px.max(largest(&misses)),
            rms_px: between.rms_px.max(rms(&misses)),
        }
    }
}

fn largest(misses_px: &[f64]) -> f64 {
    margins::SOURCE_ERROR * misses_px.iter().copied().fold(0.0, f64::max)
}

fn rms(px: &[f64]) -> f64 {
    (px.iter().map(|px| px * px).sum::<f64>() / px.len().max(1) as f64).sqrt()
}
