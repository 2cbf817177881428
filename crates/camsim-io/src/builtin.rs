//! The flight that ships inside the program: log, terrain, picture, camera, scenario (see `assets/README.md` for their licences).

use std::{
    io,
    path::{Path, PathBuf},
};

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

/// Writes the built-in scene to a folder (files that are there already with the same content stay) and gives the path of `demo.toml`.
///
/// # Errors
/// What the file system says.
pub fn unpack(folder: &Path) -> io::Result<PathBuf> {
    std::fs::create_dir_all(folder)?;
    for (name, bytes) in FILES {
        let path = folder.join(name);
        if std::fs::read(&path).is_ok_and(|there| there == *bytes) {
            continue;
        }
        let partial = folder.join(format!(".{name}.partial"));
        std::fs::write(&partial, bytes)?;
        std::fs::rename(&partial, &path)?;
    }
    Ok(folder.join("demo.toml"))
}
