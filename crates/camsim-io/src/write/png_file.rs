//! Encodes PNG files: colour in the encoding of `camera.photometric.output`, validity, contact sheets.

use std::{io::Cursor, path::Path};

use camsim_core::{frame::RenderedFrame, scenario::OutputEncoding, scene::luminance};
use image::{
    ExtendedColorType, ImageEncoder,
    codecs::png::{CompressionType, FilterType, PngEncoder},
};

use super::{
    WriteError,
    encode::{code8, code16, srgb8},
};

/// Encodes colour: RGBA of 8 or 16 bits, or luminance without alpha for the `luma` encodings.
pub(super) fn encode_color(
    path: &Path,
    frame: &RenderedFrame,
    output: OutputEncoding,
) -> Result<Vec<u8>, WriteError> {
    let pixels = frame.color_rgba().chunks_exact(4);
    let grey = |p: &[f32]| luminance([p[0], p[1], p[2]]);
    let (bytes, kind): (Vec<u8>, _) = match output {
        OutputEncoding::Srgb8 => (
            pixels.flat_map(|p| [srgb8(p[0]), srgb8(p[1]), srgb8(p[2]), code8(p[3])]).collect(),
            ExtendedColorType::Rgba8,
        ),
        OutputEncoding::Linear8 => {
            (frame.color_rgba().iter().map(|&v| code8(v)).collect(), ExtendedColorType::Rgba8)
        }
        // The encoder expects samples in native byte order.
        OutputEncoding::LinearF32 | OutputEncoding::LinearF16 => (
            frame.color_rgba().iter().flat_map(|&v| code16(v).to_ne_bytes()).collect(),
            ExtendedColorType::Rgba16,
        ),
        OutputEncoding::Luma8 => (pixels.map(|p| code8(grey(p))).collect(), ExtendedColorType::L8),
        OutputEncoding::Luma16 => {
            (pixels.flat_map(|p| code16(grey(p)).to_ne_bytes()).collect(), ExtendedColorType::L16)
        }
    };
    encode(path, frame.size_px, &bytes, kind)
}

/// Encodes validity: 255 where alpha is above 0.
pub(super) fn encode_valid(path: &Path, frame: &RenderedFrame) -> Result<Vec<u8>, WriteError> {
    let bytes: Vec<u8> =
        frame.color_rgba().chunks_exact(4).map(|p| if p[3] > 0.0 { 255 } else { 0 }).collect();
    encode(path, frame.size_px, &bytes, ExtendedColorType::L8)
}

/// Encodes numbers of objects or classes as 16 bit grey.
pub(super) fn encode_indices(path: &Path, size_px: [u32; 2], indices: &[u32]) -> Result<Vec<u8>, WriteError> {
    let mut bytes = Vec::with_capacity(2 * indices.len());
    for &index in indices {
        let index = u16::try_from(index).map_err(|_| WriteError::Encode {
            path: path.into(),
            message: format!("number {index} is above 65535, the largest that a 16 bit PNG holds"),
        })?;
        bytes.extend(index.to_ne_bytes());
    }
    encode(path, size_px, &bytes, ExtendedColorType::L16)
}

/// Encodes numbers of objects or classes as 8 bit RGB by [`palette_rgb8`].
pub(super) fn encode_palette(path: &Path, size_px: [u32; 2], indices: &[u32]) -> Result<Vec<u8>, WriteError> {
    let bytes: Vec<u8> = indices.iter().flat_map(|&index| palette_rgb8(index)).collect();
    encode(path, size_px, &bytes, ExtendedColorType::Rgb8)
}

