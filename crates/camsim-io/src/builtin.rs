//! The built-in demo flight: log, terrain, ortho-image, camera, scenario. `assets/README.md` states their
//! licences.

use std::path::{Path, PathBuf};

use camsim_assets::FILES;

use crate::write::{WriteError, write_atomic};

/// Writes the built-in files to a folder and returns the path of `demo.toml`. Files that are already there
/// with the same content are left alone.
///
/// # Errors
/// [`WriteError`] names the file.
pub fn unpack(folder: &Path) -> Result<PathBuf, WriteError> {
    for (name, _) in FILES {
        write_file(name, folder)?;
    }
    Ok(folder.join("demo.toml"))
}

/// Writes one of the built-in files to a folder, as [`unpack`], and returns its path.
///
/// # Errors
/// [`WriteError`] names the file.
pub fn write_file(name: &str, folder: &Path) -> Result<PathBuf, WriteError> {
    let path = folder.join(name);
    let content = FILES.iter().find(|(of, _)| *of == name).map_or(&[][..], |(_, bytes)| bytes);
    if !std::fs::read(&path).is_ok_and(|existing| existing == content) {
        write_atomic(&path, content)?;
    }
    Ok(path)
}
