//! Camera files: CAMERA.toml, and the calibration files of other programs.
//!
//! An importer is one file here: it takes its part of a `Document` and gives an [`ImportedCamera`], or says
//! what it cannot take over. What a camera here cannot express (skew, thin-prism terms, other lens models) is
//! an error, never left out. Its table of keys says what becomes of each; a number that no table knows is
//! named in a note.

use std::path::{Path, PathBuf};

use camsim_core::camera::CameraModel;
use camsim_core::scenario::{CameraSpec, LensModel, validate_camera};

mod agisoft;
mod basalt;
mod camodocal;
mod choose;
mod colmap;
pub(crate) mod document;
mod format;
mod gyroflow;
mod kalibr;
mod keys;
mod models;
mod ncamera;
mod okvis;
mod opencv;
mod opensfm;
mod orb_slam;
mod reference;
mod ros;
mod ros_ini;
mod syntax;
mod times;
mod vikit;

use document::{Document, Problem};
pub use format::CameraFormat;

/// What can go wrong with a camera file.
#[derive(Debug, thiserror::Error)]
pub enum CameraFileError {
    /// The file could not be read.
    #[error("{}: cannot be read: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The text is not what its format wants.
    #[error("{}{}: {message}", path.display(), line.map_or(String::new(), |line| format!(":{line}")))]
    Syntax {
        /// The file.
        path: PathBuf,
        /// Line from 1, where known.
        line: Option<usize>,
        /// What is wrong and what to do.
        message: String,
    },
    /// None of the known formats, or several.
    #[error("{}: {what}; known are {}", path.display(), format::all_titles())]
    Format {
        /// The file.
        path: PathBuf,
        /// What was found.
        what: String,
    },
    /// A key is missing, has a wrong value, or asks for what a camera here cannot do.
    #[error("{}: {key}: {message}", path.display())]
    Key {
        /// The file.
        path: PathBuf,
        /// The key.
        key: String,
        /// What is wrong and what to do.
        message: String,
    },
    /// The numbers do not make a camera.
    #[error("{}: {source}", path.display())]
    Camera {
        /// The file.
        path: PathBuf,
        /// Why not.
        source: camsim_core::camera::CameraError,
    },
}

/// What an import gives.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportedCamera {
    /// The camera.
    pub spec: CameraSpec,
    /// What the file was read as.
    pub format: CameraFormat,
    /// Choices made and things left out that somebody should know.
    pub notes: Vec<String>,
}

/// Reads a CAMERA.toml: the keys of a scenario's `[camera]` at its root. Paths in it are resolved against its
/// folder.
pub fn read_camera_toml(path: &Path) -> Result<CameraSpec, CameraFileError> {
    let text = read(path)?;
    let mut spec: CameraSpec = toml::from_str(&text).map_err(|error| CameraFileError::Syntax {
        path: path.to_owned(),
        line: error.span().map(|span| line_of(&text, span.start)),
        message: with_nearest_key(error.message()),
    })?;
    check(path, &spec)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    for file in [&mut spec.photometric.vignette, &mut spec.zoom_track].into_iter().flatten() {
        *file = folder.join(&*file);
    }
    Ok(spec)
}

/// Imports another program's calibration, whose format its content tells; see [`import_camera_as`] for the
/// notes.
pub fn import_camera(path: &Path) -> Result<CameraSpec, CameraFileError> {
    import_camera_as(path, None).map(|imported| imported.spec)
}

/// Imports another program's calibration, in a given format or in the one that its content tells. A file of
/// several cameras is refused; see [`import_camera_named`].
pub fn import_camera_as(
    path: &Path,
    format: Option<CameraFormat>,
) -> Result<ImportedCamera, CameraFileError> {
    import_camera_named(path, format, None)
}

/// Names of the cameras in a file, by which [`import_camera_named`] finds them; one empty name if the file
/// has one camera and no name for it.
pub fn camera_names(path: &Path, format: Option<CameraFormat>) -> Result<Vec<String>, CameraFileError> {
    let (document, format) = open(path, format)?;
    let entries = format.entries(&document).map_err(|problem| at_key(path, problem))?;
    Ok(entries.into_iter().map(|entry| entry.name).collect())
}

