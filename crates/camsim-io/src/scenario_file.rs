//! Scenario files: TOML, a camera file inside it, `--set` on top, each mistake with its file, line and key.
//!
//! The order is: parse, put `camera = "file.toml"` in its place, apply `--set`, check keys and types against
//! the schema, resolve paths against the folder of the file that names them (those of `--set` against the
//! working directory), deserialise, check ranges.

use std::path::{Path, PathBuf};

use camsim_core::scenario::{CameraSpec, Preset, Problem, Scenario, validate, validate_camera};
use thiserror::Error;

pub(crate) mod check;
mod mistaken;
mod paths;
pub(crate) mod schema;
pub(crate) mod tree;

pub(crate) use paths::for_each_path;
pub use schema::Kind;
use tree::Tree;

/// Why a scenario cannot be used.
#[derive(Debug, Error)]
pub enum ScenarioError {
    /// The file cannot be read.
    #[error("cannot read {}: {source}; check the path and its permissions", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Reason.
        source: std::io::Error,
    },
    /// Not UTF-8 text.
    #[error("{}: not UTF-8 text (bad byte at offset {offset}); scenarios and camera files are TOML, which is text: save it as UTF-8", path.display())]
    NotText {
        /// The file.
        path: PathBuf,
        /// First bad byte.
        offset: usize,
    },
    /// A camera file that a scenario names cannot be read.
    #[error("camera: cannot read {}: {source}; the key `camera` of {} names it, relative to that file's folder", path.display(), scenario.display())]
    ReadCamera {
        /// The camera file.
        path: PathBuf,
        /// The scenario.
        scenario: PathBuf,
        /// The reason.
        source: std::io::Error,
    },
    /// Not TOML.
    #[error("{}:{line}: not valid TOML: {message}", path.display())]
    Syntax {
        /// The file.
        path: PathBuf,
        /// Line from 1.
        line: usize,
        /// The parser's words.
        message: String,
    },
    /// A `--set` that does not fit.
    #[error("--set {set}: {message}")]
    Set {
        /// As typed.
        set: String,
        /// What is wrong.
        message: String,
    },
    /// Wrong keys, types or ranges: one line each, with its place.
    #[error("{}", .0.join("\n"))]
    Problems(Vec<String>),
}

/// Reads a scenario, or that of a `run.json`, with `sets` (`--set key=value`, in order) and `preset` on top,
/// and checks all of it.
///
/// # Errors
/// The file or its camera file cannot be read or is not TOML; a key is unknown, of the wrong type or out of
/// range.
pub fn read_scenario(
    path: &Path,
    sets: &[(String, String)],
    preset: Option<Preset>,
) -> Result<Scenario, ScenarioError> {
    finish(Tree::read_scenario(path)?, sets, preset)
}

/// As [`read_scenario`], from text that stands for the file `path`.
///
/// # Errors
/// As there.
pub fn parse_scenario(text: &str, path: &Path, sets: &[(String, String)]) -> Result<Scenario, ScenarioError> {
    finish(Tree::parse(text, path, "")?, sets, None)
}

/// Reads a camera file: the keys of `[camera]` at its root. Paths are resolved, ranges are not yet checked.
///
/// # Errors
/// As [`read_scenario`].
pub fn read_camera(path: &Path) -> Result<CameraSpec, ScenarioError> {
    let mut tree = Tree::read_camera(path)?;
    let problems = check::check(&mut tree, &schema::SCENARIO, "camera");
    if !problems.is_empty() {
        return Err(ScenarioError::Problems(problems));
    }
    deserialize(&tree)
}

/// As [`read_camera`], with the ranges of all values checked.
///
/// # Errors
/// As there, and values out of range.
pub fn read_checked_camera(path: &Path) -> Result<CameraSpec, ScenarioError> {
    let camera = read_camera(path)?;
    let problems = validate_camera(&camera);
    if problems.is_empty() {
        return Ok(camera);
    }
    // In a camera file the keys stand at the root.
    let line = |problem: &Problem| {
        format!("{}: {}", path.display(), problem.to_string().trim_start_matches("camera."))
    };
    Err(ScenarioError::Problems(problems.iter().map(line).collect()))
}

/// The commented default scenario: what `camsim render --print-default` prints.
pub fn print_default() -> String {
    include_str!("scenario_file/default.toml").to_owned()
}

/// Every key of a scenario file and what it takes, in the order of `--print-default`; elements of arrays of
/// tables stand without their index.
#[must_use]
pub fn keys() -> &'static [(&'static str, Kind)] {
    schema::SCENARIO.keys
}

fn finish(
    mut tree: Tree,
    sets: &[(String, String)],
    preset: Option<Preset>,
) -> Result<Scenario, ScenarioError> {
    tree.resolve_camera()?;
    for (key, text) in sets {
        tree.set(key, text)?;
    }
    let problems = check::check(&mut tree, &schema::SCENARIO, "");
    if !problems.is_empty() {
        return Err(ScenarioError::Problems(problems));
    }
    let mut scenario: Scenario = deserialize(&tree)?;
    if let Some(preset) = preset {
        scenario.quality.preset = preset;
    }
    let problems = validate(&scenario);
    if problems.is_empty() {
        return Ok(scenario);
    }
    Err(ScenarioError::Problems(
        problems.iter().map(|problem| format!("{}: {problem}", tree.place(&problem.key))).collect(),
    ))
}

/// The schema lets nothing through that the struct does not take; should it, the file is named without a
/// line.
pub(crate) fn deserialize<T: serde::de::DeserializeOwned>(tree: &Tree) -> Result<T, ScenarioError> {
    let described = |error: toml::de::Error| {
        ScenarioError::Problems(vec![format!("{}: {}", tree.file.display(), error.message())])
    };
    toml::Value::Table(tree.root.clone()).try_into().map_err(described)
}

#[cfg(test)]
mod tests;
