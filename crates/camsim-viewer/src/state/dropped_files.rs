//! Files dropped on the window: their kinds, and how each is used.

use std::path::Path;

use camsim_core::scenario::{CameraSpec, PhotometricSpec};
use camsim_io::{formats::reading::import_camera_as, scenario_file::read_checked_camera};
use toml::{Table, Value};

use crate::{
    document::Document,
    state::{State, UnsavedPrompt},
};

/// Uses of a dropped picture: label and key.
pub const PICTURE_USES: [(&str, &str); 3] = [
    ("vignette map", "camera.photometric.vignette"),
    ("picture on the terrain", "scene.terrain.ortho"),
    ("pattern", "scene.pattern.image"),
];

/// Keys of a board's pose, which a new target keeps.
const BOARD_POSE_KEYS: [&str; 3] = ["at", "geodetic", "angles_deg"];

/// Sort key of files that are dropped together: scenarios first, since other files become part of them.
pub fn drop_order(path: &Path) -> u8 {
    let is_toml = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml"));
    u8::from(!is_toml || is_camera(path))
}

/// Why a path cannot be used, whatever its kind: missing, a folder, or empty.
fn unusable_reason(path: &Path) -> Option<String> {
    let name = path.display();
    match std::fs::metadata(path) {
        Err(error) => Some(format!("{name}: {error}; put the file back and drop it again")),
        Ok(metadata) if metadata.is_dir() => Some(format!(
            "{name} is a folder: drop the scenario, log, calibration, picture or model that is in it"
        )),
        Ok(metadata) if metadata.len() == 0 => Some(format!("{name} is empty: nothing was changed")),
        Ok(_) => None,
    }
}

/// Opens a dropped scenario, or uses another file in the open one.
pub fn apply_dropped(state: &mut State, path: &Path) {
    if let Some(reason) = unusable_reason(path) {
        return state.notice(reason);
    }
    let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default().to_ascii_lowercase();
    match ending.as_str() {
        "toml" if is_camera(path) => {
            set_camera(state, read_checked_camera(path).map_err(|error| error.to_string()));
        }
        "toml" if state.is_unsaved() => state.unsaved_prompt = Some(UnsavedPrompt::Open(path.into())),
        "toml" => state.open(path.into()),
        "yaml" | "yml" if is_target(path) => add_target(state, path),
        "yaml" | "yml" | "xml" | "json" => import_calibration(state, path),
        "csv" | "txt" | "tum" | "log" | "ulg" | "bin" | "mcap" | "igc" | "gpx" | "kml" | "pos" => {
            set_path(state, "flight.log", path)
        }
        "png" | "jpg" | "jpeg" | "bmp" | "gif" | "pgm" | "ppm" => {
            if state.document.is_none() {
                state.notice(no_scenario(path));
            } else if let Some(waiting) = &state.dropped_picture {
                let message = format!(
                    "{}: choose the use of {} first, then drop the file again",
                    path.display(),
                    waiting.display()
                );
                state.notice(message);
            } else {
                state.dropped_picture = Some(path.into());
            }
        }
        "glb" | "gltf" => add_model(state, path),
        "tif" | "tiff" | "asc" | "hgt" => set_path(state, "scene.terrain.dem", path),
        _ => state.notice(format!(
            "{}: unknown kind of file; expected a scenario or camera (.toml), a calibration or Kalibr \
             target (.yaml, .xml, .json), a log (.csv, .txt, .ulg, .bin, .mcap, .igc, .gpx, .kml), a picture \
             (.png, .jpg, .bmp, ...), heights (.tif, .asc, .hgt) or a model (.glb, .gltf)",
            path.display()
        )),
    }
}

/// Uses the dropped picture for `key`, or for nothing.
pub fn use_picture(state: &mut State, key: Option<&str>) {
    if let (Some(path), Some(key)) = (state.dropped_picture.take(), key) {
        set_path(state, key, &path);
    }
}

/// Whether a TOML file is a camera, not a scenario. Unreadable files count as scenarios: opening reports the
/// error.
fn is_camera(path: &Path) -> bool {
    let table = std::fs::read_to_string(path).ok().and_then(|text| text.parse::<Table>().ok());
    table.is_some_and(|table| {
        !table.contains_key("flight") && !table.contains_key("scene") && !table.contains_key("camera")
    })
}

/// Whether a YAML file is a Kalibr calibration target, not a camera.
fn is_target(path: &Path) -> bool {
    std::fs::read_to_string(path)
        .is_ok_and(|text| text.lines().any(|line| line.trim_start().starts_with("target_type")))
}

/// The surface point that the pinned pixel sees, NED.
fn pinned_point_ned_m(state: &State) -> Option<[f64; 3]> {
    state.pinned.and_then(|pixel| state.engine.sample(pixel)?.hit).map(|hit| hit.point_ned_m.to_array())
}

