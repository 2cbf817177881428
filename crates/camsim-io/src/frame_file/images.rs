//! Colour pictures as linear light.

use std::path::Path;

use camsim_core::scene::linear_from_srgb;
use image::{ImageFormat, ImageReader};

use super::{
    ColorSpace, FrameFileError, FrameSpec,
    exr_planes::{Plane, read_exr},
};

/// Linear R G B A (A = 1), row-major.
pub(super) struct Color {
    pub(super) size_px: [u32; 2],
    /// Of an EXR: where its first pixel is in the file's own pixels.
    pub(super) origin_px: Option<[i32; 2]>,
    /// Where the optical axis is if nothing else is said: the middle of the whole picture, of which an EXR may hold a part, or more.
    pub(super) centre_px: [f64; 2],
    pub(super) rgba: Vec<f32>,
}

/// R G B as stored.
struct Decoded {
    size_px: [u32; 2],
    origin_px: Option<[i32; 2]>,
    centre_px: [f64; 2],
    rgb: Vec<f32>,
}

pub(super) fn failure(path: &Path, message: impl Into<String>) -> FrameFileError {
    FrameFileError::Picture { path: path.into(), message: message.into() }
}

pub(super) fn is_exr(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("exr"))
}

/// EXR is linear unless declared sRGB, everything else sRGB unless declared linear. Alpha is not read.
pub(super) fn read_color(path: &Path, spec: &FrameSpec, frame_path: &Path) -> Result<Color, FrameFileError> {
    let exr = is_exr(path);
    if let (false, Some(key)) = (exr, spec.color_key()) {
        let message = "is for EXR, and color is none; leave it out".to_owned();
        return Err(FrameFileError::Key { path: frame_path.into(), key, message });
    }
    let decoded = if exr { read_exr_color(path, spec)? } else { read_encoded_color(path)? };
    let default = if exr { ColorSpace::Linear } else { ColorSpace::Srgb };
    let linear = |v: f32| if spec.color_space.unwrap_or(default) == ColorSpace::Srgb { linear_from_srgb(v) } else { v };
    let rgba: Vec<f32> = decoded.rgb.chunks_exact(3).flat_map(|p| [linear(p[0]), linear(p[1]), linear(p[2]), 1.0]).collect();
    if rgba.iter().any(|v| !v.is_finite()) {
        return Err(failure(path, "holds a NaN or an infinity, which blur would spread; clean the picture before"));
    }
    Ok(Color { size_px: decoded.size_px, origin_px: decoded.origin_px, centre_px: decoded.centre_px, rgba })
}

fn read_encoded_color(path: &Path) -> Result<Decoded, FrameFileError> {
    let picture = open(path)?.0;
    let size_px = [picture.width(), picture.height()];
    let centre_px = size_px.map(|side| 0.5 * (f64::from(side) - 1.0));
    Ok(Decoded { size_px, origin_px: None, centre_px, rgb: picture.to_rgb32f().into_raw() })
}

/// A picture that is no EXR; its format is told by content.
pub(super) fn open(path: &Path) -> Result<(image::DynamicImage, ImageFormat), FrameFileError> {
    let reader = ImageReader::open(path)
        .and_then(ImageReader::with_guessed_format)
        .map_err(|error| failure(path, format!("cannot be read: {error}; paths are relative to FRAME.toml")))?;
    let Some(format) = reader.format() else {
        return Err(failure(path, "is no EXR, PNG, JPEG, BMP or PGM file (depth may be TIFF or PFM too)"));
    };
    let picture = reader.decode().map_err(|error| failure(path, format!("cannot be decoded: {error}")))?;
    if picture.width() == 0 || picture.height() == 0 { Err(failure(path, "has no pixel")) } else { Ok((picture, format)) }
}

fn read_exr_color(path: &Path, spec: &FrameSpec) -> Result<Decoded, FrameFileError> {
    let picture = read_exr(path)?;
    let colors = picture.colors(spec.color_channels.as_deref(), spec.color_layer.as_deref()).map_err(|message| failure(path, message))?;
    let rgb = (0..colors[0].values.len()).flat_map(|i| colors.map(|plane| plane.values[i])).collect();
    let Plane { size_px, origin_px, .. } = *colors[0];
    let centre_px = [0, 1].map(|k| picture.display_centre_px[k] - f64::from(origin_px[k]));
    Ok(Decoded { size_px, origin_px: Some(origin_px), centre_px, rgb })
}
