//! What each way of solving makes of the probes of a frame, and the cheapest that keeps the tolerance.

use camsim_core::reference::MOST_VOID_SHARE;
use std::sync::OnceLock;

use rayon::prelude::*;

use super::{Case, Ground, Looked, SAFETY, Truths, Way};
use crate::{
    BlurStage, NodeDepths, Predicted, TemporalStage,
    dry_run::{MAX_LOOK_UPS, Outcome},
    exposure::{MOST_STEPS, may_alias, miss_at_px, miss_px},
    levels::Expected,
    rounding::Rounding,
};
use camsim_core::scene::TerrainDetail;

/// Phases at which one probe in [`BETWEEN_STEP`] tries what lies between the depths of the exposure's ends.
/// Seen from mid-exposure the depths of a bent surface are missed by a parabola that is 0 at both ends, and
/// the way from there is 0 in the middle: the product is largest here, at 0.5 / sqrt(3). So is what a
/// parabola through three depths misses of a cubic.
const BETWEEN: [f64; 2] = [-0.289, 0.289];
const BETWEEN_STEP: usize = 2;
/// One probe in so many is asked first whether the depth of mid-exposure does for all of it; not in step with
/// the grid, and with phases in turn.
const MID_STEP: usize = 7;
/// RMS over time of what a polynomial misses between its nodes, of the most: 0.73 of what straight lines miss
/// of a parabola, 0.72 of what parabolas miss of a cubic.
const OVER_TIME: f64 = 0.72;
/// Instants of each probe at which a path is looked at whose nodes may all meet a vibration alike: multiples
/// of the golden ratio are in step with nothing.
const ALIASED_INSTANTS: usize = 4;
const GOLDEN: f64 = 0.618_033_988_749_895;
/// Probes whose exposure is looked at.
const MISS_PROBES: usize = 32;
/// Polynomials of the path looked at for each of them.
const MISSED_STRETCHES: u32 = 8;

impl<'a> Truths<'a> {
    pub(super) fn forecast(
        &'a self,
        detail: Option<&'a TerrainDetail<'a>>,
        ground: Option<Ground>,
    ) -> Forecast<'a> {
        let run = |looked: &Looked| self.trial.run(&looked.probe, &looked.truth, detail);
        let outcomes = self.looked.par_iter().with_min_len(16).map(run).collect();
        Forecast {
            outcomes,
            detail,
            ground,
            truths: self,
            between_px: OnceLock::new(),
            of_mid: OnceLock::new(),
            of_mid_here_and_there: OnceLock::new(),
        }
    }
}

/// Dry runs of one frame.
pub(super) struct Forecast<'a> {
    truths: &'a Truths<'a>,
    detail: Option<&'a TerrainDetail<'a>>,
    /// What that costs.
    ground: Option<Ground>,
    /// One for each of the probes.
    pub(super) outcomes: Vec<Outcome>,
    /// [`Forecast::between_px`] of both, of each probe and the largest, once it matters.
    between_px: OnceLock<(Vec<[f64; 2]>, [f64; 2])>,
    /// With the depth that look-ups find at mid-exposure, of each of the probes, and of one in [`MID_STEP`]:
    /// once it matters.
    of_mid: OnceLock<Vec<OfMid>>,
    of_mid_here_and_there: OnceLock<Vec<OfMid>>,
}

/// How far the curves between the exposure's nodes miss what they stand for, ideal pixels: the largest miss
/// with a margin, and RMS over probes and time.
#[derive(Clone, Copy, Default)]
pub(super) struct Missed {
    pub largest_px: f64,
    rms_px: f64,
}

/// Error after n look-ups, ideal pixels.
type OfMid = [f64; MAX_LOOK_UPS + 1];

