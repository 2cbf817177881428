//! Atomic writing of files.

use std::{
    collections::{HashMap, HashSet},
    ffi::{OsStr, OsString},
    fs::{self, File, OpenOptions},
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
    sync::atomic::{AtomicU64, Ordering},
};

use super::WriteError;

/// Writes `bytes` under a temporary name in the same folder, which is created if missing, and renames the
/// file. The temporary file is removed on failure. Devices and pipes are written into ([`open_special`]).
///
/// # Errors
/// [`WriteError`] with the path, the error of the system and what to do.
pub fn write_atomic(path: &Path, bytes: &[u8]) -> Result<(), WriteError> {
    write_atomic_with(path, &mut |out| out.write_all(bytes))
}

/// As [`write_atomic`], for contents that `write` gives piece by piece.
pub(crate) fn write_atomic_with(
    path: &Path,
    write: &mut dyn FnMut(&mut BufWriter<File>) -> io::Result<()>,
) -> Result<(), WriteError> {
    let fail = |source: io::Error| WriteError::Io { path: path.into(), source };
    let mut fill = |file: File| {
        let mut out = BufWriter::new(file);
        write(&mut out)?;
        out.flush()
    };
    if let Some(special) = open_special(path).map_err(fail)? {
        return fill(special).map_err(fail);
    }
    let temporary = temporary_path(path)?;
    let written = File::create(&temporary).and_then(fill);
    written.and_then(|()| fs::rename(&temporary, path)).map_err(|source| {
        // The first error is reported; failure to remove the temporary file does no harm.
        let _ = fs::remove_file(&temporary);
        fail(source)
    })
}

/// Whether something is at `path` that is to be written into: a device, a pipe, or a name of standard output.
/// To rename a file over it would take it away from everybody, if the user may.
#[must_use]
pub fn is_special(path: &Path) -> bool {
    let is_other = |kind: fs::Metadata| !kind.is_file() && !kind.is_dir();
    // /dev/stdout is a link, possibly to a file.
    fs::metadata(path).is_ok_and(is_other) || (path.starts_with("/dev") && path.is_symlink())
}

/// Opens what [`is_special`]; `None` otherwise. A pipe waits for its reader.
///
/// # Errors
/// That of the system.
pub fn open_special(path: &Path) -> io::Result<Option<File>> {
    is_special(path).then(|| OpenOptions::new().write(true).open(path)).transpose()
}

/// A temporary name in the folder of `path`, which is created if missing.
pub(crate) fn temporary_path(path: &Path) -> Result<PathBuf, WriteError> {
    let fail = |source: io::Error| WriteError::Io { path: path.into(), source };
    let name = path
        .file_name()
        .ok_or_else(|| fail(io::Error::new(io::ErrorKind::InvalidInput, "the path names no file")))?;
    let folder = path.parent().unwrap_or(Path::new(""));
    if !folder.as_os_str().is_empty() {
        fs::create_dir_all(folder).map_err(fail)?;
    }
    static COUNTER: AtomicU64 = AtomicU64::new(0);
    let unique = COUNTER.fetch_add(1, Ordering::Relaxed);
    Ok(folder.join(format!(".{}.{}-{unique}.tmp", name.to_string_lossy(), std::process::id())))
}

/// Removes the temporary files that killed runs left for these paths. Other processes that write to the same
/// folder are expected to write other paths.
pub(super) fn remove_temporaries(paths: impl Iterator<Item = PathBuf>) {
    let mut by_folder: HashMap<PathBuf, HashSet<OsString>> = HashMap::new();
    for path in paths {
        if let (Some(folder), Some(name)) = (path.parent(), path.file_name()) {
            by_folder.entry(folder.into()).or_default().insert(name.into());
        }
    }
    for (folder, names) in by_folder {
        // A missing folder has no temporary files; one that cannot be removed does no harm.
        for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
            if entry
                .file_name()
                .to_str()
                .and_then(final_name)
                .is_some_and(|name| names.contains(OsStr::new(name)))
            {
                let _ = fs::remove_file(entry.path());
            }
        }
    }
}

/// Removes the temporary files that killed runs left in `folder` and below. No other process may write there.
pub(crate) fn remove_all_temporaries(folder: &Path) {
    // As above, what cannot be read or removed does no harm.
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
        if is_folder {
            remove_all_temporaries(&entry.path());
        } else if entry.file_name().to_str().and_then(final_name).is_some() {
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// The final name of a temporary file; `None` for other files.
fn final_name(temporary: &str) -> Option<&str> {
    let (name, unique) = temporary.strip_prefix('.')?.strip_suffix(".tmp")?.rsplit_once('.')?;
    let (process, count) = unique.split_once('-')?;
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    (is_number(process) && is_number(count)).then_some(name)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[cfg(unix)]
    #[test]
    fn pipes_and_devices_are_written_into_and_stay() {
        use std::os::unix::fs::FileTypeExt;
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe.csv");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        let link = folder.path().join("link.csv");
        std::os::unix::fs::symlink(&pipe, &link).unwrap();
        for path in [&pipe, &link] {
            let reader = std::thread::spawn({
                let pipe = pipe.clone();
                move || fs::read(pipe).unwrap()
            });
            write_atomic(path, b"whole").unwrap();
            assert_eq!(reader.join().unwrap(), b"whole");
        }
        assert!(fs::metadata(&pipe).unwrap().file_type().is_fifo() && link.is_symlink());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2, "no temporary file stays");
        assert!(is_special(Path::new("/dev/null")) && is_special(Path::new("/dev/stdout")));
        let file = folder.path().join("file.csv");
        fs::write(&file, "old").unwrap();
        for path in [file.as_path(), folder.path(), &folder.path().join("none")] {
            assert!(!is_special(path), "{}", path.display());
        }
    }

    #[test]
    fn only_temporaries_of_the_given_paths_are_removed() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let kept = [
            "a.exr",
            ".b.exr.12-0.tmp",
            ".a.exr.tmp",
            ".a.exr.12-.tmp",
            ".a.exr.x-1.tmp",
            "a.exr.12-0.tmp",
            ".a.exr.12-0",
        ];
        let removed = [".a.exr.12-0.tmp", ".a.exr.4711-38.tmp"];
        kept.iter().chain(&removed).for_each(|name| fs::write(path(name), "x").unwrap());
        remove_temporaries([path("a.exr"), path("none/c.exr")].into_iter());
        assert!(
            kept.iter().all(|name| path(name).is_file()) && removed.iter().all(|name| !path(name).exists())
        );
    }
}
