//! What a file that is dropped on the window is, and what becomes of it.

use std::path::Path;

use camsim_core::scenario::{CameraSpec, PhotometricSpec};
use camsim_io::{camera_file::import_camera_as, scenario_file::read_checked_camera};
use toml::{Table, Value};

use crate::{
    document::Document,
    state::{Leaving, State},
};

/// Uses of a picture: what to call them, and their keys.
pub const PICTURE_USES: [(&str, &str); 3] = [
    ("vignette map", "camera.photometric.vignette"),
    ("picture on the terrain", "scene.terrain.ortho"),
    ("pattern", "scene.pattern.image"),
];

/// Keys of a board that another one at the same place has too.
const PLACE_OF_BOARD: [&str; 3] = ["at", "geodetic", "angles_deg"];

/// The order in which files that are dropped together are taken: a scenario before what becomes part of it.
pub fn rank(path: &Path) -> u8 {
    let is_toml = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml"));
    u8::from(!is_toml || is_camera(path))
}

/// Why a path cannot be taken whatever it is, if so: else a scenario would be left with something that cannot
/// be loaded.
fn hindrance(path: &Path) -> Option<String> {
    let name = path.display();
    match std::fs::metadata(path) {
        Err(error) => Some(format!("{name}: {error}; put the file back and drop it again")),
        Ok(what) if what.is_dir() => Some(format!(
            "{name} is a folder: drop the scenario, log, calibration, picture or model that is in it"
        )),
        Ok(what) if what.len() == 0 => Some(format!("{name} is empty: nothing was changed")),
        Ok(_) => None,
    }
}

