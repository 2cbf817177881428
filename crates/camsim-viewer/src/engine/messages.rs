//! Messages between window and engine.

use std::{sync::Arc, time::Duration};

use camsim_core::{scenario::Scenario, sequence::Sequence};
use camsim_engine::CameraReference;
use camsim_io::load::Loaded;
use eframe::egui::ColorImage;

use super::{
    error_overlay::ErrorOverlay,
    picture::{Difference, Picture},
    raw::Histogram,
};

/// Stage of the pipeline up to which a picture shows the camera's imperfections.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub enum Stage {
    /// A pinhole with an instant shutter on a still mount.
    Ideal,
    /// Ideal, with lens distortion.
    Lens,
    /// Lens, with delay, readout, exposure, interlacing and vibration.
    Time,
    /// Time, with light, vignette and noise: what `camsim render` writes.
    Photometric,
    /// The photometric stage by exact rays, on the CPU.
    Reference,
}

impl Stage {
    /// All stages in pipeline order, the reference last.
    pub const ALL: [Self; 5] = [Self::Ideal, Self::Lens, Self::Time, Self::Photometric, Self::Reference];

    /// Text of its button.
    pub fn label(self) -> &'static str {
        match self {
            Self::Ideal => "ideal",
            Self::Lens => "+ lens",
            Self::Time => "+ time",
            Self::Photometric => "+ photometric",
            Self::Reference => "reference",
        }
    }

    /// Text of its tooltip.
    pub fn tooltip(self) -> &'static str {
        match self {
            Self::Ideal => "pinhole with an instant shutter on a rigid mount, without noise and vignette",
            Self::Lens => "ideal, with lens distortion (the paper's eqs. 8 and 9)",
            Self::Time => "lens, with delay t_d, readout t_r, exposure t_e, interlacing t_i and vibration",
            Self::Photometric => {
                "time, with light, vignette and noise: the pixels that `camsim render` writes"
            }
            Self::Reference => {
                "the photometric stage by exact rays, each at its own instant, on the CPU: slow, row by row"
            }
        }
    }
}

/// Size and tolerances of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Size {
    /// Smaller, with wider tolerances: during drags and play.
    Preview,
    /// As the scenario says.
    Full,
}

/// What the window needs to show now.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameRequest {
    /// The scenario, valid and with its paths resolved.
    pub scenario: Arc<Scenario>,
    /// Incremented when files are to be read again although the scenario is the same.
    pub reload_count: u64,
    /// Frame number, clamped to the last one.
    pub frame: u64,
    /// Stages to render, never [`Stage::Reference`].
    pub stages: Vec<Stage>,
    /// Size of the pictures.
    pub size: Size,
    /// Whether depth is needed.
    pub depth: bool,
    /// Whether the raw picture of the sensor is needed as an image.
    pub raw: bool,
    /// Whether a histogram is needed.
    pub histogram: bool,
    /// Whether predicted errors over the image are needed; never with previews, which they would delay.
    pub errors: bool,
    /// Gain of the difference of the two stages; `None` if no difference is needed.
    pub gain: Option<f32>,
}

impl FrameRequest {
    /// Whether both are of the same frame of the same scenario, be it in another size or with other images.
    pub fn is_same_frame(&self, other: &Self) -> bool {
        (self.frame, self.reload_count) == (other.frame, other.reload_count)
            && self.scenario == other.scenario
    }
}

/// What the window needs of the reference.
#[derive(Clone, Debug)]
pub struct ReferenceRequest {
    /// The sequence to trace rays in.
    pub sequence: Arc<Sequence>,
    /// The frame to render; `None` for exact rays of single pixels only.
    pub frame: Option<u64>,
    /// The picture to compare with, and the gain of the difference.
    pub against: Option<(Arc<Picture>, f32)>,
}

/// Replies of the threads.
#[derive(Debug)]
pub enum Reply {
    /// Name of the renderer or graphics adapter in use.
    Adapter(String),
    /// The slow task in progress; empty for none.
    Busy(String),
    /// A scenario's files have been read.
    Loaded(Arc<Loaded>),
    /// The pictures of a frame.
    Frame(Box<FrameReply>),
    /// Predicted errors of pictures that were sent before.
    Errors(Box<ErrorsReply>),
    /// Exact rays in a sequence are ready.
    Reference(Arc<CameraReference>),
    /// The reference's picture; rows may still be missing.
    ReferencePicture(Box<ReferencePicture>),
    /// A fault: what went wrong, and what to do.
    Failed(String),
    /// An event that the user should know of, shown until dismissed.
    Notice(String),
}

/// Depth of a frame.
#[derive(Clone, Debug)]
pub struct DepthPicture {
    /// Planar depth, metres, 0 for the sky; row-major.
    pub depth_m: Vec<f32>,
    /// Least and largest depth; `None` if no pixel has a surface.
    pub range_m: Option<[f32; 2]>,
    /// Colour-coded depth.
    pub image: Arc<ColorImage>,
}

/// Pictures of a frame.
#[derive(Clone, Debug)]
pub struct FrameReply {
    /// The request.
    pub request: FrameRequest,
    /// Frame number, clamped to the sequence.
    pub frame: u64,
    /// One picture for each stage requested.
    pub pictures: Vec<Arc<Picture>>,
    /// Depth of each picture, if requested.
    pub depths: Vec<Arc<DepthPicture>>,
    /// The raw picture of each picture, if requested; `None` for a stage without sensor.
    pub raws: Vec<Option<Arc<ColorImage>>>,
    /// Histogram of each picture, if requested: of the raw picture where that is requested too.
    pub histograms: Vec<Histogram>,
    /// Predicted errors of each picture, if requested and cached; otherwise [`Reply::Errors`] follows.
    pub errors: Vec<Arc<ErrorOverlay>>,
    /// The difference of the two pictures, if requested.
    pub difference: Option<Arc<Difference>>,
    /// Time from request to reply; `None` if all pictures were cached.
    pub took: Option<Duration>,
}

/// Predicted errors of pictures that were sent before.
#[derive(Clone, Debug)]
pub struct ErrorsReply {
    /// The request that the pictures were rendered for.
    pub request: FrameRequest,
    /// One for each picture.
    pub errors: Vec<Arc<ErrorOverlay>>,
}

/// The reference's picture with the rows rendered so far.
#[derive(Clone, Debug)]
pub struct ReferencePicture {
    /// The sequence that it shows.
    pub sequence: Arc<Sequence>,
    /// Frame number.
    pub frame: u64,
    /// Linear R G B A, row-major; alpha is 0 in missing rows.
    pub color_rgba: Arc<Vec<f32>>,
    /// sRGB picture for the screen.
    pub image: Arc<ColorImage>,
    /// The requested picture less this one.
    pub difference: Option<Arc<Difference>>,
    /// Number of rendered rows, from the top.
    pub rows: u32,
}
