//! Paths in output folders: relative to the file that holds them, so that a folder can be moved together with
//! what it names.

use std::{
    io,
    path::{Component, Path, PathBuf},
};

use camsim_core::scenario::{CameraSpec, Scenario};

use crate::{
    scenario_file::for_each_path,
    write::{WriteError, write_atomic},
};

/// Folder of copies in an output folder.
const COPIES: &str = "inputs";

/// `path` as a file in `folder` names it, with `/` between its parts: relative where both are below one
/// folder other than the root, absolute where they have nothing in common but that. What is no file or folder
/// (a pipe) keeps its name.
#[must_use]
pub fn relative_to(path: &Path, folder: &Path) -> PathBuf {
    if path.metadata().is_ok_and(|of| !of.is_file() && !of.is_dir()) {
        return std::path::absolute(path).unwrap_or_else(|_| path.into());
    }
    let (path, folder) = (resolved(path), resolved(folder));
    let common = path.components().zip(folder.components()).take_while(|(a, b)| a == b).count();
    // Of the root, and of a drive's letter before it, nothing is known that would move along.
    let shared = path.components().take(common).filter(|part| matches!(part, Component::Normal(_))).count();
    if shared == 0 {
        return path;
    }
    let up = folder.components().skip(common).map(|_| "..".to_owned());
    let down = path.components().skip(common).map(|part| part.as_os_str().to_string_lossy().into_owned());
    let parts: Vec<String> = up.chain(down).collect();
    if parts.is_empty() { ".".into() } else { parts.join("/").into() }
}

/// Absolute and without links as far as it exists.
fn resolved(path: &Path) -> PathBuf {
    let absolute = std::path::absolute(path).unwrap_or_else(|_| path.into());
    for there in absolute.ancestors() {
        if let Ok(found) = there.canonicalize() {
            return lexical(found.join(absolute.strip_prefix(there).unwrap_or(Path::new(""))));
        }
    }
    lexical(absolute)
}

/// Without `.` and `..`.
fn lexical(path: PathBuf) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => {
                plain.pop();
            }
            Component::CurDir => {}
            part => plain.push(part),
        }
    }
    plain
}

/// `scenario` with its paths as a file in `folder` names them.
///
/// # Errors
/// A path that is not Unicode, which no text file can hold.
pub fn portable_scenario(scenario: &Scenario, folder: &Path) -> Result<Scenario, serde_json::Error> {
    let mut tree = serde_json::to_value(scenario)?;
    for_each_path(&mut tree, &mut |_, path| {
        *path = relative_to(Path::new(path), folder).to_string_lossy().into_owned()
    });
    serde_json::from_value(tree)
}

/// Writes `folder/camera.toml`, which reads back to `camera` wherever the folder is: vignette and zoom track
/// are in the folder, as copies in `inputs/` where they were not in it before.
///
/// # Errors
/// A file cannot be read or written.
pub fn write_camera(folder: &Path, camera: &CameraSpec) -> Result<(), WriteError> {
    let mut own = camera.clone();
    for (path, name) in [(&mut own.photometric.vignette, "vignette"), (&mut own.zoom_track, "zoom")] {
        if let Some(path) = path {
            *path = kept_in(folder, path, name)?;
        }
    }
    let target = folder.join("camera.toml");
    let encode =
        |error: toml::ser::Error| WriteError::Encode { path: target.clone(), message: error.to_string() };
    let text = toml::to_string(&own).map_err(encode)?;
    let text = format!(
        "# The camera of this run: `camera = \"camera.toml\"` in a scenario uses it. Paths are relative to \
            this file.\n{text}"
    );
    write_atomic(&target, text.as_bytes())
}

/// A path relative to `folder`, below it.
fn kept_in(folder: &Path, path: &Path, name: &str) -> Result<PathBuf, WriteError> {
    let relative = relative_to(path, folder);
    if relative.components().all(|part| matches!(part, Component::Normal(_))) {
        return Ok(relative);
    }
    let bytes = std::fs::read(path).map_err(|source| WriteError::Copy { path: path.into(), source })?;
    let ending = path.extension().map_or(String::new(), |ending| format!(".{}", ending.to_string_lossy()));
    let copy = format!("{COPIES}/{name}{ending}");
    let target = folder.join(&copy);
    if !same(&target, &bytes) {
        write_atomic(&target, &bytes)?;
    }
    Ok(copy.into())
}

