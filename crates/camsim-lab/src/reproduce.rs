//! The experiments of the paper's section 8, done again: what its text and figures claim, measured against
//! truth.
//!
//! Each experiment is one file and gives a [`Report`]: tables, plots, pictures and remarks. Inputs that are
//! not part of camsim (the paper's flight log, its calibrations and camera poses) come from a data folder;
//! without one an experiment runs on a built-in substitute and says so in its first remark.

use std::{
    convert::Infallible,
    path::{Path, PathBuf},
};

use camsim_engine::{Engine, GpuError, RenderError};
use camsim_io::{
    camera_file::CameraFileError, flight_log::FlightLogError, load::LoadError, pictures::PictureError,
    scenario_file::ScenarioError, write::WriteError,
};

use crate::plot::PlotError;

mod blur;
mod circles;
mod displace;
mod interlace;
mod lens;
mod map;
mod pattern;
mod report;
mod rig;
mod shutter;
mod speed;
mod table;
#[cfg(test)]
mod tests;
mod time;
mod tracking;

pub use report::{Picture, Report};
pub use table::{Table, short};

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
    /// 8.8, fig. 21: everything over terrain.
    Map,
    /// 8.9: frames a second.
    Speed,
}

impl Experiment {
    /// All, in the paper's order.
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

    /// Its name on the command line and of its folder.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Tracking => "tracking",
            Self::Lens => "lens",
            Self::Time => "time",
            Self::Blur => "blur",
            Self::Shutter => "shutter",
            Self::Interlace => "interlace",
            Self::Map => "map",
            Self::Speed => "speed",
        }
    }

    /// What it shows, with its place in the paper.
    #[must_use]
    pub fn title(self) -> &'static str {
        match self {
            Self::Tracking => "8.1, table 1: tracking of the flight log",
            Self::Lens => "8.3, figs. 11 and 12: the lens model",
            Self::Time => "8.4, figs. 13 to 15: the time displacement model",
            Self::Blur => "8.5, figs. 16 and 17: motion blur",
            Self::Shutter => "8.6, figs. 18 and 19: rolling shutter",
            Self::Interlace => "8.7, fig. 20: interlacing",
            Self::Map => "8.8, fig. 21: time displacement on a map",
            Self::Speed => "8.9: speed",
        }
    }

    /// Does it.
    ///
    /// # Errors
    /// [`ReproduceError`]: a file of the data folder, the device.
    pub fn run(self, setup: &Setup<'_>) -> Result<Report, ReproduceError> {
        match self {
            Self::Tracking => tracking::run(setup),
            Self::Lens => lens::run(setup),
            Self::Time => time::run(setup),
            Self::Blur => blur::run(setup),
            Self::Shutter => shutter::run(setup),
            Self::Interlace => interlace::run(setup),
            Self::Map => map::run(setup),
            Self::Speed => speed::run(setup),
        }
    }
}

/// What experiments run with.
#[derive(Clone, Copy, Debug)]
pub struct Setup<'a> {
    /// The device.
    pub engine: &'a Engine,
    /// The folder that holds `camsim/` (log, calibrations and poses of the paper's program), `flights/`,
    /// `terrain/`.
    pub data: Option<&'a Path>,
    /// Where inputs made here are put (the built-in flight).
    pub scratch: &'a Path,
    /// Width of the pictures; the paper's are 640 x 480. Smaller ones are quicker, with the same field of
    /// view.
    pub width_px: u32,
}

impl Setup<'_> {
    /// The file `name` of the data folder, if there is a data folder.
    fn data_file(&self, name: &str) -> Option<PathBuf> {
        self.data.map(|folder| folder.join(name))
    }
}

/// Why an experiment could not be done.
#[derive(Debug, thiserror::Error)]
pub enum ReproduceError {
    /// The flight log.
    #[error(transparent)]
    Log(#[from] FlightLogError),
    /// A calibration.
    #[error(transparent)]
    Camera(#[from] CameraFileError),
    /// A picture.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// A scenario.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// What a scenario names.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// The device.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// Rendering.
    #[error(transparent)]
    Render(#[from] RenderError<Infallible>),
    /// A file of the report.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// A plot.
    #[error(transparent)]
    Plot(#[from] PlotError),
    /// Pictures in which nothing is found to measure.
    #[error(
        "no circle of the target was found in the pictures of {calibration}'s calibration, {width_px} px wide: circles of fewer than {least_px} \
         dark pixels are not told from noise; take a larger width (the paper's is 640)"
    )]
    NoCircle {
        /// Whose camera.
        calibration: &'static str,
        /// Width of the pictures.
        width_px: u32,
        /// Fewest pixels of a circle.
        least_px: usize,
    },
    /// A picture too small for what is measured on it, or a setting that makes no camera.
    #[error("{what} of the experiment cannot be used: {reason}; take a width of 96 to 4096 px")]
    Made {
        /// What was made.
        what: &'static str,
        /// What is wrong with it.
        reason: String,
    },
}

impl ReproduceError {
    fn made(what: &'static str, reason: impl ToString) -> Self {
        Self::Made { what, reason: reason.to_string() }
    }
}
