//! What a frame looks at: all that its choices rest on.

use std::sync::Arc;

use super::{
    BlurStage, EdgeStage, IdealGeometry, KeyFrame, LensReach, Motion, PlanError, Planner, TemporalStage,
    around::{Search, Surroundings},
    bounds, contours,
    displaced::ShownWaves,
    dry_run, edges, error, exposure, forced, layers,
    levels::Sampling,
    motion, paper, prospect, sharing, zoom_at,
};
use camsim_core::{
    mount::CameraPath,
    pose::CameraPose,
    scenario::{Preset, QualitySpec, Silhouettes},
    temporal::displacement::Twist,
};

/// Frames of a group whose probes answer together for how much there is of borders.
const TOGETHER: u64 = 8;

/// A frame before anything is chosen for it.
#[derive(Clone)]
pub(super) struct Look<'a> {
    pub planner: &'a Planner,
    pub frame: u64,
    pub stamp_s: f64,
    pub window_s: [f64; 2],
    pub zoom: Option<f64>,
    pub reach: Arc<LensReach>,
    /// The same with the probes at which the pipeline is run dry.
    pub tried: Arc<LensReach>,
    /// The ideal frame that others are made from too, if this one is to be.
    pub common: Option<&'a sharing::Common>,
    /// Whether half of the probes look: neighbours have the others.
    has_half: bool,
    /// What is asked of the way in which it is sampled.
    pub asked: sharing::Asked,
    /// The key instant, the camera's pose and twist then.
    pub key_s: f64,
    pub key_pose: CameraPose,
    pub key_twist: Twist,
    /// The solver that the scenario asks for.
    pub demanded: Option<TemporalStage>,
}

/// What it looks at.
pub(super) struct Scenery<'a> {
    /// Ideal frame of the least scale, and what moves in its pixels.
    pub ideal: IdealGeometry,
    pub motion: Motion,
    pub prospect: prospect::Prospect<'a>,
    /// Why no silhouette can be in view, if none can.
    pub reason_for_none: Option<String>,
    /// What silhouettes cost; `None` where nobody asks.
    pub outlook: Option<contours::Outlook>,
    /// What mixed light costs; `None` where nothing is mixed.
    pub layers: Option<layers::Layers>,
    /// Whether samples of ideal pixels show all borders: not where pictures have holes, or what is mixed.
    pub may_have_samples: bool,
}

impl Planner {
    /// Looks at a frame, by itself or from an ideal frame that others are made from too.
    pub(super) fn look<'a>(
        &'a self,
        frame: u64,
        common: Option<&'a sharing::Common>,
    ) -> Result<Look<'a>, PlanError> {
        self.look_with(frame, common, common.is_some())
    }

    /// Looks at a frame by itself as those of a group are looked at, to be compared with them.
    pub(super) fn look_as_in_group(&self, frame: u64) -> Result<Look<'_>, PlanError> {
        self.look_with(frame, None, true)
    }

    fn look_with<'a>(
        &'a self,
        frame: u64,
        common: Option<&'a sharing::Common>,
        has_half: bool,
    ) -> Result<Look<'a>, PlanError> {
        let stamp_s = self.stamp_s(frame);
        let zoom = self.zoom.as_ref().map(|_| zoom_at(&self.sequence.zoom_track, stamp_s));
        let half = if has_half { self.half_the_probes(frame) } else { None };
        let reach = match (&half.or_else(|| self.fixed.clone()), &self.zoom, zoom) {
            (Some(reach), ..) => reach.clone(),
            (None, Some(table), Some(value)) => {
                Arc::new(LensReach::new(Arc::new(table.at(value)?)).ok_or(PlanError::NoRay)?)
            }
            _ => return Err(PlanError::NoRay),
        };
        let tried =
            if has_half { self.quarter_of_the_probes(frame) } else { None }.unwrap_or_else(|| reach.clone());
        let (first, last) = self.shutter.window_s();
        let window_s = [stamp_s + first, stamp_s + last];
        let path = &*self.sequence.path;
        let key_s = common.map_or(0.5 * (window_s[0] + window_s[1]), |common| common.key_s);
        let key_pose = path.pose(key_s);
        let key_twist = Twist {
            velocity_m_s: key_pose.ned_from_camera.inverse() * path.velocity_ned(key_s),
            rate_rad_s: path.rate_camera(key_s),
        };
        let demanded = forced::temporal_stage(&self.sequence.scenario.quality);
        let asked = sharing::Asked::default();
        Ok(Look {
            planner: self,
            frame,
            stamp_s,
            window_s,
            zoom,
            reach,
            tried,
            common,
            has_half,
            asked,
            key_s,
            key_pose,
            key_twist,
            demanded,
        })
    }
}