/// Scenario, calibration, log or picture.
pub fn take(state: &mut State, path: &Path) {
    if let Some(hindrance) = hindrance(path) {
        return state.notice(hindrance);
    }
    let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default().to_ascii_lowercase();
    match ending.as_str() {
        "toml" if is_camera(path) => camera(state, read_checked_camera(path).map_err(|error| error.to_string())),
        "toml" if state.is_unsaved() => state.leaving = Some(Leaving::For(path.into())),
        "toml" => state.open(path.into()),
        "yaml" | "yml" if is_target(path) => target(state, path),
        "yaml" | "yml" | "xml" | "json" => calibration(state, path),
        "csv" | "txt" | "tum" | "log" => set(state, "flight.log", path),
        "png" | "jpg" | "jpeg" | "bmp" | "gif" | "pgm" | "ppm" => {
            if state.document.is_none() {
                state.notice(no_scenario(path));
            } else if let Some(waiting) = &state.dropped_picture {
                let told = format!("{}: say first what {} is for, then drop it again", path.display(), waiting.display());
                state.notice(told);
            } else {
                state.dropped_picture = Some(path.into());
            }
        }
        "glb" | "gltf" => model(state, path),
        "tif" | "tiff" => set(state, "scene.terrain.dem", path),
        _ => state.notice(format!(
            "{}: neither a scenario or camera (.toml), a calibration or a Kalibr target (.yaml, .xml, .json), a log (.csv, .txt, .tum), \
             a picture (.png, .jpg, .bmp, ...), a terrain (.tif) nor a model (.glb, .gltf)",
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

/// Whether a TOML file has a camera at its root: scenarios have `flight` and `scene`, and what cannot be read
/// is told by who opens it.
fn is_camera(path: &Path) -> bool {
    let table = std::fs::read_to_string(path).ok().and_then(|text| text.parse::<Table>().ok());
    table.is_some_and(|table| {
        !table.contains_key("flight") && !table.contains_key("scene") && !table.contains_key("camera")
    })
}

/// Whether a YAML file describes a calibration target, as Kalibr's do, not a camera.
fn is_target(path: &Path) -> bool {
    std::fs::read_to_string(path)
        .is_ok_and(|text| text.lines().any(|line| line.trim_start().starts_with("target_type")))
}

/// What the pixel that is kept sees, north, east, down.
fn kept_point(state: &State) -> Option<[f64; 3]> {
    state.pinned.and_then(|pixel| state.heard.point_ned_m(pixel)).map(|point| point.to_array())
}

fn floats(values: [f64; 3]) -> Value {
    Value::Array(values.into_iter().map(Value::Float).collect())
}

/// A calibration board: in place of the one that is there and where that is, else where the pixel that is
/// kept looks.
fn target(state: &mut State, path: &Path) {
    let seen = kept_point(state);
    let told = match &mut state.document {
        Some(document) => std::path::absolute(path)
            .map_err(|error| format!("{}: {error}", path.display()))
            .and_then(|file| {
                let at = seen.filter(|_| document.value("scene.board").is_none());
                let mut board =
                    document.value("scene.board").and_then(Value::as_table).cloned().unwrap_or_default();
                board.retain(|key, _| PLACE_OF_BOARD.contains(&key));
                if let Some(point) = at {
                    board.insert("at".into(), floats(point));
                }
                board.insert("target".into(), Value::String(file.display().to_string()));
                put(document, "scene.board", Value::Table(board), path)
            }),
        None => Err(no_scenario(path)),
    };
    after(state, told);
}

/// One more model: where the pixel that is kept looks at, else at the origin; on the ground if there is any.
fn model(state: &mut State, path: &Path) {
    let at = kept_point(state).unwrap_or_default();
    let told = match &mut state.document {
        Some(document) => std::path::absolute(path)
            .map_err(|error| format!("{}: {error}", path.display()))
            .and_then(|file| {
                let mut entry = Table::new();
                entry.insert("file".into(), Value::String(file.display().to_string()));
                entry.insert("at".into(), floats(at));
                entry.insert("on_ground".into(), Value::Boolean(document.value("scene.terrain").is_some()));
                let mut list =
                    document.value("scene.gltf").and_then(Value::as_array).cloned().unwrap_or_default();
                list.push(Value::Table(entry));
                put(document, "scene.gltf", Value::Array(list), path)
            }),
        None => Err(no_scenario(path)),
    };
    after(state, told);
}

/// Another program's calibration: what it does not tell of shutter and light stays, but for the other lens's
/// vignette. What was left out or chosen is told.
fn calibration(state: &mut State, path: &Path) {
    let imported = match import_camera_as(path, None) {
        Ok(imported) => imported,
        Err(error) => return state.notice(error.to_string()),
    };
    let mut spec = imported.spec;
    if let Some(document) = &state.document {
        let (now, untold) = (&document.scenario.camera, CameraSpec::default());
        if spec.shutter == untold.shutter {
            spec.shutter = now.shutter.clone();
        }
        if spec.photometric == untold.photometric {
            let PhotometricSpec { vignette, vignette_thresholds, .. } = untold.photometric;
            spec.photometric = PhotometricSpec { vignette, vignette_thresholds, ..now.photometric.clone() };
        }
        // Frame rate and shutter are the scenario's here.
        let told = imported
            .notes
            .iter()
            .filter(|note| !note.contains("fps is 30") && !note.contains("shutter is global"));
        told.for_each(|note| state.notice(format!("{}: {note}", path.display())));
    }
    camera(state, Ok(spec));
}

fn camera(state: &mut State, read: Result<CameraSpec, String>) {
    let told = match (&mut state.document, read) {
        (Some(document), Ok(camera)) => document.set_camera(&camera),
        (None, Ok(_)) => Err("open a scenario first; the calibration then becomes its camera".to_owned()),
        (_, Err(error)) => Err(error),
    };
    after(state, told);
}

fn set(state: &mut State, key: &str, path: &Path) {
    let absolute = std::path::absolute(path).map_err(|error| format!("{}: {error}", path.display()));
    let told = match (&mut state.document, absolute) {
        (Some(document), Ok(absolute)) => {
            put(document, key, Value::String(absolute.display().to_string()), path)
        }
        (Some(_), Err(error)) => Err(error),
        (None, _) => Err(no_scenario(path)),
    };
    after(state, told);
}

/// Puts a value in place, or leaves all as it was.
fn put(document: &mut Document, key: &str, value: Value, path: &Path) -> Result<(), String> {
    document.set(key, Some(value), false);
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
