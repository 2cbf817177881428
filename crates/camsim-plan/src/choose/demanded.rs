//! What `quality.preset`, `quality.solver` and `quality.iterations` demand instead of leaving it to the
//! planner.

use camsim_core::scenario::{Preset, QualitySpec, Solver};

use crate::{ir::stages::TemporalStage, view::exposure::ExposurePath};

/// The temporal stage that the scenario demands by name, or `None` where the planner chooses.
///
/// `reproject` alone still leaves out what a frame does not need (rotation only, nothing moves); a number of
/// iterations does not.
pub(crate) fn temporal_stage(quality: &QualitySpec) -> Option<TemporalStage> {
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
pub(crate) fn exposure_path(demanded: Option<TemporalStage>, exposure: ExposurePath) -> ExposurePath {
    if demanded == Some(TemporalStage::Linear) { ExposurePath::STRAIGHT } else { exposure }
}

#[cfg(test)]
mod tests {
    use super::*;
    use camsim_core::scenario::Auto;

    #[test]
    fn named_solvers_and_iterations_are_demanded() {
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
}
