//! `run.json`: the scenario and inputs of a run, so that it can be repeated, and resumed with the same
//! scenario only.
//!
//! Its paths are relative to its folder. A run can be resumed after its folder or its inputs were moved, if
//! the inputs have the same content.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use camsim_core::scenario::{BurstOver, Scenario, TwinSpec};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use thiserror::Error;

use crate::{
    inputs::Inputs,
    portable::{portable_scenario, relative_to},
    scenario_file::{RELATIVE_PATHS, VariationRecord, for_each_path},
    write::{WriteError, write_atomic},
};

mod rig;

pub use rig::RigManifest;

/// Contents of `run.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunManifest {
    /// Version of camsim.
    pub version: String,
    /// Names of adapter and driver.
    pub adapter: String,
    /// Seed of all random numbers, as in the scenario.
    pub seed: u64,
    /// Base of the paths: [`RELATIVE_PATHS`].
    pub paths: String,
    /// Which variation of a scenario with `[randomize]` it is. `scenario` has its values.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub variation: Option<VariationRecord>,
    /// In the folder of a twin: which one it is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub twin: Option<TwinRecord>,
    /// The scenario with defaults and `--set` applied. In the folder of a twin, the one whose frames the twin's
    /// pictures are; of a burst, that of its centre.
    pub scenario: Scenario,
    /// Fingerprints of the files that the scenario names.
    pub inputs: Inputs,
    /// Frames of the run, `--frames` applied: the first, and one past the last.
    pub frames: [u64; 2],
    /// `[I, N]` of `--shard I/N`, from 1.
    pub shard: Option<[u64; 2]>,
    /// Number of frames written.
    pub written: u64,
    /// Number of frames that `--resume` skipped.
    pub skipped: u64,
    /// Whether the run is finished; `false` is written at its start.
    pub finished: bool,
    /// Number of tracked points, if the scenario has `[output.tracks]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tracked_points: Option<u64>,
    /// Warnings for the user.
    pub warnings: Vec<String>,
}

/// Writes `run.json`, and that of a shard.
fn write_runs(folder: &Path, shard: Option<[u64; 2]>, text: &str) -> Result<(), WriteError> {
    if let Some([shard, shards]) = shard {
        write_atomic(&folder.join(format!("run.{shard}-of-{shards}.json")), text.as_bytes())?;
    }
    write_atomic(&folder.join("run.json"), text.as_bytes())
}

/// Whether the run of a folder is finished, by its `run.json`; false without one.
#[must_use]
pub fn is_finished(folder: &Path) -> bool {
    let run = read_run(&folder.join("run.json")).ok().flatten();
    run.and_then(|run| run.get("finished")?.as_bool()).unwrap_or(false)
}

/// What `run.json` in the folder of a twin says of it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TwinRecord {
    /// Its name.
    pub name: String,
    /// The run whose frames it belongs to, relative to this file.
    pub of: String,
    /// Number of pictures in a burst.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub instants: Option<u32>,
    /// What a burst is spread over.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub over: Option<BurstOver>,
}

impl TwinRecord {
    /// The record of a twin in a folder below that of the frames.
    #[must_use]
    pub fn new(twin: &TwinSpec) -> Self {
        let over = twin.instants.map(|_| twin.over.unwrap_or_default());
        Self { name: twin.name.clone(), of: "../run.json".into(), instants: twin.instants, over }
    }
}

/// Why a run cannot be resumed in a folder.
#[derive(Debug, Error)]
pub enum ResumeError {
    /// `run.json` cannot be read.
    #[error("cannot read {}: {source}; render without --resume, or into another folder", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Error of the system.
        source: std::io::Error,
    },
    /// `run.json` cannot be parsed.
    #[error("{} is not a run.json of camsim ({message}); render without --resume, or into another \
        folder", path.display())]
    Parse {
        /// The file.
        path: PathBuf,
        /// Message of the parser.
        message: String,
    },
    /// `run.json` is of another scenario, or of other inputs.
    #[error("{} was made {made}: {}; render without --resume, or into another \
        folder", path.display(), shortened(differences))]
    Differs {
        /// The file.
        path: PathBuf,
        /// Rest of the sentence "the folder was made ...".
        made: &'static str,
        /// One text per difference: `key was old, now new`.
        differences: Vec<String>,
    },
}

/// Value of [`ResumeError::Differs::made`] for another scenario.
pub const BY_OTHER_SCENARIO: &str = "by another scenario";

impl ResumeError {
    /// The message without the advice at its end.
    #[must_use]
    pub fn reason(&self) -> String {
        let text = self.to_string();
        text.strip_suffix(ADVICE).map_or_else(|| text.clone(), str::to_owned)
    }
}

/// Advice at the end of the message of every [`ResumeError`].
const ADVICE: &str = "; render without --resume, or into another folder";

