//! What a frame is planned with: instants, camera, probes, and what is in view.

use std::{ops::Range, sync::Arc};

use camsim_core::{
    mount::CameraPath,
    pose::CameraPose,
    scenario::{Preset, QualitySpec, Silhouettes},
    shutter::Shutter,
    temporal::{IdealGeometry, displacement::Twist},
};
use glam::DVec3;

use super::{
    demanded,
    edges::IGNORED_DN,
    exposure_samples, paper,
    plan_inputs::{PlanInputs, zoom_at},
    prices::{Prices, TrianglePrices},
    shared_ideal::{SamplingRequest, SharedIdeal},
};
use crate::{
    ir::{
        budget::are_affordable,
        key_frame::KeyFrame,
        motion::Motion,
        plan_error::PlanError,
        predicted::BlendedDepthError,
        sampling_plan::SamplingPlan,
        stages::{BlurStage, EdgeStage, TemporalStage},
    },
    picture_error::{
        blended_layers::BlendSearch, misregistration::ShownSpectrum, silhouettes::SilhouetteModel,
        texture_probes::TextureProbes,
    },
    source_error::{dry_run::DryRun, exact_sources::ExactSources},
    view::{
        exposure::{ExposedFrame, ExposurePath},
        gain::gain,
        ideal_extent::ideal_extent,
        lens_reach::LensReach,
        motion,
        neighbourhood::{Neighbourhoods, search::NeighbourhoodSearch},
    },
};

/// A frame before anything is chosen for it.
#[derive(Clone)]
pub(crate) struct FrameContext<'a> {
    pub inputs: &'a PlanInputs,
    pub frame: u64,
    pub stamp_s: f64,
    /// With the frame's own exposure.
    pub shutter: Shutter,
    pub window_s: [f64; 2],
    pub zoom: Option<f64>,
    pub reach: Arc<LensReach>,
    /// The lens with the probes at which the pipeline is run dry: a quarter of them where other frames are made from
    /// the same ideal frame.
    pub dry_run_reach: Arc<LensReach>,
    /// The ideal frame that others are made from too, if this one is to be.
    pub shared: Option<&'a SharedIdeal>,
    /// Frames that have a quarter of the probes each, and share what they find; none if this one has all.
    span: Range<u64>,
    /// Request for its sampling plan.
    pub request: SamplingRequest,
    /// Key instant.
    pub key_s: f64,
    pub key_pose: CameraPose,
    pub key_twist: Twist,
    /// The solver that the scenario demands.
    pub demanded: Option<TemporalStage>,
}

/// What is in view of a frame.
pub(crate) struct FrameScene<'a> {
    /// Ideal frame of the least scale.
    pub ideal: IdealGeometry,
    /// What moves, in pixels of that.
    pub motion: Motion,
    pub texture_probes: TextureProbes<'a>,
    /// Prices of the scene's triangles, and whether the lens bends rows.
    triangles: TrianglePrices,
    is_bent: bool,
    /// Why no silhouette can be in view, if none can.
    pub no_silhouettes_reason: Option<String>,
    /// What silhouettes cost; `None` where nothing depends on it.
    pub silhouettes: Option<SilhouetteModel>,
    /// What the one depth of blended surfaces costs; `None` where nothing is blended.
    pub blended: Option<BlendedDepthError>,
    /// Whether samples of ideal pixels show all silhouettes: not where textures have holes, or of blended
    /// surfaces.
    pub may_have_samples: bool,
}

impl<'a> FrameContext<'a> {
    /// A frame by itself, or from an ideal frame that others are made from too.
    pub fn new(
        inputs: &'a PlanInputs,
        frame: u64,
        shared: Option<&'a SharedIdeal>,
    ) -> Result<Self, PlanError> {
        let stamp_s = inputs.stamp_s(frame);
        let zoom = inputs.zoom.as_ref().map(|_| zoom_at(&inputs.sequence.zoom_track, stamp_s));
        let span = match shared {
            _ if inputs.shares_probes(frame) => inputs.span_of(frame),
            Some(shared) => shared.frames.clone(),
            None => 0..0,
        };
        let quarter = if span.is_empty() { None } else { inputs.quarter_of_the_probes(frame) };
        let reach = match (&quarter.or_else(|| inputs.fixed.clone()), &inputs.zoom, zoom) {
            (Some(reach), ..) => reach.clone(),
            (None, Some(table), Some(value)) => Arc::new(inputs.zoomed(table, value)?),
            _ => return Err(PlanError::NoRay),
        };
        let shutter = inputs.shutter_of(frame);
        let (first, last) = shutter.window_s();
        let window_s = [stamp_s + first, stamp_s + last];
        let path = inputs.path();
        let key_s = shared.map_or(0.5 * (window_s[0] + window_s[1]), |shared| shared.key_s);
        let key_pose = path.pose(key_s);
        let key_twist = Twist {
            velocity_m_s: key_pose.ned_from_camera.inverse() * path.velocity_ned(key_s),
            rate_rad_s: path.rate_camera(key_s),
        };
        Ok(Self {
            inputs,
            frame,
            stamp_s,
            shutter,
            window_s,
            zoom,
            dry_run_reach: inputs.fixed.clone().filter(|_| shared.is_none()).unwrap_or_else(|| reach.clone()),
            reach,
            shared,
            span,
            request: SamplingRequest::default(),
            key_s,
            key_pose,
            key_twist,
            demanded: demanded::temporal_stage(inputs.quality()),
        })
    }

