//! The built-in demo flight: log, terrain, ortho-image, camera, scenario. `assets/README.md` states their
//! licences.

use std::path::{Path, PathBuf};

pub use camsim_assets::FILES;

use crate::write::{WriteError, write_atomic};

/// Writes the built-in files to a folder and returns the path of `demo.toml`. Files that are already there
/// with the same content are left alone.
///
/// # Errors
/// [`WriteError`] names the file.
pub fn unpack(folder: &Path) -> Result<PathBuf, WriteError> {
    for (name, bytes) in FILES {
        let path = folder.join(name);
        if std::fs::read(&path).is_ok_and(|existing| existing == *bytes) {
            continue;
        }
        write_atomic(&path, bytes)?;
    }
    Ok(folder.join("demo.toml"))
}
