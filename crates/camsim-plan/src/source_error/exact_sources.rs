//! Exact sources of the probes of a frame.

use std::sync::OnceLock;

use camsim_core::{
    mount::CameraPath, pose::CameraPose, scene::TerrainDetail, sequence::Sequence, temporal::IdealGeometry,
};
use rayon::prelude::*;

use super::dry_run::{DryRun, ExactSource};
use crate::{
    ir::{key_frame::KeyFrame, predicted::Disocclusion, seen_plane::SeenPlane, stages::RayStage},
    view::{lens_reach::LensReach, plane, probes::Probe},
};

/// One probe in so many is tested for a silhouette, to estimate the fraction of those that are at one; not in
/// step with the grid of 24 columns.
const FRACTION_STEP: usize = 5;
/// Phases of the exposure that the probes take turns in. On a shaking mount the middle and the ends may be
/// whole periods apart, where nothing has moved: the last two then stand in no simple ratio to them.
const PHASES: [f64; 5] = [0.0, -0.5, 0.5, -0.309, 0.191];
/// As many of them do for a mount at rest.
const AT_REST: usize = 3;

/// The terrain's level of detail that the ideal pass will draw.
pub(crate) fn terrain_detail<'a>(
    sequence: &'a Sequence,
    key_pose: &CameraPose,
    ideal: &IdealGeometry,
    max_error_px: f64,
) -> Option<TerrainDetail<'a>> {
    let terrain = sequence.scene.terrain.as_ref()?;
    Some(TerrainDetail::new(terrain, key_pose, ideal.tangents(), ideal.focal_px.max_element(), max_error_px))
}

/// Instants of the exposure that probes take turns in.
pub(crate) fn phases(path: &CameraPath, is_exposed: bool) -> &'static [f64] {
    match is_exposed {
        false => &PHASES[..1],
        true if path.highest_vibration_hz() > 0.0 => &PHASES,
        true => &PHASES[..AT_REST],
    }
}

/// Exact sources of the probes of one frame.
pub(crate) struct ExactSources<'a> {
    pub reach: &'a LensReach,
    pub ray: RayStage,
    pub dry_run: DryRun<'a>,
    pub probes: Vec<ProbeSource>,
}

/// A probe with its exact source.
pub(crate) struct ProbeSource {
    /// Number among the camera's probes.
    pub number: usize,
    pub probe: Probe,
    pub source: ExactSource,
    /// Whether it is to be counted apart; unknown until it matters.
    apart: OnceLock<bool>,
}

impl ProbeSource {
    pub fn new(number: usize, probe: Probe, source: ExactSource) -> Self {
        Self { number, probe, source, apart: OnceLock::new() }
    }
}

impl<'a> ExactSources<'a> {
    /// Exact sources of one probe in `step`, which take turns in the phases.
    pub fn new(
        reach: &'a LensReach,
        ray: RayStage,
        dry_run: DryRun<'a>,
        phases: &[f64],
        step: usize,
    ) -> Self {
        let find = |(i, probe): (usize, &Probe)| {
            dry_run
                .exact_source(probe, phases[i % phases.len()])
                .map(|source| ProbeSource::new(i * step, *probe, source))
        };
        let probes =
            reach.probes.par_iter().step_by(step).enumerate().with_min_len(16).filter_map(find).collect();
        ExactSources { reach, ray, dry_run, probes }
    }

    /// Exact sources at mid-exposure alone, to find silhouettes.
    pub fn of_silhouettes(reach: &'a LensReach, dry_run: DryRun<'a>) -> Self {
        Self::new(reach, RayStage::Pinhole, dry_run, &PHASES[..1], 1)
    }

    /// Largest displacement of a source by the level of detail.
    pub fn level_of_detail_px(&self, detail: Option<&TerrainDetail<'_>>) -> f64 {
        self.largest(|_, probe| self.dry_run.level_of_detail_px(&probe.source, detail))
    }

