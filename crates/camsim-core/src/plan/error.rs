//! How far the sources of a frame's pixels will be off, by cause, and the cheapest temporal inverse that keeps the tolerance.
//!
//! The prediction is no formula: the pipeline is run dry at a few hundred probes, in f64, over the scene's own surfaces, against exact
//! rays (`dry_run.rs`), and what single precision adds comes from the sizes of the numbers (`rounding.rs`). The largest error of n probes
//! is above the 99th percentile of all pixels with a probability of `1 - 0.99^n` (98.7 % of 432); what it misses is what [`SAFETY`] is for.

use std::cell::Cell;

use rayon::prelude::*;
use serde::Serialize;

use super::{
    BlurStage, EdgeStage, LensReach, Motion, RayStage, TemporalStage,
    dry_run::{MAX_LOOK_UPS, Outcome, Trial},
    levels::Expected,
    probes::Probe,
    rounding::Rounding,
};
use crate::{
    camera::CameraModel,
    pose::CameraPose,
    scenario::{Auto, Preset},
    scene::{LodSelection, select_lod},
    sequence::Sequence,
    shutter::Shutter,
    temporal::{
        IdealGeometry,
        displacement::{RK2_STEP_DEG, Twist},
    },
};

/// Times the largest error found.
const SAFETY: f64 = 1.25;
/// Part of the tolerance that the level of detail may take.
const DETAIL_SHARE: f64 = 0.3;
/// Part of the tolerance that a bound on what is left out may take.
const BOUND_SHARE: f64 = 0.5;
/// Steps of eq. 18 up to which it takes less time than a look-up of depth in every node.
const CHEAP_RK2_STEPS: f64 = 2.0;
/// Probes whose exposure is looked at.
const CHORD_PROBES: usize = 32;
/// Stretches of path looked at for each of them.
const CHORD_SEGMENTS: u32 = 8;

/// Predicted errors of a frame. All `_px` are pixels of the ideal frame and bound the 99th percentile over the valid pixels that are
/// farther than 3 px from any silhouette.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Predicted {
    /// Lens inverse.
    pub lens_px: f64,
    /// Temporal inverse: model of the motion, look-ups of depth not made.
    pub temporal_px: f64,
    /// Depth between the ideal frame's pixels and by the terrain's level of detail.
    pub depth_px: f64,
    /// The part of it that is the level of detail's.
    pub level_of_detail_px: f64,
    /// Straight stretches of the path over the exposure; nothing at mid-exposure, which is solved for itself.
    pub nodes_px: f64,
    /// Single precision of poses, depth and coordinates.
    pub format_px: f64,
    /// Resampling: what is expected of its RMS over the picture away from silhouettes, 1/255 of the linear range.
    pub resampling_dn: f64,
    /// The same of too few samples over the exposure.
    pub blur_dn: f64,
    /// Whether the two are within `quality.max_error_dn`.
    pub levels_kept: bool,
    /// If not: what is in the way.
    pub levels_in_the_way: Option<String>,
    /// All together: the bound on the 99th percentile.
    pub total_px: f64,
    /// Share of the probes that were set apart: off by more than the others, and at a silhouette or not seen from the key pose.
    pub silhouette_share: f64,
    /// Probes with a source.
    pub probes: u32,
    /// Whether `total_px` is within `quality.max_error_px`.
    pub kept: bool,
    /// If not: what is in the way.
    pub in_the_way: Option<String>,
}

/// A frame whose temporal inverse is to be chosen.
pub(super) struct Case<'a> {
    pub reach: &'a LensReach,
    pub sequence: &'a Sequence,
    pub shutter: &'a Shutter,
    pub stamp_s: f64,
    pub key_s: f64,
    pub key_pose: &'a CameraPose,
    pub ideal: &'a IdealGeometry,
    pub key_twist: Twist,
    pub ray: RayStage,
    pub blur: Option<BlurStage>,
    /// The same for a path that is a straight line whatever its nodes.
    pub straight_blur: Option<BlurStage>,
    pub expected: Expected,
    pub levels_in_the_way: Option<String>,
}

/// What was chosen, and what it leads to.
pub(super) struct Choice {
    pub way: Way,
    pub terrain_error_px: f64,
    pub predicted: Predicted,
}

/// A temporal inverse, and the exposure that it is used for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Way {
    pub temporal: TemporalStage,
    pub blur: Option<BlurStage>,
}

/// The cheapest temporal inverse, and the coarsest terrain, within the tolerance.
pub(super) fn choose(case: &Case<'_>, demanded: Option<TemporalStage>, motion: &Motion, edges: EdgeStage) -> Choice {
    let quality = &case.sequence.scenario.quality;
    let tolerance_px = quality.max_error_px;
    let mut terrain_error_px = quality.max_terrain_error_px;
    let lod = case.level_of_detail(terrain_error_px);
    let mut forecast = case.forecast(&lod);
    let detail_px = forecast.level_of_detail_px();
    let finer;
    if SAFETY * detail_px > DETAIL_SHARE * tolerance_px {
        // The error falls in proportion, in steps by which a chunk's level of detail changes.
        terrain_error_px *= 0.8 * DETAIL_SHARE * tolerance_px / (SAFETY * detail_px);
        finer = case.level_of_detail(terrain_error_px);
        forecast = case.forecast(&finer);
    }
    // Something small and near may pass between the probes: where there are silhouettes only the bound counts.
    let may_skip_depth = edges == EdgeStage::None || motion.parallax_px <= BOUND_SHARE * tolerance_px;
    let way = match demanded {
        Some(temporal) => Way { temporal, blur: case.blur },
        None => forecast.choose(tolerance_px, case.ways(motion, edges, may_skip_depth)),
    };
    let predicted = forecast.predict(case, way);
    Choice { way, terrain_error_px, predicted }
}

