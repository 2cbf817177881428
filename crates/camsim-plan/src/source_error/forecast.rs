//! What each temporal inverse makes of the probes of a frame.

use std::sync::OnceLock;

use camsim_core::scene::TerrainDetail;
use rayon::prelude::*;

use super::{
    dry_run::{MAX_LOOK_UPS, SolverErrors},
    exact_sources::{ExactSources, ProbeSource},
    path_miss::PathMiss,
    rounding::Rounding,
    temporal_method::TemporalMethod,
};
use crate::ir::{
    margins,
    stages::{BlurStage, NodeDepths, TemporalStage},
};

/// Phases at which one probe in [`BETWEEN_STEP`] tries what lies between the depths of the exposure's ends.
/// Seen from mid-exposure the depths of a bent surface are missed by a parabola that is 0 at both ends, and
/// the method from there is 0 in the middle: the product is largest here, at 0.5 / sqrt(3). So is what a
/// parabola through three depths misses of a cubic.
const BETWEEN: [f64; 2] = [-0.289, 0.289];
const BETWEEN_STEP: usize = 2;
/// One probe in so many is tried first for whether the depth of mid-exposure does for all of it; not in step
/// with the grid, and with phases in turn.
const MID_STEP: usize = 7;

impl<'a> ExactSources<'a> {
    /// Dry runs of all probes.
    pub fn forecast(&'a self, detail: Option<&'a TerrainDetail<'a>>) -> SourceForecast<'a> {
        let of_probe = |probe: &ProbeSource| self.dry_run.solver_errors(&probe.probe, &probe.source, detail);
        let errors = self.probes.par_iter().with_min_len(16).map(of_probe).collect();
        SourceForecast {
            errors,
            detail,
            sources: self,
            between_px: OnceLock::new(),
            mid_depth: OnceLock::new(),
            mid_depth_of_few: OnceLock::new(),
        }
    }
}

/// Dry runs of one frame.
pub(crate) struct SourceForecast<'a> {
    sources: &'a ExactSources<'a>,
    detail: Option<&'a TerrainDetail<'a>>,
    /// One for each of the probes.
    pub errors: Vec<SolverErrors>,
    /// [`SourceForecast::between_px`] of both, of each probe and the largest, once it matters.
    between_px: OnceLock<(Vec<[f64; 2]>, [f64; 2])>,
    /// With the depth that look-ups find at mid-exposure, of each of the probes, and of one in [`MID_STEP`]:
    /// once it matters.
    mid_depth: OnceLock<Vec<MidDepthErrors>>,
    mid_depth_of_few: OnceLock<Vec<MidDepthErrors>>,
}

/// Error after n look-ups, ideal pixels.
type MidDepthErrors = [f64; MAX_LOOK_UPS + 1];