/// As [`import_camera_as`], out of several cameras the one of that name.
pub fn import_camera_named(
    path: &Path,
    format: Option<CameraFormat>,
    camera: Option<&str>,
) -> Result<ImportedCamera, CameraFileError> {
    let asked = format.is_some();
    let (document, format) = open(path, format)?;
    let at_key = |problem| at_key(path, problem);
    let mut imported = import(&document, format, asked, camera).map_err(at_key)?;
    imported.notes.extend(doubts(&imported.spec).map_err(at_key)?);
    check(path, &imported.spec)?;
    Ok(imported)
}

fn open(path: &Path, format: Option<CameraFormat>) -> Result<(Document, CameraFormat), CameraFileError> {
    refuse_own_files(path)?;
    let text = read(path)?;
    let document = Document::parse(&text).map_err(|problem| CameraFileError::Syntax {
        path: path.to_owned(),
        line: problem.line,
        message: problem.message,
    })?;
    let format = match format {
        Some(format) => format,
        None => detect(&document).map_err(|what| CameraFileError::Format { path: path.to_owned(), what })?,
    };
    let document = if format == CameraFormat::Reference { reference::in_force(&document) } else { document };
    Ok((document, format))
}

fn at_key(path: &Path, problem: Problem) -> CameraFileError {
    CameraFileError::Key { path: path.to_owned(), key: problem.key, message: problem.message }
}

fn import(
    document: &Document,
    format: CameraFormat,
    asked: bool,
    camera: Option<&str>,
) -> Result<ImportedCamera, Problem> {
    let entries = format.entries(document)?;
    let entry = &entries[choose::choose(&entries, camera)?];
    let parts = format.parts(document, &entries, entry);
    for part in &parts {
        keys::refuse(part.keys, &part.leaves)?;
    }
    let mut imported =
        format.import(document, entry, asked).map_err(|problem| entry.placed(document, problem))?;
    let mut done =
        if format == CameraFormat::Reference { Vec::new() } else { times::apply(&parts, &mut imported)? };
    done.extend(entry.roots.iter().cloned());
    for part in &parts {
        imported.notes.extend(keys::left_out(part.keys, &part.leaves, &done));
    }
    Ok(imported)
}

/// A CAMERA.toml needs no import; binary files of programs whose text is known get a word on how to convert
/// them.
fn refuse_own_files(path: &Path) -> Result<(), CameraFileError> {
    let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default().to_ascii_lowercase();
    let what = match ending.as_str() {
        "toml" => {
            read_camera_toml(path)?;
            "this is a CAMERA.toml, and a good one: give it to a scenario as it is"
        }
        "bin" => {
            "this is binary; of COLMAP, run `colmap model_converter --output_type TXT` and import cameras.txt"
        }
        _ => return Ok(()),
    };
    Err(CameraFileError::Syntax { path: path.to_owned(), line: None, message: what.to_owned() })
}

/// The one format whose marks the document bears.
fn detect(document: &Document) -> Result<CameraFormat, String> {
    let fitting: Vec<CameraFormat> =
        CameraFormat::ALL.into_iter().filter(|format| format.fits(document)).collect();
    match fitting[..] {
        [format] => Ok(format),
        [] => {
            Err(format::hint(document)
                .unwrap_or_else(|| "this is no camera file that is known here".to_owned()))
        }
        _ => {
            let names: Vec<&str> = fitting.iter().map(|format| format.name()).collect();
            Err(format!(
                "the content fits several formats ({}): name the one that is meant with `--format`",
                names.join(", ")
            ))
        }
    }
}

/// Numbers that are no camera's in pixels are refused; those that are odd are spoken of.
fn doubts(spec: &CameraSpec) -> Result<Vec<String>, Problem> {
    let [width, height] = spec.size_px.map(f64::from);
    let [fx, fy] = spec.focal_px;
    if fx > 0.0 && fy > 0.0 && fx.min(fy) < 0.02 * width.max(height) {
        let text = format!(
            "is {fx} and {fy} for a picture of {width} x {height}: too short for pixels. Are these fractions of a side, or millimetres?"
        );
        return Err(Problem::new("the focal length", text));
    }
    let mut notes = Vec::new();
    if fx > 0.0 && fy > 0.0 && !(0.5..=2.0).contains(&(fx / fy)) {
        notes.push(format!(
            "the focal lengths {fx} and {fy} px differ by more than a factor of two: are they right?"
        ));
    }
    if spec.lens.model != LensModel::KannalaBrandt && fx > 0.0 && fx < 0.15 * width {
        let degrees = 2.0 * (0.5 * width / fx).atan().to_degrees();
        notes.push(format!("the picture spans about {degrees:.0} degrees across, a lot for a lens that is no fisheye: is the focal length of {fx} in pixels?"));
    }
    notes.extend(spec.principal_point_px.and_then(|point| doubt_of_middle([width, height], point)));
    Ok(notes)
}

