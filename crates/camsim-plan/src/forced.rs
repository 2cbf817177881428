//! What `quality.preset`, `quality.solver` and `quality.iterations` demand instead of leaving it to the
//! planner.

use glam::DVec2;

use super::{TemporalStage, exposure::ExposurePath};
use camsim_core::{
    scenario::{Preset, QualitySpec, Solver},
    temporal::displacement::{self, RK2_STEP_DEG, Twist},
};

/// The temporal stage that the scenario asks for by name, or `None` where the planner chooses.
///
/// `reproject` alone still leaves out what a frame does not need (rotation only, nothing moves); a number of
/// iterations does not.
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
pub(super) fn exposure_path(demanded: Option<TemporalStage>, exposure: ExposurePath) -> ExposurePath {
    if demanded == Some(TemporalStage::Linear) { ExposurePath::STRAIGHT } else { exposure }
}

impl TemporalStage {
    /// Ideal ray where a constant-twist solver looks for what the ray `uv` sees `dt_s` after the key instant;
    /// `None` for the others, which look where the point really is.
    pub(super) fn displaced(self, uv: DVec2, inverse_depth: f64, twist: &Twist, dt_s: f64) -> Option<DVec2> {
        match self {
            Self::Linear => Some(displacement::linear(uv, inverse_depth, twist, dt_s)),
            Self::Rk2 => Some(displacement::rk2(uv, inverse_depth, twist, dt_s, RK2_STEP_DEG.to_radians())),
            Self::Identity | Self::Rotation | Self::Reproject { .. } => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use camsim_core::scenario::Auto;

    #[test]
    fn what_is_named_is_taken_and_nothing_else() {
        let stage = |edit: fn(&mut QualitySpec)| {
            let mut quality = QualitySpec::default();
            edit(&mut quality);
            temporal_stage(&quality)
        };
        assert_eq!(stage(|_| {}), None);
        assert_eq!(stage(|q| q.solver = Auto::Value(Solver::Reproject)), None);
        assert_eq!(stage(|q| q.solver = Auto::Value(Solver::Linear)), Some(TemporalStage::Linear));
        assert_eq!(stage(|q| q.solver = Auto::Value(Solver::Rk2)), Some(TemporalStage::Rk2));
        assert_eq!(
            stage(|q| q.iterations = Auto::Value(3)),
            Some(TemporalStage::Reproject { iterations: 3 })
        );
        assert_eq!(stage(|q| q.preset = Preset::Paper), Some(TemporalStage::Rk2));
    }

    #[test]
    fn only_the_constant_twist_solvers_look_beside_the_point() {
        let twist = Twist { rate_rad_s: glam::DVec3::new(0.0, 0.0, 1.0), ..Twist::default() };
        let uv = DVec2::new(0.5, 0.0);
        let at = |stage: TemporalStage| stage.displaced(uv, 0.0, &twist, 0.1);
        assert_eq!(at(TemporalStage::Rotation), None);
        assert_eq!(at(TemporalStage::Reproject { iterations: 2 }), None);
        // Turning to the right about the optical axis, the point was 0.1 rad further clockwise before: u' =
        // u, v' = v + 0.05.
        let linear = at(TemporalStage::Linear).unwrap_or_default();
        assert!(linear.distance(DVec2::new(0.5, 0.05)) < 1e-12, "{linear}");
        let rk2 = at(TemporalStage::Rk2).unwrap_or_default();
        assert!(rk2.distance(DVec2::new(0.5 * 0.1_f64.cos(), 0.5 * 0.1_f64.sin())) < 1e-4, "{rk2}");
    }
}
