//! The frame plan: which passes a frame needs, how large, how many samples, and what is skipped and why.
//!
//! A plan is plain data and a pure function of scenario and frame number: `camsim explain` prints it, the gpu
//! crate executes it, and nothing in it depends on the frame before.

use std::sync::Arc;

use camsim_core::{
    camera::{CameraModel, ZoomTable},
    frame::RowRecord,
    mount::CameraPath,
    scenario::{Auto, Channel},
    sequence::Sequence,
    shutter::{LinesAxis, Shutter},
    temporal::{IdealGeometry, SKY_REACH_PX},
};

mod around;
mod borders;
mod bounds;
mod contours;
mod costs;
mod describe;
mod displaced;
mod dry_run;
mod edges;
mod error;
mod exposure;
mod forced;
mod frame_plan;
mod grain;
mod holes;
mod kept;
mod keys;
mod layers;
mod levels;
mod lines;
mod look;
mod motion;
pub mod paper;
mod picture;
mod plane;
mod predicted;
mod probes;
mod prospect;
mod refusal;
mod resample;
mod rounding;
mod sharing;
mod sight;
mod skyline;
mod stages;
mod stairs;
mod surfaces;
mod transfer;

use kept::Kept;
use look::{Look, Scenery};

pub use bounds::LensReach;
pub use camsim_core::temporal::MAX_KEYS;
pub use contours::Contours;
pub use describe::PlanSummary;
pub use edges::EdgeStage;
pub use error::{ErrorMap, ErrorPlace, Ground, PlaceError};
pub use frame_plan::{FramePlan, Motion, Skip};
pub use holes::Holes;
pub use keys::{KeyFrame, SIZE_QUANTUM_PX};
pub use layers::Layers;
pub use lines::{LinePoses, LineTimes, line_poses, line_times, row_records};
pub use paper::LinearFog;
pub use plane::SeenPlane;
pub use predicted::Predicted;
pub use refusal::{MAX_IDEAL_PX, PlanError};
pub use sight::Sight;
pub use stages::{BlurStage, NodeDepths, PathStage, RayStage, SurfaceReads, TemporalStage};

/// Nearest distance that the ideal frame can show, metres.
pub const NEAR_M: f64 = 0.05;
/// Frames and groups of which what was found is remembered: so many, and more for each group that is looked
/// at at once.
const FRAMES_KEPT: usize = 48;
const FRAMES_OF_GROUP_KEPT: usize = 16;
const GROUPS_KEPT: usize = 2;
const GROUPS_OF_GROUP_KEPT: usize = 2;
/// Times that an exposure whose path the probes find to be missed gets more nodes.
const MOST_REFINEMENTS: u32 = 3;

/// Plans frames of one sequence; keeps what depends on the lens alone.
#[derive(Debug)]
pub struct Planner {
    sequence: Arc<Sequence>,
    shutter: Shutter,
    zoom: Option<ZoomTable>,
    fixed: Option<Arc<LensReach>>,
    /// The same with half of its probes, for even frames and odd ones of a group; and with half of those, for
    /// every second of these frames.
    halves: Option<[Arc<LensReach>; 2]>,
    quarters: Option<[[Arc<LensReach>; 2]; 2]>,
    outline: Arc<edges::SceneOutline>,
    grain: Arc<grain::SceneGrain>,
    surfaces: Arc<surfaces::Surfaces>,
    truth: bool,
    max_side_px: u32,
    max_ideal_px: u64,
    /// What the probes of the last frames see around them.
    surroundings: Kept<around::Surroundings>,
    surroundings_by_half: Kept<around::Surroundings>,
    /// The last groups of frames that were looked at.
    groups: Kept<sharing::Group>,
    /// The last plan of a frame by itself: whoever asks whether it can be planned asks for it again.
    last: Kept<FramePlan>,
}