impl Forecast<'_> {
    fn largest(&self, of: impl Fn(usize, &Looked, &Outcome) -> f64) -> f64 {
        self.truths.largest(|i, looked| of(i, looked, &self.outcomes[i]))
    }

    /// Without the path between the exposure's nodes.
    fn total_px(&self, way: Way) -> f64 {
        let of_one = |i, looked: &Looked, run: &Outcome| {
            SAFETY * self.error_px(i, way) + self.rounding(looked, run, way.temporal).total_px()
        };
        self.largest(of_one) + SAFETY * self.between_px(way)
    }

    /// Error of a way at a probe.
    pub(super) fn error_px(&self, i: usize, way: Way) -> f64 {
        let run = &self.outcomes[i];
        match way.look_ups_of_mid() {
            Some(look_ups) => self.of_mid()[i][look_ups].max(run.after[look_ups]),
            None => error_px(run, way),
        }
    }

    /// The part of it that a better temporal inverse would mend.
    fn unsettled_px(&self, i: usize, way: Way) -> f64 {
        match way.temporal {
            TemporalStage::Reproject { iterations } if way.look_ups_of_mid().is_none() => {
                self.outcomes[i].unsettled[(iterations as usize).min(MAX_LOOK_UPS)]
            }
            _ => self.error_px(i, way),
        }
    }

    /// Has worked out what [`Forecast::error_px`] asks for.
    pub(super) fn prepare(&self, way: Way) {
        if way.look_ups_of_mid().is_some() {
            self.of_mid();
        }
    }

    fn of_mid(&self) -> &[OfMid] {
        self.of_mid.get_or_init(|| self.of_mid_of(1))
    }

    /// Of one probe in `step`.
    fn of_mid_of(&self, step: usize) -> Vec<OfMid> {
        let Truths { trial, looked, .. } = self.truths;
        let of = |(looked, run): (&Looked, &Outcome)| {
            trial.of_mid(&looked.probe, &looked.truth, run.elsewhere, self.detail)
        };
        looked.par_iter().zip(&self.outcomes).step_by(step).with_min_len(16).map(of).collect()
    }

    /// Whether a few probes tell already that a way misses by more than this.
    fn surely_misses(&self, way: Way, px: f64) -> bool {
        let Some(look_ups) = way.look_ups_of_mid() else { return false };
        let known = self.of_mid_here_and_there.get_or_init(|| self.of_mid_of(MID_STEP));
        let of_few = |i: usize| if i.is_multiple_of(MID_STEP) { known[i / MID_STEP][look_ups] } else { 0.0 };
        SAFETY * self.largest(|i, _, _| of_few(i)) > px
    }

    /// Largest miss of nodes that take what lies between the depths of others.
    pub(super) fn between_px(&self, way: Way) -> f64 {
        between_kind(way).map_or(0.0, |kind| self.between().1[kind])
    }

    fn between(&self) -> &(Vec<[f64; 2]>, [f64; 2]) {
        self.between_px.get_or_init(|| {
            let Truths { reach, ray, trial, .. } = *self.truths;
            let (_, elsewhere) = Truths::new(reach, ray, trial, &BETWEEN, BETWEEN_STEP).between_px(|_| None);
            let (of_each, at_phases) = self.truths.between_px(|i| Some(self.outcomes[i].elsewhere));
            (of_each, [0, 1].map(|k: usize| at_phases[k].max(elsewhere[k])))
        })
    }

    /// What it costs that sources are beside their place, RMS over the picture, 1/255 of the linear range.
    fn displaced_dn(&self, case: &Case<'_>, way: Way, missed: Missed) -> f64 {
        let scale = case.ideal.scale(&case.reach.camera);
        // What is farther off than all that count is at silhouettes.
        let most_px = self.largest(|i, _, _| self.error_px(i, way));
        let between = between_kind(way).map(|kind| (kind, &self.between().0));
        let of_probe = |i: usize| {
            let error_px = self.error_px(i, way);
            let between_px = between.map_or(0.0, |(kind, px)| px[i][kind].min(self.between_px(way)));
            let solved_px = if error_px <= most_px { error_px + between_px } else { 0.0 };
            solved_px.hypot(missed.rms_px) / scale
        };
        case.shown.displaced_dn((0..self.outcomes.len()).map(of_probe))
    }

    /// The first way within the tolerances, or the best there is.
    pub(super) fn choose(&self, case: &Case<'_>, ways: Vec<Way>) -> Way {
        let tolerance_px = case.sequence.scenario.quality.max_error_px;
        // What a few probes rule out is looked at more closely only if nothing else keeps the tolerance.
        let (ruled_out, in_question): (Vec<Way>, Vec<Way>) =
            ways.iter().copied().partition(|way| self.surely_misses(*way, tolerance_px));
        match self.first_within(case, in_question) {
            Err(_) if !ruled_out.is_empty() => self.first_within(case, ways).unwrap_or_else(|best| best),
            Ok(way) | Err(way) => way,
        }
    }

    /// The first way within the tolerances, of source coordinates and of what these cost in the picture; or
    /// else the best there is.
    fn first_within(&self, case: &Case<'_>, ways: Vec<Way>) -> Result<Way, Way> {
        let tolerance_px = case.sequence.scenario.quality.max_error_px;
        let mut best: Option<(f64, Way)> = None;
        let mut known_nodes: Vec<((u32, u32, bool), Missed)> = Vec::new();
        for way in ways {
            let nodes = way.blur.map_or_else(Default::default, |blur| {
                (blur.solved(), blur.path.steps(), blur.depths == NodeDepths::Each)
            });
            let missed =
                known_nodes.iter().find(|known| known.0 == nodes).map(|known| known.1).unwrap_or_else(|| {
                    let missed = self.missed(way.blur);
                    known_nodes.push((nodes, missed));
                    missed
                });
            let of_px = (self.total_px(way) + missed.largest_px) / tolerance_px;
            // What gains less than a twentieth is not worth its time.
            let is_better = |of_tolerance: f64| best.is_none_or(|(least, _)| of_tolerance < 0.95 * least);
            if of_px > 1.0 && !is_better(of_px) {
                continue;
            }
            let of_tolerance = of_px.max(self.displaced_dn(case, way, missed) / case.left_by(self.ground));
            if of_tolerance <= 1.0 {
                return Ok(way);
            }
            if is_better(of_tolerance) {
                best = Some((of_tolerance, way));
            }
        }
        Err(best
            .map_or(Way { temporal: TemporalStage::Reproject { iterations: 2 }, blur: None }, |(_, way)| way))
    }

    /// The errors of a stage by cause.
    pub(super) fn predict(&self, case: &Case<'_>, way: Way) -> Predicted {
        let (Way { temporal: stage, blur }, max_error_px) =
            (way, case.sequence.scenario.quality.max_error_px);
        let missed = self.missed(blur);
        let nodes_px = missed.largest_px;
        let total_px = self.total_px(way) + nodes_px;
        let Expected { resampling_dn, blur_dn } = case.expected;
        let lens_px = self.largest(|_, looked, run| self.rounding(looked, run, stage).lens_px);
        let format_px = self.largest(|_, looked, run| self.rounding(looked, run, stage).format_px);
        let temporal_px = SAFETY * (self.largest(|i, _, _| self.unsettled_px(i, way)) + self.between_px(way));
        let depth_px = match stage {
            TemporalStage::Reproject { .. } => SAFETY * self.largest(|_, _, run| run.after[MAX_LOOK_UPS]),
            _ => 0.0,
        };
        let (probes, tried) = (self.outcomes.len(), case.reach.probes.len());
        let void_share = 1.0 - probes as f64 / tried.max(1) as f64;
        let covered = probes > 0 && void_share <= MOST_VOID_SHARE;
        let kept = total_px <= max_error_px && covered;
        let most = blur.is_some_and(|blur| blur.solved() > MOST_STEPS);
        let at_most =
            if most { format!(", of which there are at most {}", MOST_STEPS + 1) } else { String::new() };
        let nodes = format!("the path between the exposure's nodes{at_most}");
        let causes = [
            (lens_px, "the lens inverse"),
            (format_px, "single precision of poses and coordinates"),
            (temporal_px, "the temporal inverse"),
            (
                depth_px,
                "depth between the pixels of the ideal frame (quality.key_frames or quality.ideal_scale may do more)",
            ),
            (nodes_px, nodes.as_str()),
        ];
        let largest = || {
            causes
                .into_iter()
                .max_by(|a, b| a.0.total_cmp(&b.0))
                .map(|(px, what)| format!("{what}: {px:.2e} px"))
        };
        let in_the_way = match (kept, covered) {
            (true, _) => None,
            (false, true) => largest(),
            (false, false) => Some(format!(
                "the ideal frame: {:.1} % of the pixels see what lies outside of it",
                100.0 * void_share
            )),
        };
        Predicted {
            lens_px,
            temporal_px,
            depth_px,
            level_of_detail_px: self.truths.level_of_detail_px(self.detail),
            nodes_px,
            format_px,
            resampling_dn,
            blur_dn,
            displaced_dn: self.displaced_dn(case, way, missed),
            ground: self.ground,
            silhouettes: case.silhouettes,
            layers: case.layers,
            // Judged when all that comes to it is known.
            levels_kept: false,
            levels_in_the_way: None,
            total_px,
            silhouette_share: 0.0,
            void_share,
            holes: None,
            holes_of_one: None,
            probes: probes as u32,
            kept,
            in_the_way,
        }
    }

    pub(super) fn rounding(
        &self,
        Looked { probe, truth, .. }: &Looked,
        run: &Outcome,
        stage: TemporalStage,
    ) -> Rounding {
        let Truths { reach, ray, trial, .. } = self.truths;
        Rounding::new(probe, truth.at_px, run.parallax_px, &reach.camera, trial.ideal, *ray, stage)
    }

    /// Misses of the curves between the exposure's nodes: for a surface at one depth, and where each node
    /// finds its own, along what the rays meet.
    pub(super) fn missed(&self, blur: Option<BlurStage>) -> Missed {
        let Some(blur) = blur else { return Missed::default() };
        let Truths { trial, looked, .. } = self.truths;
        let stretches = blur.stretches();
        let looked_at = MISSED_STRETCHES.min(stretches);
        let every = looked.len().div_ceil(MISS_PROBES).max(1);
        let miss = |(i, Looked { probe, truth, .. }): (usize, &Looked)| {
            let of_stretch =
                |k| miss_px(blur.path, stretches, k, |share| trial.source_px(probe, truth, share));
            let at_one_depth =
                (0..looked_at).map(|k| of_stretch(k * stretches / looked_at)).fold(0.0, f64::max);
            let follows = blur.depths == NodeDepths::Each;
            let along_surfaces = follows
                .then(|| trial.miss_along_surfaces_px(probe, blur.path, stretches, i as u32 % stretches));
            along_surfaces.map_or(at_one_depth, |px| px.max(at_one_depth))
        };
        let misses: Vec<f64> = looked.iter().step_by(every).enumerate().map(miss).collect();
        let between = Missed { largest_px: largest(&misses), rms_px: OVER_TIME * rms(&misses) };
        if !may_alias(blur.solved() - 1, trial.path.highest_vibration_hz() * trial.shutter.exposure_s()) {
            return between;
        }
        // Nodes and the middles between them may be whole periods apart.
        let instants = |(i, looked)| {
            (0..ALIASED_INSTANTS)
                .map(move |n| (looked, (GOLDEN * (i * ALIASED_INSTANTS + n + 1) as f64).fract()))
        };
        let at = |(Looked { probe, truth, .. }, share): (&Looked, f64)| {
            miss_at_px(blur.path, stretches, share, |share| trial.source_px(probe, truth, share))
        };
        let misses: Vec<f64> = looked.iter().step_by(every).enumerate().flat_map(instants).map(at).collect();
        Missed {
            largest_px: between.largest_px.max(largest(&misses)),
            rms_px: between.rms_px.max(rms(&misses)),
        }
    }
}

