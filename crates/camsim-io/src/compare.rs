//! Compares two pictures or two folders of pictures (`camsim compare`).
//!
//! Stored values are compared, integers scaled to 0..=1: EXR with EXR (linear) and PNG with PNG (encoded),
//! never one with the other.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
};

use camsim_core::metrics::{self, Comparison, ImageView, MetricError};
use serde::Serialize;
use thiserror::Error;

use crate::frame_file::exr_planes;

/// Why two paths cannot be compared.
#[derive(Debug, Error)]
pub enum CompareError {
    /// A file or folder cannot be read.
    #[error("cannot read {}: {message}; give two EXR or PNG pictures, or two folders of \
        them", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        message: String,
    },
    /// The two are of different kinds: EXR and PNG, a file and a folder, other channels.
    #[error("{} and {} do not compare: {message}", a.display(), b.display())]
    Kind {
        /// First.
        a: PathBuf,
        /// Second.
        b: PathBuf,
        /// What differs.
        message: String,
    },
    /// The sizes differ.
    #[error("{} and {}: {source}", a.display(), b.display())]
    Metric {
        /// First.
        a: PathBuf,
        /// Second.
        b: PathBuf,
        /// What differs.
        source: MetricError,
    },
    /// Two folders that have no picture of the same name.
    #[error("{} and {} have no EXR or PNG of the same name; compare two output folders of one \
        scenario", a.display(), b.display())]
    NothingInCommon {
        /// First.
        a: PathBuf,
        /// Second.
        b: PathBuf,
    },
}

/// The figures of one comparison, as `camsim compare --json` prints them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Figures {
    /// Root mean square difference. NaN (null), as all but `differing`, if a NaN or an infinity of one picture
    /// faces another value.
    pub rmse: f64,
    /// Largest absolute difference.
    pub max: f64,
    /// Peak signal-to-noise ratio for a peak of 1, dB; null for equal pictures.
    pub psnr_db: Option<f64>,
    /// Structural similarity; null below 11 pixels of width or height.
    pub ssim: Option<f64>,
    /// Fraction of pixels that differ at all.
    pub differing: f64,
    /// Number of pixels with a NaN or an infinity in either picture. RMSE, maximum, PSNR and SSIM leave out
    /// those that are alike.
    pub non_finite: u64,
}

impl From<&Comparison> for Figures {
    fn from(c: &Comparison) -> Self {
        let psnr_db = Some(c.psnr_db()).filter(|psnr| psnr.is_finite());
        Self {
            rmse: c.rmse,
            max: c.max,
            psnr_db,
            ssim: c.ssim,
            differing: c.differing,
            non_finite: c.non_finite,
        }
    }
}

/// The figures of one file of two folders.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FileFigures {
    /// Path below both folders.
    pub file: String,
    /// Figures of the two files of this path.
    #[serde(flatten)]
    pub figures: Figures,
}

/// The figures of all files of one format.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FormatFigures {
    /// Extension of the files.
    pub format: String,
    /// Number of files.
    pub files: usize,
    /// Their figures together.
    #[serde(flatten)]
    pub figures: Figures,
}

/// Result of `camsim compare`: the figures of all files together, then of each format, then file by file.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// Figures of all files together: pooled RMSE, largest maximum, mean SSIM.
    #[serde(flatten)]
    pub total: Figures,
    /// Figures of each format: EXR has linear values and PNG encoded ones. Empty for two single files.
    pub formats: Vec<FormatFigures>,
    /// Figures file by file; empty for two single files.
    pub files: Vec<FileFigures>,
    /// Pictures that only the first folder has.
    pub only_in_a: Vec<String>,
    /// Pictures that only the second folder has.
    pub only_in_b: Vec<String>,
}

/// Compares two pictures, or all pictures of the same name below two folders.
///
/// # Errors
/// Something cannot be read, or two pictures differ in kind, channels or size.
pub fn compare_paths(a: &Path, b: &Path) -> Result<Report, CompareError> {
    match (a.is_dir(), b.is_dir()) {
        (false, false) => {
            let total = Figures::from(&compare_files(a, b)?);
            Ok(Report { total, formats: vec![], files: vec![], only_in_a: vec![], only_in_b: vec![] })
        }
        (true, true) => compare_folders(a, b),
        // A missing path is reported as missing, not as a file compared with a folder.
        _ if !a.exists() || !b.exists() => {
            let missing = if a.exists() { b } else { a };
            Err(CompareError::Kind {
                a: a.into(),
                b: b.into(),
                message: format!("{} does not exist", missing.display()),
            })
        }
        _ => Err(CompareError::Kind {
            a: a.into(),
            b: b.into(),
            message: "one is a folder; give two files or two folders".into(),
        }),
    }
}