impl Case<'_> {
    /// Ways in the order of their time, as measured by `camsim bench`. The constant-twist solvers read the depth beside where they look: not
    /// for silhouettes.
    fn ways(&self, motion: &Motion, edges: EdgeStage, may_skip_depth: bool) -> Vec<Way> {
        let quality = &self.sequence.scenario.quality;
        let with = |temporal| Way { temporal, blur: self.blur };
        let mut ways = Vec::new();
        if may_skip_depth {
            ways.extend([TemporalStage::Identity, TemporalStage::Rotation].map(with));
        }
        if quality.solver == Auto::Auto && quality.key_frames == Auto::Auto && edges == EdgeStage::None {
            ways.push(Way { temporal: TemporalStage::Linear, blur: self.straight_blur });
            if motion.rotation_rad < CHEAP_RK2_STEPS * RK2_STEP_DEG.to_radians() {
                ways.push(with(TemporalStage::Rk2));
            }
        }
        let look_ups = |one_depth: bool| {
            let blur = self.blur.map(|blur| BlurStage { one_depth, ..blur });
            (1..=MAX_LOOK_UPS as u32).map(move |iterations| Way { temporal: TemporalStage::Reproject { iterations }, blur })
        };
        ways.extend(look_ups(true).filter(|way| way.blur.is_some()));
        ways.extend(look_ups(false));
        ways
    }

    /// The choice that the ideal pass will make.
    fn level_of_detail(&self, max_error_px: f64) -> LodSelection {
        self.sequence.scene.terrain.as_ref().map_or_else(LodSelection::default, |terrain| {
            select_lod(terrain, self.key_pose, self.ideal.tangents(), self.ideal.focal_px.max_element(), max_error_px)
        })
    }

    fn forecast<'a>(&'a self, lod: &'a LodSelection) -> Forecast<'a> {
        let trial = Trial {
            scene: &self.sequence.scene,
            path: &self.sequence.path,
            shutter: self.shutter,
            stamp_s: self.stamp_s,
            key_s: self.key_s,
            key_pose: self.key_pose,
            ideal: self.ideal,
            lod,
            twist: self.key_twist,
            nearest_depth: self.sequence.scenario.quality.preset == Preset::Paper,
        };
        Forecast::new(&self.reach.probes, &self.reach.camera, self.ray, trial, self.blur.is_some())
    }
}

/// Dry runs of one frame.
pub(super) struct Forecast<'a> {
    camera: &'a CameraModel,
    ray: RayStage,
    trial: Trial<'a>,
    runs: Vec<Run>,
}

/// One probe.
struct Run {
    probe: Probe,
    outcome: Outcome,
    /// Whether it is to be counted apart; unknown until it matters.
    apart: Cell<Option<bool>>,
}

impl<'a> Forecast<'a> {
    /// With an exposure that shows, the probes take turns in trying its middle and both its ends.
    pub fn new(probes: &[Probe], camera: &'a CameraModel, ray: RayStage, trial: Trial<'a>, exposed: bool) -> Self {
        let phases: &[f64] = if exposed { &[0.0, -0.5, 0.5] } else { &[0.0] };
        let run = |(i, probe): (usize, &Probe)| {
            trial.run(probe, phases[i % phases.len()]).map(|outcome| Run { probe: *probe, outcome, apart: Cell::new(None) })
        };
        let runs = probes.par_iter().enumerate().with_min_len(16).filter_map(run).collect();
        Self { camera, ray, trial, runs }
    }

    /// The largest of a figure over the runs that are not to be counted apart. Only the largest are asked whether they are.
    fn largest(&self, of: impl Fn(&Run) -> f64) -> f64 {
        let mut order: Vec<(f64, &Run)> = self.runs.iter().filter(|run| run.apart.get() != Some(true)).map(|run| (of(run), run)).collect();
        order.sort_by(|a, b| b.0.total_cmp(&a.0));
        let counted = |run: &Run| {
            let apart = run.apart.get().unwrap_or_else(|| self.trial.at_silhouette(&run.probe, &run.outcome));
            run.apart.set(Some(apart));
            !apart
        };
        order.into_iter().find(|(px, run)| *px == 0.0 || counted(run)).map_or(0.0, |(px, _)| px)
    }

    /// Largest displacement of a source by the level of detail.
    pub fn level_of_detail_px(&self) -> f64 {
        self.largest(|run| run.outcome.level_of_detail_px)
    }

