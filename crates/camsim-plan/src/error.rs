//! How far the sources of a frame's pixels will be off, by cause, and the cheapest temporal inverse that
//! keeps the tolerance.
//!
//! The prediction is no formula: the pipeline is run dry at a few hundred probes, in f64, over the scene's
//! own surfaces, against exact rays (`dry_run.rs`), and what single precision adds comes from the sizes of
//! the numbers (`rounding.rs`). The largest error of n probes is above the 99th percentile of all pixels with
//! a probability of `1 - 0.99^n` (98.7 % of 432). Frames that share an ideal frame are alike: each is run dry
//! at a quarter of the probes, and all that are solved in the same way answer for the largest error of any
//! (88.8 % of two, 98.7 % of four). What it misses is what [`SAFETY`] is for.

mod forecast;
mod ground;
mod map;

use std::sync::OnceLock;

use glam::DVec3;
use rayon::prelude::*;

use super::{
    BlurStage, Contours, Holes, KeyFrame, Layers, LensReach, Motion, NodeDepths, Predicted, RayStage,
    SeenPlane, TemporalStage,
    contours::Outlook,
    displaced::ShownWaves,
    dry_run::{MAX_LOOK_UPS, Trial, Truth},
    levels::Expected,
    probes::Probe,
    surfaces::Surfaces,
};
use camsim_core::{
    mount::CameraPath,
    pose::CameraPose,
    scenario::{Auto, Preset},
    scene::TerrainDetail,
    sequence::Sequence,
    shutter::Shutter,
    temporal::{
        IdealGeometry,
        displacement::{RK2_STEP_DEG, Twist},
    },
};

pub use ground::Ground;
pub use map::{ErrorMap, ErrorPlace, PlaceError};

/// Times the largest error found.
const SAFETY: f64 = 1.25;
/// Part of the tolerance that a bound on what is left out may take.
const BOUND_SHARE: f64 = 0.5;
/// Part of an error from which on more nodes of the exposure's path are worth a try.
const OF_NODES: f64 = 0.3;
/// Steps of eq. 18 up to which it takes less time than a look-up of depth in every node.
const CHEAP_RK2_STEPS: f64 = 2.0;
/// One probe in so many is asked whether it is at a silhouette, to tell how many are; not in step with the
/// grid of 24 columns.
const SHARE_STEP: usize = 5;
/// Phases of the exposure that the probes take turns in. On a shaking mount the middle and the ends may be
/// whole periods apart, where nothing has moved: the last two then stand in no simple ratio to them.
const PHASES: [f64; 5] = [0.0, -0.5, 0.5, -0.309, 0.191];
/// As many of them do for a mount at rest.
const AT_REST: usize = 3;

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
    /// The solver that the scenario asks for.
    pub demanded: Option<TemporalStage>,
    pub ray: RayStage,
    pub blur: Option<BlurStage>,
    /// The same for a path that is a straight line in time.
    pub straight_blur: Option<BlurStage>,
    pub expected: Expected,
    /// What pixels show, and what sources beside their place may cost of it, 1/255 of the linear range.
    pub shown: &'a ShownWaves,
    pub most_displaced_dn: f64,
    /// Around the probes, and cost of silhouettes.
    pub outlook: Option<&'a Outlook>,
    pub silhouettes: Option<Contours>,
    /// Cost of what is mixed.
    pub layers: Option<Layers>,
    pub silhouettes_in_view: bool,
    /// Whether the camera's twist at the key instant may stand for its motion.
    pub constant_twist: bool,
    pub surfaces: &'a Surfaces,
}

/// What was chosen, and what it leads to.
pub(super) struct Choice<'a> {
    pub way: Way,
    pub terrain_error_px: f64,
    pub predicted: Predicted,
    /// How far the path between the exposure's nodes is missed, and what tolerance is to be kept, ideal
    /// pixels, where one is broken.
    pub missed_px: Option<[f64; 2]>,
    pub truths: Truths<'a>,
}

/// A temporal inverse, and the exposure that it is used for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Way {
    pub temporal: TemporalStage,
    pub blur: Option<BlurStage>,
}

/// Of a camera of its own for each line, and of a look-up of depth, milliseconds as in `costs.rs`: from its
/// reverse passes, less their reads.
const POSE_MS: f64 = 0.05;
const LOOK_UP_MS: f64 = 0.25;

