//! What window and engine say to each other.

use std::{sync::Arc, time::Duration};

use camsim_core::{reference::Oracle, scenario::Scenario, sequence::Sequence};
use camsim_io::load::Loaded;
use eframe::egui::ColorImage;

use super::{
    errors::Errors,
    picture::{Difference, Picture},
};

/// How much of the camera's imperfections is in a picture, in the order of the pipeline.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub enum Stage {
    /// A pinhole with an instant shutter on a still mount.
    Ideal,
    /// With the lens.
    Lens,
    /// With everything that takes time too: delay, readout, exposure, interlacing, vibration.
    Time,
    /// With light, vignette and noise too: what `camsim render` writes.
    Photometric,
    /// The same by exact rays, on the CPU.
    Oracle,
}

impl Stage {
    /// In pipeline order, the oracle last.
    pub const ALL: [Self; 5] = [Self::Ideal, Self::Lens, Self::Time, Self::Photometric, Self::Oracle];

    /// For buttons.
    pub fn label(self) -> &'static str {
        match self {
            Self::Ideal => "ideal",
            Self::Lens => "+ lens",
            Self::Time => "+ time",
            Self::Photometric => "+ photometric",
            Self::Oracle => "oracle",
        }
    }

    /// For whoever asks what a button does.
    pub fn explanation(self) -> &'static str {
        match self {
            Self::Ideal => "A pinhole with an instant shutter on a still mount, without noise and vignette",
            Self::Lens => "With lens distortion (the paper's eqs. 8 and 9)",
            Self::Time => "With delay t_d, readout t_r, exposure t_e, interlacing t_i and vibration too",
            Self::Photometric => {
                "With light, vignette and noise too: the very pixels that `camsim render` writes"
            }
            Self::Oracle => {
                "The same by exact rays, each at its own instant, on the CPU: slow, drawn strip by strip"
            }
        }
    }
}

/// How large pictures are wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Size {
    /// Small and within wider tolerances, while something moves.
    Preview,
    /// As the scenario says.
    Full,
}

/// What the window wants to show now.
#[derive(Clone, Debug, PartialEq)]
pub struct Wanted {
    /// The scenario, valid and with its paths resolved.
    pub scenario: Arc<Scenario>,
    /// Counts up when files are to be read again although their names are the same.
    pub reading: u64,
    /// Frame number; the last one where there are fewer.
    pub frame: u64,
    /// What to render, never [`Stage::Oracle`].
    pub stages: Vec<Stage>,
    /// How large.
    pub size: Size,
    /// Whether depth is wanted too.
    pub truth: bool,
    /// Whether the predicted error from place to place is wanted too; of previews it never is: it would hold
    /// up the next one.
    pub errors: bool,
    /// Enlargement of the difference of the two stages, if it is wanted.
    pub gain: Option<f32>,
}

/// What the window wants of the oracle.
#[derive(Clone, Debug)]
pub struct ExactWanted {
    /// The sequence as it is rendered.
    pub sequence: Arc<Sequence>,
    /// The frame to draw; `None` for looks into it alone.
    pub frame: Option<u64>,
    /// What to hold against it, with the enlargement of the difference.
    pub against: Option<(Arc<Picture>, f32)>,
}

/// What the threads say.
#[derive(Debug)]
pub enum Reply {
    /// What is rendered on.
    Adapter(String),
    /// What takes long at the moment; empty for nothing.
    Busy(String),
    /// A scenario's files have been read.
    Loaded(Arc<Loaded>),
    /// Pictures.
    Frame(Box<FrameReply>),
    /// What is predicted of pictures that were sent.
    Errors(Box<ErrorsReply>),
    /// Looks into a sequence are possible.
    Looks(Arc<Oracle>),
    /// A picture of the oracle, or part of it.
    Exact(Box<ExactPicture>),
    /// What went wrong, and what to do.
    Failed(String),
    /// What happened and is over, until somebody has read it.
    Told(String),
}

/// Depth of a frame, beside its picture.
#[derive(Clone, Debug)]
pub struct Truth {
    /// Planar depth, metres, 0 = nothing there; row-major.
    pub depth_m: Vec<f32>,
    /// The nearest and the farthest of it; `None` where nothing is.
    pub range_m: Option<[f32; 2]>,
    /// As a screen shows it.
    pub image: Arc<ColorImage>,
}

/// Pictures of a frame.
#[derive(Clone, Debug)]
pub struct FrameReply {
    /// What they were made for.
    pub wanted: Wanted,
    /// Its frame, brought into the sequence.
    pub frame: u64,
    /// One for each stage wanted.
    pub pictures: Vec<Arc<Picture>>,
    /// Depth of each of the pictures, if wanted.
    pub truths: Vec<Arc<Truth>>,
    /// What is predicted of each of the pictures, if wanted and known already; else it follows.
    pub errors: Vec<Arc<Errors>>,
    /// The difference of the two pictures, if wanted.
    pub difference: Option<Arc<Difference>>,
    /// From taking up the request to this reply; `None` if all of it was there already.
    pub took: Option<Duration>,
}

/// The predicted errors of a frame's pictures, which are not kept waiting for them.
#[derive(Clone, Debug)]
pub struct ErrorsReply {
    /// What the pictures were made for.
    pub wanted: Wanted,
    /// One for each of them.
    pub errors: Vec<Arc<Errors>>,
}

/// A picture of the oracle as far as it has come.
#[derive(Clone, Debug)]
pub struct ExactPicture {
    /// What of.
    pub sequence: Arc<Sequence>,
    /// Which frame.
    pub frame: u64,
    /// Linear R G B A of the rows that are done; alpha is 0 in the others.
    pub color_rgba: Arc<Vec<f32>>,
    /// As a screen shows it.
    pub image: Arc<ColorImage>,
    /// The difference, if something was to be held against it: that picture less this one.
    pub difference: Option<Arc<Difference>>,
    /// Rows that are done, from the top.
    pub rows: u32,
}
