//! The plan of a frame.

use std::sync::Arc;

use camsim_core::{
    camera::CameraModel,
    exposure::FrameExposure,
    pose::CameraPose,
    reference::IdealView,
    scenario::{Face, Preset, Primary, QualitySpec},
    scene::LodTolerance,
    shutter::Shutter,
    temporal::{IdealGeometry, TapStage, displacement::Twist},
};

use super::{
    budget::ErrorBudget,
    key_frame::KeyFrame,
    linear_fog::LinearFog,
    margins,
    motion::Motion,
    placement::Placement,
    predicted::Predicted,
    seen_plane::SeenPlane,
    skip::Skip,
    stages::{BlurStage, EdgeStage, PrefilterTaps, RayStage, ShadowStage, TemporalStage},
};

/// A row's camera that moves towards the nearest surface gives it at most this many times its inverse depth:
/// as in `camsim-gpu/shaders/reverse/edges/near_silhouette.wgsl`.
const MOST_STRETCH: f64 = 4.0;

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
    /// Row timing, with the frame's own exposure.
    pub shutter: Shutter,
    /// Exposure time and gain, where they follow the pictures.
    pub exposure: Option<FrameExposure>,
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
    pub shared_frames: Option<[u64; 2]>,
    /// Why the frame has an ideal frame of its own.
    pub unshared_reason: Option<&'static str>,
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
    /// Shadows of the sun; `None` in a scene without.
    pub shadows: Option<ShadowStage>,
    /// What reads the surfaces' pictures for the ideal frame.
    pub surface_reads: PrefilterTaps,
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
    /// Who makes its passes.
    pub placement: Placement,
    /// What the processor does with the finished light of the frame, in order.
    pub finishing: Vec<&'static str>,
    /// What is not done.
    pub skipped: Vec<Skip>,
    /// Time that its passes are expected to take, roughly: milliseconds for pictures of 640x480 on two
    /// processor cores with llvmpipe, whatever machine this is. Plans are compared by it.
    pub price_ms: f64,
    /// Part of `price_ms` that this frame's part of the ideal frame takes.
    pub ideal_price_ms: f64,
    /// The colour that its output pass makes, of a camera whose colours have a lens each; plans are those of green.
    pub primary: Option<Primary>,
    /// The cameras of red and blue of such a camera.
    pub others: Option<[Arc<CameraModel>; 2]>,
}

impl FramePlan {
    /// The plans of the output passes that red and blue have beside this one's, from the same ideal frames.
    pub fn other_colors(&self) -> impl Iterator<Item = Self> + '_ {
        let both = [Primary::Red, Primary::Blue].into_iter();
        both.zip(self.others.iter().flatten()).map(|(primary, camera)| Self {
            primary: Some(primary),
            ray: if camera.lens.is_identity() { RayStage::Pinhole } else { RayStage::LensMap },
            camera: camera.clone(),
            truth: false,
            ..self.clone()
        })
    }

    /// What its lens map belongs to: a face, and a colour.
    #[must_use]
    pub fn lens_key(&self) -> (Option<Face>, Option<Primary>) {
        (self.camera.lens.face(), self.primary)
    }

    /// Whether the one ideal frame was taken at another instant than the middle of the window.
    #[must_use]
    pub fn has_displaced_key(&self) -> bool {
        matches!(self.keys.as_slice(), [key] if key.t_s != self.key_s)
    }

    /// The ideal pixel that the first pixel of the output is, where pixels of the output are those of the
    /// ideal frame: nothing bends rays or moves, both cameras are as fine, and positions of pixels are whole
    /// pixels apart, as `view/ideal_extent.rs` has them. Then nothing is read between them.
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
    pub fn model_tolerance(&self, quality: &QualitySpec) -> LodTolerance {
        let budget = ErrorBudget::new(quality);
        LodTolerance {
            focal_px: self.ideal.focal_px.max_element(),
            tangents: self.tangents(),
            error_px: budget.model_px() * self.ideal.scale(&self.camera).max(1.0),
            travel_m: self.motion.travel_m,
            parallax_px: budget.model_parallax_px(),
        }
    }

    /// `[u_min, u_max, v_min, v_max]` of the ideal frame's pixel area.
    #[must_use]
    pub fn tangents(&self) -> [f64; 4] {
        self.ideal.tangents()
    }

    /// How much of the frame's window has gone by at an instant, path time, seconds: 0 to 1 within it.
    #[must_use]
    pub fn window_fraction(&self, t_s: f64) -> f64 {
        let [first_s, last_s] = self.window_s;
        if last_s > first_s { (t_s - first_s) / (last_s - first_s) } else { 0.5 }
    }
}

impl FramePlan {
    /// How far from a pixel's source the rays of that pixel may lead, ideal pixels. Their parallax: `w' = w /
    /// (1 - t_z w)` is at most the inverse depth that a row's camera gives to the nearest surface `w`, and
    /// `camsim-gpu/shaders/reverse/edges/near_silhouette.wgsl`, which bounds it likewise, begins 2 % nearer
    /// than that.
    #[must_use]
    pub fn mark_reach_px(&self) -> u32 {
        let approach =
            (margins::NEARER * self.motion.travel_m / self.motion.nearest_m).min(1.0 - 1.0 / MOST_STRETCH);
        // Saturates: then every mark reaches everything.
        (margins::NEARER * self.motion.parallax_px / (1.0 - approach) + margins::MARK_REACH_PX).ceil() as u32
    }
}

impl FramePlan {
    /// Whether depth and coordinates are wanted and exact, by rays. With the paper's solvers they say where these
    /// look instead.
    #[must_use]
    pub fn has_exact_truth(&self) -> bool {
        self.truth && !matches!(self.temporal, TemporalStage::Linear | TemporalStage::Rk2)
    }
}
