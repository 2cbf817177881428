//! Scenario and camera files: TOML, changed by `--set`. Errors name file, line and key.
//!
//! The steps are: parse; replace `camera = "file.toml"`, and `file` of `[[cameras]]`, by the content of that
//! file; apply `--set`; check
//! keys and types against the schema; resolve paths against the folder of the file that names them (those of
//! `--set` against the working directory); deserialise; check ranges.

use std::path::{Path, PathBuf};

use camsim_core::scenario::{CameraSpec, Preset, Problem, Rig, Scenario};
use thiserror::Error;

pub(crate) mod check;
mod escapes;
mod listing;
mod paths;
mod randomize;
mod rig;
pub(crate) mod schema;
mod similar;
pub(crate) mod tree;
mod wrong_file_kind;

use camsim_core::{validate::checked_camera, validate::checked_rig};
pub use listing::{json_schema, print_default};
pub(crate) use paths::for_each_path;
pub use randomize::{
    Drawn, RANDOMIZE, RandomScenario, Variation, VariationRecord, drawn_json, parse_random_scenario,
    randomize, read_random_scenario,
};
pub use rig::{rig_json, rig_of_table, rig_table};
pub use schema::{CAMERAS, ValueKind, find_key, keys, kinds};
use tree::Tree;
pub use tree::UNSET;

/// Value of the key `paths` of `run.json`. Early versions have no such key, and paths relative to the working
/// directory.
pub const RELATIVE_PATHS: &str = "relative to this file";

/// Why a scenario cannot be used.
#[derive(Debug, Error)]
pub enum ScenarioError {
    /// The file cannot be read.
    #[error("cannot read {}: {source}; check the path and its permissions", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Error of the system.
        source: std::io::Error,
    },
    /// Not UTF-8 text.
    #[error("{}: not UTF-8 text (bad byte at offset {offset}); scenarios and camera files are TOML, which is \
        text: save it as UTF-8", path.display())]
    NotText {
        /// The file.
        path: PathBuf,
        /// Offset of the first byte that is not UTF-8.
        offset: usize,
    },
    /// A camera file that a scenario names cannot be read.
    #[error("{key}: cannot read {}: {source}; the key `{key}` of {} names it, relative to that file's \
        folder", path.display(), scenario.display())]
    ReadCamera {
        /// The key that names it.
        key: String,
        /// The camera file.
        path: PathBuf,
        /// The scenario that names it.
        scenario: PathBuf,
        /// Error of the system.
        source: std::io::Error,
    },
    /// Not TOML.
    #[error("{}:{line}: not valid TOML: {message}", path.display())]
    Syntax {
        /// The file.
        path: PathBuf,
        /// Line from 1.
        line: usize,
        /// Message of the parser.
        message: String,
    },
    /// A `--set` that cannot be applied.
    #[error("--set {set}: {message}")]
    Set {
        /// `key=value`, as typed.
        set: String,
        /// What is wrong.
        message: String,
    },
    /// A scenario of several cameras where one is needed.
    #[error("{}: has [[cameras]], and one of them is needed here: choose {}", path.display(), names.join(" or "))]
    SeveralCameras {
        /// The file.
        path: PathBuf,
        /// Names of the cameras.
        names: Vec<String>,
    },
    /// A variation of `[randomize]` has drawn values that cannot be used.
    #[error("variation {variation} ({drawn}): {source}")]
    Variation {
        /// Its number.
        variation: u64,
        /// Drawn values, `key = value`.
        drawn: String,
        /// What is wrong.
        source: Box<ScenarioError>,
    },
    /// Wrong keys, types or ranges: one line each, with file and line.
    #[error("{}", .0.join("\n"))]
    Problems(Vec<String>),
}

/// Reads a scenario of one camera or of several, or that of a `run.json`, with `sets` (`--set key=value`, in
/// order) and `preset` on top, and checks all of it. What `[randomize]` draws is skipped
/// ([`read_random_scenario`]).
///
/// # Errors
/// The file or its camera file cannot be read or is not TOML; a key is unknown, of the wrong type or out of
/// range.
pub fn read_rig(
    path: &Path,
    sets: &[(String, String)],
    preset: Option<Preset>,
) -> Result<Rig, ScenarioError> {
    Ok(read_random_scenario(path, sets, preset)?.into_base())
}

/// As [`read_rig`], from the text of the file `path`, which is not read.
///
/// # Errors
/// As [`read_rig`].
pub fn parse_rig(text: &str, path: &Path, sets: &[(String, String)]) -> Result<Rig, ScenarioError> {
    Ok(parse_random_scenario(text, path, sets)?.into_base())
}

