//! What a file that is dropped on the window is, and what becomes of it.

use std::path::{Path, PathBuf};

use camsim_io::{camera_file::import_camera, scenario_file::read_checked_camera};
use toml::{Table, Value};

use crate::{document::Document, state::State};

/// Uses of a picture: what to call them, and their keys.
pub const PICTURE_USES: [(&str, &str); 3] = [
    ("vignette map", "camera.photometric.vignette"),
    ("picture on the terrain", "scene.terrain.ortho"),
    ("pattern", "scene.pattern.image"),
];

/// Scenario, calibration, log or picture.
pub fn take(state: &mut State, path: &Path) {
    let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default().to_ascii_lowercase();
    match ending.as_str() {
        "toml" if is_camera(path) => camera(state, read_checked_camera(path).map_err(|error| error.to_string())),
        "toml" => state.open(path.into()),
        "yaml" | "yml" | "xml" | "json" => camera(state, import_camera(path).map_err(|error| error.to_string())),
        "csv" | "txt" | "tum" | "log" => set(state, "flight.log", path),
        "png" | "jpg" | "jpeg" | "bmp" | "gif" | "pgm" | "ppm" => {
            state.dropped_picture = state.document.is_some().then(|| path.into());
            if state.dropped_picture.is_none() {
                state.notice(no_scenario(path));
            }
        }
        "tif" | "tiff" => set(state, "scene.terrain.dem", path),
        _ => state.notice(format!(
            "{}: neither a scenario or camera (.toml), a calibration (.yaml, .xml, .json), a log (.csv, .txt, .tum), a picture (.png, .jpg, .bmp, ...) nor \
             a terrain (.tif)",
            path.display()
        )),
    }
}

/// Puts the picture that waits at `key`.
pub fn use_picture(state: &mut State, key: Option<&str>) {
    if let (Some(path), Some(key)) = (state.dropped_picture.take(), key) {
        set(state, key, &path);
    }
}

/// Whether a TOML file has a camera at its root: scenarios have `flight` and `scene`, and what cannot be read is told by who opens it.
fn is_camera(path: &Path) -> bool {
    let table = std::fs::read_to_string(path).ok().and_then(|text| text.parse::<Table>().ok());
    table.is_some_and(|table| !table.contains_key("flight") && !table.contains_key("scene") && !table.contains_key("camera"))
}

fn camera(state: &mut State, read: Result<camsim_core::scenario::CameraSpec, String>) {
    let told = match (&mut state.document, read) {
        (Some(document), Ok(camera)) => document.set_camera(&camera),
        (None, Ok(_)) => Err("open a scenario first; the calibration then becomes its camera".to_owned()),
        (_, Err(error)) => Err(error),
    };
    after(state, told);
}

fn set(state: &mut State, key: &str, path: &Path) {
    let told = match &mut state.document {
        Some(document) => put(document, key, path),
        None => Err(no_scenario(path)),
    };
    after(state, told);
}

fn put(document: &mut Document, key: &str, path: &Path) -> Result<(), String> {
    let absolute: PathBuf = std::path::absolute(path).map_err(|error| format!("{}: {error}", path.display()))?;
    document.set(key, Some(Value::String(absolute.display().to_string())), false);
    match document.problems.first() {
        None => Ok(()),
        Some(problem) => {
            let told = format!("{}: {problem}", path.display());
            document.undo();
            Err(told)
        }
    }
}

fn no_scenario(path: &Path) -> String {
    format!("{}: open a scenario first; the file then becomes part of it", path.display())
}

fn after(state: &mut State, told: Result<(), String>) {
    match told {
        Ok(()) => state.touch(),
        Err(error) => state.notice(error),
    }
}
