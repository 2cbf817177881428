//! What plans of a sequence are made from: the sequence, the renderer's limits, and what is known of lens and
//! scene.

use std::{ops::Range, sync::Arc};

use camsim_core::{
    camera::{CameraError, CameraModel, ZoomTable},
    mount::CameraPath,
    scenario::{Auto, CameraSpec, Channel, Preset, Primary, QualitySpec, Silhouettes},
    sequence::Sequence,
    shutter::Shutter,
};

use super::recent_cache::RecentCache;
use crate::{
    ir::{key_frame::KeyFrame, limits::MAX_IDEAL_PX, plan_error::PlanError},
    picture_error::texture_spectra::SceneSpectra,
    view::{
        ideal_extent::{TangentBounds, ideal_extent},
        lens_reach::LensReach,
        neighbourhood::Neighbourhoods,
        scene_outline::SceneOutline,
        surfaces::Surfaces,
    },
};

/// Frames whose neighbourhoods are cached: so many, and more for each group that is planned at once.
const CACHED_FRAMES: usize = 48;
const CACHED_FRAMES_A_GROUP: usize = 16;
/// Threads for each group that is planned at once, and such groups at most.
const THREADS_A_GROUP: usize = 2;
const MOST_GROUPS_AT_ONCE: usize = 8;

/// Frames that share what their probes find, at most and at least: spans begin at multiples.
const FRAMES_OF_A_SPAN: u64 = 8;
const LEAST_FRAMES_OF_A_SPAN: u64 = 4;
/// Least area of what the first and the last frame of a span show together, in times of one of them, from which
/// on they do not see the same.
const ALIKE: f64 = 2.0;

/// What is known of a scene.
#[derive(Clone, Debug)]
pub(crate) struct SceneKnowledge {
    pub outline: Arc<SceneOutline>,
    pub spectra: Arc<SceneSpectra>,
    pub surfaces: Arc<Surfaces>,
}

impl SceneKnowledge {
    pub fn new(sequence: &Sequence) -> Self {
        let scene = &sequence.scene;
        Self {
            outline: Arc::new(SceneOutline::new(scene)),
            spectra: Arc::new(SceneSpectra::new(scene)),
            surfaces: Arc::new(Surfaces::new(scene.clone())),
        }
    }
}

/// What plans of a sequence are made from.
#[derive(Debug)]
pub(crate) struct PlanInputs {
    pub sequence: Arc<Sequence>,
    pub scene: SceneKnowledge,
    /// With the scenario's exposure; row times are the same with any.
    pub shutter: Shutter,
    pub zoom: Option<ZoomTable>,
    /// The lenses of red and blue, where these zoom and are others.
    pub zoom_of_others: Option<[ZoomTable; 2]>,
    /// Reach of a lens that does not zoom.
    pub fixed: Option<Arc<LensReach>>,
    /// The fixed lens with a quarter of its probes, for four frames in turn.
    quarters: Option<[Arc<LensReach>; 4]>,
    pub truth: bool,
    pub max_side_px: u32,
    pub max_ideal_px: u64,
    /// Whether fine sampling costs less time than the search for the cheapest.
    pub is_drawing_cheap: bool,
    /// Neighbourhoods of the probes of recent frames, of all probes and of a quarter of them.
    pub neighbourhoods: RecentCache<Neighbourhoods>,
    pub neighbourhoods_of_quarters: RecentCache<Neighbourhoods>,
    /// Whether the frames of recent spans see nearly the same.
    spans: RecentCache<bool>,
}

impl PlanInputs {
    pub fn new(
        sequence: Arc<Sequence>,
        channels: &[Channel],
        max_side_px: u32,
        scene: SceneKnowledge,
    ) -> Result<Self, PlanError> {
        let camera = &sequence.scenario.camera;
        let shutter = Shutter::from_spec(&camera.shutter, camera.fps, camera.size_px)?;
        let zoom = ZoomTable::from_spec(camera)?;
        let zoom_of_others = match zoom {
            Some(_) => red_and_blue(camera, ZoomTable::from_spec)?
                .and_then(|[red, blue]| red.zip(blue))
                .map(<[ZoomTable; 2]>::from),
            None => None,
        };
        let fixed = match zoom {
            Some(_) => None,
            None => {
                let others = red_and_blue(camera, CameraModel::from_spec)?.map(|both| both.map(Arc::new));
                let camera = Arc::new(CameraModel::from_spec(camera)?);
                Some(Arc::new(LensReach::with_others(camera, others).ok_or(PlanError::NoRay)?))
            }
        };
        let quarters = fixed.as_ref().map(|reach| {
            [[false, false], [true, false], [false, true], [true, true]]
                .map(|of| Arc::new(reach.with_a_quarter_of_the_probes(of)))
        });
        let truth = channels.iter().any(|channel| channel.needs_truth());
        let cached = CACHED_FRAMES + CACHED_FRAMES_A_GROUP * groups_at_once();
        Ok(Self {
            sequence,
            scene,
            shutter,
            zoom,
            zoom_of_others,
            fixed,
            quarters,
            truth,
            max_side_px,
            max_ideal_px: MAX_IDEAL_PX,
            is_drawing_cheap: false,
            neighbourhoods: RecentCache::new(cached),
            neighbourhoods_of_quarters: RecentCache::new(cached),
            spans: RecentCache::new(cached),
        })
    }

    /// Reach of a zoom lens at a zoom value.
    pub fn zoomed(&self, table: &ZoomTable, zoom: f64) -> Result<LensReach, PlanError> {
        let others = match &self.zoom_of_others {
            Some([red, blue]) => Some([Arc::new(red.at(zoom)?), Arc::new(blue.at(zoom)?)]),
            None => None,
        };
        LensReach::with_others(Arc::new(table.at(zoom)?), others).ok_or(PlanError::NoRay)
    }

