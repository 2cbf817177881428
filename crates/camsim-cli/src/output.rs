//! Output to a file or to standard output.

use std::{
    fs::File,
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
};

use anyhow::Context;
use camsim_io::write::{is_special, open_special};

use crate::{
    console::Console,
    failure::{Failure, OrFail},
};

/// Calls `fill` to write to `path`, or to standard output without one. A file appears completely or not at
/// all; devices and pipes are written into.
pub fn write_output(
    path: Option<&Path>,
    console: &mut Console<'_>,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), Failure> {
    match path {
        None => Ok(fill(console.stdout())?),
        Some(path) => write_file(path, fill)
            .with_context(|| format!("{}: cannot be written", path.display()))
            .or_failed(),
    }
}

/// Checks, before the run, that a file can be written. It is not created.
///
/// # Errors
/// The error that [`write_output`] would return.
pub fn check_output(path: &Path) -> Result<(), Failure> {
    if is_special(path) {
        // To open a pipe would wait for its reader.
        return Ok(());
    }
    let checked = part_path(path)
        .and_then(|part| if path.is_dir() { Err(io::ErrorKind::IsADirectory.into()) } else { touch(&part) });
    checked.with_context(|| format!("{}: cannot be written", path.display())).or_failed()
}

/// Checks, before the run, that a folder can be written. It is created.
///
/// # Errors
/// If it cannot be created, or no file can be created in it.
pub fn check_folder(folder: &Path) -> Result<(), Failure> {
    std::fs::create_dir_all(folder)
        .with_context(|| format!("{}: cannot be created; choose another folder with -o", folder.display()))
        .or_failed()?;
    let checked = part_path(&folder.join("camsim")).and_then(|part| touch(&part));
    checked
        .with_context(|| format!("{}: cannot be written to; choose another folder with -o", folder.display()))
        .or_failed()
}

fn touch(part: &Path) -> io::Result<()> {
    File::create(part)?;
    std::fs::remove_file(part)
}

/// Temporary name of a file while it is written.
fn part_path(path: &Path) -> io::Result<PathBuf> {
    let mut name = path.file_name().ok_or(io::ErrorKind::InvalidFilename)?.to_owned();
    name.push(format!(".{}.part", std::process::id()));
    Ok(path.with_file_name(name))
}

fn write_file(path: &Path, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    if let Some(special) = open_special(path)? {
        let mut out = BufWriter::new(special);
        fill(&mut out)?;
        return out.flush();
    }
    let part = part_path(path)?;
    let written = File::create(&part).and_then(|file| {
        let mut file = BufWriter::new(file);
        fill(&mut file)?;
        file.into_inner()?.sync_all()?;
        std::fs::rename(&part, path)
    });
    if written.is_err() {
        // The error of writing is the one to report.
        let _ = std::fs::remove_file(&part);
    }
    written
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn unwritable_output_is_detected_before_the_run() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.csv");
        check_output(&path).unwrap();
        assert!(
            check_output(folder.path()).is_err()
                && check_output(&folder.path().join("none/out.csv")).is_err()
        );
        check_folder(&folder.path().join("a/b")).unwrap();
        std::fs::write(&path, "a file").unwrap();
        assert!(check_folder(&path).is_err() && check_folder(&path.join("below")).is_err());
        check_output(&path).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"a file", "what is there stays");
        assert_eq!(std::fs::read_dir(folder.path().join("a/b")).unwrap().count(), 0);
    }

    #[cfg(unix)]
    #[test]
    fn a_pipe_is_written_into() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        let reader = std::thread::spawn({
            let pipe = pipe.clone();
            move || std::fs::read(pipe).unwrap()
        });
        check_output(&pipe).unwrap();
        write_file(&pipe, |out| out.write_all(b"whole")).unwrap();
        assert_eq!(reader.join().unwrap(), b"whole");
        assert!(is_special(&pipe) && std::fs::read_dir(folder.path()).unwrap().count() == 1);
    }

    #[test]
    fn files_are_complete_or_absent() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.csv");
        let failed = write_file(&path, |out| {
            out.write_all(b"half")?;
            Err(io::ErrorKind::StorageFull.into())
        });
        assert!(failed.is_err());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
        write_file(&path, |out| out.write_all(b"whole")).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"whole");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