impl Way {
    /// Look-ups of depth, if those at mid-exposure are all that there are.
    fn look_ups_of_mid(self) -> Option<usize> {
        match self {
            Self {
                temporal: TemporalStage::Reproject { iterations },
                blur: Some(BlurStage { depths: NodeDepths::Mid, .. }),
            } => Some((iterations as usize).min(MAX_LOOK_UPS)),
            _ => None,
        }
    }

    /// Beside what the reads themselves take, milliseconds.
    pub fn ms(self) -> f64 {
        let nodes = self.blur.map_or(1, |blur| blur.solved());
        let others = match self.blur.map(|blur| blur.depths) {
            None | Some(NodeDepths::Mid) => 0,
            Some(NodeDepths::Ends) => 1,
            Some(NodeDepths::Three) => 2,
            Some(NodeDepths::Each) => nodes - 1,
        };
        let poses = f64::from(nodes) * POSE_MS;
        match self.temporal {
            TemporalStage::Identity => 0.0,
            TemporalStage::Rotation | TemporalStage::Linear | TemporalStage::Rk2 => poses,
            // What begins with what another has found needs one less.
            TemporalStage::Reproject { iterations } => {
                poses + f64::from(iterations + others * (iterations.max(2) - 1)) * LOOK_UP_MS
            }
        }
    }
}

/// The cheapest temporal inverse, and the coarsest terrain, within the tolerance.
pub(super) fn choose<'a>(case: &Case<'a>, motion: &Motion) -> Choice<'a> {
    let quality = &case.sequence.scenario.quality;
    let tolerance_px = quality.max_error_px;
    let truths = case.truths();
    let ground::Coarsened { error_px: terrain_error_px, detail, ground } = ground::coarsest(case, &truths);
    let forecast = truths.forecast(detail.as_ref(), ground);
    // Something small and near may pass between the probes: where there are silhouettes only the bound
    // counts.
    let may_skip_depth = !case.silhouettes_in_view || motion.parallax_px <= BOUND_SHARE * tolerance_px;
    let way = match case.demanded {
        Some(temporal) => Way { temporal, blur: case.blur },
        None => forecast.choose(case, case.ways(motion, may_skip_depth)),
    };
    let mut predicted = forecast.predict(case, way);
    if case.silhouettes_in_view {
        predicted.silhouette_share =
            case.silhouettes.map_or_else(|| truths.silhouette_share(), |silhouettes| silhouettes.share);
    }
    let missed_px = missed_px(case, &predicted);
    Choice { way, terrain_error_px, predicted, missed_px, truths }
}

/// [`Choice::missed_px`].
fn missed_px(case: &Case<'_>, predicted: &Predicted) -> Option<[f64; 2]> {
    let (max_error_px, nodes_px) = (case.sequence.scenario.quality.max_error_px, predicted.nodes_px);
    // Grey levels follow the displacement.
    let most_dn = case.left_by(predicted.ground);
    let is_seen = predicted.displaced_dn > most_dn && nodes_px > OF_NODES * predicted.total_px;
    let for_levels_px = is_seen.then(|| nodes_px * most_dn / predicted.displaced_dn);
    let for_sources_px = (!predicted.kept).then_some(max_error_px);
    for_levels_px.into_iter().chain(for_sources_px).reduce(f64::min).map(|most_px| [nodes_px, most_px])
}

impl<'a> Case<'a> {
    /// Ways in the order of their time, as measured by `camsim bench`. The constant-twist solvers read the
    /// depth beside where they look: not for silhouettes.
    fn ways(&self, motion: &Motion, may_skip_depth: bool) -> Vec<Way> {
        let with = |temporal| Way { temporal, blur: self.blur };
        let mut ways = Vec::new();
        if may_skip_depth {
            ways.extend([TemporalStage::Identity, TemporalStage::Rotation].map(with));
        }
        if self.may_take_twist() {
            ways.push(Way { temporal: TemporalStage::Linear, blur: self.straight_blur });
            if motion.rotation_rad < CHEAP_RK2_STEPS * RK2_STEP_DEG.to_radians() {
                ways.push(with(TemporalStage::Rk2));
            }
        }
        let look_ups = |depths: NodeDepths| {
            let blur = self.blur.map(|blur| BlurStage { depths, ..blur });
            (1..=MAX_LOOK_UPS as u32)
                .map(move |iterations| Way { temporal: TemporalStage::Reproject { iterations }, blur })
        };
        let depths: &[NodeDepths] = match self.blur.map(|blur| blur.solved()) {
            None => &[NodeDepths::Each],
            // Two nodes are the ends, three of them the middle too.
            Some(0..=2) => &[NodeDepths::Mid, NodeDepths::Each],
            Some(3) => &[NodeDepths::Mid, NodeDepths::Ends, NodeDepths::Each],
            Some(_) => &NodeDepths::ALL,
        };
        let mut looking: Vec<Way> = depths.iter().copied().flat_map(look_ups).collect();
        looking.sort_by(|a, b| a.ms().total_cmp(&b.ms()));
        ways.extend(looking);
        ways
    }