/// As [`read_rig`], for a scenario with `[camera]`.
///
/// # Errors
/// As [`read_rig`], or the scenario has `[[cameras]]`.
pub fn read_scenario(
    path: &Path,
    sets: &[(String, String)],
    preset: Option<Preset>,
) -> Result<Scenario, ScenarioError> {
    single(read_rig(path, sets, preset)?, path)
}

/// As [`read_scenario`], from the text of the file `path`, which is not read.
///
/// # Errors
/// As [`read_scenario`].
pub fn parse_scenario(text: &str, path: &Path, sets: &[(String, String)]) -> Result<Scenario, ScenarioError> {
    single(parse_rig(text, path, sets)?, path)
}

fn single(rig: Rig, path: &Path) -> Result<Scenario, ScenarioError> {
    if rig.is_list() {
        let names = rig.names().map(str::to_owned).collect();
        return Err(ScenarioError::SeveralCameras { path: path.into(), names });
    }
    Ok(rig.first().clone())
}

/// Reads a camera file, which has the keys of `[camera]` at its root. Paths are resolved; ranges are not
/// checked, and `resized` is not applied.
///
/// # Errors
/// As [`read_scenario`].
pub fn read_camera(path: &Path) -> Result<CameraSpec, ScenarioError> {
    let mut tree = Tree::read_camera(path, "camera")?;
    let problems = check::check(&mut tree, &schema::SCENARIO, "camera");
    if !problems.is_empty() {
        return Err(ScenarioError::Problems(problems));
    }
    deserialize(&tree)
}

/// Reads the cameras of a scenario, a `run.json`, a file with `[[cameras]]` alone, or a camera file, and checks
/// them.
///
/// # Errors
/// As [`read_rig`] or [`read_checked_camera`].
pub fn read_cameras(path: &Path) -> Result<Vec<CameraSpec>, ScenarioError> {
    // A camera file is no scenario, which the reader of scenarios would say.
    let is_run = std::fs::read(path).is_ok_and(|bytes| bytes.trim_ascii_start().first() == Some(&b'{'));
    let tree = if is_run { Tree::read_scenario(path)? } else { Tree::read(path, "")? };
    let is_scenario = ["camera", "flight", "scene"].iter().any(|key| tree.root.contains_key(*key));
    if is_scenario {
        let rig = read_rig(path, &[], None)?;
        return Ok(rig.scenarios().iter().map(|scenario| scenario.camera.clone()).collect());
    }
    if !tree.root.contains_key(CAMERAS) {
        return Ok(vec![read_checked_camera(path)?]);
    }
    rig::read_cameras_alone(tree)
}

/// Reads a camera file, checks the ranges of all values, and applies `resized`.
///
/// # Errors
/// As [`read_camera`], or values are out of range.
pub fn read_checked_camera(path: &Path) -> Result<CameraSpec, ScenarioError> {
    let problems = match checked_camera(read_camera(path)?) {
        Ok(camera) => return Ok(camera),
        Err(problems) => problems,
    };
    // The keys of a camera file stand at its root.
    let line = |problem: &Problem| {
        format!("{}: {}", path.display(), problem.to_string().trim_start_matches("camera."))
    };
    Err(ScenarioError::Problems(problems.iter().map(line).collect()))
}

/// Turns a tree into checked scenarios, with `camera.resized` applied.
fn rig_of_tree(tree: &mut Tree, preset: Option<Preset>) -> Result<Rig, ScenarioError> {
    checked_rig(stated_rig(tree, preset)?).map_err(|problems| {
        let line = |problem: &Problem| format!("{}: {problem}", tree.location(&problem.key));
        ScenarioError::Problems(problems.iter().map(line).collect())
    })
}

/// Turns a tree into scenarios as they are stated. Ranges are not checked.
fn stated_rig(tree: &mut Tree, preset: Option<Preset>) -> Result<Rig, ScenarioError> {
    let problems = check::check(tree, &schema::SCENARIO, "");
    if !problems.is_empty() {
        return Err(ScenarioError::Problems(problems));
    }
    let mut rig = rig_of_table(tree.root.clone()).map_err(|error| unexpected(tree, &error))?;
    if let Some(preset) = preset {
        let with_preset = |mut scenario: Scenario| {
            scenario.quality.preset = preset;
            Ok(scenario)
        };
        rig = rig.try_map(with_preset)?;
    }
    Ok(rig)
}

/// Deserialises a checked tree. The schema and the structs agree, so an error here is unexpected and names no
/// line.
pub(crate) fn deserialize<T: serde::de::DeserializeOwned>(tree: &Tree) -> Result<T, ScenarioError> {
    toml::Value::Table(tree.root.clone()).try_into().map_err(|error| unexpected(tree, &error))
}

fn unexpected(tree: &Tree, error: &toml::de::Error) -> ScenarioError {
    ScenarioError::Problems(vec![format!("{}: {}", tree.file.display(), error.message())])
}

#[cfg(test)]
mod tests;
