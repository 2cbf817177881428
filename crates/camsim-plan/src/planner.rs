//! The planner.

mod steps;

use std::sync::Arc;

use camsim_core::{
    camera::{CameraModel, ZoomTable},
    frame::RowRecord,
    mount::CameraPath,
    pose::CameraPose,
    row_time::FrameCamera,
    scenario::{Channel, Face, FlowInstant, Preset},
    sequence::Sequence,
    temporal::IdealGeometry,
};

use crate::{
    choose::{
        frame_context::{FrameContext, FrameScene},
        obstacle,
        picture::{self, PictureChoice},
        placement::{cpu_rasterises, place},
        plan_inputs::{self, PlanInputs, SceneKnowledge, zoom_at},
        recent_cache::RecentCache,
        sharing::{FrameGroup, unshared_reason},
    },
    ir::{
        error_map::ErrorMap, frame_plan::FramePlan, placement::Capabilities, plan_error::PlanError,
        row_tables::row_records,
    },
    source_error::{
        dry_run::DryRun,
        error_map::error_map,
        exact_sources::{ExactSources, phases, terrain_detail},
        pixel_truth::FrameRays,
        temporal_method::{TemporalMethod, is_of_twist},
    },
    view::{faces::faces, surfaces::Surfaces},
};
use steps::Draft;

/// Groups that are cached, and more for each that is planned at once.
const CACHED_GROUPS: usize = 2;
const CACHED_GROUPS_A_GROUP: usize = 2;

/// Plans frames of one sequence; keeps what depends on lens and scene alone.
#[derive(Debug)]
pub struct Planner {
    inputs: PlanInputs,
    capabilities: Capabilities,
    /// Whether the cpu's rasteriser draws the scene.
    rasterises: bool,
    /// The last groups of frames that were planned.
    groups: RecentCache<FrameGroup>,
    /// The last frames that were planned by themselves: callers may need them twice, and groups their middle.
    last: RecentCache<(FramePlan, PictureChoice)>,
    /// The planners of the faces that a wide field is divided among.
    faces: Vec<Self>,
}

/// The plan of a frame, step by step.
fn plan_of(
    context: &FrameContext<'_>,
    scene: &FrameScene<'_>,
    picture: &PictureChoice,
) -> Result<FramePlan, PlanError> {
    let mut draft = Draft::new(context, scene, picture)?;
    draft.choose_ray();
    let exposure = draft.choose_exposure_and_edges();
    let tried = draft.ideal;
    let mut choice = draft.choose_temporal_inverse(&tried, exposure);
    draft.fit_ideal_to(&choice)?;
    draft.choose_key_frames(&mut choice);
    choice.predicted.picture_error_obstacle =
        obstacle::to_picture_error(context.quality(), picture, &choice.predicted);
    choice.predicted.picture_error_kept = choice.predicted.picture_error_obstacle.is_none();
    draft.note_static_skips(choice.method.temporal);
    Ok(draft.finish(choice))
}

impl Planner {
    /// Prepares for the frames of `sequence`; `max_side_px` is the largest texture side that the renderer
    /// has.
    ///
    /// # Errors
    /// A camera or shutter that cannot be used.
    pub fn new(sequence: Arc<Sequence>, channels: &[Channel], max_side_px: u32) -> Result<Self, PlanError> {
        let scene = SceneKnowledge::new(&sequence);
        Self::with_scene(sequence, channels, max_side_px, scene)
    }

    /// A planner for the frames of another sequence. Where its scene is this one's (the same [`Arc`]), what
    /// is known of the scene is taken over: finding it anew takes longer than a plan. No plan changes by it.
    ///
    /// # Errors
    /// As [`Planner::new`].
    pub fn renewed(&self, sequence: Arc<Sequence>, channels: &[Channel]) -> Result<Self, PlanError> {
        let max_side_px = self.inputs.max_side_px;
        if !Arc::ptr_eq(&self.inputs.sequence.scene, &sequence.scene) {
            let planner = Self::new(sequence, channels, max_side_px)?;
            return Ok(planner.with_capabilities(self.capabilities));
        }
        let planner = Self::with_scene(sequence, channels, max_side_px, self.inputs.scene.clone())?;
        Ok(planner.with_capabilities(self.capabilities))
    }