    /// Whether the solvers of constant twist are tried.
    fn may_take_twist(&self) -> bool {
        let quality = &self.sequence.scenario.quality;
        self.constant_twist
            && quality.solver == Auto::Auto
            && quality.key_frames == Auto::Auto
            && !self.silhouettes_in_view
    }

    /// Whether anybody wants to know what these solvers do.
    fn asks_for_twist(&self) -> bool {
        matches!(self.demanded, Some(TemporalStage::Linear | TemporalStage::Rk2))
            || self.demanded.is_none() && self.may_take_twist()
    }

    /// What the ground leaves for sources beside their place, 1/255.
    fn left_by(&self, ground: Option<Ground>) -> f64 {
        let most_dn = self.most_displaced_dn;
        let ground_dn = ground.map_or(0.0, |ground| ground.error_dn()).min(ground::SHARE_OF_DN * most_dn);
        (most_dn * most_dn - ground_dn * ground_dn).sqrt()
    }

    fn terrain_detail(&self, max_error_px: f64) -> Option<TerrainDetail<'a>> {
        terrain_detail(self.sequence, self.key_pose, self.ideal, max_error_px)
    }

    /// With an exposure that shows, the probes take turns in trying its [`PHASES`].
    fn truths(&self) -> Truths<'a> {
        let trial = Trial {
            surfaces: self.surfaces,
            path: &self.sequence.path,
            shutter: self.shutter,
            stamp_s: self.stamp_s,
            key_s: self.key_s,
            key_pose: self.key_pose,
            ideal: self.ideal,
            twist: self.asks_for_twist().then_some(self.key_twist),
            nearest_depth: self.sequence.scenario.quality.preset == Preset::Paper,
            plane: DVec3::ZERO,
        };
        let mut truths =
            Truths::new(self.reach, self.ray, trial, phases(&self.sequence.path, self.blur.is_some()), 1);
        truths.trial.plane = truths.plane().normal_per_m;
        truths
    }
}

/// The choice that the ideal pass will make.
fn terrain_detail<'a>(
    sequence: &'a Sequence,
    key_pose: &CameraPose,
    ideal: &IdealGeometry,
    max_error_px: f64,
) -> Option<TerrainDetail<'a>> {
    let terrain = sequence.scene.terrain.as_ref()?;
    Some(TerrainDetail::new(terrain, key_pose, ideal.tangents(), ideal.focal_px.max_element(), max_error_px))
}

/// Instants of the exposure that probes take turns in.
fn phases(path: &CameraPath, is_exposed: bool) -> &'static [f64] {
    match is_exposed {
        false => &PHASES[..1],
        true if path.highest_vibration_hz() > 0.0 => &PHASES,
        true => &PHASES[..AT_REST],
    }
}

/// Where the probes of one frame look.
pub(super) struct Truths<'a> {
    reach: &'a LensReach,
    ray: RayStage,
    trial: Trial<'a>,
    looked: Vec<Looked>,
}

/// One probe.
struct Looked {
    /// Of the camera's probes.
    number: usize,
    probe: Probe,
    truth: Truth,
    /// Whether it is to be counted apart; unknown until it matters.
    apart: OnceLock<bool>,
}

impl Looked {
    fn new(number: usize, probe: Probe, truth: Truth) -> Self {
        Self { number, probe, truth, apart: OnceLock::new() }
    }
}

