//! Relative paths in output folders, so that a folder can be moved together with its inputs.

use std::path::{Component, Path, PathBuf};

use camsim_core::scenario::{CameraSpec, Rig, Scenario};

use crate::{
    scenario_file::{for_each_path, rig_json, rig_table},
    write::{WriteError, write_atomic},
};

/// Folder for copies of inputs, within an output folder.
const COPIES: &str = "inputs";

/// `path` relative to `folder`, with `/` between its parts. Absolute if they have only the root in common, or
/// if `path` is neither file nor folder (a pipe).
#[must_use]
pub fn relative_to(path: &Path, folder: &Path) -> PathBuf {
    if path.metadata().is_ok_and(|metadata| !metadata.is_file() && !metadata.is_dir()) {
        return std::path::absolute(path).unwrap_or_else(|_| path.into());
    }
    let (path, folder) = (resolved(path), resolved(folder));
    let common = path.components().zip(folder.components()).take_while(|(a, b)| a == b).count();
    // Folders below a common root or drive letter are unlikely to be moved together.
    let shared = path.components().take(common).filter(|part| matches!(part, Component::Normal(_))).count();
    if shared == 0 {
        return path;
    }
    let up = folder.components().skip(common).map(|_| "..".to_owned());
    let down = path.components().skip(common).map(|part| part.as_os_str().to_string_lossy().into_owned());
    let parts: Vec<String> = up.chain(down).collect();
    if parts.is_empty() { ".".into() } else { parts.join("/").into() }
}

/// The absolute path, with symbolic links resolved as far as it exists.
pub(crate) fn resolved(path: &Path) -> PathBuf {
    let absolute = std::path::absolute(path).unwrap_or_else(|_| path.into());
    for ancestor in absolute.ancestors() {
        if let Ok(canonical) = ancestor.canonicalize() {
            return normalised(canonical.join(absolute.strip_prefix(ancestor).unwrap_or(Path::new(""))));
        }
    }
    normalised(absolute)
}