fn largest(misses_px: &[f64]) -> f64 {
    SAFETY * misses_px.iter().copied().fold(0.0, f64::max)
}

fn rms(px: &[f64]) -> f64 {
    (px.iter().map(|px| px * px).sum::<f64>() / px.len().max(1) as f64).sqrt()
}

/// Which of the two misses between depths of the exposure a way has.
fn between_kind(way: Way) -> Option<usize> {
    match (way.temporal, way.blur?.depths) {
        (TemporalStage::Reproject { .. }, NodeDepths::Ends) => Some(0),
        (TemporalStage::Reproject { .. }, NodeDepths::Three) => Some(1),
        _ => None,
    }
}

/// Error at a probe of a way that takes no depth of mid-exposure elsewhere.
fn error_px(run: &Outcome, way: Way) -> f64 {
    match way.temporal {
        TemporalStage::Identity => run.still_px,
        TemporalStage::Rotation => run.after[0],
        TemporalStage::Linear => run.linear_px,
        TemporalStage::Rk2 => run.rk2_px,
        TemporalStage::Reproject { iterations } => {
            let look_ups = (iterations as usize).min(MAX_LOOK_UPS);
            if way.blur.is_some() { run.handed_on[look_ups] } else { run.after[look_ups] }
        }
    }
}
