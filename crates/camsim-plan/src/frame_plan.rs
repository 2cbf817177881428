//! What a plan says.

use std::sync::Arc;

use serde::Serialize;

use super::{
    BlurStage, EdgeStage, KeyFrame, LinearFog, Predicted, RayStage, SeenPlane, SurfaceReads, TemporalStage,
};
use camsim_core::{
    camera::CameraModel,
    pose::CameraPose,
    reference::IdealView,
    scenario::{Preset, QualitySpec},
    scene::LevelTolerance,
    shutter::Shutter,
    temporal::{IdealGeometry, TapStage, displacement::Twist},
};

/// Part of the terrain's level of detail that models get: they are borders all over, of other colours than
/// what is behind them.
const MODEL_SHARE: f64 = 0.25;
/// Part of `quality.max_error_px` that their displacement may take by parallax.
const MODEL_PARALLAX_SHARE: f64 = 0.1;

/// What moves within the frame: bounds that the choices rest on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Motion {
    /// Nearest surface in view of the key camera, planar depth, a lower bound, metres; infinite with nothing
    /// in view.
    pub nearest_m: f64,
    /// Farthest the optical centre gets from the key position in the frame's window, metres.
    pub travel_m: f64,
    /// Largest rotation from the key attitude, radians.
    pub rotation_rad: f64,
    /// Bound on the parallax of any pixel, ideal pixels.
    pub parallax_px: f64,
    /// Bound on the displacement by rotation, ideal pixels.
    pub rotation_px: f64,
    /// Longest blur path found, ideal pixels.
    pub blur_px: f64,
    /// Bound on how far a straight path misses the curved one, ideal pixels.
    pub blur_sagitta_px: f64,
}

/// Work that this frame does not need.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Skip {
    /// What is left out.
    pub what: &'static str,
    /// Why nothing is lost.
    pub reason: String,
}

/// Everything that rendering one frame takes.
#[derive(Clone, Debug)]
pub struct FramePlan {
    /// Frame number.
    pub frame: u64,
    /// Whose methods.
    pub preset: Preset,
    /// Stamp t_i, path time, seconds.
    pub stamp_s: f64,
    /// First and last instant that the frame sees, path time, seconds.
    pub window_s: [f64; 2],
    /// Whether the window reaches outside the log.
    pub extrapolated: bool,
    /// Zoom value, for a zoom lens.
    pub zoom: Option<f64>,
    /// The output camera at this zoom.
    pub camera: Arc<CameraModel>,
    /// Row timing.
    pub shutter: Shutter,
    /// Middle of the window, path time, seconds.
    pub key_s: f64,
    /// The pose then: the camera that source coordinates are given in, and that of the ideal frame where
    /// there is only one.
    pub key_pose: CameraPose,
    /// The camera's motion then, in its own axes: all that the constant-twist solvers know of it.
    pub key_twist: Twist,
    /// Instants and poses of the ideal frames, in order of time.
    pub keys: Vec<KeyFrame>,
    /// What look-ups of depth begin with.
    pub plane: SeenPlane,
    /// First and last of the frames that are made from the same ideal frame; `None` where this frame has its
    /// own.
    pub shared_by: Option<[u64; 2]>,
    /// Why there is no other.
    pub alone: Option<&'static str>,
    /// Pixels of each ideal frame.
    pub ideal: IdealGeometry,
    /// Lens inverse.
    pub ray: RayStage,
    /// Temporal inverse.
    pub temporal: TemporalStage,
    /// Gather; `None` is one instant.
    pub blur: Option<BlurStage>,
    /// Pixels that see a silhouette.
    pub edges: EdgeStage,
    /// What reads the surfaces' pictures for the ideal frame.
    pub surface_reads: SurfaceReads,
    /// Samples of each pixel of the ideal frame: 1, or [`camsim_core::temporal::SAMPLES`] where borders are
    /// known to a part of a pixel.
    pub samples_a_pixel: u32,
    /// What reads the ideal frame for each sample.
    pub taps: TapStage,
    /// How far from a surface pixels of the sky go with it, pixels of the ideal frame:
    /// [`camsim_core::temporal::SKY_REACH_PX`]. 0 where blended surfaces may stand before it, which are not
    /// of one colour.
    pub sky_reach_px: f64,
    /// Fog after the gather (the paper's); otherwise it is in the ideal frame.
    pub linear_fog: Option<LinearFog>,
    /// Whether depth and coordinates are wanted beside the picture.
    pub truth: bool,
    /// What the choices rest on.
    pub motion: Motion,
    /// Bound on the displacement of the drawn terrain, ideal pixels: `quality.max_terrain_error_px` of the
    /// camera's, or less where that would leave more of an error in the picture than `quality.max_error_dn`
    /// has left, or the parallax within the frame would turn it into one of the coordinates.
    pub terrain_error_px: f64,
    /// How far the pixels' sources will be off.
    pub predicted: Predicted,
    /// What is not done.
    pub skipped: Vec<Skip>,
    /// Time that its passes are expected to take, roughly, and the part of it that this frame's share of the
    /// ideal frame takes: milliseconds for pictures of 640x480 on two processor cores with llvmpipe, whatever
    /// machine this is. What plans are compared by.
    pub price_ms: f64,
    /// See above.
    pub ideal_price_ms: f64,
}

