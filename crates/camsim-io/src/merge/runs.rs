//! `run.json` of shards: whether they are those of one run, and that of the merged folder.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use serde::{Deserialize, de::DeserializeOwned};
use serde_json::Value;

use super::MergeError;
use crate::{
    inputs::Inputs,
    manifest::{RigManifest, RunManifest},
    portable::resolved,
    scenario_file::{ScenarioError, VariationRecord, for_each_path, read_rig},
};

/// A shard.
pub(super) struct ShardRun {
    pub(super) folder: PathBuf,
    /// With paths that do not depend on the folder.
    pub(super) manifest: ShardManifest,
}

/// What the `run.json` of a shard says, of one camera or several.
#[derive(Clone, Debug, Deserialize)]
pub(super) struct ShardManifest {
    version: String,
    pub(super) adapter: String,
    #[serde(default)]
    variation: Option<VariationRecord>,
    scenario: Value,
    inputs: Inputs,
    /// First and last frame, or those of each camera.
    frames: Value,
    shard: Option<[u64; 2]>,
    finished: bool,
}

/// Reads the shards, in their order, and checks that they are all those of one run.
pub(super) fn read(folders: &[PathBuf]) -> Result<Vec<ShardRun>, MergeError> {
    let mut by_number: BTreeMap<u64, ShardRun> = BTreeMap::new();
    let mut shards = None;
    for folder in folders {
        let manifest: ShardManifest = read_manifest(&folder.join("run.json"))?;
        let name = folder.display();
        let Some([number, count]) = manifest.shard else {
            return Err(MergeError::Shards(format!("{name} is no shard: it was rendered without --shard")));
        };
        if !manifest.finished {
            return Err(MergeError::Shards(format!(
                "{name} is not finished: repeat `camsim render ... --shard {number}/{count} --resume`"
            )));
        }
        if *shards.get_or_insert(count) != count {
            return Err(MergeError::Shards(format!("{name} is one of {count} shards, others are not")));
        }
        if let Some(other) = by_number.insert(number, ShardRun { folder: folder.clone(), manifest }) {
            return Err(MergeError::Shards(format!(
                "{} and {name} are both shard {number} of {count}: name each once",
                other.folder.display()
            )));
        }
    }
    let missing: Vec<String> = (1..=shards.unwrap_or(1))
        .filter(|number| !by_number.contains_key(number))
        .map(|n| n.to_string())
        .collect();
    if !missing.is_empty() {
        return Err(MergeError::Shards(format!(
            "{} of {} shards are missing: {}",
            missing.len(),
            shards.unwrap_or(1),
            missing.join(", ")
        )));
    }
    let runs: Vec<ShardRun> = by_number.into_values().collect();
    runs.iter().skip(1).try_for_each(|run| check_same(&runs[0], run))?;
    Ok(runs)
}

/// Checks that two shards are of one run.
fn check_same(first: &ShardRun, other: &ShardRun) -> Result<(), MergeError> {
    let (a, b) = (&first.manifest, &other.manifest);
    let what = if a.version != b.version {
        format!("versions {} and {} of camsim", a.version, b.version)
    } else if a.scenario != b.scenario {
        "different scenarios".to_owned()
    } else if a.inputs != b.inputs {
        "inputs with different content".to_owned()
    } else if a.frames != b.frames {
        format!("frames {} and {}", a.frames, b.frames)
    } else {
        return Ok(());
    };
    Err(MergeError::Shards(format!(
        "{} and {} were made by {what}: render one of them again",
        first.folder.display(),
        other.folder.display()
    )))
}

/// Writes the `run.json` at `file` below `out` that one run would have; the number of its pictures.
pub(super) fn write_joined(folders: &[&Path], file: &Path, out: &Path) -> Result<u64, MergeError> {
    let first = folders[0].join(file);
    let out = out.join(file.parent().unwrap_or(Path::new("")));
    if read_json(&first)?.get("cameras").is_some() {
        return write_joined_rig(&first, &out);
    }
    let runs: Vec<RunManifest> =
        folders.iter().map(|folder| read_manifest(&folder.join(file))).collect::<Result<_, _>>()?;
    let mut joined = runs[0].clone();
    joined.shard = None;
    joined.written = runs.iter().map(|run| run.written + run.skipped).sum();
    joined.skipped = 0;
    for warning in runs.iter().skip(1).flat_map(|run| &run.warnings) {
        if !joined.warnings.contains(warning) {
            joined.warnings.push(warning.clone());
        }
    }
    joined.write(&out)?;
    Ok(joined.written)
}

/// As [`write_joined`], for the folder of a rig, whose cameras are joined already.
fn write_joined_rig(first: &Path, out: &Path) -> Result<u64, MergeError> {
    let damaged = |error: ScenarioError| MergeError::File { path: first.into(), message: error.to_string() };
    let rig = read_rig(first, &[], None).map_err(damaged)?;
    let ShardManifest { version, adapter, inputs, variation, .. } = read_manifest(first)?;
    let runs: Vec<(String, RunManifest)> = rig
        .names()
        .map(|name| Ok((name.to_owned(), read_manifest(&out.join(name).join("run.json"))?)))
        .collect::<Result<_, MergeError>>()?;
    let frames = runs.iter().map(|(name, run)| (name.clone(), run.frames)).collect();
    let manifest =
        RigManifest { version, adapter, variation, rig: &rig, inputs, frames, shard: None, finished: true };
    manifest.write(out)?;
    Ok(runs.iter().map(|(_, run)| run.written).sum())
}

/// Reads a `run.json`, with its paths resolved.
fn read_manifest<T: DeserializeOwned>(path: &Path) -> Result<T, MergeError> {
    let mut run = read_json(path)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    // The same for all folders.
    let absolute = |path: &str| resolved(&folder.join(path)).to_string_lossy().into_owned();
    if let Some(scenario) = run.get_mut("scenario") {
        for_each_path(scenario, &mut |_, path| *path = absolute(path));
    }
    if let Some(Value::Object(inputs)) = run.get_mut("inputs") {
        *inputs = std::mem::take(inputs).into_iter().map(|(path, print)| (absolute(&path), print)).collect();
    }
    serde_json::from_value(run).map_err(|error| not_a_run(path, &error))
}

fn read_json(path: &Path) -> Result<Value, MergeError> {
    let text =
        std::fs::read_to_string(path).map_err(|source| MergeError::Read { path: path.into(), source })?;
    serde_json::from_str(&text).map_err(|error| not_a_run(path, &error))
}

fn not_a_run(path: &Path, error: &serde_json::Error) -> MergeError {
    MergeError::File {
        path: path.into(),
        message: format!("is not a run.json of this version of camsim: {error}"),
    }
}