/// A principal point that would be the middle of a picture of another size, or is nowhere in this one.
fn doubt_of_middle([width, height]: [f64; 2], [cx, cy]: [f64; 2]) -> Option<String> {
    let there = [2.0 * cx + 1.0, 2.0 * cy + 1.0];
    let size = |[x, y]: [f64; 2]| format!("{x:.0} x {y:.0}");
    let [across, down] = [there[0] / width, there[1] / height];
    let turned = [there[0] / height, there[1] / width].iter().all(|ratio| (0.92..=1.08).contains(ratio));
    if turned && !(0.9..=1.1).contains(&(width / height)) {
        let text = format!(
            "the principal point ({cx}, {cy}) would be the middle of a picture of about {}, but the size is {}: is it turned?",
            size(there),
            size([width, height])
        );
        return Some(text);
    }
    if (across.max(down) < 0.85 || across.min(down) > 1.15) && (0.95..=1.05).contains(&(across / down)) {
        let text = format!(
            "the principal point ({cx}, {cy}) would be the middle of a picture of about {}, not of {}: is the calibration of another size?",
            size(there),
            size([width, height])
        );
        return Some(text);
    }
    let inside = (-0.5..=width - 0.5).contains(&cx) && (-0.5..=height - 0.5).contains(&cy);
    (!inside).then(|| {
        format!(
            "the principal point ({cx}, {cy}) is outside of the picture of {}: is the size that of the calibration?",
            size([width, height])
        )
    })
}

fn check(path: &Path, spec: &CameraSpec) -> Result<(), CameraFileError> {
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

fn read(path: &Path) -> Result<String, CameraFileError> {
    let bytes =
        std::fs::read(path).map_err(|source| CameraFileError::Read { path: path.to_owned(), source })?;
    let text = String::from_utf8(bytes).map_err(|_| CameraFileError::Syntax {
        path: path.to_owned(),
        line: None,
        message: "this is no text in UTF-8: is it a camera file?".to_owned(),
    })?;
    Ok(text.strip_prefix('\u{feff}').map_or_else(|| text.clone(), str::to_owned))
}

fn line_of(text: &str, offset: usize) -> usize {
    text.as_bytes().iter().take(offset).filter(|byte| **byte == b'\n').count() + 1
}

/// Adds to serde's "unknown field `a`, expected one of `b`, `c`" which of them is nearest to `a`.
fn with_nearest_key(message: &str) -> String {
    let mut words = message.split('`').skip(1).step_by(2);
    if !message.starts_with("unknown") {
        return message.to_owned();
    }
    let nearest = words.next().and_then(|unknown| {
        // Times of rows are all told by the readout, however they are spelt.
        let is_readout = ["line_delay", "readout", "rolling"].iter().any(|part| unknown.contains(part));
        let known: Vec<&str> = words.collect();
        let readout = known.iter().copied().find(|known| is_readout && *known == "readout_ms");
        readout.or_else(|| known.into_iter().min_by_key(|known| strsim::damerau_levenshtein(unknown, known)))
    });
    nearest.map_or_else(|| message.to_owned(), |nearest| format!("{message}; did you mean `{nearest}`?"))
}

/// A camera of plain numbers; the rest is as by default.
fn camera(
    format: CameraFormat,
    size_px: [u32; 2],
    focal_px: [f64; 2],
    principal_point_px: [f64; 2],
    model: LensModel,
    mut coefficients: Vec<f64>,
) -> ImportedCamera {
    let used = coefficients.iter().rposition(|k| *k != 0.0).map_or(0, |last| last + 1);
    // Three would be k1, k2 and p1, but could be taken for k1, k2 and k3.
    coefficients.truncate(if used == 3 && model == LensModel::BrownConrady { 4 } else { used });
    let mut spec = CameraSpec {
        size_px,
        focal_px,
        principal_point_px: Some(principal_point_px),
        ..CameraSpec::default()
    };
    // A Kannala-Brandt lens without coefficients is an equidistant fisheye, not a pinhole.
    spec.lens.model = if used == 0 && model == LensModel::BrownConrady { LensModel::Pinhole } else { model };
    spec.lens.coefficients = coefficients;
    ImportedCamera { spec, format, notes: Vec::new() }
}

#[cfg(test)]
mod tests;