    pub fn quality(&self) -> &QualitySpec {
        &self.sequence.scenario.quality
    }

    pub fn path(&self) -> &CameraPath {
        &self.sequence.path
    }

    /// The shutter with the exposure of a frame.
    pub fn shutter_of(&self, frame: u64) -> Shutter {
        match &self.sequence.exposures {
            Some(_) => self.shutter.with_exposure_s(self.sequence.blurred_s(frame)),
            None => self.shutter,
        }
    }

    /// Stamp of a frame, path time, seconds.
    pub fn stamp_s(&self, frame: u64) -> f64 {
        self.stamp_s_of(frame as f64)
    }

    /// Stamp of a frame of any number, beyond the sequence as well.
    pub fn stamp_s_of(&self, frame: f64) -> f64 {
        self.sequence.stamp_s(frame)
    }

    /// The lens with a quarter of its probes: neighbours in time that see nearly the same have other quarters.
    pub fn quarter_of_the_probes(&self, frame: u64) -> Option<Arc<LensReach>> {
        self.quarters.as_ref().map(|quarters| quarters[(frame % 4) as usize].clone())
    }

    /// The frames that share what their probes find, if they see nearly the same.
    pub fn span_of(&self, frame: u64) -> Range<u64> {
        let first = frame / FRAMES_OF_A_SPAN * FRAMES_OF_A_SPAN;
        first..(first + FRAMES_OF_A_SPAN).min(self.sequence.frames)
    }

    /// Whether the frames around a frame see nearly the same, so that a quarter of the probes does for each.
    pub fn shares_probes(&self, frame: u64) -> bool {
        let span = self.span_of(frame);
        let is_long = span.contains(&frame) && span.end - span.start >= LEAST_FRAMES_OF_A_SPAN;
        is_long && *self.spans.get(span.start, || self.see_alike(span.clone()).unwrap_or(false))
    }

    /// Whether the first and the last of some frames see nearly the same; `None` for a lens that zooms.
    fn see_alike(&self, frames: Range<u64>) -> Option<bool> {
        let reach = self.fixed.as_ref()?;
        let (begin_s, end_s) = self.shutter.window_s();
        let [first_s, last_s] = [frames.start, frames.end - 1].map(|frame| self.stamp_s(frame));
        let key_s = 0.5 * (first_s + begin_s + last_s + end_s);
        let keys = [KeyFrame { t_s: key_s, pose: self.path().pose(key_s) }];
        let extent = |stamp_s: f64| {
            let shutter = self.shutter_of(frames.start);
            ideal_extent(reach, self.path(), &shutter, stamp_s, key_s, &keys, &self.scene.surfaces, None)
        };
        let area = |extent: TangentBounds| {
            let [width, height] = extent.pixels(&reach.camera, 1.0).size_px.map(f64::from);
            width * height
        };
        let own = area(extent(0.5 * (first_s + last_s)));
        Some(area(extent(first_s).and(extent(last_s))) < ALIKE * own)
    }

    /// Number of the group of a frame.
    pub fn group_of(&self, frame: u64) -> u64 {
        if self.may_share() { frame / u64::from(self.quality().frames_per_ideal) } else { frame }
    }

    /// Whether the scenario leaves it to the planner which frames share an ideal frame.
    pub fn may_share(&self) -> bool {
        self.reason_against_sharing().is_none()
    }

    /// What in the scenario gives each frame an ideal frame of its own.
    pub fn reason_against_sharing(&self) -> Option<&'static str> {
        let quality = self.quality();
        let reasons = [
            (quality.preset == Preset::Paper, "quality.preset = \"paper\""),
            (quality.frames_per_ideal == 1, "quality.frames_per_ideal = 1"),
            (quality.solver != Auto::Auto, "quality.solver is given"),
            (quality.key_frames != Auto::Auto, "quality.key_frames is given"),
            (quality.silhouettes == Silhouettes::Rays, "quality.silhouettes = \"rays\""),
            (self.zoom.is_some(), "the lens zooms"),
        ];
        reasons.into_iter().find_map(|(holds, reason)| holds.then_some(reason))
    }

    /// Forgets what is cached. Plans stay the same.
    pub fn forget(&self) {
        self.neighbourhoods.forget();
        self.neighbourhoods_of_quarters.forget();
        self.spans.forget();
    }
}

/// Groups that are best planned at once, each by a thread of its own: planning one is parallel in itself, but
/// not all of it.
pub(crate) fn groups_at_once() -> usize {
    (rayon::current_num_threads() / THREADS_A_GROUP).clamp(1, MOST_GROUPS_AT_ONCE)
}

/// What is made of the cameras of red and blue, where these are others.
fn red_and_blue<T>(
    camera: &CameraSpec,
    make: impl Fn(&CameraSpec) -> Result<T, CameraError>,
) -> Result<Option<[T; 2]>, CameraError> {
    if !camera.is_chromatic() {
        return Ok(None);
    }
    let [red, blue] = [Primary::Red, Primary::Blue].map(|primary| make(&camera.of_primary(primary)));
    Ok(Some([red?, blue?]))
}

/// Zoom at a time: linear between the rows of the track, held outside.
pub(crate) fn zoom_at(track: &[(f64, f64)], t_s: f64) -> f64 {
    let after = track.partition_point(|row| row.0 <= t_s);
    match (after.checked_sub(1).and_then(|i| track.get(i)), track.get(after)) {
        (Some(a), Some(b)) => a.1 + (b.1 - a.1) * (t_s - a.0) / (b.0 - a.0),
        (Some(only), None) | (None, Some(only)) => only.1,
        (None, None) => 1.0,
    }
}
