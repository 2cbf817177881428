//! The output folder before a run: whether what is in it may stay, and one run at a time where it is changed.

use std::{
    fs::{File, OpenOptions, create_dir_all},
    path::Path,
};

use anyhow::anyhow;
use camsim_core::scenario::Scenario;
use camsim_io::{
    inputs::Inputs,
    manifest::{BY_SCENARIO, ResumeError, check_resume, check_resume_of},
    write::FrameFiles,
};

use super::Job;
use crate::{
    console::Console,
    failure::{Failure, OrFail},
};

/// What holds of the files of frames in a folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Standing {
    /// They are this scenario's, or there are none.
    Ours,
    /// They are another scenario's, and all of them will be replaced.
    Replaced,
}

/// As [`standing`], and says what the user should know of it.
pub fn check(
    job: &Job<'_>,
    files: &FrameFiles,
    inputs: &Inputs,
    adapter: &str,
    console: &mut Console<'_>,
) -> Result<(), Failure> {
    match standing(job, files, inputs)? {
        Standing::Replaced if job.frames.iter().any(|&frame| files.exist(frame)) => {
            console.warn(format_args!(
                "{} is of another scenario, or of files that have changed: its frames are replaced",
                job.folder.display()
            ));
        }
        Standing::Ours if job.resume => warn_of_adapter(job, adapter, console),
        _ => {}
    }
    Ok(())
}

/// Frames of another scenario are never taken for this one's, nor left between them.
pub fn standing(job: &Job<'_>, files: &FrameFiles, inputs: &Inputs) -> Result<Standing, Failure> {
    let error = match check_resume(job.folder, &job.sequence.scenario, inputs) {
        Ok(true) => return Ok(Standing::Ours),
        Ok(false) => None,
        Err(error) => Some(error),
    };
    match error {
        // Other files of the same frames: neither makes the other untrue.
        Some(ResumeError::Differs { made: BY_SCENARIO, differences, .. })
            if !job.resume && differences.iter().all(|text| is_of_files(text)) =>
        {
            Ok(Standing::Ours)
        }
        Some(error) if job.resume => Err(Failure::bad_input(error)),
        Some(error @ ResumeError::Differs { .. }) => {
            refuse_others(job.frames, files, &error.what())?;
            Ok(Standing::Replaced)
        }
        _ => {
            refuse_unknown(job.folder, job.frames, files, job.resume)?;
            Ok(Standing::Replaced)
        }
    }
}

/// Keys that choose files and change none.
fn is_of_files(difference: &str) -> bool {
    ["output.channels was ", "output.format was "].iter().any(|key| difference.starts_with(key))
}

/// Refuses a folder with files of frames other than these, which are to be replaced.
pub fn refuse_others(frames: &[u64], files: &FrameFiles, why: &str) -> Result<(), Failure> {
    let others = files.others(frames);
    let Some(first) = others.first() else { return Ok(()) };
    let count = others.len();
    Err(Failure::bad_input(anyhow!(
        "{why}, and {count} files of frames, {first} the first, would stay between this run's: choose another folder with -o, or remove that one"
    )))
}

/// Refuses frames of which nobody knows what made them, unless they are to be replaced.
pub fn refuse_unknown(
    folder: &Path,
    frames: &[u64],
    files: &FrameFiles,
    is_resumed: bool,
) -> Result<(), Failure> {
    let unknown = format!("{} has frames and no run.json that says what made them", folder.display());
    if is_resumed && frames.iter().any(|&frame| files.exist(frame)) {
        return Err(Failure::bad_input(anyhow!(
            "{unknown}: render without --resume, or into another folder"
        )));
    }
    refuse_others(frames, files, &unknown)
}

fn warn_of_adapter(job: &Job<'_>, adapter: &str, console: &mut Console<'_>) {
    if let Err(ResumeError::Differs { path, .. }) =
        check_resume_of(job.folder, "adapter", "by another adapter", &adapter)
    {
        console.warn(format_args!(
            "{} was made by another adapter than {adapter}: frames that are there stay, and differ from what this one would make by what rounding does",
            path.display()
        ));
    }
}

/// Files that this scenario would have in the folder, whatever its channels.
pub fn files_of(scenario: &Scenario, folder: &Path) -> FrameFiles {
    FrameFiles::new(folder, &scenario.output, scenario.camera.photometric.output)
}

/// Holds the folder's tables against other runs in it until it is dropped. Where a file system knows no locks
/// there is none.
#[derive(Debug)]
pub struct Lock(#[allow(dead_code, reason = "closing it unlocks")] Option<File>);

impl Lock {
    /// Waits for whoever has it.
    pub fn take(folder: &Path) -> Result<Self, Failure> {
        create_dir_all(folder)
            .map_err(|error| {
                anyhow!("{}: cannot be made: {error}; choose another folder with -o", folder.display())
            })
            .or_failed()?;
        let locked = |file: std::io::Result<File>| file.and_then(|file| file.lock().map(|()| file)).ok();
        // The folder itself, so that nothing is left in it; some systems lock only what can be written.
        let file = || OpenOptions::new().create(true).append(true).open(folder.join(".camsim.lock"));
        Ok(Self(locked(File::open(folder)).or_else(|| locked(file()))))
    }
}