impl SourceForecast<'_> {
    pub fn largest(&self, figure: impl Fn(usize, &ProbeSource, &SolverErrors) -> f64) -> f64 {
        self.sources.largest(|i, probe| figure(i, probe, &self.errors[i]))
    }

    /// Largest error of a method, without the path between the exposure's nodes.
    pub fn total_px(&self, method: TemporalMethod) -> f64 {
        let of_one = |i, probe: &ProbeSource, errors: &SolverErrors| {
            margins::SOURCE_ERROR * self.error_px(i, method)
                + self.rounding(probe, errors, method.temporal).total_px()
        };
        self.largest(of_one) + margins::SOURCE_ERROR * self.between_px(method)
    }

    /// Error of a method at a probe.
    pub fn error_px(&self, i: usize, method: TemporalMethod) -> f64 {
        let errors = &self.errors[i];
        match method.look_ups_of_mid() {
            Some(look_ups) => self.mid_depth()[i][look_ups].max(errors.after_look_ups[look_ups]),
            None => error_px(errors, method),
        }
    }

    /// The part of the error that a better temporal inverse would mend.
    pub fn unsettled_px(&self, i: usize, method: TemporalMethod) -> f64 {
        match method.temporal {
            TemporalStage::Reproject { iterations } if method.look_ups_of_mid().is_none() => {
                self.errors[i].unsettled[(iterations as usize).min(MAX_LOOK_UPS)]
            }
            _ => self.error_px(i, method),
        }
    }

    /// Works out what [`SourceForecast::error_px`] needs.
    pub fn prepare(&self, method: TemporalMethod) {
        if method.look_ups_of_mid().is_some() {
            self.mid_depth();
        }
    }

    fn mid_depth(&self) -> &[MidDepthErrors] {
        self.mid_depth.get_or_init(|| self.mid_depth_of(1))
    }

    /// Errors with the depth of mid-exposure, of one probe in `step`.
    fn mid_depth_of(&self, step: usize) -> Vec<MidDepthErrors> {
        let ExactSources { dry_run, probes, .. } = self.sources;
        let of_probe = |(probe, errors): (&ProbeSource, &SolverErrors)| {
            dry_run.mid_depth_errors(&probe.probe, &probe.source, errors.far_end_inverse_depth, self.detail)
        };
        probes.par_iter().zip(&self.errors).step_by(step).with_min_len(16).map(of_probe).collect()
    }

    /// Whether a few probes show already that a method misses by more than this.
    pub fn surely_misses(&self, method: TemporalMethod, px: f64) -> bool {
        let Some(look_ups) = method.look_ups_of_mid() else { return false };
        let known = self.mid_depth_of_few.get_or_init(|| self.mid_depth_of(MID_STEP));
        let of_few = |i: usize| if i.is_multiple_of(MID_STEP) { known[i / MID_STEP][look_ups] } else { 0.0 };
        margins::SOURCE_ERROR * self.largest(|i, _, _| of_few(i)) > px
    }

    /// Largest miss of nodes that take what lies between the depths of others.
    pub fn between_px(&self, method: TemporalMethod) -> f64 {
        between_kind(method).map_or(0.0, |kind| self.between().1[kind])
    }

    pub fn between(&self) -> &(Vec<[f64; 2]>, [f64; 2]) {
        self.between_px.get_or_init(|| {
            let ExactSources { reach, ray, dry_run, .. } = *self.sources;
            let (_, far_phases) =
                ExactSources::new(reach, ray, dry_run, &BETWEEN, BETWEEN_STEP).between_px(|_| None);
            let (of_each, at_phases) =
                self.sources.between_px(|i| Some(self.errors[i].far_end_inverse_depth));
            (of_each, [0, 1].map(|k: usize| at_phases[k].max(far_phases[k])))
        })
    }

    /// Largest displacement of a source by the level of detail.
    pub fn level_of_detail_px(&self) -> f64 {
        self.sources.level_of_detail_px(self.detail)
    }

    /// Miss of the exposure's path between its nodes.
    pub fn path_miss(&self, blur: Option<BlurStage>) -> PathMiss {
        self.sources.path_miss(blur)
    }

    pub fn rounding(
        &self,
        ProbeSource { probe, source, .. }: &ProbeSource,
        errors: &SolverErrors,
        stage: TemporalStage,
    ) -> Rounding {
        let ExactSources { reach, ray, dry_run, .. } = self.sources;
        Rounding::new(probe, source.source_px, errors.parallax_px, &reach.camera, dry_run.ideal, *ray, stage)
    }
}

/// Which of the two misses between depths of the exposure a method has.
pub(crate) fn between_kind(method: TemporalMethod) -> Option<usize> {
    match (method.temporal, method.blur?.depths) {
        (TemporalStage::Reproject { .. }, NodeDepths::Ends) => Some(0),
        (TemporalStage::Reproject { .. }, NodeDepths::Three) => Some(1),
        _ => None,
    }
}

/// Error at a probe of a method that takes no depth of mid-exposure elsewhere.
fn error_px(errors: &SolverErrors, method: TemporalMethod) -> f64 {
    match method.temporal {
        TemporalStage::Identity => errors.still_px,
        TemporalStage::Rotation => errors.after_look_ups[0],
        TemporalStage::Linear => errors.linear_px,
        TemporalStage::Rk2 => errors.rk2_px,
        TemporalStage::Reproject { iterations } => {
            let look_ups = (iterations as usize).min(MAX_LOOK_UPS);
            if method.blur.is_some() {
                errors.after_hand_over[look_ups]
            } else {
                errors.after_look_ups[look_ups]
            }
        }
    }
}
