//! A frame whose temporal inverse is to be chosen, and the methods that may do.

use camsim_core::{
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
use glam::DVec3;

use super::prices::temporal_ms;
use crate::{
    ir::{
        budget,
        motion::Motion,
        predicted::{BlendedDepthError, SilhouetteError, TerrainError},
        sampling_plan::ResamplingError,
        stages::{BlurStage, NodeDepths, RayStage, TemporalStage},
    },
    picture_error::{misregistration::ShownSpectrum, silhouettes::SilhouetteModel},
    source_error::{
        dry_run::{DryRun, MAX_LOOK_UPS},
        exact_sources::{ExactSources, phases, terrain_detail},
        temporal_method::TemporalMethod,
    },
    view::{lens_reach::LensReach, surfaces::Surfaces},
};

/// Steps of eq. 18 up to which it takes less time than a look-up of depth in every node.
const CHEAP_RK2_STEPS: f64 = 2.0;

/// A frame whose temporal inverse is to be chosen.
pub(crate) struct TemporalTask<'a> {
    pub reach: &'a LensReach,
    pub sequence: &'a Sequence,
    pub shutter: &'a Shutter,
    pub surfaces: &'a Surfaces,
    pub stamp_s: f64,
    pub key_s: f64,
    pub key_pose: &'a CameraPose,
    pub key_twist: Twist,
    pub ideal: &'a IdealGeometry,
    /// The solver that the scenario demands.
    pub demanded: Option<TemporalStage>,
    pub ray: RayStage,
    pub blur: Option<BlurStage>,
    /// The exposure for a path that is a straight line in time.
    pub straight_blur: Option<BlurStage>,
    /// Picture error by resampling.
    pub resampling: ResamplingError,
    /// Power of what pixels show, by frequency.
    pub shown: ShownSpectrum,
    /// Most that terrain and misregistration may cost, 1/255 of the linear range.
    pub most_misregistration_dn: f64,
    pub silhouette_model: Option<&'a SilhouetteModel>,
    pub silhouettes: Option<SilhouetteError>,
    pub blended: Option<BlendedDepthError>,
    pub silhouettes_in_view: bool,
    /// Whether the camera's twist at the key instant may stand for its motion.
    pub constant_twist: bool,
}

impl<'a> TemporalTask<'a> {
    /// Methods in the order of their time, as measured by `camsim bench`. The constant-twist solvers read the
    /// depth beside where they look: not for silhouettes.
    pub fn methods(&self, motion: &Motion, may_skip_depth: bool) -> Vec<TemporalMethod> {
        let with = |temporal| TemporalMethod { temporal, blur: self.blur };
        let mut methods = Vec::new();
        if may_skip_depth {
            methods.extend([TemporalStage::Identity, TemporalStage::Rotation].map(with));
        }
        if self.may_take_twist() {
            methods.push(TemporalMethod { temporal: TemporalStage::Linear, blur: self.straight_blur });
            if motion.rotation_rad < CHEAP_RK2_STEPS * RK2_STEP_DEG.to_radians() {
                methods.push(with(TemporalStage::Rk2));
            }
        }
        let look_ups = |depths: NodeDepths| {
            let blur = self.blur.map(|blur| BlurStage { depths, ..blur });
            (1..=MAX_LOOK_UPS as u32).map(move |iterations| TemporalMethod {
                temporal: TemporalStage::Reproject { iterations },
                blur,
            })
        };
        let depths: &[NodeDepths] = match self.blur.map(|blur| blur.solved()) {
            None => &[NodeDepths::Each],
            // Two nodes are the ends, three of them the middle too.
            Some(0..=2) => &[NodeDepths::Mid, NodeDepths::Each],
            Some(3) => &[NodeDepths::Mid, NodeDepths::Ends, NodeDepths::Each],
            Some(_) => &NodeDepths::ALL,
        };
        let mut with_depth: Vec<TemporalMethod> = depths.iter().copied().flat_map(look_ups).collect();
        with_depth.sort_by(|a, b| temporal_ms(*a).total_cmp(&temporal_ms(*b)));
        methods.extend(with_depth);
        methods
    }

    /// Whether the solvers of constant twist are tried.
    fn may_take_twist(&self) -> bool {
        let quality = &self.sequence.scenario.quality;
        self.constant_twist
            && quality.solver == Auto::Auto
            && quality.key_frames == Auto::Auto
            && !self.silhouettes_in_view
    }

    /// Whether the errors of these solvers are needed.
    fn needs_twist(&self) -> bool {
        matches!(self.demanded, Some(TemporalStage::Linear | TemporalStage::Rk2))
            || self.demanded.is_none() && self.may_take_twist()
    }

    /// What the terrain leaves for misregistration, 1/255.
    pub fn left_for_misregistration_dn(&self, terrain: Option<TerrainError>) -> f64 {
        let most_dn = self.most_misregistration_dn;
        let terrain_dn = terrain.map_or(0.0, |terrain| terrain.error_dn()).min(budget::terrain_dn(most_dn));
        (most_dn * most_dn - terrain_dn * terrain_dn).sqrt()
    }

    pub fn terrain_detail(&self, max_error_px: f64) -> Option<TerrainDetail<'a>> {
        terrain_detail(self.sequence, self.key_pose, self.ideal, max_error_px)
    }

    /// Exact sources of the probes. With an exposure that shows, the probes take turns in its phases.
    pub fn exact_sources(&self) -> ExactSources<'a> {
        let dry_run = DryRun {
            surfaces: self.surfaces,
            path: &self.sequence.path,
            shutter: self.shutter,
            stamp_s: self.stamp_s,
            key_s: self.key_s,
            key_pose: self.key_pose,
            ideal: self.ideal,
            twist: self.needs_twist().then_some(self.key_twist),
            nearest_depth: self.sequence.scenario.quality.preset == Preset::Paper,
            plane: DVec3::ZERO,
        };
        let phases = phases(&self.sequence.path, self.blur.is_some());
        let mut sources = ExactSources::new(self.reach, self.ray, dry_run, phases, 1);
        sources.dry_run.plane = sources.plane().normal_per_m;
        sources
    }
}