    /// The frame with another request.
    pub fn requesting(self, request: SamplingRequest) -> Self {
        Self { request, ..self }
    }

    /// The frame in the middle of those that see nearly the same, by which all are sampled; `None` without.
    pub fn middle_of_span(&self) -> Option<u64> {
        let Range { start, end } = self.span;
        (start < end).then_some((start + end) / 2)
    }

    pub fn quality(&self) -> &'a QualitySpec {
        self.inputs.quality()
    }

    pub fn is_paper(&self) -> bool {
        self.quality().preset == Preset::Paper
    }

    /// The single key frame.
    pub fn key(&self) -> KeyFrame {
        KeyFrame { t_s: self.key_s, pose: self.key_pose }
    }

    pub fn path(&self) -> &'a CameraPath {
        self.inputs.path()
    }

    /// Ideal frame that shows what a solver looks for in `keys`, or what all those do that are made from the
    /// shared one.
    pub fn ideal_of(&self, keys: &[KeyFrame], scale: f64, solver: Option<TemporalStage>) -> IdealGeometry {
        let Self { inputs, reach, shutter, stamp_s, key_s, .. } = self;
        let twist = solver.map(|stage| (stage, self.key_twist));
        let surfaces = &inputs.scene.surfaces;
        let own = || ideal_extent(reach, self.path(), shutter, *stamp_s, *key_s, keys, surfaces, twist);
        self.shared.map_or_else(own, |shared| shared.extent).pixels(&reach.camera, scale)
    }

    /// What moves within the frame, in the pixels of an ideal frame.
    pub fn motion_in(&self, ideal: &IdealGeometry) -> Motion {
        let surfaces = &self.inputs.scene.surfaces;
        motion::measure(&self.reach, self.path(), &self.shutter, self.stamp_s, self.key_s, ideal, surfaces)
    }

    pub fn exposed(&self, motion: Motion, ideal: &IdealGeometry) -> ExposedFrame<'_> {
        ExposedFrame {
            reach: &self.reach,
            path: self.path(),
            shutter: &self.shutter,
            stamp_s: self.stamp_s,
            focal_px: ideal.focal_px,
            motion,
        }
    }

    /// The exposure with its samples, and with the poses that rays at silhouettes take.
    pub fn blur_stage(
        &self,
        exposure: ExposurePath,
        edges: EdgeStage,
        plan: &SamplingPlan,
        motion: Motion,
        ideal: &IdealGeometry,
    ) -> BlurStage {
        let has_rays = edges.has_rays() && self.demanded != Some(TemporalStage::Linear);
        let exposure = if has_rays {
            self.exposed(motion, ideal).with_poses_for_rays(exposure, self.quality())
        } else {
            exposure
        };
        exposure_samples::blur_stage(plan, self.quality(), exposure, motion.blur_px)
    }

    /// What is in view.
    pub fn scene(&self) -> FrameScene<'a> {
        let PlanInputs { sequence, scene, fixed, .. } = self.inputs;
        let Self { reach, stamp_s, shutter, key_pose, .. } = self;
        let ideal = match self.is_paper() {
            true => paper::ideal_geometry(&reach.camera),
            false => self.ideal_of(&[self.key()], reach.least_scale(), self.demanded),
        };
        let motion = self.motion_in(&ideal);
        let no_silhouettes_reason =
            scene.outline.reason_for_none(&sequence.scene, key_pose, ideal.tangents(), motion.travel_m);
        FrameScene {
            // A few of all probes, whichever frame has the others.
            texture_probes: TextureProbes::new(
                fixed.as_ref().unwrap_or(reach),
                sequence,
                &scene.surfaces,
                &scene.spectra,
                shutter,
                *stamp_s,
                key_pose,
                self.frame,
            ),
            triangles: TrianglePrices::new(&sequence.scene),
            is_bent: !reach.camera.lens.is_identity() || reach.others.is_some(),
            silhouettes: self.silhouettes(&ideal, no_silhouettes_reason.is_none()),
            blended: self.blended(&[self.key()]),
            may_have_samples: !self.is_paper() && sequence.scene.has_triangle_borders_only(),
            ideal,
            motion,
            no_silhouettes_reason,
        }
    }

    /// What silhouettes cost, where something depends on it.
    fn silhouettes(&self, ideal: &IdealGeometry, in_view: bool) -> Option<SilhouetteModel> {
        let quality = self.quality();
        let ignored = quality.silhouettes == Silhouettes::Auto && quality.max_error_dn >= IGNORED_DN;
        if !in_view || self.is_paper() || ignored {
            return None;
        }
        let &Self { stamp_s, key_s, ref key_pose, ref reach, .. } = self;
        let dry_run = DryRun {
            surfaces: &self.inputs.scene.surfaces,
            path: self.path(),
            shutter: &self.shutter,
            stamp_s,
            key_s,
            key_pose,
            ideal,
            twist: None,
            nearest_depth: false,
            plane: DVec3::ZERO,
        };
        let sources = ExactSources::of_silhouettes(reach, dry_run);
        let own = self.neighbourhoods(self.frame, reach);
        let least_fraction = sources.fraction_apart(|probe| own.of_probes[probe].near_silhouette);
        let plane = sources.plane();
        let disocclusion = sources.disocclusion(&[self.key()], quality.max_error_px);
        let model = |all: &Neighbourhoods| {
            SilhouetteModel::new(all, &reach.camera, key_pose, &plane, disocclusion, least_fraction)
        };
        Some(if self.span.is_empty() {
            model(&own)
        } else {
            model(&own.with(self.neighbourhoods_of_others()))
        })
    }

    /// Neighbourhoods of the probes of a frame.
    fn neighbourhoods(&self, frame: u64, reach: &LensReach) -> Arc<Neighbourhoods> {
        let PlanInputs { sequence, scene, neighbourhoods, neighbourhoods_of_quarters, .. } = self.inputs;
        let gain = &gain(sequence, &reach.camera, frame);
        let search = NeighbourhoodSearch {
            reach,
            surfaces: &scene.surfaces,
            path: self.path(),
            shutter: &self.inputs.shutter_of(frame),
            stamp_s: self.inputs.stamp_s(frame),
            gain,
        };
        let cache = if self.span.is_empty() { neighbourhoods } else { neighbourhoods_of_quarters };
        cache.get(frame, || search.neighbourhoods())
    }

    /// Neighbourhoods of the probes of the other frames, as their own cameras would see them: silhouettes are few,
    /// and a quarter of the probes of one frame is too few.
    fn neighbourhoods_of_others(&self) -> impl Iterator<Item = Neighbourhoods> {
        let own_pose =
            |[x, y]: [u32; 2]| self.path().pose(self.stamp_s + self.inputs.shutter.dt_pixel_s(x, y));
        self.span.clone().filter(|&other| other != self.frame).filter_map(move |other| {
            let reach = self.inputs.quarter_of_the_probes(other)?;
            Some(self.neighbourhoods(other, &reach).seen_from(&reach.probes, own_pose))
        })
    }

    /// What the one depth of blended surfaces costs with these ideal frames.
    pub fn blended(&self, keys: &[KeyFrame]) -> Option<BlendedDepthError> {
        let PlanInputs { sequence, scene, fixed, .. } = self.inputs;
        let shutter = &self.shutter;
        // All probes: blended surfaces may be little of the picture.
        let (stamp_s, reach) = (self.stamp_s, fixed.as_ref().unwrap_or(&self.reach));
        let gain = &gain(sequence, &reach.camera, self.frame);
        let surfaces = &scene.surfaces;
        let search = BlendSearch { reach, surfaces, path: self.path(), shutter, stamp_s, keys, gain };
        // The paper's errors are not judged.
        if self.is_paper() { None } else { search.error() }
    }
}

impl FrameScene<'_> {
    pub fn prices(&self) -> Prices<'_> {
        let Self { texture_probes: probes, triangles, is_bent, .. } = self;
        Prices { probes, triangles: *triangles, is_bent: *is_bent }
    }

    /// Power of what its pixels show, away from silhouettes.
    pub fn shown(&self, exposed: bool) -> ShownSpectrum {
        ShownSpectrum::new(&self.texture_probes, exposed)
    }

    /// RMS error over the picture by the one depth of blended surfaces, 1/255 of the linear range.
    pub fn blended_dn(&self) -> f64 {
        self.blended.map_or(0.0, |blended| blended.error_dn)
    }

    /// Whether silhouettes may be left as they are: another instant sees more of what is behind them than
    /// rays could make up for.
    pub fn may_be_shared(&self, quality: &QualitySpec, scale: f64) -> bool {
        let is_auto = quality.silhouettes == Silhouettes::Auto;
        self.silhouettes.as_ref().is_none_or(|model| {
            let at_best = model.plain_at_best(scale, self.may_have_samples);
            !is_auto || are_affordable(&at_best, quality.max_error_dn)
        })
    }
}
