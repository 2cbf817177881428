//! `run.json` of a rig.

use std::{collections::BTreeMap, path::Path};

use camsim_core::scenario::Rig;

use super::{portable_inputs, write_runs};
use crate::{
    inputs::Inputs,
    portable::portable_rig,
    scenario_file::{RELATIVE_PATHS, VariationRecord},
    write::WriteError,
};

/// Contents of `run.json` in the folder of a rig, which has a folder with a `run.json` for each camera.
#[derive(Clone, Debug)]
pub struct RigManifest<'a> {
    /// Version of camsim.
    pub version: String,
    /// Names of adapter and driver.
    pub adapter: String,
    /// Which variation of a scenario with `[randomize]` it is.
    pub variation: Option<VariationRecord>,
    /// The scenario with all cameras, with defaults and `--set` applied.
    pub rig: &'a Rig,
    /// Fingerprints of the files that it names.
    pub inputs: Inputs,
    /// Frames of the run of each camera that it renders: the first, and one past the last.
    pub frames: BTreeMap<String, [u64; 2]>,
    /// `[I, N]` of `--shard I/N`, from 1.
    pub shard: Option<[u64; 2]>,
    /// Whether the runs of all cameras are finished.
    pub finished: bool,
}

impl RigManifest<'_> {
    /// Writes `run.json` into `folder`, and a copy for each shard as [`RunManifest::write`].
    ///
    /// # Errors
    /// As [`write_atomic`].
    pub fn write(&self, folder: &Path) -> Result<(), WriteError> {
        let path = folder.join("run.json");
        let fail =
            |error: serde_json::Error| WriteError::Encode { path: path.clone(), message: error.to_string() };
        let runs: BTreeMap<&str, String> =
            self.rig.names().map(|name| (name, format!("{name}/run.json"))).collect();
        let mut manifest = serde_json::json!({
            "version": self.version,
            "adapter": self.adapter,
            "seed": self.rig.first().seed,
            "paths": RELATIVE_PATHS,
            "cameras": runs,
            "scenario": portable_rig(self.rig, folder).map_err(fail)?,
            "inputs": portable_inputs(&self.inputs, folder),
            "frames": self.frames,
            "shard": self.shard,
            "finished": self.finished,
        });
        if let (Some(variation), Some(root)) = (&self.variation, manifest.as_object_mut()) {
            root.insert("variation".into(), serde_json::to_value(variation).map_err(fail)?);
        }
        let text = serde_json::to_string_pretty(&manifest).map_err(fail)? + "\n";
        write_runs(folder, self.shard, &text)
    }
}
