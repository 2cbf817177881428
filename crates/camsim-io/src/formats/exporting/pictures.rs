//! Pictures for programs that want grey or RGB samples, and no alpha; with masks apart.

use std::path::Path;

use image::{DynamicImage, ExtendedColorType, ImageReader};

use super::run_folder::{RunCamera, RunFrame};
use super::{DatasetError, ExportJob};
use crate::write::encode_png;

/// Samples of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Samples {
    /// 8 bit grey.
    Grey,
    /// 8 bit RGB, or grey where the picture is.
    Color,
}

impl Samples {
    /// What estimators get: grey, or what the user asked for.
    pub(crate) fn of_estimators(job: &ExportJob<'_>) -> Self {
        if job.options.color { Self::Color } else { Self::Grey }
    }

    /// In words.
    pub(crate) fn words(self) -> &'static str {
        match self {
            Self::Grey => {
                "8 bit grey, 0.299 R + 0.587 G + 0.114 B of the encoded values, as OpenCV has it (`--color` for colour)"
            }
            Self::Color => "8 bit, without alpha",
        }
    }
}

/// Reads a picture of the run.
pub(crate) fn read(path: &Path) -> Result<DynamicImage, DatasetError> {
    let fail = |error: String| DatasetError::Input {
        path: path.into(),
        message: format!("cannot be read: {error}; render it again with --resume"),
    };
    let mut reader = ImageReader::open(path).map_err(|error| fail(error.to_string()))?;
    // It is a file of our own, of any size.
    reader.no_limits();
    reader.decode().map_err(|error| fail(error.to_string()))
}

/// Writes a frame's picture.
pub(crate) fn put(
    job: &ExportJob<'_>,
    camera: &RunCamera,
    frame: &RunFrame,
    samples: Samples,
    name: &str,
) -> Result<(), DatasetError> {
    let source = camera.file(frame, "color_png");
    job.target.make(name, || {
        let picture = read(&source)?;
        let size_px = [picture.width(), picture.height()];
        let is_grey = !picture.color().has_color();
        let rgb = picture.into_rgb8().into_raw();
        let (bytes, kind) = if is_grey || samples == Samples::Grey {
            (rgb.chunks_exact(3).map(grey).collect(), ExtendedColorType::L8)
        } else {
            (rgb, ExtendedColorType::Rgb8)
        };
        Ok(encode_png(&source, size_px, &bytes, kind)?)
    })
}

/// By the weights of ITU-R BT.601; grey pixels stay as they are.
fn grey(rgb: &[u8]) -> u8 {
    let [r, g, b] = [rgb[0], rgb[1], rgb[2]].map(u32::from);
    ((299 * r + 587 * g + 114 * b + 500) / 1000) as u8
}

/// Where the lens shows something, 255, and where not, 0; `None` if it shows something everywhere, or the run does not
/// say. It is the same in all pictures of a camera.
pub(crate) fn mask(camera: &RunCamera) -> Result<Option<Mask>, DatasetError> {
    let column = if camera.has("valid") { "valid" } else { "color_png" };
    let Some(source) = camera.frames.first().map(|frame| camera.file(frame, column)) else { return Ok(None) };
    let picture = read(&source)?;
    let size_px = [picture.width(), picture.height()];
    let seen: Vec<bool> = match column {
        "valid" => picture.into_luma8().pixels().map(|pixel| pixel.0[0] > 0).collect(),
        _ => picture.into_rgba16().pixels().map(|pixel| pixel.0[3] > 0).collect(),
    };
    Ok(seen.contains(&false).then_some(Mask { size_px, seen }))
}

/// Pixels of a camera that a ray belongs to.
pub(crate) struct Mask {
    size_px: [u32; 2],
    seen: Vec<bool>,
}

impl Mask {
    /// Writes it as 8 bit grey: this value where the lens shows something, the other one of 0 and 255 elsewhere.
    pub(crate) fn write(&self, job: &ExportJob<'_>, name: &str, seen: u8) -> Result<(), DatasetError> {
        let bytes: Vec<u8> =
            self.seen.iter().map(|is_seen| if *is_seen { seen } else { 255 - seen }).collect();
        let png = encode_png(&job.target.path(name), self.size_px, &bytes, ExtendedColorType::L8)?;
        Ok(crate::write::write_atomic(&job.target.path(name), &png)?)
    }
}