fn same(path: &Path, bytes: &[u8]) -> bool {
    let read = || -> io::Result<Vec<u8>> { std::fs::read(path) };
    read().is_ok_and(|there| there == bytes)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]
    use super::*;
    use crate::{camera_file::read_camera_toml, scenario_file::read_camera};
    use camsim_core::scenario::ZoomSpec;

    #[test]
    fn paths_lead_from_the_folder_that_holds_them() {
        let base = tempfile::tempdir().unwrap();
        let at = |name: &str| base.path().join(name);
        std::fs::create_dir_all(at("runs/out/scene")).unwrap();
        std::fs::create_dir_all(at("data")).unwrap();
        for file in ["data/dem.tif", "runs/out/scene/a.csv"] {
            std::fs::write(at(file), "x").unwrap();
        }
        for (path, folder, wanted) in [
            ("data/dem.tif", "runs/out", "../../data/dem.tif"),
            ("runs/out/scene/a.csv", "runs/out", "scene/a.csv"),
            ("runs/../data/./dem.tif", "runs/out", "../../data/dem.tif"),
            ("data/dem.tif", "data", "dem.tif"),
            // Neither has to be there.
            ("data/none/x.csv", "runs/new/deep", "../../../data/none/x.csv"),
            ("runs/out", "runs/out", "."),
        ] {
            let found = relative_to(&at(path), &at(folder));
            assert_eq!(found, Path::new(wanted), "{path} from {folder}");
        }
        // Nothing in common but the root.
        assert_eq!(
            relative_to(Path::new("/no-such-place/dem.tif"), &at("runs")),
            Path::new("/no-such-place/dem.tif")
        );
    }

    #[cfg(unix)]
    #[test]
    fn links_are_followed_before_paths_are_compared() {
        let base = tempfile::tempdir().unwrap();
        let at = |name: &str| base.path().join(name);
        std::fs::create_dir_all(at("disk/deep/out")).unwrap();
        std::fs::write(at("log.csv"), "the log").unwrap();
        std::os::unix::fs::symlink(at("disk/deep/out"), at("out")).unwrap();
        let relative = relative_to(&at("log.csv"), &at("out"));
        assert_eq!(std::fs::read_to_string(at("out").join(relative)).unwrap(), "the log");
        // A pipe is named as it is.
        assert_eq!(relative_to(Path::new("/dev/null"), &at("out")), Path::new("/dev/null"));
    }

    #[test]
    fn a_camera_takes_its_files_along() {
        let base = tempfile::tempdir().unwrap();
        let at = |name: &str| base.path().join(name);
        std::fs::write(at("v.png"), "a picture").unwrap();
        std::fs::create_dir_all(at("out/scene")).unwrap();
        std::fs::write(at("out/scene/zoom.csv"), "t_s,zoom\n").unwrap();
        let zoom = [1.0, 2.0]
            .map(|at| ZoomSpec {
                at,
                focal_px: [500.0 * at; 2],
                principal_point_px: None,
                coefficients: Vec::new(),
            })
            .to_vec();
        let mut camera =
            CameraSpec { zoom, zoom_track: Some(at("out/scene/zoom.csv")), ..CameraSpec::default() };
        camera.photometric.vignette = Some(at("v.png"));
        write_camera(&at("out"), &camera).unwrap();
        std::fs::remove_file(at("v.png")).unwrap();
        std::fs::rename(at("out"), at("elsewhere")).unwrap();
        for read in [
            read_camera(&at("elsewhere/camera.toml")).unwrap(),
            read_camera_toml(&at("elsewhere/camera.toml")).unwrap(),
        ] {
            let vignette = read.photometric.vignette.unwrap();
            assert_eq!(vignette, at("elsewhere/inputs/vignette.png"));
            assert_eq!(std::fs::read_to_string(vignette).unwrap(), "a picture");
            assert_eq!(read.zoom_track.unwrap(), at("elsewhere/scene/zoom.csv"));
        }
        let gone = CameraSpec { zoom_track: Some(at("none.csv")), ..CameraSpec::default() };
        let error = write_camera(&at("elsewhere"), &gone).unwrap_err().to_string();
        assert!(error.contains("none.csv") && error.contains("camera.toml"), "{error}");
    }
}
