//! Inputs of the pipeline, and the reasons for which it, or one of its pixels, gives no result.

use glam::DVec2;

use super::{FlowField, PoseTrackError};
use crate::{camera::CameraError, shutter::ShutterError, temporal::IdealGeometry};

/// Why the pipeline cannot run.
#[derive(Debug, thiserror::Error)]
pub enum ApplyError {
    /// The camera is invalid.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// The shutter is invalid.
    #[error(transparent)]
    Shutter(#[from] ShutterError),
    /// Rows with exposures of different lengths.
    #[error("camera.shutter.reset = \"global\" is not made of pictures of other programs: write \"rolling\"")]
    Reset,
    /// The images of the frame are invalid.
    #[error("the ideal frame has {what}: {fix}")]
    Frame {
        /// What is wrong.
        what: String,
        /// What to do.
        fix: &'static str,
    },
    /// The motion is invalid.
    #[error(transparent)]
    Motion(#[from] PoseTrackError),
    /// Methods that a flow makes meaningless.
    #[error(
        "a flow already contains all motion, so the paper's methods and solvers cannot be used with it: leave --preset and --solver out, or the flow"
    )]
    Flow,
    /// A solver that needs a scene.
    #[error(
        "solver \"reference\" needs a scene, which an ideal frame does not have: use \"reproject\" (exact up \
         to what the frame shows)"
    )]
    Reference,
    /// Linear fog without the paper's preset.
    #[error(
        "linear fog after the blur belongs to the paper's methods (otherwise fog is part of the ideal frame): use the preset \"paper\", or leave fog out"
    )]
    Fog,
    /// Automatic exposure.
    #[error(
        "camera.auto_exposure meters a flight through a scene, and these frames are pictures by themselves: leave \
         it out, and give camera.shutter.exposure_ms"
    )]
    AutoExposure,
    /// The paper's methods with a point spread.
    #[error(
        "the paper's methods have their own photometric model: leave [point_spread] out of the camera, or use the \
         preset \"default\""
    )]
    PointSpread,
}

/// A pinhole RGB-D image with its geometry.
#[derive(Clone, Debug, PartialEq)]
pub struct IdealFrame {
    /// Its geometry. It is usually larger than the output, so that lens and motion find their sources.
    pub geometry: IdealGeometry,
    /// Linear R G B A, row-major; A is not used.
    pub color_rgba: Vec<f32>,
    /// Inverse planar depth, 1/m, row-major; 0 = infinitely far (sky, or unknown).
    pub inverse_depth: Vec<f32>,
    /// Mask of pixels with unknown depth, row-major; empty means none. Rays that hit such a hole have no
    /// result.
    pub holes: Vec<bool>,
    /// Instant of the frame, seconds after the stamp.
    pub instant_s: f64,
}

/// Why a pixel has no source.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoSource {
    /// The lens has no ray there.
    NoRay,
    /// The source is beyond the border of the ideal frame, or behind its camera.
    Outside,
    /// The depth at the source is unknown ([`IdealFrame::holes`]).
    Hole,
    /// The flow at the source is unknown.
    UnknownFlow,
    /// The source could not be found, because the flow of neighbouring pixels is too irregular.
    TornFlow,
}

/// Number of pixels without a source, by reason.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NoSourceCounts {
    /// Pixels with [`NoSource::NoRay`].
    pub no_ray: u64,
    /// Pixels with [`NoSource::Outside`].
    pub outside: u64,
    /// Pixels with [`NoSource::Hole`].
    pub holes: u64,
    /// Pixels with [`NoSource::UnknownFlow`].
    pub unknown_flow: u64,
    /// Pixels with [`NoSource::TornFlow`].
    pub torn_flow: u64,
}

impl NoSourceCounts {
    pub(super) fn add(&mut self, why: NoSource) {
        match why {
            NoSource::NoRay => self.no_ray += 1,
            NoSource::Outside => self.outside += 1,
            NoSource::Hole => self.holes += 1,
            NoSource::UnknownFlow => self.unknown_flow += 1,
            NoSource::TornFlow => self.torn_flow += 1,
        }
    }

    /// Sum over all reasons.
    #[must_use]
    pub fn all(&self) -> u64 {
        self.no_ray + self.outside + self.holes + self.unknown_flow + self.torn_flow
    }
}

impl IdealFrame {
    /// Checks the size, interval and values of a flow.
    pub(super) fn check_flow(&self, flow: &FlowField) -> Result<(), ApplyError> {
        let frame = |what: String, fix| Err(ApplyError::Frame { what, fix });
        let [[width, height], [w, h]] = [self.geometry.size_px, flow.size_px];
        if [width, height] != [w, h] || flow.px.len() != w as usize * h as usize {
            return frame(
                format!("a flow of {w}x{h} pixels and an image of {width}x{height}"),
                "flow and colour must have the same size",
            );
        }
        if !(flow.interval_s.is_finite() && flow.interval_s != 0.0) {
            return frame(
                format!("a flow over {} s", flow.interval_s),
                "give the time between its two instants",
            );
        }
        Ok(())
    }

    /// Checks that the images fill the geometry with finite values.
    pub(super) fn check(&self) -> Result<(), ApplyError> {
        let frame = |what: String, fix| Err(ApplyError::Frame { what, fix });
        let [width, height] = self.geometry.size_px.map(|side| side as usize);
        if width == 0 || height == 0 {
            return frame("no pixel".into(), "give images of at least 1x1");
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
                "colour and depth must have the same size",
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
                "use 0 for unknown or infinitely far",
            );
        }
        if self.color_rgba.iter().any(|v| !v.is_finite()) {
            return frame(
                "colours that are not finite".into(),
                "replace them first: NaN would spread along every blur path",
            );
        }
        Ok(())
    }
}

impl std::ops::AddAssign for NoSourceCounts {
    fn add_assign(&mut self, other: Self) {
        self.no_ray += other.no_ray;
        self.outside += other.outside;
        self.holes += other.holes;
        self.unknown_flow += other.unknown_flow;
        self.torn_flow += other.torn_flow;
    }
}
