//! `export.json`: which run an export was made of, so that it can be completed, and is not mixed with another.

use std::path::Path;

use camsim_core::scenario::DatasetFormat;
use serde::{Deserialize, Serialize};

use super::{DatasetError, ExportOptions, RunFolder};
use crate::write::{FRAMES_CSV, POINTS_CSV, WriteError, write_atomic};

/// Contents of `export.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ExportRecord {
    /// Version of camsim that made the pictures.
    version: String,
    format: DatasetFormat,
    /// Checksum of scenario and inputs, without the choice of files.
    run: String,
    /// Checksum of the tables of frames.
    content: String,
    depth_per_metre: Option<f64>,
    /// Whether estimators get colour.
    #[serde(default)]
    color: bool,
    /// What the user should know; missing while the export is not finished.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    notes: Option<Vec<String>>,
}

/// What a folder holds.
pub(crate) enum Found {
    /// This export as a whole, with its notes.
    Complete(Vec<String>),
    /// A part of it.
    Incomplete,
    /// Nothing, or this export of fewer frames or channels.
    Other,
}

const FILE: &str = "export.json";

impl ExportRecord {
    pub(crate) fn new(
        run: &RunFolder,
        format: DatasetFormat,
        options: &ExportOptions,
    ) -> Result<Self, DatasetError> {
        let encode = |error: serde_json::Error| DatasetError::Input {
            path: run.path.join("run.json"),
            message: error.to_string(),
        };
        let mut identity = String::new();
        for camera in &run.cameras {
            let manifest = &camera.manifest;
            let mut scenario = serde_json::to_value(&manifest.scenario).map_err(encode)?;
            if let Some(output) = scenario.get_mut("output").and_then(serde_json::Value::as_object_mut) {
                // They choose files, and change none.
                ["channels", "format", "palette", "tracks", "twin", "datasets"].iter().for_each(|key| {
                    output.remove(*key);
                });
            }
            let inputs = serde_json::to_string(&manifest.inputs).map_err(encode)?;
            identity += &format!("{scenario}{inputs}");
        }
        Ok(Self {
            version: run.manifest().version.clone(),
            format,
            run: checksum(identity.as_bytes()),
            content: content(run)?,
            depth_per_metre: options.depth_per_metre,
            color: options.color,
            notes: None,
        })
    }

    /// Writes it, with the notes if the export is finished.
    pub(crate) fn write(&self, folder: &Path, notes: Option<&[String]>) -> Result<(), DatasetError> {
        let path = folder.join(FILE);
        let record = Self { notes: notes.map(<[String]>::to_vec), ..self.clone() };
        let text = serde_json::to_string_pretty(&record)
            .map_err(|error| WriteError::Encode { path: path.clone(), message: error.to_string() })?;
        Ok(write_atomic(&path, (text + "\n").as_bytes())?)
    }
}

fn checksum(bytes: &[u8]) -> String {
    format!("{:08x}-{}", crc32fast::hash(bytes), bytes.len())
}

/// Checksum of the tables that name frames, files and tracks.
fn content(run: &RunFolder) -> Result<String, DatasetError> {
    let mut all = String::new();
    let mut add = |path: &Path| -> Result<(), DatasetError> {
        match std::fs::read(path) {
            Ok(bytes) => all += &checksum(&bytes),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => all.push('-'),
            Err(error) => {
                let message = format!("cannot be read: {error}");
                return Err(DatasetError::Input { path: path.into(), message });
            }
        }
        Ok(())
    };
    for camera in &run.cameras {
        add(&camera.folder.join(FRAMES_CSV))?;
        add(&camera.folder.join(POINTS_CSV))?;
        for twin in camera.twins() {
            add(&camera.folder.join(&twin.name).join(FRAMES_CSV))?;
        }
    }
    Ok(checksum(all.as_bytes()))
}

/// What `folder` holds.
///
/// # Errors
/// It holds another export, or files without one.
pub(crate) fn check(
    folder: &Path,
    record: &ExportRecord,
    options: &ExportOptions,
) -> Result<Found, DatasetError> {
    let path = folder.join(FILE);
    let text = match std::fs::read_to_string(&path) {
        Ok(text) => text,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Found::Other),
        Err(error) => {
            return Err(DatasetError::Input { path, message: format!("cannot be read: {error}") });
        }
    };
    let old: Option<ExportRecord> = serde_json::from_str(&text).ok();
    let is_same = |old: &ExportRecord| {
        (&old.version, old.format, &old.run) == (&record.version, record.format, &record.run)
            && (old.depth_per_metre, old.color) == (record.depth_per_metre, record.color)
    };
    match old {
        Some(old) if is_same(&old) && old.content == record.content => {
            Ok(old.notes.map_or(Found::Incomplete, Found::Complete))
        }
        Some(old) if is_same(&old) => Ok(Found::Other),
        Some(_) if options.replace => {
            std::fs::remove_dir_all(folder)
                .map_err(|source| WriteError::Io { path: folder.into(), source })?;
            Ok(Found::Other)
        }
        _ => Err(DatasetError::Refused(format!(
            "{} holds an export of another run, layout, scale of depth or colour: choose another folder with -o, or remove \
             that one",
            folder.display()
        ))),
    }
}
