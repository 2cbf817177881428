//! Joins the output folders of the shards of a run into the folder that one run would have made.
//!
//! Frames are linked, or copied where links are impossible. Tables with a row for each frame are joined in the order
//! of frames. Files that every shard has, such as `camera.toml`, must have the same content. `run.json` is written
//! last, so that a merge that was interrupted can be repeated.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs::{self, File},
    io::{self, BufReader, Read},
    path::{Path, PathBuf},
};

use thiserror::Error;

use crate::write::{FRAMES_CSV, TRACKS_CSV, WriteError};

mod checksums;
mod runs;
mod tables;
#[cfg(test)]
mod tests;

pub use checksums::{CHECKSUMS_FILE, write_checksums};

/// Why shards cannot be merged.
#[derive(Debug, Error)]
pub enum MergeError {
    /// A file or folder cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Error of the system.
        source: io::Error,
    },
    /// The shards are not those of one run, or not complete.
    #[error("{0}")]
    Shards(String),
    /// A file is damaged.
    #[error("{}: {message}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        message: String,
    },
    /// The merged folder cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}

/// What was merged.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct MergeReport {
    /// Number of shards.
    pub shards: u64,
    /// Number of frames.
    pub frames: u64,
    /// Number of files of frames.
    pub files: u64,
    /// How many of the shards had checksums, all of which were right.
    pub checked: u64,
    /// What users should know.
    pub warnings: Vec<String>,
}

/// Merges the folders of all shards of a run into `out`.
///
/// # Errors
/// A shard is missing, unfinished, or of another run; a file does not have its checksum; `out` has a run already.
pub fn merge(shards: &[PathBuf], out: &Path) -> Result<MergeReport, MergeError> {
    if out.join("run.json").exists() {
        return Err(MergeError::Shards(format!(
            "{} has a run already: choose another folder, or remove that one",
            out.display()
        )));
    }
    let runs = runs::read(shards)?;
    let mut report = MergeReport { shards: runs.len() as u64, ..MergeReport::default() };
    for run in &runs {
        report.checked += u64::from(checksums::check(&run.folder)?);
    }
    let mut folders_of: BTreeMap<PathBuf, Vec<&Path>> = BTreeMap::new();
    for run in &runs {
        for file in files_below(&run.folder)? {
            folders_of.entry(file).or_default().push(&run.folder);
        }
    }
    let mut run_files = BTreeSet::new();
    for (file, folders) in &folders_of {
        let sources: Vec<PathBuf> = folders.iter().map(|folder| folder.join(file)).collect();
        let target = out.join(file);
        match file.file_name().and_then(|name| name.to_str()).unwrap_or_default() {
            "run.json" => {
                run_files.insert(file.clone());
            }
            FRAMES_CSV | TRACKS_CSV => tables::join(&sources, &target)?,
            _ if sources.len() == 1 => {
                link(&sources[0], &target)?;
                report.files += 1;
            }
            _ => {
                check_equal(&sources)?;
                link(&sources[0], &target)?;
            }
        }
    }
    let adapters: BTreeSet<&str> = runs.iter().map(|run| run.manifest.adapter.as_str()).collect();
    if adapters.len() > 1 {
        let adapters: Vec<&str> = adapters.into_iter().collect();
        report.warnings.push(format!(
            "the shards were rendered by different adapters, whose frames differ by rounding: {}",
            adapters.join("; ")
        ));
    }
    // Those of twins and cameras first: the run is merged when its own is there.
    let mut run_files: Vec<&PathBuf> = run_files.iter().collect();
    run_files.sort_by_key(|file| std::cmp::Reverse(file.components().count()));
    for file in run_files {
        report.frames = runs::write_joined(&folders_of[file], file, out)?;
    }
    Ok(report)
}

/// Files below a folder that belong to the merged run, by paths relative to it.
fn files_below(folder: &Path) -> Result<Vec<PathBuf>, MergeError> {
    let mut files = Vec::new();
    let mut folders = vec![PathBuf::new()];
    while let Some(below) = folders.pop() {
        let path = folder.join(&below);
        let fail = |source| MergeError::Read { path: path.clone(), source };
        for entry in fs::read_dir(&path).map_err(fail)? {
            let entry = entry.map_err(fail)?;
            let file = below.join(entry.file_name());
            if entry.path().is_dir() {
                folders.push(file);
            } else if !is_of_shard(&entry.file_name().to_string_lossy()) {
                files.push(file);
            }
        }
    }
    Ok(files)
}

/// Whether a file says something of the shard alone: temporary files, counts, checksums.
fn is_of_shard(name: &str) -> bool {
    name.starts_with('.')
        || name == CHECKSUMS_FILE
        || (name.starts_with("run.") && name.ends_with(".json") && name != "run.json")
}

/// Checks that files have the same content.
fn check_equal(paths: &[PathBuf]) -> Result<(), MergeError> {
    let fail = |path: &Path, source| MergeError::Read { path: path.into(), source };
    let open = |path: &PathBuf| File::open(path).map(BufReader::new).map_err(|error| fail(path, error));
    for path in &paths[1..] {
        let (mut first, mut other) = (open(&paths[0])?, open(path)?);
        let (mut a, mut b) = (Vec::new(), Vec::new());
        loop {
            a.clear();
            b.clear();
            first.by_ref().take(1 << 20).read_to_end(&mut a).map_err(|error| fail(&paths[0], error))?;
            other.by_ref().take(1 << 20).read_to_end(&mut b).map_err(|error| fail(path, error))?;
            if a != b {
                return Err(MergeError::File {
                    path: path.clone(),
                    message: format!(
                        "differs from {}, where all shards of a run have the same: render the shard again",
                        paths[0].display()
                    ),
                });
            }
            if a.is_empty() {
                break;
            }
        }
    }
    Ok(())
}

/// Links a file, or copies it where the file system has no links. A file of an interrupted merge is replaced.
fn link(from: &Path, to: &Path) -> Result<(), MergeError> {
    let fail = |source| MergeError::Write(WriteError::Io { path: to.into(), source });
    if let Some(folder) = to.parent() {
        fs::create_dir_all(folder).map_err(fail)?;
    }
    match fs::remove_file(to) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(fail(error)),
        _ => {}
    }
    if fs::hard_link(from, to).is_ok() {
        return Ok(());
    }
    let temporary = crate::write::temporary_path(to)?;
    let copied = fs::copy(from, &temporary).and_then(|_| fs::rename(&temporary, to));
    copied.map_err(|error| {
        // The first error is reported; failure to remove the temporary file does no harm.
        let _ = fs::remove_file(&temporary);
        fail(error)
    })
}
