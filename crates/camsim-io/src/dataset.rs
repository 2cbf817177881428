//! Output folders of `camsim render` in the layouts of other programs.
//!
//! An export is a pure function of an output folder: pictures are linked or copied as they are where readers take
//! alpha and 16 bits, and else encoded again; tables are turned into the axes, quaternion orders, pixel origins and clocks that the reader expects. A page
//! `README.md` in the export says which.
//!
//! | module | writes |
//! |---|---|
//! | `euroc` | EuRoC/ASL, with `settings` for ORB-SLAM3, OpenVINS and VINS-Fusion |
//! | `tum` | TUM RGB-D |
//! | `kitti` | KITTI: odometry, depth, flow |
//! | `colmap` | COLMAP models with exact tracks |
//! | `nerfstudio` | `transforms.json` |
//! | `kalibr` | folders of the bag creator, the true chain |
//! | `bag` | MCAP with messages of ROS 2 |
//! | `pairs` | Carla-RS, Fastec-RS; GoPro, REDS |
//! | `webdataset` | tar shards |
//! | `flow` | `.flo` |
//!
//! A layout is a file with `write`, which returns notes for the user; a line in `DatasetFormat` and in [`export`];
//! and what it needs in `requirements`.
//!
//! Frames are handled one at a time, so memory does not grow with their number, except for a few hundred bytes
//! of their row in `frames.csv`.

use std::{
    io,
    path::{Path, PathBuf},
};

use camsim_core::scenario::DatasetFormat;
use rayon::prelude::*;
use thiserror::Error;

use crate::{
    calibration::{CalibrationError, axes, text},
    write::WriteError,
};

mod bag;
mod colmap;
mod csv_rows;
mod depth;
mod euroc;
mod flow;
mod imu;
mod kalibr;
mod kitti;
mod nerfstudio;
mod openvins;
mod page;
mod pairs;
mod pictures;
mod receivers;
mod record;
mod requirements;
mod run_folder;
mod settings;
mod stamps;
mod stereo;
mod target;
mod tum;
mod twins;
mod webdataset;

pub use crate::calibration::Intrinsics;
pub use axes::{Rigid, enu, enu_from_camera};
pub use requirements::{judge_lens, require};
pub use run_folder::{PlatformState, RunCamera, RunFolder, RunFrame};
use target::Target;

/// Why a folder was not exported.
#[derive(Debug, Error)]
pub enum DatasetError {
    /// A file of the run cannot be used.
    #[error("{}: {message}", path.display())]
    Input {
        /// The file.
        path: PathBuf,
        /// The place, the problem and the remedy.
        message: String,
    },
    /// The run lacks something; the message names the key that adds it.
    #[error("{0}")]
    Missing(String),
    /// The layout has no place for something, or the folder holds another export.
    #[error("{0}")]
    Refused(String),
    /// A format of calibrations has no place for the camera.
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
    /// A file cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// A piece of a file cannot be written; its writer adds the path.
    #[error(transparent)]
    Piece(#[from] io::Error),
    /// The caller wanted an end.
    #[error("stopped on request; what is written stays, and the same command goes on")]
    Stopped,
}

/// Choices of an export.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ExportOptions {
    /// Integers per metre in depth pictures; `None`: what the layout is known for, or less where depths would
    /// not fit.
    pub depth_per_metre: Option<f64>,
    /// Whether estimators get colour, not grey.
    pub color: bool,
    /// Whether an export of another run in the folder is removed; otherwise it is an error.
    pub replace: bool,
}

/// Progress of an export.
#[allow(missing_debug_implementations, reason = "functions")]
pub struct Watch<'a> {
    /// Called after each picture, from several threads.
    pub advance: &'a (dyn Fn() + Sync),
    /// Whether the export has to end.
    pub is_stopped: &'a (dyn Fn() -> bool + Sync),
}

/// What an export did.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ExportReport {
    /// Number of pictures of the cameras, without those of twins.
    pub pictures: u64,
    /// What the user should know.
    pub notes: Vec<String>,
    /// Whether everything was there already.
    pub was_complete: bool,
}

/// An export at work.
struct ExportJob<'a> {
    run: &'a RunFolder,
    format: DatasetFormat,
    target: Target<'a>,
    options: &'a ExportOptions,
    /// Whether the folder has parts of this very export.
    keeps: bool,
    /// What the user should know, whatever the layout.
    notes: Vec<String>,
}

impl ExportJob<'_> {
    /// Name of the format, for messages.
    fn name(&self) -> &'static str {
        self.format.name()
    }

    /// Calls `work` for each frame of a camera, on several threads.
    fn each_frame(
        &self,
        camera: &RunCamera,
        work: impl Fn(&RunFrame) -> Result<(), DatasetError> + Sync,
    ) -> Result<(), DatasetError> {
        self.each_of(&camera.frames, work)
    }

    /// Calls `work` for each of these frames, on several threads.
    fn each_of(
        &self,
        frames: &[RunFrame],
        work: impl Fn(&RunFrame) -> Result<(), DatasetError> + Sync,
    ) -> Result<(), DatasetError> {
        frames.par_iter().try_for_each(|frame| {
            work(frame)?;
            self.target.advance()
        })
    }

    /// Prefix of the files of camera `i`: none for the only one.
    fn prefix(&self, i: usize) -> String {
        if self.run.cameras.len() == 1 { String::new() } else { format!("cam{i}/") }
    }
}

/// Exports an output folder into `folder`.
///
/// # Errors
/// The run lacks something that the layout needs, the layout has no place for something that the run has, or a
/// file cannot be read or written.
pub fn export(
    run: &RunFolder,
    format: DatasetFormat,
    folder: &Path,
    options: &ExportOptions,
    watch: &Watch<'_>,
) -> Result<ExportReport, DatasetError> {
    let record = record::ExportRecord::new(run, format, options)?;
    let report = ExportReport { pictures: run.frames(), ..ExportReport::default() };
    let keeps = match record::check(folder, &record, options)? {
        record::Found::Complete(notes) => return Ok(ExportReport { notes, was_complete: true, ..report }),
        record::Found::Incomplete => true,
        record::Found::Other => false,
    };
    crate::write::remove_all_temporaries(folder);
    record.write(folder, None)?;
    let (run, shifted) = stamps::fitted(run, format)?;
    let notes: Vec<String> = shifted.into_iter().collect();
    let job = ExportJob { run: &run, format, target: Target { folder, watch }, options, keeps, notes };
    let own = match format {
        DatasetFormat::Euroc => euroc::write(&job)?,
        DatasetFormat::Tum => tum::write(&job)?,
        DatasetFormat::Kitti => kitti::write(&job)?,
        DatasetFormat::Colmap => colmap::write(&job)?,
        DatasetFormat::Nerfstudio => nerfstudio::write(&job)?,
        DatasetFormat::Kalibr => kalibr::write(&job)?,
        DatasetFormat::CarlaRs => pairs::write_carla(&job)?,
        DatasetFormat::Gopro => pairs::write_gopro(&job)?,
        DatasetFormat::Flo => flow::write(&job)?,
        DatasetFormat::Mcap => bag::write(&job)?,
        DatasetFormat::Webdataset => webdataset::write(&job)?,
    };
    let notes = [job.notes, own].concat();
    record.write(folder, Some(&notes))?;
    Ok(ExportReport { notes, ..report })
}

#[cfg(test)]
mod tests;