impl<'a> Look<'a> {
    /// The same, asked for something else.
    pub fn asking(self, asked: sharing::Asked) -> Self {
        Self { asked, ..self }
    }

    pub fn is_paper(&self) -> bool {
        self.planner.sequence.scenario.quality.preset == Preset::Paper
    }

    pub fn key(&self) -> KeyFrame {
        KeyFrame { t_s: self.key_s, pose: self.key_pose }
    }

    pub fn path(&self) -> &CameraPath {
        &self.planner.sequence.path
    }

    /// Ideal frame that shows what a solver looks for in `keys`, or what all those do that are made from the
    /// common one.
    pub fn geometry(&self, keys: &[KeyFrame], scale: f64, solver: Option<TemporalStage>) -> IdealGeometry {
        let Self { planner, reach, stamp_s, key_s, .. } = self;
        let displaced = solver.map(|stage| (stage, self.key_twist));
        let own = || {
            bounds::view(
                reach,
                self.path(),
                &planner.shutter,
                *stamp_s,
                *key_s,
                keys,
                &planner.surfaces,
                displaced,
            )
        };
        self.common.map_or_else(own, |common| common.view).pixels(&reach.camera, scale)
    }

    /// What moves within the frame, in the pixels of an ideal frame.
    pub fn motion_in(&self, ideal: &IdealGeometry) -> Motion {
        let Planner { shutter, surfaces, .. } = self.planner;
        motion::measure(&self.reach, self.path(), shutter, self.stamp_s, self.key_s, ideal, surfaces)
    }

