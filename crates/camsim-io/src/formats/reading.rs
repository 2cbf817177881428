//! Camera files: CAMERA.toml, and the calibration files of other programs.
//!
//! Each importer is a module that converts its part of a `Document` to an [`ImportedCamera`]. What camsim
//! does not support (skew, thin-prism terms, other lens models) is an error. The importer's table of keys
//! defines the treatment of each key; numbers under unknown keys are reported in notes.

use std::path::{Path, PathBuf};

use camsim_core::{camera::CameraModel, scenario::CameraSpec, validate::validate_camera};

use crate::kernel_file::{KernelFileError, load_kernel};
use crate::lens_table::{LensTableError, load_lens_table};
use crate::text::document::{Document, KeyProblem};
use crate::unlikely_camera;

pub(crate) mod format;
pub(crate) mod key_table;
pub(crate) mod lens_models;
pub(crate) mod other_text;
pub(crate) mod poses;
mod rig;
pub(crate) mod selection;
pub(crate) mod stated_size;
mod syntax;
pub(crate) mod timing;

use format::{ReadCamera, Selected};
use poses::Extrinsics;

pub use super::CameraFormat;
pub use super::lensfun::{LensfunCamera, LensfunQuery, import_lensfun};
pub use poses::BodyAxes;
pub use rig::{ImportedRig, import_rig};

/// Why a camera file cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum CameraFileError {
    /// The file could not be read.
    #[error("{}: cannot be read: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: std::io::Error,
    },
    /// The text has a syntax error.
    #[error("{}{}: {message}", path.display(), line.map_or(String::new(), |line| format!(":{line}")))]
    Syntax {
        /// The file.
        path: PathBuf,
        /// Line from 1, where known.
        line: Option<usize>,
        /// The problem and the remedy.
        message: String,
    },
    /// The content matches no format, or several.
    #[error("{}: {problem}; supported are {}", path.display(), all_titles())]
    Format {
        /// The file.
        path: PathBuf,
        /// The problem.
        problem: String,
    },
    /// A key is missing, has an invalid value, or is not supported.
    #[error("{}: {key}: {message}", path.display())]
    Key {
        /// The file.
        path: PathBuf,
        /// Path of the key.
        key: String,
        /// The problem and the remedy.
        message: String,
    },
    /// The file of a lens cannot be used.
    #[error(transparent)]
    LensTable(#[from] LensTableError),
    /// The file of a kernel cannot be used.
    #[error("{0}; check point_spread.kernel")]
    Kernel(#[from] KernelFileError),
    /// The values do not make a camera.
    #[error("{}: {source}", path.display())]
    Camera {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: camsim_core::camera::CameraError,
    },
}

/// An imported camera.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportedCamera {
    /// The camera.
    pub spec: CameraSpec,
    /// Format that the file was read in.
    pub format: CameraFormat,
    /// Notes for the user about assumptions and values that are not applied.
    pub notes: Vec<String>,
}

/// Choices of an import.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ImportOptions<'a> {
    /// Format of the file; `None`: the detected one.
    pub format: Option<CameraFormat>,
    /// Name of the camera in a file with several.
    pub camera: Option<&'a str>,
    /// Size of the pictures, for files that state none.
    pub size_px: Option<[u32; 2]>,
    /// Axes to which the poses of the file refer. `None`: poses and clocks are reported, not applied.
    pub body: Option<BodyAxes>,
}

/// Reads a CAMERA.toml: the keys of a scenario's `[camera]` at its root. Relative paths are relative to its
/// folder.
pub fn read_camera_toml(path: &Path) -> Result<CameraSpec, CameraFileError> {
    let text = read(path)?;
    let mut spec: CameraSpec = toml::from_str(&text).map_err(|error| CameraFileError::Syntax {
        path: path.to_owned(),
        line: error.span().map(|span| line_of(&text, span.start)),
        message: with_nearest_key(error.message()),
    })?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let lens_table = spec.lens_table.as_mut().map(|table| &mut table.path);
    let kernel = spec.point_spread.as_mut().and_then(|spread| spread.kernel.as_mut());
    let kernel = kernel.map(|file| &mut file.path);
    let files = [spec.photometric.vignette.as_mut(), spec.zoom_track.as_mut(), lens_table, kernel];
    for file in files.into_iter().flatten() {
        *file = folder.join(&*file);
    }
    load_lens_table(&mut spec)?;
    load_kernel(&mut spec)?;
    check(path, &spec)?;
    Ok(spec)
}