impl RunManifest {
    /// Writes `run.json` into `folder`. A shard also writes `run.I-of-N.json`, so that the counts of all
    /// shards in one folder are kept.
    ///
    /// # Errors
    /// As [`write_atomic`].
    pub fn write(&self, folder: &Path) -> Result<(), WriteError> {
        let path = folder.join("run.json");
        let fail =
            |error: serde_json::Error| WriteError::Encode { path: path.clone(), message: error.to_string() };
        let portable = Self {
            paths: RELATIVE_PATHS.to_owned(),
            scenario: portable_scenario(&self.scenario, folder).map_err(fail)?,
            inputs: portable_inputs(&self.inputs, folder),
            ..self.clone()
        };
        let text = serde_json::to_string_pretty(&portable).map_err(fail)? + "\n";
        write_runs(folder, self.shard, &text)
    }
}

/// Fingerprints by paths relative to a folder.
#[must_use]
pub fn portable_inputs(inputs: &Inputs, folder: &Path) -> Inputs {
    let name = |path: &String| relative_to(Path::new(path), folder).to_string_lossy().into_owned();
    inputs.iter().map(|(path, fingerprint)| (name(path), fingerprint.clone())).collect()
}

/// Maximum number of differences that an error lists.
const MAX_LISTED: usize = 5;

/// Differences as text, the first [`MAX_LISTED`] in full.
fn shortened(differences: &[String]) -> String {
    let listed = differences[..differences.len().min(MAX_LISTED)].join("; ");
    let more = differences.len().saturating_sub(MAX_LISTED);
    if more > 0 { format!("{listed}; and {more} more") } else { listed }
}

/// Checks that the frames in `folder` were made from `scenario` with these inputs. `Ok(false)` if there is no
/// `run.json`, hence no frames.
///
/// # Errors
/// `run.json` cannot be read, or is of another scenario or of other inputs.
pub fn check_resume(folder: &Path, scenario: &Scenario, inputs: &Inputs) -> Result<bool, ResumeError> {
    let path = folder.join("run.json");
    let Some(run) = read_run(&path)? else { return Ok(false) };
    let parse =
        |error: serde_json::Error| ResumeError::Parse { path: path.clone(), message: error.to_string() };
    let (mut old, old_inputs) =
        (value_of(&run, "scenario", &path)?.clone(), value_of(&run, "inputs", &path)?);
    let mut new = through_text(&portable_scenario(scenario, folder).map_err(parse)?).map_err(parse)?;
    // Each twin has a folder and a `run.json` of its own.
    [&mut old, &mut new].into_iter().filter_map(|tree| tree.get_mut("output")?.as_object_mut()).for_each(
        |output| {
            output.remove("twin");
            // Datasets are made of the frames.
            output.remove("datasets");
        },
    );
    let new_inputs = portable_inputs(inputs, folder);
    let moved = MovedFiles::between(&mut old, old_inputs, &mut new, &new_inputs);
    check_equal(&path, BY_OTHER_SCENARIO, &old, &new)?;
    let new_inputs = through_text(&new_inputs).map_err(parse)?;
    check_equal(&path, "when a file had something else in it", &moved.inputs(old_inputs), &new_inputs)?;
    Ok(true)
}

/// Checks that the pictures in `folder` are those of the same burst, or of no burst. `Ok(false)` as
/// [`check_resume`].
///
/// # Errors
/// As [`check_resume`].
pub fn check_burst(folder: &Path, twin: Option<&TwinRecord>) -> Result<bool, ResumeError> {
    let path = folder.join("run.json");
    let Some(run) = read_run(&path)? else { return Ok(false) };
    let parse =
        |error: serde_json::Error| ResumeError::Parse { path: path.clone(), message: error.to_string() };
    let new = through_text(&twin).map_err(parse)?;
    let burst = |twin: Option<&Value>| {
        let fields = ["instants", "over"].map(|key| (key, twin.and_then(|twin| twin.get(key)).cloned()));
        fields.into_iter().filter_map(|(key, value)| Some((format!("twin.{key}"), value?))).collect()
    };
    check_equal(
        &path,
        BY_OTHER_SCENARIO,
        &Value::Object(burst(run.get("twin"))),
        &Value::Object(burst(Some(&new))),
    )?;
    Ok(true)
}

/// As [`check_resume`], for the value at `key` of `run.json`. `made` completes the sentence "the folder was
/// made ..." in the error.
///
/// # Errors
/// As [`check_resume`].
pub fn check_resume_key(
    folder: &Path,
    key: &str,
    made: &'static str,
    new: &impl Serialize,
) -> Result<bool, ResumeError> {
    let path = folder.join("run.json");
    let Some(run) = read_run(&path)? else { return Ok(false) };
    let new = through_text(new)
        .map_err(|error| ResumeError::Parse { path: path.clone(), message: error.to_string() })?;
    check_equal(&path, made, value_of(&run, key, &path)?, &new)?;
    Ok(true)
}