/// Colour of the object or class with number n; black for 0. Hue h = fract(0.618034 n), by the golden ratio,
/// so that numbers near each other differ. Neighbouring hues recur after 34, 55, 89 ... numbers, so saturation
/// and brightness change too: s = 0.9, 0.55, 0.9, 0.55 and v = 1, 0.95, 0.65, 0.7 for n mod 4 = 0, 1, 2, 3.
/// Channel c (0 red, 1 green, 2 blue) is
///
/// ```text
/// 255 v (1 - s clamp(2 - |6 fract(h + (3 - c)/3) - 3|, 0, 1))
/// ```
#[must_use]
pub fn palette_rgb8(number: u32) -> [u8; 3] {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    if number == 0 {
        return [0; 3];
    }
    let hue = (GOLDEN * f64::from(number)).fract();
    let (saturation, value) = [(0.9, 1.0), (0.55, 0.95), (0.9, 0.65), (0.55, 0.7)][number as usize % 4];
    hue_rgb8(hue, saturation, value)
}

/// Colour of a hue, 0 to 1, a saturation and a brightness.
pub(super) fn hue_rgb8(hue: f64, saturation: f64, value: f64) -> [u8; 3] {
    [0.0, 1.0, 2.0].map(|channel| {
        let missing = (2.0 - (6.0 * (hue + (3.0 - channel) / 3.0).fract() - 3.0).abs()).clamp(0.0, 1.0);
        (255.0 * value * (1.0 - saturation * missing)).round() as u8
    })
}

/// Encodes samples.
pub(crate) fn encode(
    path: &Path,
    [width, height]: [u32; 2],
    bytes: &[u8],
    kind: ExtendedColorType,
) -> Result<Vec<u8>, WriteError> {
    let mut out = Cursor::new(Vec::new());
    PngEncoder::new_with_quality(&mut out, CompressionType::Fast, FilterType::Adaptive)
        .write_image(bytes, width, height, kind)
        .map_err(|error| WriteError::Encode { path: path.into(), message: error.to_string() })?;
    Ok(out.into_inner())
}

/// Writes a contact sheet as an sRGB PNG: frames in rows of `columns`, each reduced by the factor `shrink`
/// (mean of linear values).
///
/// # Errors
/// There is no frame, their sizes differ, or the file cannot be written.
pub fn contact_sheet(
    path: &Path,
    frames: &[RenderedFrame],
    columns: u32,
    shrink: u32,
) -> Result<(), WriteError> {
    let fail = |frame: u64, message: &str| WriteError::Frame { frame, message: message.into() };
    let first = frames.first().ok_or_else(|| fail(0, "a contact sheet needs at least one frame"))?;
    let (columns, shrink) = (columns.clamp(1, frames.len() as u32), shrink.max(1));
    let [width, height] = first.size_px.map(|side| (side / shrink).max(1));
    let sheet = [width * columns, height * (frames.len() as u32).div_ceil(columns)];
    let mut bytes = vec![0_u8; sheet[0] as usize * sheet[1] as usize * 3];
    for (index, frame) in frames.iter().enumerate() {
        let ([source_width, source_height], color_rgba) = (frame.size_px, frame.color_rgba());
        if frame.size_px != first.size_px
            || color_rgba.len() != source_width as usize * source_height as usize * 4
        {
            return Err(fail(frame.index, "its size is not that of the first frame of the contact sheet"));
        }
        let corner = [index as u32 % columns * width, index as u32 / columns * height];
        for y in 0..height {
            for x in 0..width {
                let mut sum = [0.0_f32; 3];
                let mut count = 0.0_f32;
                for sy in y * shrink..((y + 1) * shrink).min(source_height) {
                    for sx in x * shrink..((x + 1) * shrink).min(source_width) {
                        let first = (sy as usize * source_width as usize + sx as usize) * 4;
                        sum.iter_mut().zip(&color_rgba[first..]).for_each(|(sum, value)| *sum += value);
                        count += 1.0;
                    }
                }
                let first = ((corner[1] + y) as usize * sheet[0] as usize + (corner[0] + x) as usize) * 3;
                bytes[first..first + 3].copy_from_slice(&sum.map(|sum| srgb8(sum / count)));
            }
        }
    }
    super::write_atomic(path, &encode(path, sheet, &bytes, ExtendedColorType::Rgb8)?)
}