    fn with_scene(
        sequence: Arc<Sequence>,
        channels: &[Channel],
        max_side_px: u32,
        scene: SceneKnowledge,
    ) -> Result<Self, PlanError> {
        let cached_groups = CACHED_GROUPS + CACHED_GROUPS_A_GROUP * Self::groups_at_once();
        let of_face = |&face: &Face| {
            Self::with_scene(Arc::new(sequence.face(face)), channels, max_side_px, scene.clone())
        };
        let faces = faces(&sequence, channels)?;
        if !faces.is_empty() && channels.contains(&Channel::Coords) {
            return Err(PlanError::CoordsOfFaces);
        }
        let faces = faces.iter().map(of_face).collect::<Result<_, _>>()?;
        Ok(Self {
            faces,
            inputs: PlanInputs::new(sequence, channels, max_side_px, scene)?,
            capabilities: Capabilities::default(),
            rasterises: false,
            groups: RecentCache::new(cached_groups),
            last: RecentCache::new(cached_groups),
        })
    }

    /// For renderers that only need the geometry of the ideal frame and never make it: any number of pixels
    /// will do.
    #[must_use]
    pub fn with_ideals_of_any_area(self) -> Self {
        let mut inputs = self.inputs;
        inputs.max_ideal_px = u64::MAX;
        let faces = self.faces.into_iter().map(Self::with_ideals_of_any_area).collect();
        Self { inputs, faces, ..self }
    }

    /// Plans for a machine with these capabilities. Without, passes are placed as on a graphics card, and
    /// sampling is as sparing as on a processor.
    #[must_use]
    pub fn with_capabilities(mut self, capabilities: Capabilities) -> Self {
        let has_shadows = self.inputs.sequence.scene.light.is_some_and(|light| light.shadows);
        self.inputs.is_drawing_cheap = capabilities.draws_on_card() && !has_shadows;
        let rasterises = cpu_rasterises(&self.inputs.sequence.scene, capabilities.max_picture_px);
        let faces = self.faces.into_iter().map(|face| face.with_capabilities(capabilities)).collect();
        Self { capabilities, rasterises, faces, ..self }
    }

    /// The sequence.
    #[must_use]
    pub fn sequence(&self) -> &Arc<Sequence> {
        &self.inputs.sequence
    }

    /// Whether depth and coordinates are wanted.
    #[must_use]
    pub fn wants_truth(&self) -> bool {
        self.inputs.truth
    }

    /// Calibration table of a zoom lens.
    #[must_use]
    pub fn zoom_table(&self) -> Option<&ZoomTable> {
        self.inputs.zoom.as_ref()
    }

    /// Stamp of a frame, path time, seconds: `start + (i + phase) / fps`.
    #[must_use]
    pub fn stamp_s(&self, frame: u64) -> f64 {
        self.inputs.stamp_s(frame)
    }

    /// Number of plans of a frame: 1, or that of the faces that a wide field is divided among.
    #[must_use]
    pub fn lanes(&self) -> usize {
        self.faces.len().max(1)
    }

    /// Number of output passes of each plan: 3 where red and blue have lenses of their own.
    #[must_use]
    pub fn colors(&self) -> usize {
        if self.inputs.sequence.scenario.camera.is_chromatic() { 3 } else { 1 }
    }

    /// The planner of a face, or this one where there are none.
    #[must_use]
    pub fn lane(&self, number: usize) -> &Self {
        self.faces.get(number).unwrap_or(self)
    }

    /// The plans of one frame: one, or one a face.
    ///
    /// # Errors
    /// As [`Planner::plan`].
    pub fn plans(&self, frame: u64) -> Result<Vec<FramePlan>, PlanError> {
        (0..self.lanes()).map(|number| self.lane(number).plan(frame)).collect()
    }

