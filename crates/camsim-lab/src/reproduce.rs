//! The experiments of section 8 of the paper, with errors measured against ground truth.
//!
//! Each experiment is one file and returns an [`ExperimentReport`] of tables, plots, pictures and notes.
//! Inputs that are not part of camsim (the paper's flight log and camera poses) come from a data folder.
//! Without it an experiment uses a built-in substitute and says so in its first note.

use std::{
    convert::Infallible,
    path::{Path, PathBuf},
};

use camsim_engine::{Engine, GpuError, RenderError};
use camsim_io::{
    flight_log::FlightLogError, formats::reading::CameraFileError, load::LoadError,
    raster::pictures::PictureError, scenario_file::ScenarioError, write::WriteError,
};

use crate::plot::PlotError;

mod blur;
mod circle_grid;
mod circles;
mod displacement;
mod interlace;
mod lens;
mod map;
mod report;
mod shutter;
mod speed;
mod table;
mod test_bench;
#[cfg(test)]
mod tests;
mod time;
mod tracking;

pub use report::{ExperimentReport, Picture};
pub use table::{Table, short};

type Run = fn(&Setup<'_>) -> Result<ExperimentReport, ReproduceError>;

/// An experiment of section 8.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Experiment {
    /// 8.1, table 1: how close the tracker stays to the log.
    Tracking,
    /// 8.3, figs. 11 and 12: circles through the lens.
    Lens,
    /// 8.4, figs. 13 to 15: the displacement models over one second.
    Time,
    /// 8.5, figs. 16 and 17: motion blur.
    Blur,
    /// 8.6, figs. 18 and 19: rolling shutter.
    Shutter,
    /// 8.7, fig. 20: interlacing.
    Interlace,
    /// 8.8, fig. 21: all effects over terrain.
    Map,
    /// 8.9: frame rates.
    Speed,
}

impl Experiment {
    /// All experiments, in the order of the paper.
    pub const ALL: [Self; 8] = [
        Self::Tracking,
        Self::Lens,
        Self::Time,
        Self::Blur,
        Self::Shutter,
        Self::Interlace,
        Self::Map,
        Self::Speed,
    ];

    /// Name; section and figures of the paper, and the subject; the experiment itself.
    fn facts(self) -> (&'static str, &'static str, Run) {
        match self {
            Self::Tracking => ("tracking", "8.1, table 1: tracking of the flight log", tracking::run),
            Self::Lens => ("lens", "8.3, figs. 11 and 12: the lens model", lens::run),
            Self::Time => ("time", "8.4, figs. 13 to 15: the time displacement model", time::run),
            Self::Blur => ("blur", "8.5, figs. 16 and 17: motion blur", blur::run),
            Self::Shutter => ("shutter", "8.6, figs. 18 and 19: rolling shutter", shutter::run),
            Self::Interlace => ("interlace", "8.7, fig. 20: interlacing", interlace::run),
            Self::Map => ("map", "8.8, fig. 21: time displacement on a map", map::run),
            Self::Speed => ("speed", "8.9: speed", speed::run),
        }
    }

    /// Name on the command line and of the output folder.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.facts().0
    }

    /// Section and figures of the paper, and the subject.
    #[must_use]
    pub fn title(self) -> &'static str {
        self.facts().1
    }

    /// Runs the experiment.
    ///
    /// # Errors
    /// [`ReproduceError`].
    pub fn run(self, setup: &Setup<'_>) -> Result<ExperimentReport, ReproduceError> {
        self.facts().2(setup)
    }
}

/// Inputs of the experiments.
#[derive(Clone, Copy, Debug)]
pub struct Setup<'a> {
    /// The renderer.
    pub engine: &'a Engine,
    /// Folder with `camsim/` (log, calibrations and poses of the paper's program), `flights/` and `terrain/`.
    pub data: Option<&'a Path>,
    /// Folder for the files of the built-in flight.
    pub scratch: &'a Path,
    /// Width of the frames, which are 640 x 480 in the paper. Smaller frames have the same field of view.
    pub width_px: u32,
}

impl Setup<'_> {
    /// Path of a file in the data folder, if there is a data folder.
    fn data_file(&self, name: &str) -> Option<PathBuf> {
        self.data.map(|folder| folder.join(name))
    }
}

/// Why an experiment failed.
#[derive(Debug, thiserror::Error)]
pub enum ReproduceError {
    /// The flight log cannot be read.
    #[error(transparent)]
    Log(#[from] FlightLogError),
    /// A calibration cannot be read.
    #[error(transparent)]
    Camera(#[from] CameraFileError),
    /// A picture cannot be read.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// A scenario cannot be read.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// A file of a scenario cannot be loaded.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// The adapter failed.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// Rendering failed.
    #[error(transparent)]
    Render(#[from] RenderError<Infallible>),
    /// A file of the report cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// A plot failed.
    #[error(transparent)]
    Plot(#[from] PlotError),
    /// No circle of the target was detected.
    #[error(
        "no circle of the target was found in the frames of {calibration}'s calibration, {width_px} px wide: \
         circles of fewer than {least_px} dark pixels are ignored as noise; choose a larger --width (640 in \
         the paper)"
    )]
    NoCircle {
        /// Name of the calibration.
        calibration: &'static str,
        /// Width of the frames, pixels.
        width_px: u32,
        /// Smallest area of a detected circle, pixels.
        least_px: usize,
    },
    /// An experiment's own camera, motion or frame is invalid.
    #[error("{what} of the experiment cannot be used: {reason}; choose a --width of 96 to 4096 px")]
    Setup {
        /// The invalid part.
        what: &'static str,
        /// Reason.
        reason: String,
    },
}

impl ReproduceError {
    fn setup(what: &'static str, reason: impl ToString) -> Self {
        Self::Setup { what, reason: reason.to_string() }
    }
}
