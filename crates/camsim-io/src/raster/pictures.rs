//! Reads textures and grey images from PNG, JPEG, WebP, GIF (first frame), BMP and TIFF files. The format is
//! detected by content, not by name. An orientation (EXIF, or tag 274 of a TIFF) is applied.

use std::path::{Path, PathBuf};

use camsim_core::{
    photometric::{GrayImage, vignette_part},
    scenario::CameraSpec,
    scene::{Encoding, Texture, luminance},
};
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, metadata::Orientation};

use crate::{
    raster::decoded::{Raster, is_tiff, max_decoded_bytes},
    similar_file::suggestion,
};

/// Why a picture cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    /// The file cannot be opened.
    #[error("{path}: cannot be read: {source}{}", suggestion(path))]
    Open {
        /// The file.
        path: PathBuf,
        /// Error of the system.
        source: std::io::Error,
    },
    /// The content cannot be used.
    #[error("{path}: cannot be decoded: {reason}")]
    Decode {
        /// The file.
        path: PathBuf,
        /// What is wrong and, where known, what to do.
        reason: String,
    },
}

impl PictureError {
    pub(crate) fn open(path: &Path, source: std::io::Error) -> Self {
        Self::Open { path: path.into(), source }
    }

    /// The message without the path.
    pub(crate) fn reason(&self) -> String {
        match self {
            Self::Open { source, .. } => format!("cannot be read: {source}"),
            Self::Decode { reason, .. } => format!("cannot be decoded: {reason}"),
        }
    }

    pub(crate) fn decode(path: &Path, reason: impl Into<String>) -> Self {
        Self::Decode { path: path.into(), reason: reason.into() }
    }
}

/// Reads a picture as a texture of 8 bits. `encoding` is the transfer function of its values.
///
/// # Errors
///
/// [`PictureError`] names the file.
pub fn read_texture(path: &Path, encoding: Encoding) -> Result<Texture, PictureError> {
    let (texture, orientation) = if is_tiff(path)? {
        let raster = Raster::read(path)?;
        (raster.to_texture(path, encoding)?, raster.geo.orientation)
    } else {
        let StoredPicture { texture, orientation, .. } = read_stored(path, encoding)?;
        (texture, orientation)
    };
    Ok(match orientation {
        Some(orientation) => oriented(texture, orientation),
        None => texture,
    })
}

/// A picture other than TIFF, in its stored orientation.
pub(crate) struct StoredPicture {
    /// Pixels in stored order, rounded to 8 bits.
    pub(crate) texture: Texture,
    /// EXIF orientation (2 to 8), if it is not upright.
    pub(crate) orientation: Option<u64>,
    /// Largest colour value of a picture of 16 bits.
    pub(crate) largest_of_16_bits: Option<u16>,
}

/// Reads a picture other than TIFF without applying its orientation.
pub(crate) fn read_stored(path: &Path, encoding: Encoding) -> Result<StoredPicture, PictureError> {
    let (picture, orientation) = decode(path)?;
    let largest_of_16_bits = largest_of_16_bits(&picture);
    let picture = picture.into_rgba8();
    let exif_orientation = (orientation != Orientation::NoTransforms).then(|| orientation.to_exif().into());
    let texture =
        Texture { size_px: [picture.width(), picture.height()], rgba8: picture.into_raw(), encoding };
    Ok(StoredPicture { texture, orientation: exif_orientation, largest_of_16_bits })
}

/// Largest colour value of a picture of 16 bits; `None` for other depths.
pub(crate) fn largest_of_16_bits(picture: &DynamicImage) -> Option<u16> {
    match picture {
        DynamicImage::ImageLuma16(picture) => picture.iter().max().copied(),
        DynamicImage::ImageLumaA16(picture) => picture.pixels().map(|pixel| pixel.0[0]).max(),
        DynamicImage::ImageRgb16(picture) => picture.iter().max().copied(),
        DynamicImage::ImageRgba16(picture) => {
            picture.pixels().flat_map(|pixel| [pixel.0[0], pixel.0[1], pixel.0[2]]).max()
        }
        _ => None,
    }
}

