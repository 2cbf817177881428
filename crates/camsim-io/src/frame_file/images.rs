//! Reads colour pictures as linear light.

use std::path::Path;

use camsim_core::scene::linear_from_srgb;
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, metadata::Orientation};

use super::{
    ColorSpace, FrameFileError, FrameSpec,
    exr_planes::{ExrPlane, read_exr},
    png_chunks::PngChunks,
};
use crate::raster::pictures::largest_of_16_bits;

/// A colour picture as linear light.
pub(super) struct Color {
    /// Width, height.
    pub(super) size_px: [u32; 2],
    /// Position of the first pixel in the pixels of the file; `None` unless it is an EXR.
    pub(super) origin_px: Option<[i32; 2]>,
    /// Default principal point: the centre of the picture, or of the display window of an EXR.
    pub(super) centre_px: [f64; 2],
    /// Linear R, G, B, A (A = 1), row by row.
    pub(super) rgba: Vec<f32>,
    /// Notes about the file.
    pub(super) notes: Vec<String>,
}

/// R, G, B as stored, before linearisation.
struct ColorValues {
    size_px: [u32; 2],
    origin_px: Option<[i32; 2]>,
    centre_px: [f64; 2],
    rgb: Vec<f32>,
    notes: Vec<String>,
}

/// An error about a picture.
pub(super) fn failure(path: &Path, message: impl Into<String>) -> FrameFileError {
    FrameFileError::Picture { path: path.into(), message: message.into() }
}

/// Whether a path has the extension of EXR.
pub(super) fn is_exr(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("exr"))
}

/// Reads a colour picture. The default of `color_space` is linear for EXR and sRGB for other formats. Alpha
/// is not read.
pub(super) fn read_color(path: &Path, spec: &FrameSpec, frame_path: &Path) -> Result<Color, FrameFileError> {
    let exr = is_exr(path);
    if let (false, Some(key)) = (exr, spec.color_key()) {
        let message = "is for EXR, and color is none; leave it out".to_owned();
        return Err(FrameFileError::Key { path: frame_path.into(), key, message });
    }
    let decoded = if exr { read_exr_color(path, spec)? } else { read_encoded_color(path, spec, frame_path)? };
    let default = if exr { ColorSpace::Linear } else { ColorSpace::Srgb };
    let linear = |v: f32| {
        if spec.color_space.unwrap_or(default) == ColorSpace::Srgb { linear_from_srgb(v) } else { v }
    };
    let rgba: Vec<f32> =
        decoded.rgb.chunks_exact(3).flat_map(|p| [linear(p[0]), linear(p[1]), linear(p[2]), 1.0]).collect();
    if rgba.iter().any(|v| !v.is_finite()) {
        return Err(failure(
            path,
            "holds a NaN or an infinity, which blur would spread; clean the picture before",
        ));
    }
    let ColorValues { size_px, origin_px, centre_px, notes, .. } = decoded;
    Ok(Color { size_px, origin_px, centre_px, rgba, notes })
}

/// Reads a picture of any format but EXR.
fn read_encoded_color(
    path: &Path,
    spec: &FrameSpec,
    frame_path: &Path,
) -> Result<ColorValues, FrameFileError> {
    let DecodedPicture { picture, format, icc } = decode(path)?;
    let color_space_error =
        |message: String| FrameFileError::Key { path: frame_path.into(), key: "color_space", message };
    let advice = "set \"linear\" or \"srgb\"";
    if spec.color_space.is_none()
        && matches!(picture, DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_))
    {
        return Err(color_space_error(format!(
            "is missing: {} holds floats, which may be linear light or sRGB values: {advice}",
            path.display()
        )));
    }
    let chunks = if format == ImageFormat::Png { PngChunks::read(path) } else { PngChunks::default() };
    if let (None, Some(curve)) = (spec.color_space, chunks.foreign_transfer()) {
        return Err(color_space_error(format!("is missing: {} says {curve}: {advice}", path.display())));
    }
    let mut notes: Vec<String> = chunks
        .color_note()
        .into_iter()
        .chain(bit_depth_note(&picture))
        .map(|note| format!("{}: {note}", path.display()))
        .collect();
    if let Some(icc) = icc.filter(|icc| !icc.windows(4).any(|part| part == b"sRGB")) {
        let bytes = icc.len();
        notes.push(format!(
            "{}: its colour profile ({bytes} bytes of ICC) is not applied: values are taken as color_space \
                says",
            path.display()
        ));
    }
    if let Some(fraction) = transparent_fraction(&picture) {
        notes.push(format!(
            "{}: its alpha is not read: {:.1} % of the pixels are not opaque",
            path.display(),
            100.0 * fraction
        ));
    }
    let size_px = [picture.width(), picture.height()];
    let centre_px = size_px.map(|side| 0.5 * (f64::from(side) - 1.0));
    Ok(ColorValues { size_px, origin_px: None, centre_px, rgb: picture.to_rgb32f().into_raw(), notes })
}