impl Planner {
    /// Prepares for the frames of `sequence`; `max_side_px` is the largest texture side that the renderer
    /// has.
    ///
    /// # Errors
    /// A camera or shutter that cannot be used.
    pub fn new(sequence: Arc<Sequence>, channels: &[Channel], max_side_px: u32) -> Result<Self, PlanError> {
        let outline = Arc::new(edges::SceneOutline::new(&sequence.scene));
        let grain = Arc::new(grain::SceneGrain::new(&sequence.scene));
        let surfaces = Arc::new(surfaces::Surfaces::new(sequence.scene.clone()));
        Self::of_scene(sequence, channels, max_side_px, outline, grain, surfaces)
    }

    /// A planner for the frames of another sequence. Where its scene is this one's (the same [`Arc`]), what
    /// is known of the scene is taken over: finding it anew takes longer than a plan. No plan changes by it.
    ///
    /// # Errors
    /// As [`Planner::new`].
    pub fn renewed(&self, sequence: Arc<Sequence>, channels: &[Channel]) -> Result<Self, PlanError> {
        if !Arc::ptr_eq(&self.sequence.scene, &sequence.scene) {
            return Self::new(sequence, channels, self.max_side_px);
        }
        let (outline, grain, surfaces) = (self.outline.clone(), self.grain.clone(), self.surfaces.clone());
        Self::of_scene(sequence, channels, self.max_side_px, outline, grain, surfaces)
    }

    fn of_scene(
        sequence: Arc<Sequence>,
        channels: &[Channel],
        max_side_px: u32,
        outline: Arc<edges::SceneOutline>,
        grain: Arc<grain::SceneGrain>,
        surfaces: Arc<surfaces::Surfaces>,
    ) -> Result<Self, PlanError> {
        let camera = &sequence.scenario.camera;
        let shutter = Shutter::from_spec(&camera.shutter, camera.fps, camera.size_px)?;
        let zoom = ZoomTable::from_spec(camera)?;
        let fixed = match zoom {
            Some(_) => None,
            None => Some(Arc::new(
                LensReach::new(Arc::new(CameraModel::from_spec(camera)?)).ok_or(PlanError::NoRay)?,
            )),
        };
        let halves =
            fixed.as_ref().map(|reach| [false, true].map(|odd| Arc::new(reach.with_half_the_probes(odd))));
        let quarters = halves.as_ref().map(|halves| {
            halves
                .each_ref()
                .map(|half: &Arc<LensReach>| [false, true].map(|low| Arc::new(half.with_half_of_these(low))))
        });
        let truth = channels.iter().any(|c| matches!(c, Channel::Depth | Channel::Coords));
        let max_ideal_px = MAX_IDEAL_PX;
        let frames_kept = FRAMES_KEPT + FRAMES_OF_GROUP_KEPT * Self::groups_at_once();
        let groups_kept = GROUPS_KEPT + GROUPS_OF_GROUP_KEPT * Self::groups_at_once();
        Ok(Self {
            sequence,
            shutter,
            zoom,
            fixed,
            halves,
            quarters,
            outline,
            grain,
            surfaces,
            truth,
            max_side_px,
            max_ideal_px,
            surroundings: Kept::new(frames_kept),
            surroundings_by_half: Kept::new(frames_kept),
            groups: Kept::new(groups_kept),
            last: Kept::new(1),
        })
    }

    /// For renderers that only want to know the geometry of the ideal frame and never make it: any number of
    /// pixels will do.
    #[must_use]
    pub fn with_ideals_of_any_area(self) -> Self {
        Self { max_ideal_px: u64::MAX, ..self }
    }

    /// The sequence.
    #[must_use]
    pub fn sequence(&self) -> &Arc<Sequence> {
        &self.sequence
    }

    /// Whether depth and coordinates are wanted.
    #[must_use]
    pub fn wants_truth(&self) -> bool {
        self.truth
    }

    /// Calibration table of a zoom lens.
    #[must_use]
    pub fn zoom_table(&self) -> Option<&ZoomTable> {
        self.zoom.as_ref()
    }

    /// Stamp of a frame, path time, seconds: `start + (i + phase) / fps`.
    #[must_use]
    pub fn stamp_s(&self, frame: u64) -> f64 {
        let camera = &self.sequence.scenario.camera;
        self.sequence.start_s + (frame as f64 + camera.phase) / camera.fps
    }

