//! The cheapest temporal inverse that keeps the tolerances, and the errors that it leaves.

use camsim_core::reference::MAX_VOID_SHARE;

use super::{
    temporal_task::TemporalTask,
    terrain_detail::{self, TerrainChoice},
};
use crate::{
    ir::{
        budget::{ErrorBudget, worthwhile_nodes_px},
        margins,
        motion::Motion,
        predicted::{Predicted, TerrainError},
        skip::Skip,
        stages::{NodeDepths, TemporalStage},
    },
    source_error::{
        dry_run::MAX_LOOK_UPS,
        exact_sources::ExactSources,
        forecast::{SourceForecast, between_kind},
        path_miss::PathMiss,
        temporal_method::TemporalMethod,
    },
    view::exposure::MOST_STEPS,
};

/// A method whose error is more than this part of another one's is not worth its time.
const BETTER: f64 = 0.95;

/// What was chosen, and what it leads to.
pub(crate) struct TemporalChoice<'a> {
    pub method: TemporalMethod,
    pub terrain_tolerance_px: f64,
    pub predicted: Predicted,
    /// How far the path between the exposure's nodes is missed, and the tolerance to be kept, ideal pixels,
    /// where one is broken.
    pub missed_px: Option<[f64; 2]>,
    pub sources: ExactSources<'a>,
}

/// The cheapest temporal inverse, and the coarsest terrain, within the tolerances.
pub(crate) fn choose<'a>(task: &TemporalTask<'a>, motion: &Motion) -> TemporalChoice<'a> {
    let budget = ErrorBudget::new(&task.sequence.scenario.quality);
    let sources = task.exact_sources();
    let TerrainChoice { tolerance_px: terrain_tolerance_px, detail, error: terrain } =
        terrain_detail::coarsest(task, &sources);
    let search = TemporalSearch { task, forecast: sources.forecast(detail.as_ref()), terrain };
    // Something small and near may pass between the probes: where there are silhouettes only the bound
    // counts.
    let may_skip_depth = !task.silhouettes_in_view || motion.parallax_px <= budget.bound_px();
    let method = match task.demanded {
        Some(temporal) => TemporalMethod { temporal, blur: task.blur },
        None => search.choose(task.methods(motion, may_skip_depth)),
    };
    let mut predicted = search.predict(method);
    if task.silhouettes_in_view {
        predicted.silhouette_fraction = task
            .silhouettes
            .map_or_else(|| sources.silhouette_fraction(), |silhouettes| silhouettes.fraction);
    }
    let missed_px = missed_px(task, &predicted);
    TemporalChoice { method, terrain_tolerance_px, predicted, missed_px, sources }
}

/// [`TemporalChoice::missed_px`].
fn missed_px(task: &TemporalTask<'_>, predicted: &Predicted) -> Option<[f64; 2]> {
    let (max_error_px, nodes_px) = (task.sequence.scenario.quality.max_error_px, predicted.nodes_px);
    // The picture error follows the displacement.
    let most_dn = task.left_for_misregistration_dn(predicted.terrain);
    let is_seen =
        predicted.misregistration_dn > most_dn && nodes_px > worthwhile_nodes_px(predicted.total_px);
    let for_picture_px = is_seen.then(|| nodes_px * most_dn / predicted.misregistration_dn);
    let for_sources_px = (!predicted.source_error_kept).then_some(max_error_px);
    for_picture_px.into_iter().chain(for_sources_px).reduce(f64::min).map(|most_px| [nodes_px, most_px])
}

/// What the choice of a temporal inverse leaves out, and why nothing is lost.
pub(crate) fn note_skips(motion: &Motion, temporal: TemporalStage, skipped: &mut Vec<Skip>) {
    if matches!(temporal, TemporalStage::Rotation | TemporalStage::Identity) {
        skipped.push(Skip {
            what: "depth in the temporal inverse",
            reason: format!("parallax within the frame is at most {:.2e} px", motion.parallax_px),
        });
    }
    if temporal == TemporalStage::Identity {
        skipped.push(Skip {
            what: "temporal inverse",
            reason: format!(
                "rotation within the frame moves no pixel by more than {:.2e} px",
                motion.rotation_px
            ),
        });
    }
}

/// Methods of one frame, by their errors.
struct TemporalSearch<'t, 'a> {
    task: &'t TemporalTask<'a>,
    forecast: SourceForecast<'t>,
    terrain: Option<TerrainError>,
}

impl TemporalSearch<'_, '_> {
    /// Misregistration, RMS over the picture, 1/255 of the linear range.
    fn misregistration_dn(&self, method: TemporalMethod, missed: PathMiss) -> f64 {
        let Self { task, forecast, .. } = self;
        let scale = task.ideal.scale(&task.reach.camera);
        // What is farther off than all that count is at silhouettes.
        let most_px = forecast.largest(|i, _, _| forecast.error_px(i, method));
        let between = between_kind(method).map(|kind| (kind, &forecast.between().0));
        let of_probe = |i: usize| {
            let error_px = forecast.error_px(i, method);
            let between_px = between.map_or(0.0, |(kind, px)| px[i][kind].min(forecast.between_px(method)));
            let solved_px = if error_px <= most_px { error_px + between_px } else { 0.0 };
            solved_px.hypot(missed.rms_px) / scale
        };
        task.shown.misregistration_dn((0..forecast.errors.len()).map(of_probe))
    }