fn floats(values: [f64; 3]) -> Value {
    Value::Array(values.into_iter().map(Value::Float).collect())
}

/// Adds a calibration board at the point that the pinned pixel sees, or replaces the board of the scenario at
/// its pose.
fn add_target(state: &mut State, path: &Path) {
    let pinned_ned_m = pinned_point_ned_m(state);
    use_file(state, "scene.board", path, |document, file| {
        let present = document.value("scene.board").and_then(Value::as_table);
        let position = pinned_ned_m.filter(|_| document.value("scene.board").is_none());
        let mut board = present.cloned().unwrap_or_default();
        board.retain(|key, _| BOARD_POSE_KEYS.contains(&key));
        if let Some(point) = position {
            board.insert("at".into(), floats(point));
        }
        board.insert("target".into(), file);
        Value::Table(board)
    });
}

/// Adds a model at the point that the pinned pixel sees, or at the origin; on the ground if there is terrain.
fn add_model(state: &mut State, path: &Path) {
    let position_ned_m = pinned_point_ned_m(state).unwrap_or_default();
    use_file(state, "scene.gltf", path, |document, file| {
        let mut entry = Table::new();
        entry.insert("file".into(), file);
        entry.insert("at".into(), floats(position_ned_m));
        entry.insert("on_ground".into(), Value::Boolean(document.value("scene.terrain").is_some()));
        let mut list = document.value("scene.gltf").and_then(Value::as_array).cloned().unwrap_or_default();
        list.push(Value::Table(entry));
        Value::Array(list)
    });
}

/// Imports another program's calibration. Shutter and photometry stay if the file has none, but for the
/// vignette of the old lens. The notes of the import are shown.
fn import_calibration(state: &mut State, path: &Path) {
    let imported = match import_camera_as(path, None) {
        Ok(imported) => imported,
        Err(error) => return state.notice(error.to_string()),
    };
    let mut spec = imported.spec;
    if let Some(document) = &state.document {
        let (current, default) = (&document.scenario.camera, CameraSpec::default());
        if spec.shutter == default.shutter {
            spec.shutter = current.shutter.clone();
        }
        if spec.photometric == default.photometric {
            let PhotometricSpec { vignette, vignette_thresholds, .. } = default.photometric;
            spec.photometric =
                PhotometricSpec { vignette, vignette_thresholds, ..current.photometric.clone() };
        }
        // Frame rate and shutter stay the scenario's.
        let notes = imported
            .notes
            .iter()
            .filter(|note| !note.contains("fps is 30") && !note.contains("shutter is global"));
        notes.for_each(|note| state.notice(format!("{}: {note}", path.display())));
    }
    set_camera(state, Ok(spec));
}

/// Replaces the scenario's camera, or reports why it was not read.
fn set_camera(state: &mut State, read: Result<CameraSpec, String>) {
    let outcome = match (&mut state.document, read) {
        (Some(document), Ok(camera)) => document.set_camera(&camera),
        (None, Ok(_)) => Err("open a scenario first; the calibration then becomes its camera".to_owned()),
        (_, Err(error)) => Err(error),
    };
    finish(state, outcome);
}

/// Sets `key` to a dropped file.
fn set_path(state: &mut State, key: &str, path: &Path) {
    use_file(state, key, path, |_, file| file);
}

/// Sets `key` to a value that is made from the absolute path of a dropped file.
fn use_file(state: &mut State, key: &str, path: &Path, value: impl FnOnce(&Document, Value) -> Value) {
    let absolute = std::path::absolute(path).map_err(|error| format!("{}: {error}", path.display()));
    let outcome = match (&mut state.document, absolute) {
        (Some(document), Ok(file)) => {
            let value = value(document, Value::String(file.display().to_string()));
            try_set(document, key, value, path)
        }
        (Some(_), Err(error)) => Err(error),
        (None, _) => Err(no_scenario(path)),
    };
    finish(state, outcome);
}

/// Sets a value, or undoes that if it is not legal.
fn try_set(document: &mut Document, key: &str, value: Value, path: &Path) -> Result<(), String> {
    document.set(key, Some(value), false);
    match document.problems.first() {
        None => Ok(()),
        Some(problem) => {
            let message = format!("{}: {problem}", path.display());
            document.undo();
            Err(message)
        }
    }
}

fn no_scenario(path: &Path) -> String {
    format!("{}: open a scenario first; the file then becomes part of it", path.display())
}

/// Records the input, or shows the error.
fn finish(state: &mut State, outcome: Result<(), String>) {
    match outcome {
        Ok(()) => state.note_input(),
        Err(error) => state.notice(error),
    }
}