/// Applies an EXIF orientation (1 to 8).
pub(crate) fn oriented(texture: Texture, orientation: u64) -> Texture {
    let transform =
        u8::try_from(orientation).ok().and_then(Orientation::from_exif).unwrap_or(Orientation::NoTransforms);
    let Texture { size_px: [width, height], rgba8, encoding } = texture;
    let Some(picture) = image::RgbaImage::from_raw(width, height, rgba8) else {
        return Texture::uniform([0; 4], encoding);
    };
    let mut picture = DynamicImage::ImageRgba8(picture);
    picture.apply_orientation(transform);
    Texture { size_px: [picture.width(), picture.height()], rgba8: picture.into_rgba8().into_raw(), encoding }
}

/// Reads the vignette map of a camera: of a part of the picture that the map covers, that part
/// ([`CameraSpec::files_of`]).
///
/// # Errors
/// As [`read_gray_image`].
pub fn read_vignette(camera: &CameraSpec) -> Result<Option<GrayImage>, PictureError> {
    let Some(path) = &camera.photometric.vignette else { return Ok(None) };
    let map = read_gray_image(path)?;
    Ok(Some(match &camera.files_of {
        Some(files_of) => vignette_part(&map, files_of, camera.size_px),
        None => map,
    }))
}

/// Reads a picture as grey values 0..=1, without undoing a transfer function. For vignettes. Colours become
/// Rec. 709 luma.
///
/// # Errors
///
/// [`PictureError`] names the file.
pub fn read_gray_image(path: &Path) -> Result<GrayImage, PictureError> {
    if is_tiff(path)? {
        let raster = Raster::read(path)?;
        let pixels = raster.size[0] as usize * raster.size[1] as usize;
        // Float values up to 255 would all be clipped to white.
        let max = if raster.is_integer_depth() == Some(false) {
            (0..pixels).map(|pixel| raster.value(pixel)).fold(0.0, f64::max)
        } else {
            0.0
        };
        if max > 1.0 + 1e-6 {
            return Err(PictureError::decode(
                path,
                format!(
                    "grey values of floats are 0 to 1, and the largest is {max}: divide them by what white \
                        is"
                ),
            ));
        }
        return match raster.geo.orientation {
            Some(orientation) => {
                Ok(gray_from_texture(&oriented(raster.to_texture(path, Encoding::Linear)?, orientation)))
            }
            None => raster.to_gray(path),
        };
    }
    let (mut picture, orientation) = decode(path)?;
    picture.apply_orientation(orientation);
    if picture.color().has_alpha() && picture.to_rgba8().pixels().any(|pixel| pixel.0[3] < u8::MAX) {
        return Err(PictureError::decode(
            path,
            "grey values are wanted, and parts of it are transparent: flatten it onto black or white",
        ));
    }
    let size_px = [picture.width(), picture.height()];
    let values = match picture {
        DynamicImage::ImageLuma8(gray) => gray.into_raw().into_iter().map(|v| f32::from(v) / 255.0).collect(),
        DynamicImage::ImageLuma16(gray) => {
            gray.into_raw().into_iter().map(|v| f32::from(v) / 65535.0).collect()
        }
        other => {
            let rgb = other.into_rgb16();
            rgb.pixels().map(|pixel| luma(pixel.0.map(|v| f32::from(v) / 65535.0))).collect()
        }
    };
    Ok(GrayImage { size_px, values })
}

/// Rec. 709 luma of a texture.
pub(crate) fn gray_from_texture(texture: &Texture) -> GrayImage {
    let values = texture
        .rgba8
        .chunks_exact(4)
        .map(|p| luma([p[0], p[1], p[2]].map(|v| f32::from(v) / 255.0)))
        .collect();
    GrayImage { size_px: texture.size_px, values }
}

/// Rec. 709 luma; exact for equal channels.
fn luma([r, g, b]: [f32; 3]) -> f32 {
    if r == g && g == b { r } else { luminance([r, g, b]) }
}