/// Imports another program's calibration in the detected format; [`import_camera_as`] returns the notes too.
pub fn import_camera(path: &Path) -> Result<CameraSpec, CameraFileError> {
    import_camera_as(path, None).map(|imported| imported.spec)
}

/// Imports another program's calibration in a given or the detected format. A file with several cameras is
/// refused; see [`import_camera_named`].
pub fn import_camera_as(
    path: &Path,
    format: Option<CameraFormat>,
) -> Result<ImportedCamera, CameraFileError> {
    import_camera_named(path, format, None)
}

/// Names of the cameras in a file, for [`import_camera_named`]; one empty name for a single camera without
/// name.
pub fn camera_names(path: &Path, format: Option<CameraFormat>) -> Result<Vec<String>, CameraFileError> {
    let (document, format) = open(path, &ImportOptions { format, ..ImportOptions::default() })?;
    let entries = (format.row().entries)(&document).map_err(|problem| key_error(path, problem))?;
    Ok(entries.into_iter().map(|entry| entry.name).collect())
}

/// Like [`import_camera_as`], for the camera of a name.
pub fn import_camera_named(
    path: &Path,
    format: Option<CameraFormat>,
    camera: Option<&str>,
) -> Result<ImportedCamera, CameraFileError> {
    import_camera_with(path, &ImportOptions { format, camera, ..ImportOptions::default() })
}

/// Imports a camera of another program's calibration.
///
/// # Errors
/// The file cannot be read, or does not hold one camera of the name that camsim can render.
pub fn import_camera_with(
    path: &Path,
    options: &ImportOptions<'_>,
) -> Result<ImportedCamera, CameraFileError> {
    let (document, format) = open(path, options)?;
    import_document(path, &document, format, options)
}

/// Imports a camera of a parsed file, and checks it.
fn import_document(
    path: &Path,
    document: &Document,
    format: CameraFormat,
    options: &ImportOptions<'_>,
) -> Result<ImportedCamera, CameraFileError> {
    let to_error = |problem| key_error(path, problem);
    let mut imported = import(document, format, options).map_err(to_error)?;
    check(path, &imported.spec)?;
    for doubt in unlikely_camera::doubts_of_calibration(&imported.spec) {
        if let Some(message) = doubt.refusal() {
            let name = options.camera.map_or(String::new(), |name| format!(" of {name}"));
            return Err(to_error(KeyProblem::new(format!("the focal length{name}"), message)));
        }
        imported.notes.push(doubt.to_string());
    }
    Ok(imported)
}

/// Titles of all formats, separated by commas.
fn all_titles() -> String {
    CameraFormat::ALL.map(|format| format.row().title).join(", ")
}

/// Parses a file and detects its format if none is given.
fn open(path: &Path, options: &ImportOptions<'_>) -> Result<(Document, CameraFormat), CameraFileError> {
    refuse_other_files(path)?;
    let text = read(path)?;
    let document = Document::parse(&text).map_err(|problem| CameraFileError::Syntax {
        path: path.to_owned(),
        line: problem.line,
        message: problem.message,
    })?;
    let format = match options.format {
        Some(format) => format,
        None => {
            detect(&document).map_err(|problem| CameraFileError::Format { path: path.to_owned(), problem })?
        }
    };
    let mut document = (format.row().prepare)(document);
    if let Some(size_px) = options.size_px {
        (format.row().complete)(&mut document, size_px);
    }
    Ok((document, format))
}

fn key_error(path: &Path, problem: KeyProblem) -> CameraFileError {
    CameraFileError::Key { path: path.to_owned(), key: problem.key, message: problem.message }
}

fn import(
    document: &Document,
    format: CameraFormat,
    options: &ImportOptions<'_>,
) -> Result<ImportedCamera, KeyProblem> {
    let reader = format.row();
    let entries = (reader.entries)(document)?;
    let index = selection::select(&entries, options.camera)?;
    let is_explicit = options.format.is_some();
    let selected = Selected { reader, document, entries: &entries, index, is_explicit };
    let entry = selected.entry();
    let parts = (reader.leaves)(&selected);
    for part in &parts {
        key_table::refuse(part.keys, &part.leaves)?;
    }
    let ReadCamera { mut spec, mut notes } =
        (reader.import)(&selected).map_err(|problem| entry.with_full_key(document, problem))?;
    stated_size::check(options.size_px, spec.size_px)?;
    let mut applied =
        if reader.has_common_timing { timing::apply(&parts, &mut spec, &mut notes)? } else { Vec::new() };
    applied.extend(entry.roots.iter().cloned());
    if let Some(axes) = options.body {
        let mut extrinsics = Extrinsics::default();
        (reader.poses)(&mut extrinsics, &selected)?;
        notes.extend(extrinsics.apply(axes, &mut spec));
        applied.extend(extrinsics.applied);
    }
    for part in &parts {
        notes.extend(key_table::unapplied_notes(part.keys, &part.leaves, &applied));
    }
    Ok(ImportedCamera { spec, format, notes })
}

