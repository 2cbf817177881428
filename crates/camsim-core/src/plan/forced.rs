//! What `quality.preset`, `quality.solver` and `quality.iterations` demand instead of leaving it to the planner.

use glam::DVec2;

use super::{BlurStage, Motion, TemporalStage};
use crate::{
    scenario::{Preset, QualitySpec, Solver},
    temporal::displacement::{self, RK2_STEP_DEG, Twist},
};

/// The temporal stage that the scenario asks for by name, or `None` where the planner chooses.
///
/// `reproject` alone still leaves out what a frame does not need (rotation only, nothing moves); a number of iterations does not.
pub(super) fn temporal_stage(quality: &QualitySpec) -> Option<TemporalStage> {
    if quality.preset == Preset::Paper {
        return Some(TemporalStage::Rk2);
    }
    match (quality.solver.value(), quality.iterations.value()) {
        (Some(Solver::Linear), _) => Some(TemporalStage::Linear),
        (Some(Solver::Rk2), _) => Some(TemporalStage::Rk2),
        (_, Some(iterations)) => Some(TemporalStage::Reproject { iterations }),
        _ => None,
    }
}

/// Eq. 16 is a straight line in time: more than its two ends would be work for nothing.
pub(super) fn blur_stage(temporal: TemporalStage, blur: Option<BlurStage>, quality: &QualitySpec, motion: &Motion) -> Option<BlurStage> {
    if temporal != TemporalStage::Linear {
        return blur;
    }
    blur.map(|_| super::motion::samples_between(2, quality, motion))
}

impl TemporalStage {
    /// Ideal ray where a constant-twist solver looks for what the ray `uv` sees `dt_s` after the key instant; `None` for the others,
    /// which look where the point really is.
    pub(super) fn displaced(self, uv: DVec2, inverse_depth: f64, twist: &Twist, dt_s: f64) -> Option<DVec2> {
        match self {
            Self::Linear => Some(displacement::linear(uv, inverse_depth, twist, dt_s)),
            Self::Rk2 => Some(displacement::rk2(uv, inverse_depth, twist, dt_s, RK2_STEP_DEG.to_radians())),
            Self::Identity | Self::Rotation | Self::Reproject { .. } => None,
        }
    }
}
