//! The flight that ships inside the program: log, terrain, picture, camera, scenario (see `assets/README.md`
//! for their licences).

use std::path::{Path, PathBuf};

use crate::write::{WriteError, write_atomic};

macro_rules! embedded {
    ($($name:literal),* $(,)?) => {
        const FILES: &[(&str, &[u8])] = &[$(($name, include_bytes!(concat!("../../../assets/", $name)))),*];
    };
}

embedded![
    "README.md",
    "acircles.png",
    "demo.toml",
    "demo_camera.toml",
    "demo_dem.tif",
    "demo_flight.csv",
    "demo_ortho.jpg",
    "pattern.toml",
    "vignette.png",
];

/// Writes the built-in scene to a folder (files that are there already with the same content stay) and gives
/// the path of `demo.toml`.
///
/// # Errors
/// [`WriteError`] names the file.
pub fn unpack(folder: &Path) -> Result<PathBuf, WriteError> {
    for (name, bytes) in FILES {
        let path = folder.join(name);
        if std::fs::read(&path).is_ok_and(|there| there == *bytes) {
            continue;
        }
        write_atomic(&path, bytes)?;
    }
    Ok(folder.join("demo.toml"))
}