    /// The first method within the tolerances, or the best there is.
    fn choose(&self, methods: Vec<TemporalMethod>) -> TemporalMethod {
        let tolerance_px = self.task.sequence.scenario.quality.max_error_px;
        // What a few probes rule out is tried at all of them only if nothing else keeps the tolerance.
        let (ruled_out, in_question): (Vec<TemporalMethod>, Vec<TemporalMethod>) =
            methods.iter().copied().partition(|method| self.forecast.surely_misses(*method, tolerance_px));
        match self.first_within(in_question) {
            Err(_) if !ruled_out.is_empty() => self.first_within(methods).unwrap_or_else(|best| best),
            Ok(method) | Err(method) => method,
        }
    }

    /// The first method within the tolerances, of source coordinates and of what these cost in the picture;
    /// or else the best there is.
    fn first_within(&self, methods: Vec<TemporalMethod>) -> Result<TemporalMethod, TemporalMethod> {
        let tolerance_px = self.task.sequence.scenario.quality.max_error_px;
        let left_dn = self.task.left_for_misregistration_dn(self.terrain);
        let mut best: Option<(f64, TemporalMethod)> = None;
        let mut known: Vec<((u32, u32, bool), PathMiss)> = Vec::new();
        for method in methods {
            let nodes = method.blur.map_or_else(Default::default, |blur| {
                (blur.solved(), blur.path.steps(), blur.depths == NodeDepths::Each)
            });
            let missed =
                known.iter().find(|known| known.0 == nodes).map(|known| known.1).unwrap_or_else(|| {
                    let missed = self.forecast.path_miss(method.blur);
                    known.push((nodes, missed));
                    missed
                });
            let of_px = (self.forecast.total_px(method) + missed.largest_px) / tolerance_px;
            let is_better = |of_tolerance: f64| best.is_none_or(|(least, _)| of_tolerance < BETTER * least);
            if of_px > 1.0 && !is_better(of_px) {
                continue;
            }
            let of_tolerance = of_px.max(self.misregistration_dn(method, missed) / left_dn);
            if of_tolerance <= 1.0 {
                return Ok(method);
            }
            if is_better(of_tolerance) {
                best = Some((of_tolerance, method));
            }
        }
        let otherwise = TemporalMethod { temporal: TemporalStage::Reproject { iterations: 2 }, blur: None };
        Err(best.map_or(otherwise, |(_, method)| method))
    }

    /// The errors of a method by cause.
    fn predict(&self, method: TemporalMethod) -> Predicted {
        let Self { task, forecast, .. } = self;
        let stage = method.temporal;
        let missed = forecast.path_miss(method.blur);
        let depth_px = match stage {
            TemporalStage::Reproject { .. } => {
                margins::SOURCE_ERROR * forecast.largest(|_, _, errors| errors.after_look_ups[MAX_LOOK_UPS])
            }
            _ => 0.0,
        };
        let (probes, tried) = (forecast.errors.len(), task.reach.probes.len());
        let predicted = Predicted {
            lens_px: forecast.largest(|_, probe, errors| forecast.rounding(probe, errors, stage).lens_px),
            rounding_px: forecast
                .largest(|_, probe, errors| forecast.rounding(probe, errors, stage).format_px),
            temporal_px: margins::SOURCE_ERROR
                * (forecast.largest(|i, _, _| forecast.unsettled_px(i, method))
                    + forecast.between_px(method)),
            depth_px,
            level_of_detail_px: forecast.level_of_detail_px(),
            nodes_px: missed.largest_px,
            total_px: forecast.total_px(method) + missed.largest_px,
            resampling_dn: task.resampling.resampling_dn,
            blur_dn: task.resampling.blur_dn,
            misregistration_dn: self.misregistration_dn(method, missed),
            terrain: self.terrain,
            silhouettes: task.silhouettes,
            blended_depth: task.blended,
            void_fraction: 1.0 - probes as f64 / tried.max(1) as f64,
            probes: probes as u32,
            ..Predicted::default()
        };
        self.judged(predicted, method)
    }

    /// With whether the source error is kept, and if not, by what.
    fn judged(&self, predicted: Predicted, method: TemporalMethod) -> Predicted {
        let max_error_px = self.task.sequence.scenario.quality.max_error_px;
        let void_fraction = predicted.void_fraction;
        let covered = predicted.probes > 0 && void_fraction <= MAX_VOID_SHARE;
        let kept = predicted.total_px <= max_error_px && covered;
        let most = method.blur.is_some_and(|blur| blur.solved() > MOST_STEPS);
        let obstacle = match (kept, covered) {
            (true, _) => None,
            (false, true) => largest_cause(&predicted, most),
            (false, false) => Some(format!(
                "the ideal frame: {:.1} % of the pixels see what lies outside of it",
                100.0 * void_fraction
            )),
        };
        Predicted { source_error_kept: kept, source_error_obstacle: obstacle, ..predicted }
    }
}

/// The largest cause of the source error; `has_most_nodes` where the exposure's path can have no more.
fn largest_cause(predicted: &Predicted, has_most_nodes: bool) -> Option<String> {
    let at_most = if has_most_nodes {
        format!(", of which there are at most {}", MOST_STEPS + 1)
    } else {
        String::new()
    };
    let nodes = format!("the path between the exposure's nodes{at_most}");
    let causes = [
        (predicted.lens_px, "the lens inverse"),
        (predicted.rounding_px, "single precision of poses and coordinates"),
        (predicted.temporal_px, "the temporal inverse"),
        (
            predicted.depth_px,
            "depth between the pixels of the ideal frame (quality.key_frames or quality.ideal_scale may do more)",
        ),
        (predicted.nodes_px, nodes.as_str()),
    ];
    causes.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)).map(|(px, what)| format!("{what}: {px:.2e} px"))
}
