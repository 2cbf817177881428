//! Decodes depth that is packed into the three bytes of a colour picture.

use std::path::Path;

use image::{DynamicImage, ImageFormat};

use super::{FrameFileError, images::failure};

/// Encoding of packed depth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Packing {
    /// That of the reference program: metres are (65025 R + 255 G + B) / 255.
    Packed24,
    /// That of CARLA: metres are 1000 (R + 256 G + 65536 B) / 16777215.
    Carla,
}

/// Depth of `packed24` that stands for the sky, metres: all bytes 255.
const PACKED24_SKY_M: f64 = 65_281.0;
/// Far plane of CARLA, metres: all bytes 255.
const CARLA_FAR_M: f64 = 1000.0;
/// Largest integer of three bytes.
const THREE_BYTES: f64 = 16_777_215.0;

/// Formulas of the encodings, for messages. The picture itself does not state its encoding.
pub(super) const FORMULAS: &str = "depth_encoding = \"carla\" where metres are 1000 (R + 256 G + 65536 B) / \
    16777215, or \"packed24\" where they are \
                                   (65025 R + 255 G + B) / 255";

/// Decodes a picture to metres, 0 for the sky. Packed bytes must not be filtered, so each pixel is decoded
/// alone.
pub(super) fn metres(
    picture: &DynamicImage,
    format: ImageFormat,
    packing: Packing,
    path: &Path,
) -> Result<Vec<f64>, FrameFileError> {
    if !matches!(format, ImageFormat::Png | ImageFormat::Bmp | ImageFormat::Pnm) {
        let message = "is not lossless: depth packed into bytes must be stored byte by byte; give it as PNG, \
            BMP or PPM";
        return Err(failure(path, message));
    }
    if !matches!(picture, DynamicImage::ImageRgb8(_) | DynamicImage::ImageRgba8(_)) {
        let message = "is no 8-bit RGB picture, which depth_encoding = \"packed24\" and \"carla\" are for; \
            leave that key out for 16-bit grey";
        return Err(failure(path, message));
    }
    Ok(picture.to_rgb8().pixels().map(|pixel| packing.metres(pixel.0.map(f64::from))).collect())
}

impl Packing {
    /// Value of `depth_encoding`.
    pub(super) fn word(self) -> &'static str {
        match self {
            Self::Packed24 => "packed24",
            Self::Carla => "carla",
        }
    }

    fn metres(self, [r, g, b]: [f64; 3]) -> f64 {
        let (metres, sky_m) = match self {
            Self::Packed24 => (r * 255.0 + g + b / 255.0, PACKED24_SKY_M),
            Self::Carla => (CARLA_FAR_M * (r + 256.0 * g + 65_536.0 * b) / THREE_BYTES, CARLA_FAR_M),
        };
        if metres >= sky_m { 0.0 } else { metres }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packed_bytes_are_decoded_by_formula() {
        assert!((Packing::Packed24.metres([12.0, 34.0, 51.0]) - 3094.2).abs() < 1e-9);
        assert_eq!(Packing::Packed24.metres([255.0; 3]), 0.0);
        // 167 772 of 16 777 215 parts of a kilometre.
        assert!((Packing::Carla.metres([92.0, 143.0, 2.0]) - 9.999_99).abs() < 1e-4);
        assert_eq!((Packing::Carla.metres([255.0; 3]), Packing::Carla.metres([0.0; 3])), (0.0, 0.0));
        assert!(Packing::Carla.metres([254.0, 255.0, 255.0]) > 999.999);
    }
}
