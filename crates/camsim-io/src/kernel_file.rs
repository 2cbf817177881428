//! Files of `camera.point_spread.kernel`: the picture of a point of light.
//!
//! A PNG or TIFF has its values as they are, without a transfer function; grey, or red, green and blue. An
//! EXR has the channels Y, or R, G and B. A CSV has a row of numbers for each row of pixels.

use std::path::{Path, PathBuf};

use camsim_core::{
    imaging::{KernelError, SpreadKernel},
    scenario::{CameraSpec, LoadedFile},
};

use crate::{
    frame_file::{FrameFileError, exr_planes::read_exr},
    raster::pictures::decode_bytes,
};

/// A kernel that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum KernelFileError {
    /// The file, or a location in it.
    #[error("{}{location}: {problem}", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// `, line N`, or nothing.
        location: String,
        /// The problem and the remedy.
        problem: String,
    },
    /// The values are no kernel.
    #[error("{}: the kernel {source}", path.display())]
    Kernel {
        /// The file.
        path: PathBuf,
        /// The problem and the remedy.
        source: KernelError,
    },
    /// An EXR that cannot be read.
    #[error(transparent)]
    Exr(#[from] FrameFileError),
}

/// Reads the kernel of a camera's point spread, if it has one that has not been read.
///
/// # Errors
/// The file cannot be read or holds no kernel.
pub fn load_kernel(camera: &mut CameraSpec) -> Result<(), KernelFileError> {
    let file = camera.point_spread.as_mut().and_then(|spread| spread.kernel.as_mut());
    if let Some(file) = file.filter(|file| !file.is_read()) {
        *file = LoadedFile::new(&file.path, read_kernel(&file.path)?);
    }
    Ok(())
}

/// Reads a kernel.
///
/// # Errors
/// As [`load_kernel`].
pub fn read_kernel(path: &Path) -> Result<SpreadKernel, KernelFileError> {
    let (size, channels) = read_values(path)?;
    SpreadKernel::new(size, channels).map_err(|source| KernelFileError::Kernel { path: path.into(), source })
}

/// Values of red, green and blue, row by row, and the numbers of columns and rows.
pub type ChannelValues = ([usize; 2], [Vec<f64>; 3]);

/// Reads the values of a picture or of a CSV as they are, those of whole numbers as fractions of the largest.
///
/// # Errors
/// The file cannot be read.
pub fn read_values(path: &Path) -> Result<ChannelValues, KernelFileError> {
    let has_ending = |ending: &str| path.extension().is_some_and(|other| other.eq_ignore_ascii_case(ending));
    match () {
        () if has_ending("exr") => exr(path),
        () if has_ending("csv") => csv(path),
        () => picture(path),
    }
}

fn fail(path: &Path, line: Option<u64>, problem: impl Into<String>) -> KernelFileError {
    let location = line.map_or(String::new(), |line| format!(", line {line}"));
    KernelFileError::Content { path: path.into(), location, problem: problem.into() }
}

fn exr(path: &Path) -> Result<ChannelValues, KernelFileError> {
    let planes = read_exr(path)?;
    let colors = planes.colors(None, None).map_err(|problem| fail(path, None, problem))?;
    let size = colors[0].size_px.map(|side| side as usize);
    Ok((size, colors.map(|plane| plane.values.iter().copied().map(f64::from).collect())))
}

fn picture(path: &Path) -> Result<ChannelValues, KernelFileError> {
    let bytes = std::fs::read(path).map_err(|error| fail(path, None, format!("cannot be read: {error}")))?;
    let picture = decode_bytes(&bytes)
        .map_err(|problem| fail(path, None, format!("{problem}; give a PNG, TIFF, EXR or CSV file")))?
        .into_rgb32f();
    let size = [picture.width() as usize, picture.height() as usize];
    let channel = |k: usize| picture.pixels().map(|pixel| f64::from(pixel.0[k])).collect();
    Ok((size, [0, 1, 2].map(channel)))
}

fn csv(path: &Path) -> Result<ChannelValues, KernelFileError> {
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_path(path)
        .map_err(|error| fail(path, None, error.to_string()))?;
    let (mut values, mut width, mut height) = (Vec::new(), 0, 0);
    for record in reader.records() {
        let record = record
            .map_err(|error| fail(path, error.position().map(csv::Position::line), error.to_string()))?;
        let line = record.position().map(csv::Position::line);
        if height > 0 && record.len() != width {
            let problem = format!("has {} values, and the rows before have {width}", record.len());
            return Err(fail(path, line, problem));
        }
        width = record.len();
        height += 1;
        for text in &record {
            values.push(text.parse::<f64>().map_err(|_| fail(path, line, format!("`{text}` is no number")))?);
        }
    }
    Ok(([width, height], [values.clone(), values.clone(), values]))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]
    use super::*;

    fn gray(size: [usize; 2], values: &[f64]) -> SpreadKernel {
        SpreadKernel::new(size, [values.to_vec(), values.to_vec(), values.to_vec()]).unwrap()
    }

    #[test]
    fn tables_and_pictures_hold_the_same_kernel() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let values = [0.0, 1.0, 2.0, 10.0, 3.0, 255.0];
        std::fs::write(path("k.csv"), "# of a star\n0, 1, 2\n10, 3, 255\n").unwrap();
        assert_eq!(read_kernel(&path("k.csv")).unwrap(), gray([3, 2], &values));
        image::GrayImage::from_raw(3, 2, values.map(|value| value as u8).to_vec())
            .unwrap()
            .save(path("k.png"))
            .unwrap();
        let (size, channels) = read_values(&path("k.png")).unwrap();
        assert_eq!(size, [3, 2]);
        for (found, value) in channels.iter().flat_map(|channel| channel.iter().zip(values)) {
            // Rounding of f32.
            assert!((found - value / 255.0).abs() < 1e-7, "{found} {value}");
        }
    }

    #[test]
    fn files_that_are_no_kernels_are_named_with_the_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        for (name, text, wanted) in [
            ("short.csv", "1,2\n3\n", "short.csv, line 2: has 1 values"),
            ("word.csv", "1,two\n", "word.csv, line 1: `two` is no number"),
            ("dark.csv", "0,0\n", "dark.csv: the kernel is black"),
            ("below.csv", "1,-1\n", "column 2, row 1"),
            ("empty.csv", "", "0 values"),
            ("text.png", "no picture", "give a PNG, TIFF, EXR or CSV file"),
        ] {
            std::fs::write(path(name), text).unwrap();
            let error = read_kernel(&path(name)).unwrap_err().to_string();
            assert!(error.contains(wanted), "{error}");
        }
        assert!(read_kernel(&path("gone.png")).unwrap_err().to_string().contains("cannot be read"));
    }
}
