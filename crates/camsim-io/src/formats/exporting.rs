//! Output folders of `camsim render` in the layouts of other programs.
//!
//! An export is a pure function of an output folder: pictures are linked or copied as they are where readers take
//! alpha and 16 bits, and else encoded again; tables are turned into the axes, quaternion orders, pixel origins and
//! clocks that the reader expects. A page `README.md` in the export says which.
//!
//! Frames are handled one at a time, so memory does not grow with their number, except for a few hundred bytes
//! of their row in `frames.csv`.

use std::{
    io,
    path::{Path, PathBuf},
};

use camsim_core::scenario::{Channel, DatasetFormat};
use rayon::prelude::*;
use thiserror::Error;

use super::layout;
use super::writing::{Calibration, CalibrationError};
use crate::write::WriteError;

pub(crate) mod csv_rows;
pub(crate) mod depth;
pub(crate) mod imu;
pub(crate) mod page;
pub(crate) mod pictures;
pub(crate) mod receivers;
pub(crate) mod record;
pub(crate) mod requirements;
pub(crate) mod run_folder;
pub(crate) mod stamps;
pub(crate) mod stereo;
pub(crate) mod target;
pub(crate) mod twins;

pub use super::axes::{Rigid, enu, enu_from_camera};
pub use super::writing::Intrinsics;
pub use requirements::{judge_lens, require};
pub use run_folder::{PlatformState, RunCamera, RunFolder, RunFrame};
use target::Target;
use twins::TwinNeed;

/// Why a folder was not exported.
#[derive(Debug, Error)]
pub enum DatasetError {
    /// A file of the run cannot be used.
    #[error("{}: {message}", path.display())]
    Input {
        /// The file.
        path: PathBuf,
        /// The location, the problem and the remedy.
        message: String,
    },
    /// The run lacks something; the message names the key that adds it.
    #[error("{0}")]
    Missing(String),
    /// The layout cannot hold something, or the folder holds another export.
    #[error("{0}")]
    Refused(String),
    /// A format of calibrations cannot hold the camera.
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

/// Judges whether a layout can hold a camera.
pub(crate) type Judge = fn(&Calibration) -> Result<(), CalibrationError>;

/// A layout of another program: how it is written, and what it needs beside pictures in colour.
pub(crate) struct Layout {
    /// Writes an export; returns notes for the user.
    pub(crate) write: fn(&ExportJob<'_>) -> Result<Vec<String>, DatasetError>,
    /// Called before anything is rendered, where the layout has a calibration.
    pub(crate) judge: Option<Judge>,
    pub(crate) channels: &'static [Channel],
    pub(crate) twins: &'static [TwinNeed],
    /// Whether pictures and channels are those of a twin without lens, where the camera has one.
    pub(crate) is_pinhole: bool,
    /// Whether it has a pose for each picture.
    pub(crate) has_poses: bool,
    pub(crate) has_tracks: bool,
    /// Whether it holds pictures of any format.
    pub(crate) has_any_pictures: bool,
    /// Whether its stamps are names of files, or have no sign.
    pub(crate) begins_at_zero: bool,
}

impl Layout {
    /// A layout of pictures alone.
    pub(crate) const fn new(write: fn(&ExportJob<'_>) -> Result<Vec<String>, DatasetError>) -> Self {
        Self {
            write,
            judge: None,
            channels: &[],
            twins: &[],
            is_pinhole: false,
            has_poses: false,
            has_tracks: false,
            has_any_pictures: false,
            begins_at_zero: false,
        }
    }
}

/// An export at work.
pub(crate) struct ExportJob<'a> {
    pub(crate) run: &'a RunFolder,
    pub(crate) format: DatasetFormat,
    pub(crate) target: Target<'a>,
    pub(crate) options: &'a ExportOptions,
    /// Whether the folder has parts of this very export.
    pub(crate) keeps: bool,
    /// What the user should know, whatever the layout.
    pub(crate) notes: Vec<String>,
}

impl ExportJob<'_> {
    /// Name of the format, for messages.
    pub(crate) fn name(&self) -> &'static str {
        self.format.name()
    }

    /// Calls `work` for each frame of a camera, on several threads.
    pub(crate) fn each_frame(
        &self,
        camera: &RunCamera,
        work: impl Fn(&RunFrame) -> Result<(), DatasetError> + Sync,
    ) -> Result<(), DatasetError> {
        self.each_of(&camera.frames, work)
    }

    /// Calls `work` for each of these frames, on several threads.
    pub(crate) fn each_of(
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
    pub(crate) fn prefix(&self, i: usize) -> String {
        if self.run.cameras.len() == 1 { String::new() } else { format!("cam{i}/") }
    }
}

/// Exports an output folder into `folder`.
///
/// # Errors
/// The run lacks something that the layout needs, the layout cannot hold something that the run has, or a
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
    let own = (layout(format).write)(&job)?;
    let notes = [job.notes, own].concat();
    record.write(folder, Some(&notes))?;
    Ok(ExportReport { notes, ..report })
}

#[cfg(test)]
mod tests;