    /// The plan of one frame.
    ///
    /// # Errors
    /// A zoom value without a usable camera; an ideal frame larger than the renderer can hold.
    pub fn plan(&self, frame: u64) -> Result<FramePlan, PlanError> {
        let mut plan = self.shared_plan(frame).map_or_else(|| self.plan_alone(frame), Ok)?;
        if plan.shared_by.is_none() {
            plan.alone = Some(self.why_alone(&plan));
        }
        Ok(plan)
    }

    /// The plan of a frame by itself.
    fn plan_alone(&self, frame: u64) -> Result<FramePlan, PlanError> {
        let find = || {
            let look = self.look(frame, None)?;
            self.plan_of(&look, &look.scenery())
        };
        self.last.try_of(frame, find).map(|plan| FramePlan::clone(&plan))
    }

    fn plan_of(&self, look: &Look<'_>, scenery: &Scenery<'_>) -> Result<FramePlan, PlanError> {
        let &Look { frame, stamp_s, window_s, key_s, key_pose, key_twist, demanded, .. } = look;
        let quality = &self.sequence.scenario.quality;
        let picture = look.picture(scenery);
        let sampling = picture.sampling;
        let (mut ideal, mut motion) = (scenery.ideal, scenery.motion);
        if sampling.scale != look.reach.least_scale() && !look.is_paper() {
            ideal = look.geometry(&[look.key()], sampling.scale, demanded);
            motion = look.motion_in(&ideal);
        }
        refusal::check_size(frame, ideal.size_px, self.max_side_px, self.max_ideal_px)?;
        let mut skipped = Vec::new();
        if sampling.samples_a_pixel == 1 && !look.is_paper() {
            skipped.push(Skip {
                what: "several samples an ideal pixel",
                reason: picture::why_one_sample(scenery, &picture, quality).into(),
            });
        }
        let camera = &look.reach.camera;
        let ray =
            if look.is_paper() { paper::ray_stage(camera) } else { ray_stage(&look.reach, &mut skipped) };
        let (mut exposure, blur, edges) = if look.is_paper() {
            skipped.push(Skip {
                what: "silhouette supersampling",
                reason: "quality.preset \"paper\" takes one sample a pixel".into(),
            });
            (None, paper::blur_stage(&self.shutter, quality, &mut skipped), EdgeStage::None)
        } else {
            let exposed = look.exposed(motion, &ideal);
            let exposure =
                exposed.path(quality, &mut skipped).map(|exposure| forced::exposure_path(demanded, exposure));
            let case = edges::EdgeCase {
                outline: &self.outline,
                pose: &key_pose,
                ideal: &ideal,
                travel_m: motion.travel_m,
                quality,
                max_side_px: self.max_side_px,
                reason_for_none: scenery.reason_for_none.as_deref(),
                plain: picture.silhouettes.as_ref().filter(|_| picture.is_plain),
                fine: picture.fine,
                rays: picture.rays,
            };
            let edges = edges::edge_stage(&case, &mut skipped);
            (
                exposure,
                exposure.map(|exposure| look.blur_stage(exposure, edges, &sampling, motion, &ideal)),
                edges,
            )
        };
        let expected = scenery.prospect.expected(&sampling, blur);
        let shown = scenery.shown(blur.is_some());
        let tried = ideal;
        let mut case = error::Case {
            reach: &look.tried,
            sequence: &self.sequence,
            shutter: &self.shutter,
            stamp_s,
            key_s,
            key_pose: &key_pose,
            ideal: &tried,
            key_twist,
            demanded,
            ray,
            blur,
            straight_blur: blur
                .map(|_| sampling.blur_stage(exposure::ExposurePath::STRAIGHT, quality, motion.blur_px)),
            expected,
            shown: &shown,
            most_displaced_dn: levels::for_displaced_dn(
                quality,
                &self.sequence.scene,
                expected.total_dn().hypot(picture.silhouettes_dn()).hypot(scenery.layers_dn()),
            ),
            outlook: scenery.outlook.as_ref(),
            silhouettes: picture.silhouettes,
            layers: scenery.layers,
            silhouettes_in_view: scenery.reason_for_none.is_none(),
            constant_twist: look.common.is_none(),
            surfaces: &self.surfaces,
        };
        let mut choice = error::choose(&case, &motion);
        for _ in 0..MOST_REFINEMENTS {
            let missed = choice.missed_px.filter(|_| demanded != Some(TemporalStage::Linear));
            let Some((before, [px, most_px])) = exposure.zip(missed) else { break };
            // A vibration that the nodes were blind to asks for as many as it has periods.
            let by_rule = Some(look.exposed(motion, &tried).path_within(most_px))
                .filter(|rule| px > most_px && rule.steps() > before.steps());
            let finer =
                by_rule.into_iter().chain(before.finer(px, most_px)).max_by_key(|finer| finer.steps());
            let Some(finer) = finer else { break };
            exposure = Some(finer);
            case.blur = Some(look.blur_stage(finer, edges, &sampling, motion, &tried));
            choice = error::choose(&case, &motion);
        }
        let error::Choice { way, terrain_error_px, mut predicted, truths, .. } = choice;
        let error::Way { temporal, blur } = way;
        if demanded.is_none() && matches!(temporal, TemporalStage::Linear | TemporalStage::Rk2) {
            // These look, and read the depth, where the point is not.
            ideal = look.geometry(&[look.key()], sampling.scale, Some(temporal));
            refusal::check_size(frame, ideal.size_px, self.max_side_px, self.max_ideal_px)?;
        }
        motion::note_skips(&motion, temporal, &mut skipped);
        let looks_behind = edges.has_rays() && matches!(temporal, TemporalStage::Reproject { .. });
        let plane = truths.plane();
        predicted.holes_of_one = looks_behind.then(|| truths.holes(&[look.key()], quality.max_error_px));
        let for_layers = match look.common {
            None if quality.key_frames == Auto::Auto && scenery.layers.is_some() => {
                let layers_dn = |count: u32| match count {
                    1 => scenery.layers_dn(),
                    _ => look
                        .layers(&keys::spread(look.path(), window_s, count))
                        .map_or(0.0, |layers| layers.error_dn),
                };
                keys::for_layers(layers_dn, predicted.without_layers_dn(), quality.max_error_dn)
            }
            // Each frame of a group has the one that is common to all.
            _ => 1,
        };
        let wanted =
            keys::wanted(predicted.holes_of_one.as_ref(), for_layers, temporal, quality, &mut skipped);
        let keys = keys::fitting(wanted, edges, self.max_side_px, &mut skipped, |count| {
            let keys = keys::spread(look.path(), window_s, count);
            let ideal = look.geometry(&keys, sampling.scale, Some(temporal));
            (keys, ideal)
        });
        let keys = keys.map_or_else(
            || vec![look.key()],
            |(keys, of_keys)| {
                ideal = of_keys;
                keys
            },
        );
        predicted.holes = if keys.len() > 1 {
            looks_behind.then(|| truths.holes(&keys, quality.max_error_px))
        } else {
            predicted.holes_of_one
        };
        if keys.len() > 1 && scenery.layers.is_some() {
            predicted.layers = look.layers(&keys);
        }
        predicted.levels_in_the_way = levels::in_the_way(quality, &sampling, &predicted, picture.is_plain);
        predicted.levels_kept = predicted.levels_in_the_way.is_none();
        self.note_static_skips(&mut skipped, temporal);
        // Coordinates are those of the middle of the frame's own window, wherever the ideal frame is taken.
        let middle_s = 0.5 * (window_s[0] + window_s[1]);
        let span_s = self.sequence.path.span_s();
        let mut plan = FramePlan {
            frame,
            preset: quality.preset,
            stamp_s,
            window_s,
            extrapolated: window_s[0] < span_s.0 || window_s[1] > span_s.1,
            zoom: look.zoom,
            camera: camera.clone(),
            shutter: self.shutter,
            key_s: middle_s,
            key_pose: look.path().pose(middle_s),
            key_twist,
            keys,
            plane,
            shared_by: None,
            alone: None,
            ideal,
            ray,
            temporal,
            blur,
            edges,
            surface_reads: sampling.surface_reads,
            samples_a_pixel: sampling.samples_a_pixel,
            taps: sampling.taps,
            sky_reach_px: if self.surfaces.blends() { 0.0 } else { SKY_REACH_PX * ideal.scale(camera) },
            linear_fog: if look.is_paper() { paper::fog(&self.sequence.scene) } else { None },
            truth: self.truth,
            motion,
            terrain_error_px,
            predicted,
            skipped,
            price_ms: picture.price.ms + way.ms(),
            ideal_price_ms: picture.price.ideal_ms,
        };
        if plan.copied_from().is_some() {
            plan.skipped.push(Skip {
                what: "reads between ideal pixels",
                reason: "where the host makes the picture: the camera's pixels are the ideal frame's own"
                    .into(),
            });
        }
        Ok(plan)
    }

