//! All cameras of a file as a rig.

use std::path::Path;

use camsim_core::scenario::CameraSpec;

use super::poses::BodyAxes;
use super::{CameraFileError, CameraFormat, ImportOptions, import_document, key_error, open};

/// The cameras of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportedRig {
    /// The cameras, each with a name.
    pub cameras: Vec<CameraSpec>,
    /// Format that the file was read in.
    pub format: CameraFormat,
    /// Notes for the user; those that hold for one camera begin with its name.
    pub notes: Vec<String>,
}

impl ImportedRig {
    /// Text of a file with `[[cameras]]`, which a scenario names by `cameras = "FILE"`.
    ///
    /// # Errors
    /// Values that TOML cannot store.
    pub fn to_toml(&self) -> Result<String, toml::ser::Error> {
        #[derive(serde::Serialize)]
        struct File<'a> {
            cameras: &'a [CameraSpec],
        }
        toml::to_string(&File { cameras: &self.cameras })
    }
}

/// Imports every camera of a file, with poses, clocks and readouts. `options.camera` is not used; `options.body`
/// is forward, left, up if it is not given.
///
/// # Errors
/// As [`import_camera_with`](super::import_camera_with), for any of the cameras.
pub fn import_rig(path: &Path, options: &ImportOptions<'_>) -> Result<ImportedRig, CameraFileError> {
    let (document, format) = open(path, options)?;
    let names: Vec<String> = {
        let entries = (format.row().entries)(&document).map_err(|problem| key_error(path, problem))?;
        entries.iter().map(|entry| entry.name.clone()).collect()
    };
    let mut rig = ImportedRig { cameras: Vec::new(), format, notes: Vec::new() };
    let mut notes: Vec<(String, Vec<String>)> = Vec::new();
    for (index, name) in names.iter().enumerate() {
        let options = ImportOptions {
            camera: Some(name.as_str()).filter(|name| !name.is_empty()),
            body: Some(options.body.unwrap_or(BodyAxes::Flu)),
            ..*options
        };
        let mut imported = import_document(path, &document, format, &options)?;
        imported.spec.name = unique_name(name, index, &rig.cameras);
        if imported.spec.name != *name && !name.is_empty() {
            rig.notes.push(format!("the camera `{name}` is named {}", imported.spec.name));
        }
        notes.push((imported.spec.name.clone(), imported.notes));
        rig.cameras.push(imported.spec);
    }
    rig.notes.extend(merged(&notes));
    Ok(rig)
}

/// A name of letters, digits, - and _ that no other camera has.
fn unique_name(name: &str, index: usize, others: &[CameraSpec]) -> String {
    let plain: String = name
        .chars()
        .map(|c| if c.is_ascii_alphanumeric() || c == '-' || c == '_' { c } else { '_' })
        .collect();
    let plain = plain.trim_matches('_').to_owned();
    let is_free = |name: &str| !others.iter().any(|other| other.name.eq_ignore_ascii_case(name));
    if !plain.is_empty() && is_free(&plain) { plain } else { format!("{plain}cam{index}") }
}

/// Notes that all cameras have are given once.
fn merged(all: &[(String, Vec<String>)]) -> Vec<String> {
    let is_shared = |note: &String| all.len() > 1 && all.iter().all(|(_, notes)| notes.contains(note));
    let shared = all.first().into_iter().flat_map(|(_, notes)| notes.iter().filter(|note| is_shared(note)));
    let own = all.iter().flat_map(|(name, notes)| {
        notes.iter().filter(|note| !is_shared(note)).map(move |note| format!("{name}: {note}"))
    });
    shared.cloned().chain(own).collect()
}