/// The path without `.` and `..`, by its text alone.
fn normalised(path: PathBuf) -> PathBuf {
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

/// `scenario` with paths relative to `folder`.
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

/// As [`portable_scenario`], for all cameras of a rig, as JSON.
///
/// # Errors
/// As [`portable_scenario`].
pub fn portable_rig(rig: &Rig, folder: &Path) -> Result<serde_json::Value, serde_json::Error> {
    rig_json(&rig.clone().try_map(|scenario| portable_scenario(&scenario, folder))?)
}

/// Writes `folder/camera.toml`. Vignette and zoom track that are not in the folder are copied to `inputs/`,
/// so that the folder can be moved.
///
/// # Errors
/// A file cannot be read or written.
pub fn write_camera(folder: &Path, camera: &CameraSpec) -> Result<(), WriteError> {
    let mut portable = camera.clone();
    let lens_table = portable.lens_table.as_mut().map(|table| &mut table.path);
    let kernel = portable.point_spread.as_mut().and_then(|spread| spread.kernel.as_mut());
    let files = [
        (portable.photometric.vignette.as_mut(), "vignette"),
        (portable.zoom_track.as_mut(), "zoom"),
        (lens_table, "lens"),
        (kernel.map(|file| &mut file.path), "kernel"),
    ];
    for (path, name) in files {
        if let Some(path) = path {
            *path = path_within(folder, path, name)?;
        }
    }
    let target = folder.join("camera.toml");
    let encode =
        |error: toml::ser::Error| WriteError::Encode { path: target.clone(), message: error.to_string() };
    let text = toml::to_string(&portable).map_err(encode)?;
    let text = format!(
        "# The camera of this run: `camera = \"camera.toml\"` in a scenario uses it. Paths are relative to \
            this file.\n{text}"
    );
    write_atomic(&target, text.as_bytes())
}

/// Writes a scenario file with paths relative to it.
///
/// # Errors
/// A path that is not Unicode; the file cannot be written.
pub fn write_scenario(path: &Path, rig: &Rig) -> Result<(), WriteError> {
    let encode = |message: String| WriteError::Encode { path: path.into(), message };
    let folder = path.parent().unwrap_or(Path::new(""));
    let portable = rig
        .clone()
        .try_map(|scenario| portable_scenario(&scenario, folder))
        .map_err(|error| encode(error.to_string()))?;
    let text = rig_table(&portable).and_then(|table| toml::to_string(&table));
    write_atomic(path, text.map_err(|error| encode(error.to_string()))?.as_bytes())
}

/// The path of a file within `folder`, relative to it. A file elsewhere is copied to `inputs/`.
fn path_within(folder: &Path, path: &Path, name: &str) -> Result<PathBuf, WriteError> {
    let relative = relative_to(path, folder);
    if relative.components().all(|part| matches!(part, Component::Normal(_))) {
        return Ok(relative);
    }
    let bytes = std::fs::read(path).map_err(|source| WriteError::Copy { path: path.into(), source })?;
    let ending = path.extension().map_or(String::new(), |ending| format!(".{}", ending.to_string_lossy()));
    let copy = format!("{COPIES}/{name}{ending}");
    let target = folder.join(&copy);
    if !has_content(&target, &bytes) {
        write_atomic(&target, &bytes)?;
    }
    Ok(copy.into())
}

fn has_content(path: &Path, bytes: &[u8]) -> bool {
    std::fs::read(path).is_ok_and(|existing| existing == bytes)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]
    use super::*;
    use crate::{formats::reading::read_camera_toml, scenario_file::read_camera};
    use camsim_core::scenario::ZoomSpec;

    #[test]
    fn paths_are_relative_to_the_folder() {
        let base = tempfile::tempdir().unwrap();
        let path = |name: &str| base.path().join(name);
        std::fs::create_dir_all(path("runs/out/scene")).unwrap();
        std::fs::create_dir_all(path("data")).unwrap();
        for file in ["data/dem.tif", "runs/out/scene/a.csv"] {
            std::fs::write(path(file), "x").unwrap();
        }
        for (file, folder, wanted) in [
            ("data/dem.tif", "runs/out", "../../data/dem.tif"),
            ("runs/out/scene/a.csv", "runs/out", "scene/a.csv"),
            ("runs/../data/./dem.tif", "runs/out", "../../data/dem.tif"),
            ("data/dem.tif", "data", "dem.tif"),
            // Neither file nor folder has to exist.
            ("data/none/x.csv", "runs/new/deep", "../../../data/none/x.csv"),
            ("runs/out", "runs/out", "."),
        ] {
            let relative = relative_to(&path(file), &path(folder));
            assert_eq!(relative, Path::new(wanted), "{file} from {folder}");
        }
        // Only the root is common.
        assert_eq!(
            relative_to(Path::new("/no-such-place/dem.tif"), &path("runs")),
            Path::new("/no-such-place/dem.tif")
        );
    }

    #[cfg(unix)]
    #[test]
    fn links_are_resolved_before_paths_are_compared() {
        let base = tempfile::tempdir().unwrap();
        let path = |name: &str| base.path().join(name);
        std::fs::create_dir_all(path("disk/deep/out")).unwrap();
        std::fs::write(path("log.csv"), "the log").unwrap();
        std::os::unix::fs::symlink(path("disk/deep/out"), path("out")).unwrap();
        let relative = relative_to(&path("log.csv"), &path("out"));
        assert_eq!(std::fs::read_to_string(path("out").join(relative)).unwrap(), "the log");
        // A device keeps its absolute path.
        assert_eq!(relative_to(Path::new("/dev/null"), &path("out")), Path::new("/dev/null"));
    }

    #[test]
    fn camera_folders_can_be_moved() {
        let base = tempfile::tempdir().unwrap();
        let path = |name: &str| base.path().join(name);
        std::fs::write(path("v.png"), "a picture").unwrap();
        std::fs::create_dir_all(path("out/scene")).unwrap();
        std::fs::write(path("out/scene/zoom.csv"), "t_s,zoom\n").unwrap();
        let zoom = [1.0, 2.0]
            .map(|zoom| ZoomSpec {
                at: zoom,
                focal_px: [500.0 * zoom; 2],
                principal_point_px: None,
                coefficients: Vec::new(),
            })
            .to_vec();
        let mut camera =
            CameraSpec { zoom, zoom_track: Some(path("out/scene/zoom.csv")), ..CameraSpec::default() };
        camera.photometric.vignette = Some(path("v.png"));
        write_camera(&path("out"), &camera).unwrap();
        std::fs::remove_file(path("v.png")).unwrap();
        std::fs::rename(path("out"), path("elsewhere")).unwrap();
        for read in [
            read_camera(&path("elsewhere/camera.toml")).unwrap(),
            read_camera_toml(&path("elsewhere/camera.toml")).unwrap(),
        ] {
            let vignette = read.photometric.vignette.unwrap();
            assert_eq!(vignette, path("elsewhere/inputs/vignette.png"));
            assert_eq!(std::fs::read_to_string(vignette).unwrap(), "a picture");
            assert_eq!(read.zoom_track.unwrap(), path("elsewhere/scene/zoom.csv"));
        }
        let gone = CameraSpec { zoom_track: Some(path("none.csv")), ..CameraSpec::default() };
        let error = write_camera(&path("elsewhere"), &gone).unwrap_err().to_string();
        assert!(error.contains("none.csv") && error.contains("camera.toml"), "{error}");
    }
}
