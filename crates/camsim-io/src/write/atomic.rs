//! A file is written whole or not at all.

use std::{
    collections::{HashMap, HashSet},
    ffi::{OsStr, OsString},
    fs, io,
    path::{Path, PathBuf},
    sync::atomic::{AtomicU64, Ordering},
};

use super::WriteError;

/// Writes `bytes` under a temporary name in the same folder (made if need be) and renames; nothing is left
/// behind on failure.
///
/// # Errors
/// With the path, the system's reason and what to do.
pub fn write_atomic(path: &Path, bytes: &[u8]) -> Result<(), WriteError> {
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
    let temporary = folder.join(format!(".{}.{}-{unique}.tmp", name.to_string_lossy(), std::process::id()));
    fs::write(&temporary, bytes).and_then(|()| fs::rename(&temporary, path)).map_err(|source| {
        // The first error is the one to tell; a temporary file that cannot be removed either is only litter.
        let _ = fs::remove_file(&temporary);
        fail(source)
    })
}

/// Removes what killed runs left of these files: temporary names that nobody will rename. Whoever else writes
/// below the folder writes other files.
pub(super) fn sweep(paths: impl Iterator<Item = PathBuf>) {
    let mut by_folder: HashMap<PathBuf, HashSet<OsString>> = HashMap::new();
    for path in paths {
        if let (Some(folder), Some(name)) = (path.parent(), path.file_name()) {
            by_folder.entry(folder.into()).or_default().insert(name.into());
        }
    }
    for (folder, names) in by_folder {
        // A folder that is not there has nothing to sweep; litter that cannot be removed stays litter.
        for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
            if entry.file_name().to_str().and_then(meant).is_some_and(|name| names.contains(OsStr::new(name)))
            {
                let _ = fs::remove_file(entry.path());
            }
        }
    }
}

/// The name that a temporary one stands for.
fn meant(temporary: &str) -> Option<&str> {
    let (name, unique) = temporary.strip_prefix('.')?.strip_suffix(".tmp")?.rsplit_once('.')?;
    let (process, count) = unique.split_once('-')?;
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    (is_number(process) && is_number(count)).then_some(name)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn only_leftovers_of_these_files_go() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let stay = [
            "a.exr",
            ".b.exr.12-0.tmp",
            ".a.exr.tmp",
            ".a.exr.12-.tmp",
            ".a.exr.x-1.tmp",
            "a.exr.12-0.tmp",
            ".a.exr.12-0",
        ];
        let go = [".a.exr.12-0.tmp", ".a.exr.4711-38.tmp"];
        stay.iter().chain(&go).for_each(|name| fs::write(at(name), "x").unwrap());
        sweep([at("a.exr"), at("none/c.exr")].into_iter());
        assert!(stay.iter().all(|name| at(name).is_file()) && go.iter().all(|name| !at(name).exists()));
    }
}