/// Compares all pictures of the same path below two folders.
fn compare_folders(a: &Path, b: &Path) -> Result<Report, CompareError> {
    let (mut in_a, mut in_b) = (BTreeSet::new(), BTreeSet::new());
    pictures_below(a, "", &mut in_a)?;
    pictures_below(b, "", &mut in_b)?;
    let (mut files, mut all) = (Vec::new(), Vec::new());
    let mut by_format: BTreeMap<String, Vec<Comparison>> = BTreeMap::new();
    for name in in_a.intersection(&in_b) {
        let comparison = compare_files(&a.join(name), &b.join(name))?;
        files.push(FileFigures { file: name.clone(), figures: (&comparison).into() });
        let format = Path::new(name).extension().map(|extension| extension.to_string_lossy().into_owned());
        by_format.entry(format.unwrap_or_default()).or_default().push(comparison);
        all.push(comparison);
    }
    let total =
        Comparison::pooled(&all).ok_or_else(|| CompareError::NothingInCommon { a: a.into(), b: b.into() })?;
    let only = |one: &BTreeSet<String>, other: &BTreeSet<String>| one.difference(other).cloned().collect();
    let of_format = |(format, all): (String, Vec<Comparison>)| {
        let figures = (&Comparison::pooled(&all)?).into();
        Some(FormatFigures { format, files: all.len(), figures })
    };
    Ok(Report {
        total: (&total).into(),
        formats: by_format.into_iter().filter_map(of_format).collect(),
        files,
        only_in_a: only(&in_a, &in_b),
        only_in_b: only(&in_b, &in_a),
    })
}

/// Collects the paths of all pictures below `root`, recursively.
fn pictures_below(root: &Path, below: &str, names: &mut BTreeSet<String>) -> Result<(), CompareError> {
    let folder = root.join(below);
    let fail =
        |error: std::io::Error| CompareError::Read { path: folder.clone(), message: error.to_string() };
    for entry in fs::read_dir(&folder).map_err(fail)? {
        let entry = entry.map_err(fail)?;
        let file = entry.file_name().to_string_lossy().into_owned();
        let name = if below.is_empty() { file } else { format!("{below}/{file}") };
        // The type of the entry itself, so that links are not followed: they may form a cycle.
        if entry.file_type().map_err(fail)?.is_dir() {
            pictures_below(root, &name, names)?;
        } else if file_format(Path::new(&name)).is_some() {
            names.insert(name);
        }
    }
    Ok(())
}

/// `exr` or `png` by the extension; `None` for others.
fn file_format(path: &Path) -> Option<&'static str> {
    let extension = path.extension()?.to_str()?;
    ["exr", "png"].into_iter().find(|kind| extension.eq_ignore_ascii_case(kind))
}

/// A decoded picture.
struct ComparedPicture {
    size_px: [u32; 2],
    /// Names of the channels.
    channels: Vec<String>,
    /// Interleaved samples, row by row.
    samples: Vec<f32>,
}

impl ComparedPicture {
    fn view(&self, alpha: Option<usize>) -> ImageView<'_> {
        ImageView { size_px: self.size_px, channels: self.channels.len(), alpha, samples: &self.samples }
    }
}

fn compare_files(a: &Path, b: &Path) -> Result<Comparison, CompareError> {
    let differ = |message: String| CompareError::Kind { a: a.into(), b: b.into(), message };
    let (one, other) = (read(a)?, read(b)?);
    if file_format(a) != file_format(b) {
        return Err(differ("one is linear EXR, the other encoded PNG; compare files of one format".into()));
    }
    if one.channels != other.channels {
        return Err(differ(format!(
            "channels {} against {}",
            one.channels.join(" "),
            other.channels.join(" ")
        )));
    }
    let alpha = one.channels.iter().position(|name| name == "A");
    metrics::compare(one.view(alpha), other.view(alpha)).map_err(|source| CompareError::Metric {
        a: a.into(),
        b: b.into(),
        source,
    })
}

fn read(path: &Path) -> Result<ComparedPicture, CompareError> {
    let fail = |message: String| CompareError::Read { path: path.into(), message };
    match file_format(path) {
        Some("exr") => read_exr(path).map_err(fail),
        Some(_) => read_png(path).map_err(fail),
        None if path.exists() => Err(fail("it is neither .exr nor .png".into())),
        None => Err(fail("there is no such file".into())),
    }
}