    /// Without the chords of the exposure.
    pub fn total_px(&self, way: Way) -> f64 {
        self.largest(|run| SAFETY * error_px(&run.outcome, way) + self.rounding(run, way.temporal).total_px())
    }

    /// The first way within the tolerance, or the best there is.
    pub fn choose(&self, tolerance_px: f64, ways: Vec<Way>) -> Way {
        let mut best: Option<(f64, Way)> = None;
        let mut known_nodes: Vec<(u32, f64)> = Vec::new();
        for way in ways {
            let nodes = way.blur.map_or(1, |blur| blur.nodes);
            let nodes_px = known_nodes.iter().find(|known| known.0 == nodes).map(|known| known.1).unwrap_or_else(|| {
                let px = self.nodes_px(way.blur);
                known_nodes.push((nodes, px));
                px
            });
            let total_px = self.total_px(way) + nodes_px;
            if total_px <= tolerance_px {
                return way;
            }
            // What gains less than a twentieth is not worth its time.
            if best.is_none_or(|(px, _)| total_px < 0.95 * px) {
                best = Some((total_px, way));
            }
        }
        best.map_or(Way { temporal: TemporalStage::Reproject { iterations: 2 }, blur: None }, |(_, way)| way)
    }

    /// The errors of a stage by cause.
    pub fn predict(&self, case: &Case<'_>, way: Way) -> Predicted {
        let (Way { temporal: stage, blur }, max_error_px) = (way, case.sequence.scenario.quality.max_error_px);
        let nodes_px = self.nodes_px(blur);
        let total_px = self.total_px(way) + nodes_px;
        let Expected { resampling_dn, blur_dn } = case.expected;
        let lens_px = self.largest(|run| self.rounding(run, stage).lens_px);
        let format_px = self.largest(|run| self.rounding(run, stage).format_px);
        let temporal_px = SAFETY * self.largest(|run| unsettled_px(&run.outcome, way));
        let depth_px = match stage {
            TemporalStage::Reproject { .. } => SAFETY * self.largest(|run| run.outcome.after[MAX_LOOK_UPS]),
            _ => 0.0,
        };
        let kept = total_px <= max_error_px;
        let causes = [
            (lens_px, "the lens inverse"),
            (format_px, "single precision of poses and coordinates"),
            (temporal_px, "the temporal inverse"),
            (depth_px, "depth between the pixels of the ideal frame"),
            (nodes_px, "the straight stretches between the exposure's nodes"),
        ];
        let largest = causes.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)).filter(|_| !kept);
        let probes = self.runs.len() as u32;
        let apart = self.runs.iter().filter(|run| run.apart.get() == Some(true)).count();
        Predicted {
            lens_px,
            temporal_px,
            depth_px,
            level_of_detail_px: self.level_of_detail_px(),
            nodes_px,
            format_px,
            resampling_dn,
            blur_dn,
            levels_kept: case.levels_in_the_way.is_none(),
            levels_in_the_way: case.levels_in_the_way.clone(),
            total_px,
            silhouette_share: apart as f64 / f64::from(probes.max(1)),
            probes,
            kept,
            in_the_way: largest.map(|(px, what)| format!("{what}: {px:.2e} px")),
        }
    }

    fn rounding(&self, run: &Run, stage: TemporalStage) -> Rounding {
        Rounding::new(&run.probe, run.outcome.at_px, run.outcome.parallax_px, self.camera, self.trial.ideal, self.ray, stage)
    }

    /// Largest miss of the straight stretches between the exposure's nodes.
    fn nodes_px(&self, blur: Option<BlurStage>) -> f64 {
        let Some(segments) = blur.map(|blur| blur.nodes - 1) else { return 0.0 };
        let looked_at = CHORD_SEGMENTS.min(segments);
        let every = self.runs.len().div_ceil(CHORD_PROBES).max(1);
        let miss = |run: &Run| {
            (0..looked_at).map(|k| self.trial.chord_px(&run.probe, &run.outcome, k * segments / looked_at, segments)).fold(0.0, f64::max)
        };
        SAFETY * self.runs.iter().step_by(every).map(miss).fold(0.0, f64::max)
    }
}

/// Error of a way at a probe.
fn error_px(run: &Outcome, way: Way) -> f64 {
    match way.temporal {
        TemporalStage::Identity => run.still_px,
        TemporalStage::Rotation => run.after[0],
        TemporalStage::Linear => run.linear_px,
        TemporalStage::Rk2 => run.rk2_px,
        TemporalStage::Reproject { iterations } => {
            let look_ups = (iterations as usize).min(MAX_LOOK_UPS);
            if way.blur.is_some_and(|blur| blur.one_depth) { run.of_mid[look_ups].max(run.after[look_ups]) } else { run.after[look_ups] }
        }
    }
}

/// The part of it that a better temporal inverse would mend.
fn unsettled_px(run: &Outcome, way: Way) -> f64 {
    match way {
        Way { temporal: TemporalStage::Reproject { iterations }, blur } if !blur.is_some_and(|blur| blur.one_depth) => {
            run.unsettled[(iterations as usize).min(MAX_LOOK_UPS)]
        }
        _ => error_px(run, way),
    }
}
