//! Plans that share an ideal frame, made to agree on it.

use crate::ir::{frame_plan::FramePlan, motion::Motion, predicted::Predicted, skip::Skip};

/// Plans from one ideal frame: what that is made by is the strictest of all.
pub(crate) fn merged(mut plans: Vec<FramePlan>) -> Vec<FramePlan> {
    let (Some(first), Some(last)) =
        (plans.first().map(|plan| plan.frame), plans.last().map(|plan| plan.frame))
    else {
        return plans;
    };
    let terrain_error_px = plans.iter().map(|plan| plan.terrain_error_px).fold(f64::INFINITY, f64::min);
    let motion = plans.iter().map(|plan| plan.motion).reduce(Motion::and).unwrap_or_default();
    let predicted: Vec<Predicted> =
        plans.iter().map(|plan| with_largest_source_errors(plan, &plans)).collect();
    for (plan, predicted) in plans.iter_mut().zip(predicted) {
        plan.predicted = predicted;
        plan.shared_frames = Some([first, last]);
        plan.predicted.terrain =
            plan.predicted.terrain.map(|terrain| terrain.times(terrain_error_px / plan.terrain_error_px));
        plan.terrain_error_px = terrain_error_px;
        // What does not depend on the ideal frame stays that of the frame.
        let Motion { own, blur_px, blur_sagitta_px, .. } = plan.motion;
        plan.motion = Motion { own, blur_px, blur_sagitta_px, ..motion };
        plan.skipped.push(Skip {
            what: "ideal frame of its own",
            reason: format!("frames {first} to {last} are made from one"),
        });
    }
    plans
}

/// The prediction of a plan, with the largest source errors of all frames from the same ideal frame that are
/// solved in the same way: each has been run dry at a part of the probes, and they are alike.
fn with_largest_source_errors(plan: &FramePlan, plans: &[FramePlan]) -> Predicted {
    let is_alike = |other: &&FramePlan| other.temporal == plan.temporal && other.blur == plan.blur;
    let all = || plans.iter().filter(is_alike).map(|plan| &plan.predicted);
    let most = |figure: fn(&Predicted) -> f64| all().map(figure).fold(0.0, f64::max);
    let worst = all().max_by(|a, b| a.total_px.total_cmp(&b.total_px));
    Predicted {
        lens_px: most(|predicted| predicted.lens_px),
        temporal_px: most(|predicted| predicted.temporal_px),
        depth_px: most(|predicted| predicted.depth_px),
        level_of_detail_px: most(|predicted| predicted.level_of_detail_px),
        nodes_px: most(|predicted| predicted.nodes_px),
        rounding_px: most(|predicted| predicted.rounding_px),
        total_px: most(|predicted| predicted.total_px),
        void_fraction: most(|predicted| predicted.void_fraction),
        source_error_obstacle: worst.and_then(|worst| worst.source_error_obstacle.clone()),
        probes: all().map(|predicted| predicted.probes).sum(),
        source_error_kept: all().all(|predicted| predicted.source_error_kept),
        ..plan.predicted.clone()
    }
}
