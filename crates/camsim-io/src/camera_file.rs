//! Camera files: CAMERA.toml, and the calibration files of other programs.
//!
//! An importer is one file here: it takes a [`Document`] and gives an [`ImportedCamera`], or says what it cannot take over. What
//! a camera here cannot express (skew, thin-prism terms, other lens models) is an error, never left out.

use std::path::{Path, PathBuf};

use camsim_core::camera::CameraModel;
use camsim_core::scenario::{CameraSpec, LensModel};

mod agisoft;
mod camodocal;
pub(crate) mod document;
mod gyroflow;
mod kalibr;
mod opencv;
mod reference;
mod ros;

use document::{Document, Problem};

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
    #[error(
        "{}: {what}; known are OpenCV YAML/XML, Kalibr camchain, EuRoC sensor.yaml, ROS camera_info, camodocal (VINS) YAML, the reference \
         program's XML, Agisoft XML and Gyroflow lens profiles",
        path.display()
    )]
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

/// Formats that can be imported.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CameraFormat {
    /// OpenCV FileStorage, YAML, XML or JSON.
    OpenCv,
    /// Kalibr camchain YAML.
    Kalibr,
    /// EuRoC `sensor.yaml`.
    Euroc,
    /// ROS `camera_info` YAML.
    RosCameraInfo,
    /// camodocal YAML, which VINS-Mono and VINS-Fusion read.
    Camodocal,
    /// XML of the paper's reference program.
    Reference,
    /// Agisoft Metashape, PhotoScan or Lens XML.
    Agisoft,
    /// Gyroflow lens profile JSON.
    Gyroflow,
}

impl CameraFormat {
    /// Every format, in the order of detection.
    pub const ALL: [Self; 8] =
        [Self::Reference, Self::Agisoft, Self::Gyroflow, Self::Kalibr, Self::Euroc, Self::RosCameraInfo, Self::Camodocal, Self::OpenCv];

    /// Its name for people and for `--format`.
    pub fn name(self) -> &'static str {
        match self {
            Self::OpenCv => "opencv",
            Self::Kalibr => "kalibr",
            Self::Euroc => "euroc",
            Self::RosCameraInfo => "ros-camera-info",
            Self::Camodocal => "camodocal",
            Self::Reference => "reference",
            Self::Agisoft => "agisoft",
            Self::Gyroflow => "gyroflow",
        }
    }

    fn fits(self, document: &Document) -> bool {
        match self {
            Self::OpenCv => opencv::fits(document),
            Self::Kalibr => kalibr::fits_camchain(document),
            Self::Euroc => kalibr::fits_euroc(document),
            Self::RosCameraInfo => ros::fits(document),
            Self::Camodocal => camodocal::fits(document),
            Self::Reference => reference::fits(document),
            Self::Agisoft => agisoft::fits(document),
            Self::Gyroflow => gyroflow::fits(document),
        }
    }

    fn import(self, document: &Document) -> Result<ImportedCamera, Problem> {
        match self {
            Self::OpenCv => opencv::import(document),
            Self::Kalibr => kalibr::import_camchain(document),
            Self::Euroc => kalibr::import_euroc(document),
            Self::RosCameraInfo => ros::import(document),
            Self::Camodocal => camodocal::import(document),
            Self::Reference => reference::import(document),
            Self::Agisoft => agisoft::import(document),
            Self::Gyroflow => gyroflow::import(document),
        }
    }
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

/// Reads a CAMERA.toml: the keys of a scenario's `[camera]` at its root. Paths in it are resolved against its folder.
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

/// Imports another program's calibration, whose format its content tells; see [`import_camera_as`] for the notes.
pub fn import_camera(path: &Path) -> Result<CameraSpec, CameraFileError> {
    import_camera_as(path, None).map(|imported| imported.spec)
}

/// Imports another program's calibration, in a given format or in the one that its content tells.
pub fn import_camera_as(path: &Path, format: Option<CameraFormat>) -> Result<ImportedCamera, CameraFileError> {
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
    let imported = format.import(&document).map_err(|problem| CameraFileError::Key {
        path: path.to_owned(),
        key: problem.key,
        message: problem.message,
    })?;
    check(path, &imported.spec)?;
    Ok(imported)
}

/// The one format whose marks the document bears.
fn detect(document: &Document) -> Result<CameraFormat, String> {
    let fitting: Vec<CameraFormat> = CameraFormat::ALL.into_iter().filter(|format| format.fits(document)).collect();
    match fitting[..] {
        [format] => Ok(format),
        [] => Err("this is no camera file that is known here".to_owned()),
        _ => {
            let names: Vec<&str> = fitting.iter().map(|format| format.name()).collect();
            Err(format!("the content fits several formats ({}): name the one that is meant", names.join(", ")))
        }
    }
}

fn check(path: &Path, spec: &CameraSpec) -> Result<(), CameraFileError> {
    let failed = |source| CameraFileError::Camera { path: path.to_owned(), source };
    CameraModel::from_spec(spec).map_err(failed)?;
    camsim_core::camera::ZoomTable::from_spec(spec).map_err(failed)?;
    Ok(())
}

fn read(path: &Path) -> Result<String, CameraFileError> {
    let bytes = std::fs::read(path).map_err(|source| CameraFileError::Read { path: path.to_owned(), source })?;
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
    let nearest = words.next().and_then(|unknown| words.min_by_key(|known| strsim::damerau_levenshtein(unknown, known)));
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
    coefficients.truncate(used);
    let mut spec = CameraSpec { size_px, focal_px, principal_point_px: Some(principal_point_px), ..CameraSpec::default() };
    // A Kannala-Brandt lens without coefficients is an equidistant fisheye, not a pinhole.
    spec.lens.model = if used == 0 && model == LensModel::BrownConrady { LensModel::Pinhole } else { model };
    spec.lens.coefficients = coefficients;
    ImportedCamera { spec, format, notes: Vec::new() }
}

#[cfg(test)]
mod tests;