    /// How far the drawn terrain is from its position at each source, ideal pixels.
    pub fn terrain_px(&self, detail: &TerrainDetail<'_>) -> impl ExactSizeIterator<Item = f64> {
        self.probes.iter().map(|probe| self.dry_run.terrain_px(&probe.source, detail))
    }

    /// The largest of a figure over the probes that are not to be counted apart. Only the largest are tested
    /// for it.
    pub fn largest(&self, figure: impl Fn(usize, &ProbeSource) -> f64) -> f64 {
        let counted = self.probes.iter().enumerate().filter(|(_, probe)| probe.apart.get() != Some(&true));
        let mut order: Vec<(f64, &ProbeSource)> =
            counted.map(|(i, probe)| (figure(i, probe), probe)).collect();
        order.sort_by(|a, b| b.0.total_cmp(&a.0));
        order.into_iter().find(|(px, probe)| *px == 0.0 || !self.is_apart(probe)).map_or(0.0, |(px, _)| px)
    }

    /// Folds are not set apart here, so that the bound is on the safe side.
    pub fn is_apart(&self, probe: &ProbeSource) -> bool {
        *probe.apart.get_or_init(|| self.dry_run.at_silhouette(&probe.probe, &probe.source, false))
    }

    /// Fraction of the pixels at silhouettes: of one probe in [`FRACTION_STEP`].
    pub fn silhouette_fraction(&self) -> f64 {
        let asked: Vec<&ProbeSource> = self.probes.iter().step_by(FRACTION_STEP).collect();
        let apart = asked
            .par_iter()
            .with_min_len(8)
            .filter(|probe| self.dry_run.at_silhouette(&probe.probe, &probe.source, true))
            .count();
        apart as f64 / asked.len().max(1) as f64
    }

    /// Fraction of the pixels that are counted apart, given which probes are beside a step or fold.
    pub fn fraction_apart(&self, is_beside: impl Fn(usize) -> bool) -> f64 {
        let apart =
            self.probes.iter().filter(|probe| probe.source.is_hidden() || is_beside(probe.number)).count();
        apart as f64 / self.probes.len().max(1) as f64
    }

    /// The plane that is nearest to what they see in the key frame.
    pub fn plane(&self) -> SeenPlane {
        let DryRun { key_pose, ideal, .. } = self.dry_run;
        let surfaces = self.probes.iter().filter(|probe| probe.source.key_inverse_depth > 0.0);
        let inverse_depth = |ProbeSource { source, .. }: &ProbeSource| {
            ((source.source_px - ideal.principal_px) / ideal.focal_px, source.key_inverse_depth)
        };
        plane::fit(*key_pose, surfaces.map(inverse_depth))
    }

    /// What key frames do not show.
    pub fn disocclusion(&self, keys: &[KeyFrame], max_error_px: f64) -> Disocclusion {
        let probe = self.probes.par_iter().map(|ProbeSource { probe, source, .. }| (probe, source));
        Disocclusion::new(&self.dry_run, probe, keys, self.probe_px(), max_error_px)
    }

    /// Side of the part of the picture that a probe stands for, ideal pixels.
    fn probe_px(&self) -> f64 {
        self.dry_run.ideal.scale(&self.reach.camera) * self.reach.probe_px
    }

    /// Miss of what lies between the depths of the exposure's ends, and between these and its middle, of each
    /// probe, and the largest. `elsewhere` is
    /// [`SolverErrors::far_end_inverse_depth`](super::dry_run::SolverErrors::far_end_inverse_depth) of each,
    /// if that is known.
    pub fn between_px(&self, elsewhere: impl Fn(usize) -> Option<f64> + Sync) -> (Vec<[f64; 2]>, [f64; 2]) {
        let of_probe = |(i, probe): (usize, &ProbeSource)| {
            self.dry_run.between_px(&probe.probe, &probe.source, elsewhere(i))
        };
        let px: Vec<[f64; 2]> = self.probes.par_iter().enumerate().with_min_len(16).map(of_probe).collect();
        let largest = [0, 1].map(|k: usize| self.largest(|i, _| px[i][k]));
        (px, largest)
    }
}