/// A note if the largest value of a picture of 16 bits is below 2^14, as of pictures with 10 to 14 bits.
fn bit_depth_note(picture: &DynamicImage) -> Option<String> {
    let largest = largest_of_16_bits(picture).filter(|largest| (1..1 << 14).contains(largest))?;
    let white = (1_u32 << (u16::BITS - largest.leading_zeros())) - 1;
    Some(format!(
        "its values of 16 bits end at {largest} of 65535, which is white: the picture is nearly black. If \
            white is {white}, multiply its values by 65535 / {white}"
    ))
}

/// Fraction of pixels with alpha below 1; `None` if there are none.
fn transparent_fraction(picture: &DynamicImage) -> Option<f64> {
    if !picture.color().has_alpha() {
        return None;
    }
    let pixels = f64::from(picture.width()) * f64::from(picture.height());
    let transparent = picture.to_rgba16().pixels().filter(|pixel| pixel.0[3] < u16::MAX).count();
    (transparent > 0).then_some(transparent as f64 / pixels)
}

/// Decodes a picture of any format but EXR, detected by content.
pub(super) fn open(path: &Path) -> Result<(DynamicImage, ImageFormat), FrameFileError> {
    decode(path).map(|DecodedPicture { picture, format, .. }| (picture, format))
}

/// A decoded picture.
struct DecodedPicture {
    picture: DynamicImage,
    format: ImageFormat,
    /// Colour profile.
    icc: Option<Vec<u8>>,
}

/// Decodes a picture; one with an EXIF orientation is refused.
fn decode(path: &Path) -> Result<DecodedPicture, FrameFileError> {
    let reader = ImageReader::open(path).and_then(ImageReader::with_guessed_format).map_err(|error| {
        failure(path, format!("cannot be read: {error}; paths are relative to FRAME.toml"))
    })?;
    let Some(format) = reader.format() else {
        return Err(failure(
            path,
            "is no EXR, PNG, JPEG, BMP, PGM, TIFF or WebP file (depth may be PFM or .npy too)",
        ));
    };
    let decode_error = |error: image::ImageError| failure(path, format!("cannot be decoded: {error}"));
    let mut decoder = reader.into_decoder().map_err(decode_error)?;
    let orientation = decoder.orientation().unwrap_or(Orientation::NoTransforms);
    if orientation != Orientation::NoTransforms {
        return Err(failure(
            path,
            format!(
                "is stored turned (EXIF orientation {}), and depth, focal_px and principal_point_px may be \
                    of either: save it upright, or take the mark away \
                 where they go with the pixels as they are stored (`exiftool -Orientation=1 -n FILE`)",
                orientation.to_exif()
            ),
        ));
    }
    let icc = decoder.icc_profile().ok().flatten();
    // The limit protects against small files that claim huge sizes.
    image::Limits::default().reserve(decoder.total_bytes()).map_err(decode_error)?;
    let picture = DynamicImage::from_decoder(decoder).map_err(decode_error)?;
    if picture.width() == 0 || picture.height() == 0 {
        Err(failure(path, "has no pixel"))
    } else {
        Ok(DecodedPicture { picture, format, icc })
    }
}

/// Reads the colour channels of an EXR.
fn read_exr_color(path: &Path, spec: &FrameSpec) -> Result<ColorValues, FrameFileError> {
    let picture = read_exr(path)?;
    let colors = picture
        .colors(spec.color_channels.as_deref(), spec.color_layer.as_deref())
        .map_err(|message| failure(path, message))?;
    let rgb = (0..colors[0].values.len()).flat_map(|i| colors.map(|plane| plane.values[i])).collect();
    let ExrPlane { size_px, origin_px, .. } = *colors[0];
    let centre_px = [0, 1].map(|k| picture.display_centre_px[k] - f64::from(origin_px[k]));
    Ok(ColorValues {
        size_px,
        origin_px: Some(origin_px),
        centre_px,
        rgb,
        notes: picture.notes(spec.focal_px),
    })
}
