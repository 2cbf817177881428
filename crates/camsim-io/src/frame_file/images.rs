//! Colour pictures as linear light.

use std::path::Path;

use camsim_core::scene::linear_from_srgb;
use exr::prelude::read_first_flat_layer_from_file;
use image::ImageReader;

use super::{ColorSpace, FrameFileError};

/// Linear R G B A (A = 1), row-major.
pub(super) struct Color {
    pub(super) size_px: [u32; 2],
    pub(super) rgba: Vec<f32>,
}

/// Planes of an EXR's first layer by name.
pub(super) struct Planes {
    pub(super) size_px: [u32; 2],
    pub(super) planes: Vec<(String, Vec<f32>)>,
}

pub(super) fn failure(path: &Path, message: impl Into<String>) -> FrameFileError {
    FrameFileError::Picture { path: path.into(), message: message.into() }
}

pub(super) fn is_exr(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("exr"))
}

/// EXR is linear unless declared sRGB, everything else sRGB unless declared linear. Alpha is not read.
pub(super) fn read_color(path: &Path, space: Option<ColorSpace>) -> Result<Color, FrameFileError> {
    let (size_px, rgb, default) =
        if is_exr(path) { with(read_exr_color(path)?, ColorSpace::Linear) } else { with(read_encoded_color(path)?, ColorSpace::Srgb) };
    let linear = |v: f32| if space.unwrap_or(default) == ColorSpace::Srgb { linear_from_srgb(v) } else { v };
    let rgba: Vec<f32> = rgb.chunks_exact(3).flat_map(|p| [linear(p[0]), linear(p[1]), linear(p[2]), 1.0]).collect();
    if rgba.iter().any(|v| !v.is_finite()) {
        return Err(failure(path, "holds a NaN or an infinity, which blur would spread; clean the picture before"));
    }
    Ok(Color { size_px, rgba })
}

fn with((size_px, rgb): ([u32; 2], Vec<f32>), default: ColorSpace) -> ([u32; 2], Vec<f32>, ColorSpace) {
    (size_px, rgb, default)
}

fn read_encoded_color(path: &Path) -> Result<([u32; 2], Vec<f32>), FrameFileError> {
    let picture = open(path)?;
    let size_px = [picture.width(), picture.height()];
    Ok((size_px, picture.to_rgb32f().into_raw()))
}

/// A picture that is no EXR; its format is told by content.
pub(super) fn open(path: &Path) -> Result<image::DynamicImage, FrameFileError> {
    let reader = ImageReader::open(path)
        .and_then(ImageReader::with_guessed_format)
        .map_err(|error| failure(path, format!("cannot be read: {error}; paths are relative to FRAME.toml")))?;
    if reader.format().is_none() {
        return Err(failure(path, "is no EXR, PNG, JPEG, BMP or PGM file"));
    }
    let picture = reader.decode().map_err(|error| failure(path, format!("cannot be decoded: {error}")))?;
    if picture.width() == 0 || picture.height() == 0 { Err(failure(path, "has no pixel")) } else { Ok(picture) }
}

fn read_exr_color(path: &Path) -> Result<([u32; 2], Vec<f32>), FrameFileError> {
    let Planes { size_px, planes } = read_exr(path)?;
    let named = |wanted: &str| {
        // "R", or the last part of a name such as "ViewLayer.Combined.R".
        planes.iter().find(|(name, _)| name.rsplit('.').next() == Some(wanted)).map(|(_, plane)| plane)
    };
    let colors = match (named("R"), named("G"), named("B"), named("Y")) {
        (Some(r), Some(g), Some(b), _) => [r, g, b],
        (_, _, _, Some(y)) => [y, y, y],
        _ => return Err(failure(path, format!("has no channels R G B or Y, but {}", list(&planes)))),
    };
    let rgb = (0..colors[0].len()).flat_map(|i| colors.map(|plane| plane[i])).collect();
    Ok((size_px, rgb))
}

pub(super) fn list(planes: &[(String, Vec<f32>)]) -> String {
    planes.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(" ")
}

pub(super) fn read_exr(path: &Path) -> Result<Planes, FrameFileError> {
    let image = read_first_flat_layer_from_file(path)
        .map_err(|error| failure(path, format!("cannot be read as EXR: {error}; paths are relative to FRAME.toml")))?;
    let layer = image.layer_data;
    let size_px = [layer.size.0 as u32, layer.size.1 as u32];
    let planes: Vec<(String, Vec<f32>)> =
        layer.channel_data.list.iter().map(|c| (c.name.to_string(), c.sample_data.values_as_f32().collect())).collect();
    let pixels = layer.size.0 * layer.size.1;
    if pixels == 0 || planes.iter().any(|(_, plane)| plane.len() != pixels) {
        return Err(failure(path, "has subsampled channels or no pixel"));
    }
    Ok(Planes { size_px, planes })
}