/// Size of an encoded picture in memory, pixels.
pub(crate) fn size_of_bytes(bytes: &[u8]) -> Result<[u32; 2], String> {
    if bytes.is_empty() {
        return Err("it has no bytes".into());
    }
    let reader = ImageReader::new(std::io::Cursor::new(bytes))
        .with_guessed_format()
        .map_err(|error| error.to_string())?;
    if reader.format().is_none() {
        return Err("it is none of them".into());
    }
    refuse_floats(reader.format())?;
    reader.into_dimensions().map(|(width, height)| [width, height]).map_err(|error| error.to_string())
}

/// Decodes a picture in memory.
pub(crate) fn decode_bytes(bytes: &[u8]) -> Result<DynamicImage, String> {
    let mut reader = ImageReader::new(std::io::Cursor::new(bytes))
        .with_guessed_format()
        .map_err(|error| error.to_string())?;
    let mut limits = image::Limits::default();
    limits.max_alloc = limits.max_alloc.map(|least| least.max(max_decoded_bytes(bytes.len() as u64)));
    reader.limits(limits);
    let picture = reader.decode().map_err(|error| error.to_string())?;
    if picture.width() == 0 || picture.height() == 0 {
        Err("the picture has no pixel".into())
    } else {
        Ok(picture)
    }
}

/// Refuses formats of linear floats: textures have 8 bits and end at white.
fn refuse_floats(format: Option<ImageFormat>) -> Result<(), String> {
    let name = match format {
        Some(ImageFormat::OpenExr) => "OpenEXR",
        Some(ImageFormat::Hdr) => "Radiance HDR",
        _ => return Ok(()),
    };
    Err(format!(
        "it is {name}, whose values are linear and go beyond white, while textures and maps end at \
         white: make a PNG of it, for example with `oiiotool IN --colorconvert linear sRGB -d uint8 -o OUT.png`. \
         Only emitted light goes beyond: a model's emissiveFactor with KHR_materials_emissive_strength, and \
         scene.sky_brightness"
    ))
}

