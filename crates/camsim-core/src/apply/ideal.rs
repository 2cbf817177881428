//! What the pipeline takes: the ideal frame; and why it, or a pixel of it, gives nothing.

use glam::DVec2;

use super::{FlowField, PoseTrackError};
use crate::{camera::CameraError, shutter::ShutterError, temporal::IdealGeometry};

/// Why the pipeline cannot run.
#[derive(Debug, thiserror::Error)]
pub enum ApplyError {
    /// The camera.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// The shutter.
    #[error(transparent)]
    Shutter(#[from] ShutterError),
    /// The frame's images.
    #[error("the ideal frame has {what}: {fix}")]
    Frame {
        /// What is wrong.
        what: String,
        /// What to do.
        fix: &'static str,
    },
    /// The motion.
    #[error(transparent)]
    Motion(#[from] PoseTrackError),
    /// Methods that a flow leaves nothing to do.
    #[error(
        "a flow says where everything goes, which the paper's methods and solvers cannot use: leave --preset and --solver out, or the flow"
    )]
    Flow,
    /// A solver that needs a scene.
    #[error(
        "solver \"oracle\" casts rays into a scene, and an ideal frame is none: use \"reproject\" (exact up to what the frame shows)"
    )]
    Oracle,
    /// Linear fog outside of the paper's preset.
    #[error(
        "fog is a part of the ideal frame; the linear fog added afterwards belongs to the paper's methods: use the preset \"paper\", or leave fog out"
    )]
    Fog,
}

/// A pinhole RGB-D picture with its geometry.
#[derive(Clone, Debug, PartialEq)]
pub struct IdealFrame {
    /// Its pixels; usually larger than the output's, so that lens and motion find sources.
    pub geometry: IdealGeometry,
    /// Linear R G B A, row-major; A is not used.
    pub color_rgba: Vec<f32>,
    /// Inverse planar depth, 1/m, row-major; 0 = infinitely far (sky, or unknown).
    pub inverse_depth: Vec<f32>,
    /// Where the depth is not known, so that what looks there has no answer; empty is nowhere.
    pub holes: Vec<bool>,
    /// When it was taken, seconds after the stamp.
    pub instant_s: f64,
}

/// Why a pixel shows nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unseen {
    /// The lens has no ray there.
    NoRay,
    /// It looks beyond the ideal frame's border, or behind its camera.
    Outside,
    /// It looks where the depth is not known ([`IdealFrame::holes`]).
    Hole,
    /// It looks where the flow is not known.
    UnknownFlow,
    /// What it looks at could not be found: neighbours' flows have too little in common.
    TornFlow,
}

/// Pixels that show nothing, by reason.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct UnseenCounts {
    /// [`Unseen::NoRay`].
    pub no_ray: u64,
    /// [`Unseen::Outside`].
    pub outside: u64,
    /// [`Unseen::Hole`].
    pub holes: u64,
    /// [`Unseen::UnknownFlow`].
    pub unknown_flow: u64,
    /// [`Unseen::TornFlow`].
    pub torn_flow: u64,
}

impl UnseenCounts {
    pub(super) fn add(&mut self, why: Unseen) {
        match why {
            Unseen::NoRay => self.no_ray += 1,
            Unseen::Outside => self.outside += 1,
            Unseen::Hole => self.holes += 1,
            Unseen::UnknownFlow => self.unknown_flow += 1,
            Unseen::TornFlow => self.torn_flow += 1,
        }
    }

    /// All of them.
    #[must_use]
    pub fn all(&self) -> u64 {
        self.no_ray + self.outside + self.holes + self.unknown_flow + self.torn_flow
    }
}

impl IdealFrame {
    /// A flow for each pixel, over some time.
    pub(super) fn check_flow(&self, flow: &FlowField) -> Result<(), ApplyError> {
        let frame = |what: String, fix| Err(ApplyError::Frame { what, fix });
        let [[width, height], [w, h]] = [self.geometry.size_px, flow.size_px];
        if [width, height] != [w, h] || flow.px.len() != w as usize * h as usize {
            return frame(
                format!("a flow of {w}x{h} pixels beside a picture of {width}x{height}"),
                "flow and colour must have one size",
            );
        }
        if !(flow.interval_s.is_finite() && flow.interval_s != 0.0) {
            return frame(
                format!("a flow over {} s", flow.interval_s),
                "give the time between the two instants that it joins",
            );
        }
        Ok(())
    }

    /// Planes that fill the geometry, and finite values.
    pub(super) fn check(&self) -> Result<(), ApplyError> {
        let frame = |what: String, fix| Err(ApplyError::Frame { what, fix });
        let [width, height] = self.geometry.size_px.map(|side| side as usize);
        if width == 0 || height == 0 {
            return frame("no pixel".into(), "give pictures of at least 1x1");
        }
        let holes_fit = self.holes.is_empty() || self.holes.len() == width * height;
        if self.color_rgba.len() != 4 * width * height
            || self.inverse_depth.len() != width * height
            || !holes_fit
        {
            return frame(
                format!(
                    "{} colour and {} depth values for {width}x{height} pixels",
                    self.color_rgba.len(),
                    self.inverse_depth.len()
                ),
                "colour and depth must have one size",
            );
        }
        let DVec2 { x: fx, y: fy } = self.geometry.focal_px;
        if !(fx.is_finite()
            && fy.is_finite()
            && fx > 0.0
            && fy > 0.0
            && self.geometry.principal_px.is_finite())
        {
            return frame(
                format!("focal_px [{fx}, {fy}]"),
                "give positive finite focal lengths and a finite principal point",
            );
        }
        if self.inverse_depth.iter().any(|w| !(w.is_finite() && *w >= 0.0)) {
            return frame(
                "depths that are negative or not finite".into(),
                "0 stands for unknown or infinitely far",
            );
        }
        if self.color_rgba.iter().any(|v| !v.is_finite()) {
            return frame(
                "colours that are not finite".into(),
                "clean the picture before: NaN would spread over every blur path",
            );
        }
        Ok(())
    }
}

impl std::ops::AddAssign for UnseenCounts {
    fn add_assign(&mut self, other: Self) {
        self.no_ray += other.no_ray;
        self.outside += other.outside;
        self.holes += other.holes;
        self.unknown_flow += other.unknown_flow;
        self.torn_flow += other.torn_flow;
    }
}