/// Reads an EXR, with channels in the order R, G, B, A, and others by name.
fn read_exr(path: &Path) -> Result<ComparedPicture, String> {
    let mut planes = exr_planes::read(path).map_err(|error| error.to_string())?.planes;
    planes.sort_by_key(|plane| {
        (["R", "G", "B", "A"].iter().position(|name| *name == plane.name).unwrap_or(4), plane.name.clone())
    });
    let size_px @ [width, height] = planes.first().ok_or("it has no channels")?.size_px;
    let pixels = width as usize * height as usize;
    if planes.iter().any(|plane| plane.values.len() != pixels) {
        return Err("it has subsampled channels".into());
    }
    let samples = (0..pixels).flat_map(|pixel| planes.iter().map(move |plane| plane.values[pixel])).collect();
    Ok(ComparedPicture { size_px, channels: planes.into_iter().map(|plane| plane.name).collect(), samples })
}

fn read_png(path: &Path) -> Result<ComparedPicture, String> {
    let image = image::open(path).map_err(|error| error.to_string())?;
    let size_px = [image.width(), image.height()];
    let names: &[&str] = match image.color().channel_count() {
        1 => &["L"],
        2 => &["L", "A"],
        3 => &["R", "G", "B"],
        _ => &["R", "G", "B", "A"],
    };
    let samples = match names.len() {
        1 => image.to_luma32f().into_raw(),
        2 => image.to_luma_alpha32f().into_raw(),
        3 => image.to_rgb32f().into_raw(),
        _ => image.to_rgba32f().into_raw(),
    };
    Ok(ComparedPicture { size_px, channels: names.iter().map(|&name| name.into()).collect(), samples })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]
    use camsim_core::{
        frame::RenderedFrame,
        scenario::{ImageFormat, OutputEncoding, OutputSpec},
    };

    use super::*;
    use crate::write::{FrameFiles, FrameWriter};

    fn render(folder: &Path, value: f32, frames: u64, width: u32) {
        let spec = OutputSpec { format: vec![ImageFormat::Exr, ImageFormat::Png], ..OutputSpec::default() };
        let mut writer = FrameWriter::new(FrameFiles::new(folder, &spec, OutputEncoding::Linear8), 1);
        for index in 0..frames {
            let color = (0..width * 12).flat_map(|_| [value, value, value, 1.0]).collect();
            writer.write(RenderedFrame { index, ..RenderedFrame::picture([width, 12], color) }).unwrap();
        }
        writer.finish().unwrap();
    }

    #[test]
    fn folders_and_files_are_compared_and_mismatches_refused() {
        let dir = tempfile::tempdir().unwrap();
        let [a, b, c] = ["a", "b", "c"].map(|name| dir.path().join(name));
        render(&a, 0.5, 3, 16);
        render(&b, 0.25, 2, 16);
        render(&c, 0.5, 1, 17);

        let equal = compare_paths(&a, &a).unwrap();
        assert_eq!(
            (equal.total.rmse, equal.total.psnr_db, equal.total.differing, equal.files.len()),
            (0.0, None, 0.0, 6)
        );
        let json: serde_json::Value = serde_json::to_value(&equal).unwrap();
        for key in ["rmse", "max", "psnr_db", "ssim", "differing"] {
            assert!(json.get(key).is_some(), "{key}");
        }

        let report = compare_paths(&a, &b).unwrap();
        assert_eq!((report.files.len(), report.only_in_a.len(), report.only_in_b.len()), (4, 2, 0));
        assert_eq!(
            (report.files[0].file.as_str(), report.files[0].figures.rmse),
            ("color/frame_000000.exr", 0.25)
        );
        assert_eq!(report.total.differing, 1.0);
        let formats: Vec<(&str, usize, f64)> =
            report.formats.iter().map(|of| (of.format.as_str(), of.files, of.figures.max)).collect();
        assert!(
            formats[0] == ("exr", 2, 0.25) && formats[1].0 == "png" && formats[1].2 != 0.25,
            "{formats:?}"
        );

        let (exr, png) = ("color/frame_000000.exr", "color/frame_000000.png");
        assert_eq!(compare_paths(&a.join(exr), &b.join(exr)).unwrap().total.max, 0.25);
        for (one, other, expected) in [
            (a.join(exr), a.join(png), "compare files of one format"),
            (a.join(exr), c.join(exr), "16x12 against 17x12"),
            (a.clone(), a.join(exr), "one is a folder"),
            (a.join("no.png"), a.join(png), "cannot read"),
            (a.join("color"), b.join("nowhere"), "nowhere does not exist"),
            (a.join("color"), c.clone(), "no EXR or PNG of the same name"),
        ] {
            let error = compare_paths(&one, &other).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
        fs::write(a.join("broken.exr"), b"not an exr").unwrap();
        assert!(
            compare_paths(&a.join("broken.exr"), &a.join(exr))
                .unwrap_err()
                .to_string()
                .contains("broken.exr")
        );
    }
}