    /// The plan of one frame; where a wide field is divided among faces, that of the first face.
    ///
    /// # Errors
    /// A zoom value without a usable camera; an ideal frame larger than the renderer can hold.
    pub fn plan(&self, frame: u64) -> Result<FramePlan, PlanError> {
        if let Some(face) = self.faces.first() {
            return face.plan(frame);
        }
        // The same picture has the same plan, to the last bit.
        let picture = self.inputs.sequence.picture(frame);
        if picture != frame {
            return Ok(FramePlan { frame, ..self.plan(picture)? });
        }
        let mut plan = self.shared_plan(frame).map_or_else(|| self.plan_alone(frame), Ok)?;
        if plan.shared_frames.is_none() {
            plan.unshared_reason = Some(unshared_reason(&self.inputs, &plan));
        }
        plan.placement = place(&self.capabilities, &plan, self.rasterises);
        Ok(plan)
    }

    /// The plan of a frame by itself.
    fn plan_alone(&self, frame: u64) -> Result<FramePlan, PlanError> {
        self.planned_alone(frame).map(|planned| planned.0.clone())
    }

    fn planned_alone(&self, frame: u64) -> Result<Arc<(FramePlan, PictureChoice)>, PlanError> {
        let find = || {
            let context = FrameContext::new(&self.inputs, frame, None)?;
            let scene = context.scene();
            let picture =
                self.picture_alike(&context, &scene).unwrap_or_else(|| picture::choose(&context, &scene));
            Ok((plan_of(&context, &scene, &picture)?, picture))
        };
        self.last.try_get(frame, find)
    }

    /// The picture of a frame sampled as the middle one of those that see nearly the same is, if that does for it
    /// as well.
    fn picture_alike(&self, context: &FrameContext<'_>, scene: &FrameScene<'_>) -> Option<PictureChoice> {
        let middle = context.middle_of_span().filter(|middle| *middle != context.frame)?;
        picture::choose_alike(context, scene, &self.planned_alone(middle).ok()?.1)
    }

    /// The plan of a frame as its group has it; `None` where it is to be planned by itself.
    fn shared_plan(&self, frame: u64) -> Option<FramePlan> {
        if !self.inputs.may_share() || frame >= self.inputs.sequence.frames {
            return None;
        }
        let number = self.group_of(frame);
        let own = |middle: u64| self.plan_alone(middle).ok();
        self.groups.get(number, || FrameGroup::new(&self.inputs, plan_of, own, number)).plan(frame)
    }

    /// Number of the group of a frame: frames of one are best planned one after the other, by the same
    /// thread.
    #[must_use]
    pub fn group_of(&self, frame: u64) -> u64 {
        self.inputs.group_of(frame)
    }

    /// Groups that are best planned at once, each by a thread of its own: planning one is parallel in itself,
    /// but not all of it.
    #[must_use]
    pub fn groups_at_once() -> usize {
        plan_inputs::groups_at_once()
    }

    /// Forgets the groups that were planned. Plans stay the same: for benchmarks, which plan the same frames
    /// over and over.
    pub fn forget(&self) {
        self.faces.iter().for_each(Self::forget);
        self.inputs.forget();
        self.groups.forget();
        self.last.forget();
    }

    /// Time, pose and velocity of each row of a frame.
    #[must_use]
    pub fn rows(&self, plan: &FramePlan) -> Vec<RowRecord> {
        row_records(plan, self.inputs.path(), self.inputs.sequence.epoch_ns)
    }

    /// Rays of the pixels of a frame, each at its own instant; coordinates are of exposure phase `phase`
    /// (-0.5 to 0.5).
    #[must_use]
    pub fn frame_rays<'a>(&'a self, plan: &'a FramePlan, phase: f64) -> FrameRays<'a> {
        let of_face = self.of_face(plan);
        FrameRays::new(of_face.inputs.path(), &self.inputs.scene.surfaces, plan, phase)
    }

    /// The planner that made a plan: that of its face, if it is of one.
    fn of_face(&self, plan: &FramePlan) -> &Self {
        let face = plan.camera.lens.face();
        self.faces.iter().find(|planner| planner.sequence().scenario.camera.face == face).unwrap_or(self)
    }

    /// The surfaces of the scene.
    pub(crate) fn surfaces(&self) -> &Surfaces {
        &self.inputs.scene.surfaces
    }

    /// The camera of a frame at the mid-exposure of its centre.
    pub(crate) fn middle_view(&self, frame: u64) -> Result<(Arc<CameraModel>, f64, CameraPose), PlanError> {
        let (path, camera, stamp_s) = self.camera_at(frame as i64)?;
        let (first_s, last_s) = self.inputs.shutter.window_s();
        let t_s = stamp_s + 0.5 * (first_s + last_s);
        Ok((camera, t_s, path.pose(t_s)))
    }