    /// What the scenario as a whole makes unnecessary.
    fn note_static_skips(&self, skipped: &mut Vec<Skip>, temporal: TemporalStage) {
        let photometric = &self.sequence.scenario.camera.photometric;
        let mut skip = |what, reason: &str| skipped.push(Skip { what, reason: reason.into() });
        if photometric.noise_sigma <= 0.0 {
            skip("noise", "camera.photometric.noise_sigma is 0");
        }
        if self.sequence.vignette.is_none() {
            skip("vignette map", "camera.photometric.vignette is not set");
        }
        if !self.truth {
            skip("depth and coordinates", "neither is among the output channels");
            if matches!(temporal, TemporalStage::Identity | TemporalStage::Rotation) {
                skip("depth read by the reverse pipeline", "no stage of this frame uses it");
            }
        }
        if !self.surfaces.blends() {
            skip("mixing of blended surfaces", "no surface of the scene is blended");
        }
        if self.sequence.scene.fog_visibility_m.is_none() {
            skip("fog", "scene.fog_visibility_m is not set");
        }
    }

    /// Time, pose and velocity of each line of a frame.
    #[must_use]
    pub fn rows(&self, plan: &FramePlan) -> Vec<RowRecord> {
        row_records(plan, &self.sequence.path, self.sequence.epoch_ns)
    }
}

