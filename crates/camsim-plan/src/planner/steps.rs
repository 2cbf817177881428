//! The steps of a plan.

use camsim_core::{
    scenario::{Auto, CameraSpec, Primary},
    scene::Light,
    temporal::{IdealGeometry, SKY_REACH_PX},
};

use crate::{
    choose::{
        demanded,
        edges::{self, EdgeCase},
        exposure_samples,
        frame_context::{FrameContext, FrameScene},
        key_frames, paper,
        picture::{self, PictureChoice},
        prices::temporal_ms,
        temporal_inverse::{self, TemporalChoice},
        temporal_task::TemporalTask,
    },
    ir::{
        budget::ErrorBudget,
        frame_plan::FramePlan,
        key_frame::KeyFrame,
        motion::Motion,
        placement::Placement,
        plan_error::PlanError,
        skip::Skip,
        stages::{BlurStage, EdgeStage, RayStage, ShadowStage, TemporalStage},
    },
    view::{exposure::ExposurePath, ideal_extent::check_size},
};

/// Times that an exposure whose path the probes find to be missed gets more nodes.
const MOST_REFINEMENTS: u32 = 3;

/// Rays over a pixel at a shadow's border. On a lattice of a Fibonacci number of points the fraction of them on
/// one side of a straight line is within 0.05 of the area's.
const SHADOW_BORDER_RAYS: u32 = 21;

/// What follows the last pass of a renderer.
fn finishing(camera: &CameraSpec) -> Vec<&'static str> {
    let sensor = camera.sensor.as_ref().map(|_| "image sensor: light -> electrons -> numbers -> colours");
    let spread = camera.point_spread.as_ref().map(|_| "point spread of the lens, glare");
    let simple = spread.filter(|_| sensor.is_none()).map(|_| "light, noise and saturation");
    spread.into_iter().chain(simple).chain(sensor).collect()
}

fn shadow_stage(light: Option<Light>) -> Option<ShadowStage> {
    light.filter(|light| light.shadows).map(|_| ShadowStage { border_rays: SHADOW_BORDER_RAYS })
}

/// Price of the output passes that red and blue have beside that of green, ms.
fn price_of_other_colors(plan: &FramePlan) -> f64 {
    if plan.others.is_some() { 2.0 * (plan.price_ms - plan.ideal_price_ms) } else { 0.0 }
}

/// A plan in the making.
pub(super) struct Draft<'a> {
    context: &'a FrameContext<'a>,
    scene: &'a FrameScene<'a>,
    picture: &'a PictureChoice,
    pub ideal: IdealGeometry,
    motion: Motion,
    ray: RayStage,
    blur: Option<BlurStage>,
    edges: EdgeStage,
    keys: Vec<KeyFrame>,
    skipped: Vec<Skip>,
}

impl<'a> Draft<'a> {
    /// A plan with the ideal frame of a picture.
    pub fn new(
        context: &'a FrameContext<'a>,
        scene: &'a FrameScene<'a>,
        picture: &'a PictureChoice,
    ) -> Result<Self, PlanError> {
        let (mut ideal, mut motion) = (scene.ideal, scene.motion);
        if picture.plan.scale != context.reach.least_scale() && !context.is_paper() {
            ideal = context.ideal_of(&[context.key()], picture.plan.scale, context.demanded);
            motion = context.motion_in(&ideal);
        }
        let mut draft = Self {
            context,
            scene,
            picture,
            ideal,
            motion,
            ray: RayStage::Pinhole,
            blur: None,
            edges: EdgeStage::None,
            keys: Vec::new(),
            skipped: Vec::new(),
        };
        draft.check_size()?;
        if picture.plan.samples_a_pixel == 1 && !context.is_paper() {
            let reason = picture::why_one_sample(scene, picture, context.quality());
            draft.skip("several samples an ideal pixel", reason);
        }
        Ok(draft)
    }

    fn check_size(&self) -> Result<(), PlanError> {
        let inputs = self.context.inputs;
        check_size(self.context.frame, self.ideal.size_px, inputs.max_side_px, inputs.max_ideal_px)
    }