impl<'a> Truths<'a> {
    /// Of one probe in `step`.
    fn new(reach: &'a LensReach, ray: RayStage, trial: Trial<'a>, phases: &[f64], step: usize) -> Self {
        let look = |(i, probe): (usize, &Probe)| {
            trial.look(probe, phases[i % phases.len()]).map(|truth| Looked::new(i * step, *probe, truth))
        };
        let looked =
            reach.probes.par_iter().step_by(step).enumerate().with_min_len(16).filter_map(look).collect();
        Truths { reach, ray, trial, looked }
    }

    /// At mid-exposure alone: for what silhouettes there are.
    pub fn of_silhouettes(reach: &'a LensReach, trial: Trial<'a>) -> Self {
        Self::new(reach, RayStage::Pinhole, trial, &PHASES[..1], 1)
    }

    /// Largest displacement of a source by the level of detail.
    fn level_of_detail_px(&self, detail: Option<&TerrainDetail<'_>>) -> f64 {
        self.largest(|_, looked| self.trial.level_of_detail_px(&looked.truth, detail))
    }

    /// The largest of a figure over the probes that are not to be counted apart. Only the largest are asked
    /// whether they are.
    fn largest(&self, of: impl Fn(usize, &Looked) -> f64) -> f64 {
        let counted = self.looked.iter().enumerate().filter(|(_, looked)| looked.apart.get() != Some(&true));
        let mut order: Vec<(f64, &Looked)> = counted.map(|(i, looked)| (of(i, looked), looked)).collect();
        order.sort_by(|a, b| b.0.total_cmp(&a.0));
        order.into_iter().find(|(px, looked)| *px == 0.0 || !self.is_apart(looked)).map_or(0.0, |(px, _)| px)
    }

    /// Folds are not set apart here, so that the bound is on the safe side.
    fn is_apart(&self, looked: &Looked) -> bool {
        *looked.apart.get_or_init(|| self.trial.at_silhouette(&looked.probe, &looked.truth, false))
    }

    /// Share of the pixels at silhouettes: of one probe in [`SHARE_STEP`].
    pub fn silhouette_share(&self) -> f64 {
        let asked: Vec<&Looked> = self.looked.iter().step_by(SHARE_STEP).collect();
        let apart = asked
            .par_iter()
            .with_min_len(8)
            .filter(|looked| self.trial.at_silhouette(&looked.probe, &looked.truth, true))
            .count();
        apart as f64 / asked.len().max(1) as f64
    }

    /// The same of all of them, given which probes are beside a step or fold.
    pub fn share_apart(&self, is_beside: impl Fn(usize) -> bool) -> f64 {
        let apart =
            self.looked.iter().filter(|looked| looked.truth.is_hidden() || is_beside(looked.number)).count();
        apart as f64 / self.looked.len().max(1) as f64
    }

    /// The plane that is nearest to what they see in the key frame.
    pub fn plane(&self) -> SeenPlane {
        let Trial { key_pose, ideal, .. } = self.trial;
        let surfaces = self.looked.iter().filter(|looked| looked.truth.key_inverse_depth > 0.0);
        let seen = |Looked { truth, .. }: &Looked| {
            ((truth.at_px - ideal.principal_px) / ideal.focal_px, truth.key_inverse_depth)
        };
        SeenPlane::fitted(*key_pose, surfaces.map(seen))
    }

    /// What `keys` do not see.
    pub fn holes(&self, keys: &[KeyFrame], max_error_px: f64) -> Holes {
        let looked = self.looked.par_iter().map(|Looked { probe, truth, .. }| (probe, truth));
        Holes::new(&self.trial, looked, keys, self.probe_px(), max_error_px)
    }

    /// Side of the part of the picture that a probe stands for, ideal pixels.
    fn probe_px(&self) -> f64 {
        self.trial.ideal.scale(&self.reach.camera) * self.reach.probe_px
    }

    /// Miss of what lies between the depths of the exposure's ends, and between these and its middle, of each
    /// probe, and the largest. `elsewhere` is [`Outcome::elsewhere`] of each, if that is known.
    fn between_px(&self, elsewhere: impl Fn(usize) -> Option<f64> + Sync) -> (Vec<[f64; 2]>, [f64; 2]) {
        let of =
            |(i, looked): (usize, &Looked)| self.trial.between_px(&looked.probe, &looked.truth, elsewhere(i));
        let px: Vec<[f64; 2]> = self.looked.par_iter().enumerate().with_min_len(16).map(of).collect();
        let largest = [0, 1].map(|k: usize| self.largest(|i, _| px[i][k]));
        (px, largest)
    }
}