impl FramePlan {
    /// Whether the one ideal frame was taken at another instant than the middle of the window.
    #[must_use]
    pub fn looks_from_elsewhere(&self) -> bool {
        matches!(self.keys.as_slice(), [key] if key.t_s != self.key_s)
    }

    /// The ideal pixel that the first pixel of the output is, where pixels of the output are those of the
    /// ideal frame: nothing bends rays or moves, both cameras are as fine, and places of pixels are whole
    /// pixels apart, as [`super::bounds`] has them. Then nothing is read between them.
    #[must_use]
    pub fn copied_from(&self) -> Option<[u32; 2]> {
        /// Rounding of the difference of principal points, pixels.
        const HAIR_PX: f64 = 1e-9;
        let is_plain =
            self.preset == Preset::Default && self.ray == RayStage::Pinhole && !self.edges.has_rays();
        let is_sharp = self.temporal == TemporalStage::Identity
            && self.blur.is_none()
            && self.taps == TapStage::Bilinear;
        let first_px = self.ideal.principal_px - self.camera.principal_point_px;
        let is_whole =
            (first_px - first_px.round()).abs().max_element() < HAIR_PX && first_px.min_element() > -0.5;
        let is_copied = is_plain
            && is_sharp
            && is_whole
            && self.keys.len() == 1
            && self.ideal.focal_px == self.camera.focal_px;
        let first = first_px.round().to_array().map(|px| px as u32);
        let is_within = |axis: usize| {
            u64::from(first[axis]) + u64::from(self.camera.size_px[axis])
                <= u64::from(self.ideal.size_px[axis])
        };
        (is_copied && is_within(0) && is_within(1)).then_some(first)
    }

    /// The ideal frame that `coords` refers to: the pose at the middle of the window, and the pixels.
    #[must_use]
    pub fn ideal_view(&self) -> IdealView {
        IdealView { pose: self.key_pose, ideal: self.ideal }
    }

    /// Poses of the ideal frames.
    #[must_use]
    pub fn key_poses(&self) -> Vec<CameraPose> {
        self.keys.iter().map(|key| key.pose).collect()
    }

    /// Pose of the ideal frame's camera; of several the middle one's.
    #[must_use]
    pub fn ideal_pose(&self) -> CameraPose {
        self.keys.get(self.keys.len() / 2).map_or(self.key_pose, |key| key.pose)
    }

    /// How far the surfaces of models may be from where they are, in the ideal frames: frames that share one
    /// agree on it. In ideal frames that are finer than the picture, as they are for borders between
    /// surfaces, they may be as many more of their pixels.
    #[must_use]
    pub fn model_tolerance(&self, quality: &QualitySpec) -> LevelTolerance {
        LevelTolerance {
            focal_px: self.ideal.focal_px.max_element(),
            tangents: self.tangents(),
            error_px: MODEL_SHARE * quality.max_terrain_error_px * self.ideal.scale(&self.camera).max(1.0),
            travel_m: self.motion.travel_m,
            parallax_px: MODEL_PARALLAX_SHARE * quality.max_error_px,
        }
    }

    /// `[u_min, u_max, v_min, v_max]` of the ideal frame's pixel area.
    #[must_use]
    pub fn tangents(&self) -> [f64; 4] {
        self.ideal.tangents()
    }

    /// How much of the frame's window has gone by at an instant, path time, seconds: 0 to 1 within it.
    #[must_use]
    pub fn window_share(&self, t_s: f64) -> f64 {
        let [first_s, last_s] = self.window_s;
        if last_s > first_s { (t_s - first_s) / (last_s - first_s) } else { 0.5 }
    }
}