/// Refuses CAMERA.toml, which needs no import, and binary files, with the command that converts them.
fn refuse_other_files(path: &Path) -> Result<(), CameraFileError> {
    let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default().to_ascii_lowercase();
    let message = match ending.as_str() {
        "toml" => {
            read_camera_toml(path)?;
            "this is a valid CAMERA.toml, which needs no import: use it in a scenario"
        }
        "bin" => {
            "this is a binary file: if it is from COLMAP, run `colmap model_converter --output_type TXT` and \
             import cameras.txt"
        }
        _ => return Ok(()),
    };
    Err(CameraFileError::Syntax { path: path.to_owned(), line: None, message: message.to_owned() })
}

/// The only format that a document matches.
fn detect(document: &Document) -> Result<CameraFormat, String> {
    let matching: Vec<CameraFormat> =
        CameraFormat::ALL.into_iter().filter(|format| format.row().has_marks_in(document)).collect();
    match matching[..] {
        [format] => Ok(format),
        [] => Err(format::unsupported_hint(document)
            .unwrap_or_else(|| "this is not a known camera file".to_owned())),
        _ => {
            let names: Vec<&str> = matching.iter().map(|format| format.name()).collect();
            Err(format!(
                "the content matches several formats ({}): select one with `--format`",
                names.join(", ")
            ))
        }
    }
}

/// Checks that the values make a camera.
pub(crate) fn check(path: &Path, spec: &CameraSpec) -> Result<(), CameraFileError> {
    let failed = |source| CameraFileError::Camera { path: path.to_owned(), source };
    CameraModel::from_spec(spec).map_err(failed)?;
    camsim_core::camera::ZoomTable::from_spec(spec).map_err(failed)?;
    match validate_camera(spec).into_iter().next() {
        None => Ok(()),
        Some(problem) => {
            let key = problem.key.strip_prefix("camera.").unwrap_or(&problem.key).to_owned();
            Err(CameraFileError::Key { path: path.to_owned(), key, message: problem.message })
        }
    }
}

/// Reads a text file without byte-order mark.
pub(crate) fn read(path: &Path) -> Result<String, CameraFileError> {
    let bytes =
        std::fs::read(path).map_err(|source| CameraFileError::Read { path: path.to_owned(), source })?;
    let text = String::from_utf8(bytes).map_err(|_| CameraFileError::Syntax {
        path: path.to_owned(),
        line: None,
        message: "this is not UTF-8 text: check that it is a camera file".to_owned(),
    })?;
    Ok(text.strip_prefix('\u{feff}').map_or_else(|| text.clone(), str::to_owned))
}

/// Line from 1 of a byte offset.
fn line_of(text: &str, offset: usize) -> usize {
    text.as_bytes().iter().take(offset).filter(|byte| **byte == b'\n').count() + 1
}

/// Adds the nearest known key to serde's "unknown field `a`, expected one of `b`, `c`".
fn with_nearest_key(message: &str) -> String {
    let mut words = message.split('`').skip(1).step_by(2);
    if !message.starts_with("unknown") {
        return message.to_owned();
    }
    let nearest = words.next().and_then(|unknown| {
        // All row times are given by readout_ms in a CAMERA.toml.
        let is_readout = ["line_delay", "readout", "rolling"].iter().any(|part| unknown.contains(part));
        let known: Vec<&str> = words.collect();
        let readout = known.iter().copied().find(|known| is_readout && *known == "readout_ms");
        readout.or_else(|| known.into_iter().min_by_key(|known| strsim::damerau_levenshtein(unknown, known)))
    });
    nearest.map_or_else(|| message.to_owned(), |nearest| format!("{message}; did you mean `{nearest}`?"))
}

#[cfg(test)]
mod tests;