    fn skip(&mut self, what: &'static str, reason: impl Into<String>) {
        self.skipped.push(Skip { what, reason: reason.into() });
    }

    /// The lens inverse.
    pub fn choose_ray(&mut self) {
        let camera = &self.context.reach.camera;
        self.ray = if self.context.is_paper() {
            paper::ray_stage(camera)
        } else if camera.lens.is_identity() {
            self.skip("lens map", "the camera has no lens distortion");
            RayStage::Pinhole
        } else {
            RayStage::LensMap
        };
    }

    /// The exposure with its samples, and how pixels at silhouettes are made. Returns the exposure's path.
    pub fn choose_exposure_and_edges(&mut self) -> Option<ExposurePath> {
        let Self { context, scene, picture, ideal, motion, .. } = *self;
        let quality = context.quality();
        if context.is_paper() {
            self.skip("silhouette rays", "quality.preset \"paper\" takes one sample a pixel");
            self.blur = paper::blur_stage(&context.shutter, quality, &mut self.skipped);
            return None;
        }
        let exposure = context
            .exposed(motion, &ideal)
            .path(quality, &mut self.skipped)
            .map(|exposure| demanded::exposure_path(context.demanded, exposure));
        let case = EdgeCase {
            outline: &context.inputs.scene.outline,
            pose: &context.key_pose,
            ideal: &ideal,
            travel_m: motion.travel_m,
            quality,
            max_side_px: context.inputs.max_side_px,
            reason_for_none: scene.no_silhouettes_reason.as_deref(),
            plain: picture.silhouettes.as_ref().filter(|_| picture.is_plain),
            fine: picture.fine,
            rays: picture.rays,
        };
        self.edges = edges::edge_stage(&case, &mut self.skipped);
        self.blur =
            exposure.map(|exposure| context.blur_stage(exposure, self.edges, &picture.plan, motion, &ideal));
        exposure
    }