/// Decodes a file. Returns pixels in stored order, and the orientation.
fn decode(path: &Path) -> Result<(DynamicImage, Orientation), PictureError> {
    let bytes = std::fs::metadata(path).map_err(|source| PictureError::open(path, source))?.len();
    let mut reader = ImageReader::open(path)
        .and_then(ImageReader::with_guessed_format)
        .map_err(|source| PictureError::open(path, source))?;
    if reader.format().is_none() {
        return Err(PictureError::decode(path, "not a PNG, JPEG, WebP, GIF, BMP or TIFF file"));
    }
    refuse_floats(reader.format()).map_err(|reason| PictureError::decode(path, reason))?;
    let decode_error = |error: image::ImageError| PictureError::decode(path, error.to_string());
    // The default limit of 512 MiB is raised in proportion to the size of the file.
    let mut limits = image::Limits::default();
    limits.max_alloc = limits.max_alloc.map(|least| least.max(max_decoded_bytes(bytes)));
    reader.limits(limits.clone());
    let mut decoder = reader.into_decoder().map_err(decode_error)?;
    let orientation = decoder.orientation().map_err(decode_error)?;
    limits.reserve(decoder.total_bytes()).map_err(decode_error)?;
    decoder.set_limits(limits).map_err(decode_error)?;
    let picture = DynamicImage::from_decoder(decoder).map_err(decode_error)?;
    if picture.width() == 0 || picture.height() == 0 {
        return Err(PictureError::decode(path, "the picture has no pixel"));
    }
    Ok((picture, orientation))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn pictures_of_floats_are_refused_with_the_remedy() {
        let folder = tempfile::tempdir().unwrap();
        let exr = folder.path().join("sky.exr");
        let white = |_, _| (3.0_f32, 1.0_f32, 0.5_f32);
        exr::prelude::write_rgb_file(&exr, 4, 3, white).unwrap();
        let hdr = folder.path().join("sky.hdr");
        std::fs::write(&hdr, b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n\x80\x80\x80\x81").unwrap();
        for (path, name) in [(&exr, "OpenEXR"), (&hdr, "Radiance HDR")] {
            let errors = [
                read_texture(path, Encoding::Srgb).unwrap_err().to_string(),
                read_gray_image(path).unwrap_err().to_string(),
            ];
            for error in errors {
                assert!(error.starts_with(&path.display().to_string()), "{error}");
                assert!(error.contains(&format!("it is {name}, whose values are linear")), "{error}");
                assert!(error.contains("oiiotool") && error.contains("emissiveFactor"), "{error}");
            }
            assert!(size_of_bytes(&std::fs::read(path).unwrap()).unwrap_err().contains(name));
        }
    }

    #[test]
    fn formats_are_detected_by_content() {
        let folder = tempfile::tempdir().unwrap();
        let mut picture = image::RgbaImage::from_pixel(3, 2, image::Rgba([10, 20, 30, 255]));
        picture.put_pixel(2, 1, image::Rgba([200, 100, 50, 255]));
        for format in [image::ImageFormat::Png, image::ImageFormat::Bmp, image::ImageFormat::Gif] {
            let path = folder.path().join("picture.dat");
            picture.save_with_format(&path, format).unwrap();
            let texture = read_texture(&path, Encoding::Srgb).unwrap();
            assert_eq!(texture.size_px, [3, 2]);
            assert_eq!(&texture.rgba8[20..23], [200, 100, 50], "{format:?}");
        }
    }

    #[test]
    fn grey_values_of_16_bits_are_exact() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("deep.png");
        image::ImageBuffer::<image::Luma<u16>, _>::from_raw(2, 1, vec![1u16, 65535])
            .unwrap()
            .save(&path)
            .unwrap();
        let gray = read_gray_image(&path).unwrap();
        assert_eq!(gray.values, [1.0 / 65535.0, 1.0]);
        let path = folder.path().join("colour.png");
        image::RgbImage::from_raw(2, 1, vec![255, 255, 255, 255, 0, 0]).unwrap().save(&path).unwrap();
        assert_eq!(read_gray_image(&path).unwrap().values, [1.0, 0.2126]);
    }

    #[test]
    fn errors_name_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let missing = folder.path().join("missing.png");
        assert!(
            read_texture(&missing, Encoding::Srgb)
                .unwrap_err()
                .to_string()
                .contains("missing.png: cannot be read")
        );
        for (name, bytes) in [
            ("empty.png", &b""[..]),
            ("text.png", b"hello, world"),
            ("cut.png", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR"),
            ("cut.tif", b"II*\0"),
        ] {
            let path = folder.path().join(name);
            std::fs::write(&path, bytes).unwrap();
            let text = read_texture(&path, Encoding::Srgb).unwrap_err().to_string();
            assert!(text.contains(name) && text.contains("cannot be"), "{text}");
            assert!(read_gray_image(&path).is_err());
        }
    }

    #[test]
    fn published_pictures_can_be_read() {
        let Some(data) = std::env::var_os("CAMSIM_DATA").map(PathBuf::from) else {
            eprintln!("CAMSIM_DATA is not set: real pictures are not read");
            return;
        };
        let pattern = data.join("camsim/acircles_pattern-patternsX-towards-imageTop(North).gif");
        assert_eq!(read_texture(&pattern, Encoding::Srgb).unwrap().size_px, [1830, 1330]);
        for name in ["camsim/vignet-S3LowOffset.bmp", "camsim/vignet-fisheye-640x480.bmp"] {
            let gray = read_gray_image(&data.join(name)).unwrap();
            assert_eq!(gray.size_px, [640, 480]);
            let (low, high) =
                gray.values.iter().fold((f32::MAX, f32::MIN), |(low, high), &v| (low.min(v), high.max(v)));
            assert!((0.0..0.2).contains(&low) && (0.6..=1.0).contains(&high), "{name} {low} {high}");
        }
        for (name, size) in [
            ("texture/DJI_0032.JPG", [4000, 2250]),
            ("texture/neon_2019_YELL_2_541000_4977000_image_crop.png", [1249, 1035]),
            ("terrain/brighton_beach/brighton_beach.jpg", [1865, 1085]),
            ("terrain/sertig/sertig_valley_color.tif", [641, 917]),
        ] {
            let texture = read_texture(&data.join(name), Encoding::Srgb).unwrap();
            assert_eq!(
                (texture.size_px, texture.rgba8.len()),
                (size, 4 * (size[0] * size[1]) as usize),
                "{name}"
            );
        }
    }
}