    pub fn exposed(&self, motion: Motion, ideal: &IdealGeometry) -> exposure::Exposed<'_> {
        let (path, shutter) = (self.path(), &self.planner.shutter);
        exposure::Exposed {
            reach: &self.reach,
            path,
            shutter,
            stamp_s: self.stamp_s,
            focal_px: ideal.focal_px,
            motion,
        }
    }

    /// The exposure with its samples, and with the poses that rays at silhouettes take.
    pub fn blur_stage(
        &self,
        exposure: exposure::ExposurePath,
        edges: EdgeStage,
        sampling: &Sampling,
        motion: Motion,
        ideal: &IdealGeometry,
    ) -> BlurStage {
        let quality = &self.planner.sequence.scenario.quality;
        let has_rays = edges.has_rays() && self.demanded != Some(TemporalStage::Linear);
        let exposure = if has_rays {
            self.exposed(motion, ideal).with_poses_for_rays(exposure, quality)
        } else {
            exposure
        };
        sampling.blur_stage(exposure, quality, motion.blur_px)
    }

    pub fn scenery(&self) -> Scenery<'a> {
        let Planner { sequence, shutter, surfaces, grain, outline, fixed, .. } = self.planner;
        let Self { reach, stamp_s, key_pose, .. } = self;
        let ideal = match self.is_paper() {
            true => paper::ideal_geometry(&reach.camera),
            false => self.geometry(&[self.key()], reach.least_scale(), self.demanded),
        };
        let motion = self.motion_in(&ideal);
        let reason_for_none =
            outline.reason_for_none(&sequence.scene, key_pose, ideal.tangents(), motion.travel_m);
        Scenery {
            // A few of all probes, whoever has the others.
            prospect: prospect::Prospect::new(
                fixed.as_ref().unwrap_or(reach),
                sequence,
                surfaces,
                grain,
                shutter,
                *stamp_s,
                key_pose,
            ),
            outlook: self.outlook(&ideal, reason_for_none.is_none()),
            layers: self.layers(&[self.key()]),
            may_have_samples: !self.is_paper() && sequence.scene.has_borders_of_triangles(),
            ideal,
            motion,
            reason_for_none,
        }
    }

    /// What silhouettes cost, where something depends on it.
    fn outlook(&self, ideal: &IdealGeometry, in_view: bool) -> Option<contours::Outlook> {
        let Planner { sequence, shutter, surfaces, .. } = self.planner;
        let quality = &sequence.scenario.quality;
        let ignored = quality.silhouettes == Silhouettes::Auto && quality.max_error_dn >= edges::IGNORED_DN;
        if !in_view || self.is_paper() || ignored {
            return None;
        }
        let &Self { stamp_s, key_s, ref key_pose, ref reach, .. } = self;
        let path = self.path();
        let trial = dry_run::Trial {
            surfaces,
            path,
            shutter,
            stamp_s,
            key_s,
            key_pose,
            ideal,
            twist: None,
            nearest_depth: false,
            plane: glam::DVec3::ZERO,
        };
        let truths = error::Truths::of_silhouettes(reach, trial);
        let own = self.surroundings(self.frame, reach);
        let least_share = truths.share_apart(|probe| own.around[probe].is_beside);
        let (plane, holes) = (truths.plane(), truths.holes(&[self.key()], quality.max_error_px));
        let outlook = |all: &Surroundings| {
            contours::Outlook::new(all, &reach.camera, key_pose, &plane, holes, least_share)
        };
        if !self.has_half {
            return Some(outlook(&own));
        }
        Some(outlook(&own.with(self.surroundings_of_neighbours())))
    }

    /// What the probes of a frame see around them.
    fn surroundings(&self, frame: u64, reach: &LensReach) -> Arc<Surroundings> {
        let Planner { sequence, shutter, surfaces, surroundings, surroundings_by_half, .. } = self.planner;
        let gain = &prospect::gain(sequence, &reach.camera);
        let search = Search {
            reach,
            surfaces,
            path: self.path(),
            shutter,
            stamp_s: self.planner.stamp_s(frame),
            gain,
        };
        let known = if self.has_half { surroundings_by_half } else { surroundings };
        known.of(frame, || search.look_around())
    }

    /// What is around the probes of the frames beside this one in a group, as its own camera would see that:
    /// borders are few, and half of the probes of one frame tell too little.
    fn surroundings_of_neighbours(&self) -> impl Iterator<Item = Surroundings> {
        let (planner, frame) = (self.planner, self.frame);
        let first = frame / TOGETHER * TOGETHER;
        // The one beside it has the other half, whatever its group is.
        let is_beside = move |other: u64| {
            other == frame ^ 1 || other != frame && planner.group_of(other) == planner.group_of(frame)
        };
        let others = (first..first + TOGETHER)
            .filter(move |&other| other < planner.sequence.frames && is_beside(other));
        let own_pose =
            |[x, y]: [u32; 2]| self.path().pose(self.stamp_s + self.planner.shutter.dt_pixel_s(x, y));
        others.filter_map(move |other| {
            let reach = self.planner.half_the_probes(other)?;
            Some(self.surroundings(other, &reach).seen_from(&reach.probes, own_pose))
        })
    }
}

impl Look<'_> {
    /// What mixed light costs with these ideal frames.
    pub fn layers(&self, keys: &[KeyFrame]) -> Option<layers::Layers> {
        let Planner { sequence, shutter, surfaces, fixed, .. } = self.planner;
        // All probes: what is mixed may be little of the picture.
        let (stamp_s, reach) = (self.stamp_s, fixed.as_ref().unwrap_or(&self.reach));
        let gain = &prospect::gain(sequence, &reach.camera);
        let search = layers::Search { reach, surfaces, path: self.path(), shutter, stamp_s, keys, gain };
        // The paper's errors are not judged.
        if self.is_paper() { None } else { search.layers() }
    }
}

impl Scenery<'_> {
    /// What its pixels show, away from silhouettes.
    pub fn shown(&self, exposed: bool) -> ShownWaves {
        ShownWaves::new(&self.prospect, exposed)
    }

    /// RMS error over the picture by mixed light, 1/255 of the linear range.
    pub fn layers_dn(&self) -> f64 {
        self.layers.map_or(0.0, |layers| layers.error_dn)
    }

    /// Whether silhouettes may be left as they are: another instant sees more of what is behind them than
    /// rays could make up for.
    pub fn may_be_shared(&self, quality: &QualitySpec, scale: f64) -> bool {
        let is_auto = quality.silhouettes == Silhouettes::Auto;
        self.outlook.as_ref().is_none_or(|outlook| {
            !is_auto
                || outlook.plain_at_best(scale, self.may_have_samples).are_affordable(quality.max_error_dn)
        })
    }
}