    /// The temporal inverse and the terrain's level of detail, in the ideal frame `tried`. Where the probes
    /// find the exposure's path to be missed it gets more nodes.
    pub fn choose_temporal_inverse<'t>(
        &self,
        tried: &'t IdealGeometry,
        mut exposure: Option<ExposurePath>,
    ) -> TemporalChoice<'t>
    where
        'a: 't,
    {
        let Self { context, picture, motion, edges, .. } = *self;
        let mut task = self.temporal_task(tried);
        let mut choice = temporal_inverse::choose(&task, &motion);
        for _ in 0..MOST_REFINEMENTS {
            let missed = choice.missed_px.filter(|_| context.demanded != Some(TemporalStage::Linear));
            let Some((before, [px, most_px])) = exposure.zip(missed) else { break };
            let needed = ErrorBudget::new(context.quality()).with_source_px(most_px);
            // A vibration that the nodes were blind to needs as many as it has periods.
            let by_rule = Some(context.exposed(motion, tried).path_within(&needed))
                .filter(|rule| px > most_px && rule.steps() > before.steps());
            let finer =
                by_rule.into_iter().chain(before.finer(px, &needed)).max_by_key(|finer| finer.steps());
            let Some(finer) = finer else { break };
            exposure = Some(finer);
            task.blur = Some(context.blur_stage(finer, edges, &picture.plan, motion, tried));
            choice = temporal_inverse::choose(&task, &motion);
        }
        choice
    }

    fn temporal_task<'t>(&self, tried: &'t IdealGeometry) -> TemporalTask<'t>
    where
        'a: 't,
    {
        let Self { context, scene, picture, motion, blur, .. } = *self;
        let inputs = context.inputs;
        let quality = context.quality();
        let resampling = scene.texture_probes.expected(&picture.plan, blur);
        let others_dn = resampling.total_dn().hypot(picture.silhouettes_dn()).hypot(scene.blended_dn());
        TemporalTask {
            reach: &context.dry_run_reach,
            sequence: &inputs.sequence,
            shutter: &context.shutter,
            surfaces: &inputs.scene.surfaces,
            stamp_s: context.stamp_s,
            key_s: context.key_s,
            key_pose: &context.key_pose,
            key_twist: context.key_twist,
            ideal: tried,
            demanded: context.demanded,
            ray: self.ray,
            blur,
            straight_blur: blur.map(|_| {
                exposure_samples::blur_stage(&picture.plan, quality, ExposurePath::STRAIGHT, motion.blur_px)
            }),
            resampling,
            shown: scene.shown(blur.is_some()),
            most_misregistration_dn: ErrorBudget::new(quality)
                .misregistration_dn(&inputs.sequence.scene, others_dn),
            silhouette_model: scene.silhouettes.as_ref(),
            silhouettes: picture.silhouettes,
            blended: scene.blended,
            silhouettes_in_view: scene.no_silhouettes_reason.is_none(),
            constant_twist: context.shared.is_none(),
        }
    }

    /// The ideal frame that the temporal inverse needs.
    pub fn fit_ideal_to(&mut self, choice: &TemporalChoice<'_>) -> Result<(), PlanError> {
        let context = self.context;
        let temporal = choice.method.temporal;
        if context.demanded.is_none() && matches!(temporal, TemporalStage::Linear | TemporalStage::Rk2) {
            // These look, and read the depth, where the point is not.
            self.ideal = context.ideal_of(&[context.key()], self.picture.plan.scale, Some(temporal));
            self.check_size()?;
        }
        temporal_inverse::note_skips(&self.motion, temporal, &mut self.skipped);
        Ok(())
    }

    /// The key frames, and the disocclusion and blended depth with them.
    pub fn choose_key_frames(&mut self, choice: &mut TemporalChoice<'_>) {
        let Self { context, edges, .. } = *self;
        let (quality, temporal) = (context.quality(), choice.method.temporal);
        let TemporalChoice { predicted, sources, .. } = choice;
        let has_disocclusion = edges.has_rays() && matches!(temporal, TemporalStage::Reproject { .. });
        predicted.disocclusion_of_one_key =
            has_disocclusion.then(|| sources.disocclusion(&[context.key()], quality.max_error_px));
        let for_blended = match context.shared {
            None if quality.key_frames == Auto::Auto && self.scene.blended.is_some() => {
                let blended_dn = |count| self.blended_dn(count);
                key_frames::for_blended(
                    blended_dn,
                    predicted.without_blended_depth_dn(),
                    quality.max_error_dn,
                )
            }
            // Each frame of a group has the one that is common to all.
            _ => 1,
        };
        let disocclusion = predicted.disocclusion_of_one_key.as_ref();
        let wanted = key_frames::wanted(disocclusion, for_blended, temporal, quality, &mut self.skipped);
        let scale = self.picture.plan.scale;
        let max_side_px = context.inputs.max_side_px;
        let fitting = key_frames::fitting(wanted, edges, max_side_px, &mut self.skipped, |count| {
            let keys = key_frames::spread(context.path(), context.window_s, count);
            let ideal = context.ideal_of(&keys, scale, Some(temporal));
            (keys, ideal)
        });
        match fitting {
            Some((keys, ideal)) => (self.keys, self.ideal) = (keys, ideal),
            None => self.keys = vec![context.key()],
        }
        predicted.disocclusion = if self.keys.len() > 1 {
            has_disocclusion.then(|| sources.disocclusion(&self.keys, quality.max_error_px))
        } else {
            predicted.disocclusion_of_one_key
        };
        if self.keys.len() > 1 && self.scene.blended.is_some() {
            predicted.blended_depth = context.blended(&self.keys);
        }
    }

    /// What the one depth of blended surfaces costs with so many key frames, 1/255 of the linear range.
    fn blended_dn(&self, count: u32) -> f64 {
        let context = self.context;
        match count {
            1 => self.scene.blended_dn(),
            _ => context
                .blended(&key_frames::spread(context.path(), context.window_s, count))
                .map_or(0.0, |blended| blended.error_dn),
        }
    }

    /// What the scenario as a whole makes unnecessary.
    pub fn note_static_skips(&mut self, temporal: TemporalStage) {
        let inputs = self.context.inputs;
        let camera = &inputs.sequence.scenario.camera;
        if camera.sensor.is_none() && camera.photometric.noise_sigma <= 0.0 {
            self.skip("noise", "camera.photometric.noise_sigma is 0");
        }
        if inputs.sequence.vignette.is_none() && camera.photometric.vignetting.is_none() {
            self.skip("vignette map", "camera.photometric.vignette is not set");
        }
        if !inputs.truth {
            self.skip("depth and coordinates", "neither is among the output channels");
            if matches!(temporal, TemporalStage::Identity | TemporalStage::Rotation) {
                self.skip("depth read by the reverse pipeline", "no stage of this frame uses it");
            }
        }
        if !inputs.scene.surfaces.blends {
            self.skip("blending of surfaces", "no surface of the scene is blended");
        }
        match inputs.sequence.scene.light {
            None => self.skip("shadows", "scene.light is not set"),
            Some(Light { shadows: false, .. }) => self.skip("shadows", "scene.light.shadows is off"),
            Some(_) => {}
        }
        if inputs.sequence.scene.fog_visibility_m.is_none() {
            self.skip("fog", "scene.fog_visibility_m is not set");
        }
    }

    /// The plan of what was chosen.
    pub fn finish(self, choice: TemporalChoice<'_>) -> FramePlan {
        let Self { context, picture, ideal, .. } = self;
        let (inputs, window_s) = (context.inputs, context.window_s);
        let sampling = picture.plan;
        let TemporalChoice { method, terrain_tolerance_px, predicted, sources, .. } = choice;
        // Coordinates are those of the middle of the frame's own window, wherever the ideal frame is taken.
        let middle_s = 0.5 * (window_s[0] + window_s[1]);
        let span_s = context.path().span_s();
        let camera = &context.reach.camera;
        let has_no_reach = inputs.scene.surfaces.blends;
        let mut plan = FramePlan {
            frame: context.frame,
            preset: context.quality().preset,
            stamp_s: context.stamp_s,
            window_s,
            extrapolated: window_s[0] < span_s.0 || window_s[1] > span_s.1,
            zoom: context.zoom,
            camera: camera.clone(),
            shutter: context.shutter,
            exposure: inputs.sequence.exposure(context.frame),
            key_s: middle_s,
            key_pose: context.path().pose(middle_s),
            key_twist: context.key_twist,
            keys: self.keys,
            plane: sources.plane(),
            shared_frames: None,
            unshared_reason: None,
            ideal,
            ray: self.ray,
            temporal: method.temporal,
            blur: method.blur,
            edges: self.edges,
            shadows: shadow_stage(inputs.sequence.scene.light),
            surface_reads: sampling.surface_reads,
            samples_a_pixel: sampling.samples_a_pixel,
            taps: sampling.taps,
            sky_reach_px: if has_no_reach { 0.0 } else { SKY_REACH_PX * ideal.scale(camera) },
            linear_fog: if context.is_paper() { paper::fog(&inputs.sequence.scene) } else { None },
            truth: inputs.truth,
            motion: self.motion,
            terrain_error_px: terrain_tolerance_px,
            predicted,
            placement: Placement::default(),
            finishing: finishing(&inputs.sequence.scenario.camera),
            skipped: self.skipped,
            price_ms: picture.price.ms + temporal_ms(method),
            ideal_price_ms: picture.price.ideal_ms,
            primary: context.reach.others.is_some().then_some(Primary::Green),
            others: context.reach.others.clone(),
        };
        plan.price_ms += price_of_other_colors(&plan);
        if plan.copied_from().is_some() {
            plan.skipped.push(Skip {
                what: "taps between ideal pixels",
                reason: "where the CPU makes the picture: the camera's pixels are the ideal frame's own"
                    .into(),
            });
        }
        plan
    }
}