    /// The camera of a frame with the poses of its rows, for frames of any number.
    ///
    /// # Errors
    /// A zoom value without a usable camera.
    pub fn frame_camera(&self, frame: i64) -> Result<FrameCamera, PlanError> {
        let (path, camera, stamp_s) = self.camera_at(frame)?;
        Ok(FrameCamera::new(path, camera, &self.inputs.shutter, stamp_s))
    }

    /// The camera of a frame as a global shutter would expose it at an instant of its readout.
    ///
    /// # Errors
    /// As [`Planner::frame_camera`].
    pub fn global_camera(&self, frame: i64, instant: FlowInstant) -> Result<FrameCamera, PlanError> {
        let (path, camera, stamp_s) = self.camera_at(frame)?;
        let dt_s = self.inputs.shutter.dt_instant_s(instant);
        Ok(FrameCamera::global(path, camera, stamp_s + dt_s))
    }

    fn camera_at(&self, frame: i64) -> Result<(Arc<CameraPath>, Arc<CameraModel>, f64), PlanError> {
        let inputs = &self.inputs;
        let stamp_s = inputs.stamp_s_of(frame as f64);
        let camera = match (&inputs.fixed, &inputs.zoom) {
            (Some(reach), _) => reach.camera.clone(),
            (None, Some(table)) => Arc::new(table.at(zoom_at(&inputs.sequence.zoom_track, stamp_s))?),
            (None, None) => return Err(PlanError::NoRay),
        };
        Ok((inputs.sequence.path.clone(), camera, stamp_s))
    }

    /// The predicted source error of a frame from pixel to pixel, by the dry runs that its plan was chosen
    /// by. It takes about as long as these: a fraction of a plan.
    ///
    /// Frames that share an ideal frame have probes of their own, and may have a finer terrain than each
    /// alone would: their map is of what is drawn there, and may be below what the plan says, which answers
    /// for all that are solved in the same way.
    ///
    /// # Errors
    /// As [`Planner::plan`].
    pub fn error_map(&self, plan: &FramePlan) -> Result<ErrorMap, PlanError> {
        let inputs = &self.of_face(plan).inputs;
        let context = FrameContext::new(inputs, plan.frame, None)?;
        let quarter = plan.shared_frames.and_then(|_| inputs.quarter_of_the_probes(plan.frame));
        let reach = quarter.unwrap_or_else(|| context.dry_run_reach.clone());
        let ideal = tried_ideal(&context, plan);
        // Of several ideal frames the prediction has the one in the middle of the window.
        let (key_s, key_pose) = match plan.keys.as_slice() {
            [key] => (key.t_s, key.pose),
            _ => (plan.key_s, plan.key_pose),
        };
        let method = TemporalMethod { temporal: plan.temporal, blur: plan.blur };
        let dry_run = DryRun {
            surfaces: &inputs.scene.surfaces,
            path: inputs.path(),
            shutter: &plan.shutter,
            stamp_s: plan.stamp_s,
            key_s,
            key_pose: &key_pose,
            ideal: &ideal,
            twist: is_of_twist(method.temporal).then_some(plan.key_twist),
            nearest_depth: plan.preset == Preset::Paper,
            plane: plan.plane.seen_from(&key_pose),
        };
        let phases = phases(inputs.path(), plan.blur.is_some());
        let sources = ExactSources::new(&reach, plan.ray, dry_run, phases, 1);
        let detail = terrain_detail(&inputs.sequence, &key_pose, &ideal, plan.terrain_error_px);
        Ok(error_map(&sources, detail.as_ref(), method))
    }
}

/// The ideal frame that a plan's prediction was made for: its own, but where what was chosen then needed a
/// larger one.
fn tried_ideal(context: &FrameContext<'_>, plan: &FramePlan) -> IdealGeometry {
    let grew = plan.keys.len() > 1 || context.demanded.is_none() && is_of_twist(plan.temporal);
    if !grew {
        return plan.ideal;
    }
    let scale = plan.ideal.scale(&plan.camera);
    context.ideal_of(&[context.key()], scale, context.demanded)
}
