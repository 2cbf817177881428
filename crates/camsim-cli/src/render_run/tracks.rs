//! The tables of tracked points beside the frames.

use std::{collections::BTreeSet, path::Path};

use anyhow::anyhow;
use camsim_io::write::{TrackFiles, WriteError, points_csv, tracks_rows};
use camsim_plan::{PlanError, Planner, Tracks};

use super::Job;
use crate::{
    console::Console,
    failure::{Failure, OrFail},
    progress::waiting,
};

/// Tracked points of a run.
pub struct JobTracks<'a> {
    job: &'a Job<'a>,
    tracks: Tracks,
    files: TrackFiles,
}

impl<'a> JobTracks<'a> {
    /// Chooses the points, and prints remarks on them; `None` if the scenario asks for none.
    pub fn new(
        job: &'a Job<'a>,
        planner: &Planner,
        console: &mut Console<'_>,
    ) -> Result<Option<Self>, Failure> {
        if job.sequence.scenario.output.tracks.is_none() {
            return Ok(None);
        }
        let waiting = waiting("choosing the points to track", console.is_quiet());
        let tracks = Tracks::new(planner, &job.tracks.given);
        waiting.finish_and_clear();
        let tracks = tracks.or_bad_input()?;
        tracks.notes().iter().for_each(|note| console.warn(note));
        console.detail(format_args!("{} points are tracked", tracks.points().len()));
        Ok(Some(Self { job, tracks, files: TrackFiles::new(job.folder) }))
    }

    /// Number of points.
    pub fn points(&self) -> u64 {
        self.tracks.points().len() as u64
    }

    /// Remarks on the choice of the points.
    pub fn notes(&self) -> &[String] {
        self.tracks.notes()
    }

    /// Writes `points.csv`.
    pub fn begin(&self) -> Result<(), Failure> {
        let geodetic =
            |point: &camsim_core::tracks::TrackPoint| self.job.tracks.geodetic(point.position_ned_m);
        self.files.begin(&points_csv(self.tracks.points(), &geodetic)).or_failed()
    }

    /// Writes the rows of a frame, until [`Self::finish`] to a file of their own.
    pub fn write(&self, frame: u64) -> Result<(), WriteError> {
        let rows =
            self.rows(frame).map_err(|error| WriteError::Frame { frame, message: error.to_string() })?;
        self.files.write_part(frame, &rows)
    }

    /// Writes `tracks.csv` for all frames of the folder.
    pub fn finish(&self, frames: &BTreeSet<u64>) -> Result<(), Failure> {
        let mut rows =
            |frame| self.rows(frame).map_err(|error| WriteError::Frame { frame, message: error.to_string() });
        self.files.merge(frames, &mut rows).or_failed()
    }

    fn rows(&self, frame: u64) -> Result<String, PlanError> {
        Ok(tracks_rows(frame, self.job.sequence.epoch_ns, &self.tracks.sightings(frame)?))
    }
}

/// Refuses a folder with tables of these names that something else has made.
pub fn check_folder(folder: &Path, writes_tracks: bool) -> Result<(), Failure> {
    let foreign = if writes_tracks { TrackFiles::new(folder).foreign().or_failed()? } else { None };
    let Some(path) = foreign else { return Ok(()) };
    Err(Failure::bad_input(anyhow!(
        "{} is no table of tracks that camsim made, and would be replaced: choose another folder with -o, or \
         move the file",
        path.display()
    )))
}

/// Removes the tables of another scenario, but none that something else has made.
pub fn remove(folder: &Path) -> Result<(), Failure> {
    let files = TrackFiles::new(folder);
    if files.foreign().or_failed()?.is_some() { Ok(()) } else { files.remove().or_failed() }
}