fn ray_stage(reach: &LensReach, skipped: &mut Vec<Skip>) -> RayStage {
    if reach.camera.lens.is_identity() {
        skipped.push(Skip { what: "lens map", reason: "the camera has no lens distortion".into() });
        RayStage::Pinhole
    } else {
        RayStage::LensMap
    }
}

/// Zoom at a time: linear between rows, held outside.
fn zoom_at(track: &[(f64, f64)], t_s: f64) -> f64 {
    let after = track.partition_point(|row| row.0 <= t_s);
    match (after.checked_sub(1).and_then(|i| track.get(i)), track.get(after)) {
        (Some(a), Some(b)) => a.1 + (b.1 - a.1) * (t_s - a.0) / (b.0 - a.0),
        (Some(only), None) | (None, Some(only)) => only.1,
        (None, None) => 1.0,
    }
}

/// Line axis and the number of pose-table fields (2 where sideways readout meets interlacing).
#[must_use]
pub fn table_shape(shutter: &Shutter) -> (LinesAxis, u32, u32) {
    let axis = shutter.lines_axis();
    let fields = if axis == LinesAxis::Columns && shutter.interlace_s() > 0.0 { 2 } else { 1 };
    (axis, shutter.lines(), fields)
}

/// Farthest the optical centre gets from `key_s`'s position over the window, sampled at 17 instants plus 2
/// per vibration period.
fn travel_m(path: &CameraPath, window_s: [f64; 2], key_s: f64) -> f64 {
    let key = path.pose(key_s).position_ned_m;
    motion::instants(path, window_s).map(|t| path.pose(t).position_ned_m.distance(key)).fold(0.0, f64::max)
}