/// Parses `run.json`; `None` if there is no such file.
fn read_run(path: &Path) -> Result<Option<Value>, ResumeError> {
    match std::fs::read_to_string(path) {
        Ok(text) => serde_json::from_str(&text)
            .map(Some)
            .map_err(|error| ResumeError::Parse { path: path.into(), message: error.to_string() }),
        Err(source) if source.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(source) => Err(ResumeError::Read { path: path.into(), source }),
    }
}

/// The value at a key of `run.json`.
fn value_of<'a>(run: &'a Value, key: &str, path: &Path) -> Result<&'a Value, ResumeError> {
    run.get(key).ok_or_else(|| ResumeError::Parse { path: path.into(), message: format!("it has no {key}") })
}

/// Serialises and parses a value, so that numbers with the same text are equal.
fn through_text(value: &impl Serialize) -> Result<Value, serde_json::Error> {
    serde_json::to_string(value).and_then(|text| serde_json::from_str(&text))
}

/// Reports all differences of two values.
fn check_equal(path: &Path, made: &'static str, old: &Value, new: &Value) -> Result<(), ResumeError> {
    let mut differences = Vec::new();
    collect_differences(old, new, "", &mut differences);
    if differences.is_empty() {
        Ok(())
    } else {
        Err(ResumeError::Differs { path: path.into(), made, differences })
    }
}

/// Files with unchanged content that were moved since a run.
struct MovedFiles {
    /// New paths by old paths.
    files: BTreeMap<String, String>,
    /// New folders of moved files by their old folders.
    folders: BTreeMap<PathBuf, PathBuf>,
}

impl MovedFiles {
    /// Compares the paths at equal keys of two scenarios. Old paths whose files have the same content at the
    /// new path are replaced by it.
    fn between(old: &mut Value, old_inputs: &Value, new: &mut Value, new_inputs: &Inputs) -> Self {
        let mut new_paths = BTreeMap::new();
        for_each_path(new, &mut |key, path| {
            new_paths.insert(key.to_owned(), path.clone());
        });
        let mut moved = Self { files: BTreeMap::new(), folders: BTreeMap::new() };
        for_each_path(old, &mut |key, path| {
            let Some(new_path) = new_paths.get(key).filter(|new_path| *new_path != path) else { return };
            let old_fingerprint = old_inputs.get(path.as_str()).and_then(Value::as_str);
            let new_fingerprint = new_inputs.get(new_path).map(String::as_str);
            if old_fingerprint.is_none()
                || old_fingerprint != new_fingerprint
                || old_fingerprint == Some(crate::inputs::NOT_READABLE)
            {
                return;
            }
            if let (Some(from), Some(to)) = (Path::new(path).parent(), Path::new(new_path).parent()) {
                moved.folders.insert(from.into(), to.into());
            }
            moved.files.insert(path.clone(), new_path.clone());
            path.clone_from(new_path);
        });
        moved
    }

    /// Old fingerprints at the new paths. Files that a moved file needs are expected beside it.
    fn inputs(&self, old: &Value) -> Value {
        let new_path = |path: &String| {
            let beside_moved_file = || {
                let folder = self.folders.get(Path::new(path).parent()?)?;
                Some(folder.join(Path::new(path).file_name()?).to_string_lossy().into_owned())
            };
            self.files.get(path).cloned().or_else(beside_moved_file).unwrap_or_else(|| path.clone())
        };
        let Value::Object(map) = old else { return old.clone() };
        Value::Object(map.iter().map(|(path, fingerprint)| (new_path(path), fingerprint.clone())).collect())
    }
}

/// Appends `key was old, now new` for each leaf that differs.
fn collect_differences(old: &Value, new: &Value, key: &str, differences: &mut Vec<String>) {
    if let (Value::Object(a), Value::Object(b)) = (old, new) {
        for name in a.keys().chain(b.keys().filter(|name| !a.contains_key(*name))) {
            let key = if key.is_empty() { name.clone() } else { format!("{key}.{name}") };
            let [a, b] = [a, b].map(|map| map.get(name).unwrap_or(&Value::Null));
            collect_differences(a, b, &key, differences);
        }
    } else if old != new {
        let show = |value: &Value| if value.is_null() { "nothing".to_owned() } else { value.to_string() };
        differences.push(format!("{key} was {}, now {}", show(old), show(new)));
    }
}

/// Whether shard `[i, n]` (i from 1) renders frame `index`. A shard has every n-th frame, so that all shards
/// take about the same time.
pub fn in_shard(index: u64, [i, n]: [u64; 2]) -> bool {
    n > 0 && index % n + 1 == i
}

#[cfg(test)]
mod tests;
