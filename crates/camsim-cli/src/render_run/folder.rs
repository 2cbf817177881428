//! Checks of the output folder before a run, and a lock against concurrent runs.

use std::{
    fs::{File, OpenOptions, create_dir_all},
    path::Path,
};

use anyhow::anyhow;
use camsim_core::scenario::Scenario;
use camsim_io::{
    manifest::{BY_OTHER_SCENARIO, ResumeError, check_burst, check_resume, check_resume_key},
    write::{FrameFiles, unlisted_frame_files},
};

use super::{Job, pictures::Pictures};
use crate::{
    console::Console,
    failure::{Failure, OrFail},
};

/// State of the frame files in a folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FolderState {
    /// They belong to this scenario, or there are none.
    Ours,
    /// They belong to another scenario, and all of them will be replaced.
    Replaced,
}

/// Checks the folder of pictures with [`folder_state`], and prints warnings.
pub fn check(
    job: &Job<'_>,
    pictures: &Pictures,
    adapter: &str,
    console: &mut Console<'_>,
) -> Result<(), Failure> {
    match folder_state(job, pictures)? {
        FolderState::Replaced if pictures.any_exists(job.frames) => {
            console.warn(format_args!(
                "{} belongs to another scenario, or its input files have changed: its frames are replaced",
                pictures.folder.display()
            ));
        }
        FolderState::Ours if job.resume => warn_of_adapter(&pictures.folder, adapter, console),
        _ => {}
    }
    Ok(())
}

/// Determines the state of a folder. Frames of different scenarios never mix in one folder.
pub fn folder_state(job: &Job<'_>, pictures: &Pictures) -> Result<FolderState, Failure> {
    let folder = &pictures.folder;
    let checked = check_resume(folder, &pictures.sequence.scenario, &pictures.inputs);
    let is_burst_of_others = check_burst(folder, pictures.twin.as_ref()).err();
    // Other files of the same frames do not contradict each other.
    let is_ours = match &checked {
        Ok(is_ours) => *is_ours,
        Err(ResumeError::Differs { made: BY_OTHER_SCENARIO, differences, .. }) => {
            !job.resume && differences.iter().all(|text| is_of_files(text))
        }
        Err(_) => false,
    };
    if is_ours && is_burst_of_others.is_none() {
        return Ok(FolderState::Ours);
    }
    let error = checked.err().filter(|_| !is_ours).or(is_burst_of_others);
    match error {
        Some(error) if job.resume => Err(Failure::bad_input(error)),
        Some(error @ ResumeError::Differs { .. }) => {
            refuse_files(&pictures.files_of_others(job.frames), &error.reason())?;
            Ok(FolderState::Replaced)
        }
        _ => {
            let others = pictures.files_of_others(job.frames);
            refuse_origin(folder, &others, job.resume && pictures.any_exists(job.frames))?;
            Ok(FolderState::Replaced)
        }
    }
}

/// Whether a key only selects files, without changing their contents.
fn is_of_files(difference: &str) -> bool {
    const OUTPUT: [&str; 5] = [
        "output.channels was ",
        "output.format was ",
        "output.palette was ",
        "output.tracks",
        "output.trajectory was ",
    ];
    const SENSORS: [&str; 4] = ["imu was ", "gnss was ", "barometer was ", "magnetometer was "];
    OUTPUT.iter().chain(&SENSORS).any(|key| difference.starts_with(key))
}

/// Refuses a folder with frame files other than those that will be replaced.
pub fn refuse_others(folder: &Path, frames: &[u64], files: &FrameFiles, why: &str) -> Result<(), Failure> {
    refuse_files(&unlisted_frame_files(folder, &files.paths(frames)), why)
}

fn refuse_files(others: &[String], why: &str) -> Result<(), Failure> {
    let Some(first) = others.first() else { return Ok(()) };
    let count = others.len();
    Err(Failure::bad_input(anyhow!(
        "{why}, and {count} files of other frames would remain ({first} is the first): choose another folder \
         with -o, or remove that one"
    )))
}

/// Refuses frames of unknown origin, unless they will be replaced.
pub fn refuse_unknown(
    folder: &Path,
    frames: &[u64],
    files: &FrameFiles,
    is_resumed: bool,
) -> Result<(), Failure> {
    let others = unlisted_frame_files(folder, &files.paths(frames));
    refuse_origin(folder, &others, is_resumed && frames.iter().any(|&frame| files.exist(frame)))
}

fn refuse_origin(folder: &Path, others: &[String], would_keep: bool) -> Result<(), Failure> {
    let unknown = format!("{} has frames, but no run.json that describes their origin", folder.display());
    if would_keep {
        return Err(Failure::bad_input(anyhow!(
            "{unknown}: render without --resume, or into another folder"
        )));
    }
    refuse_files(others, &unknown)
}

fn warn_of_adapter(folder: &Path, adapter: &str, console: &mut Console<'_>) {
    if let Err(ResumeError::Differs { path, .. }) =
        check_resume_key(folder, "adapter", "by another adapter", &adapter)
    {
        console.warn(format_args!(
            "{} was rendered by another adapter than {adapter}: existing frames are kept, and differ from \
             new ones by rounding",
            path.display()
        ));
    }
}

/// Files that this scenario could have in the folder, for any channels.
pub fn files_of(scenario: &Scenario, folder: &Path) -> FrameFiles {
    FrameFiles::new(folder, &scenario.output, scenario.camera.photometric.output)
}

/// Locks the folder's tables against other runs until dropped. There is no lock if the file system has none.
#[derive(Debug)]
pub struct Lock(#[allow(dead_code, reason = "closing it unlocks")] Option<File>);

impl Lock {
    /// Waits for the lock.
    pub fn take(folder: &Path) -> Result<Self, Failure> {
        create_dir_all(folder)
            .map_err(|error| {
                anyhow!("{}: cannot be created: {error}; choose another folder with -o", folder.display())
            })
            .or_failed()?;
        let locked = |file: std::io::Result<File>| file.and_then(|file| file.lock().map(|()| file)).ok();
        // The folder itself is locked, so that no file is left in it; some systems lock only writable files.
        let file = || OpenOptions::new().create(true).append(true).open(folder.join(".camsim.lock"));
        Ok(Self(locked(File::open(folder)).or_else(|| locked(file()))))
    }
}
