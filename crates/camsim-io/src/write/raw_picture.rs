//! Raw pictures: the digital numbers of an image sensor as they are, in 16 bits.

use std::{io::Cursor, path::Path};

use camsim_core::{
    frame::RawPicture,
    scenario::{ExrCompression, ExrPixel, RawFormat},
};
use image::{ExtendedColorType, ImageEncoder, codecs::tiff::TiffEncoder};

use super::{WriteError, exr_file, png_file};

/// Encodes a raw picture: one grey channel, or red, green and blue.
pub(super) fn encode(
    path: &Path,
    size_px: [u32; 2],
    raw: &RawPicture,
    format: RawFormat,
    compression: ExrCompression,
) -> Result<Vec<u8>, WriteError> {
    let is_grey = raw.channels == 1;
    let kind = if is_grey { ExtendedColorType::L16 } else { ExtendedColorType::Rgb16 };
    // Both encoders expect samples in native byte order.
    let bytes = || raw.values.iter().flat_map(|value| value.to_ne_bytes()).collect::<Vec<u8>>();
    match format {
        RawFormat::Png => png_file::encode(path, size_px, &bytes(), kind),
        RawFormat::Tiff => {
            let mut file = Cursor::new(Vec::new());
            TiffEncoder::new(&mut file)
                .write_image(&bytes(), size_px[0], size_px[1], kind)
                .map_err(|error| WriteError::Encode { path: path.into(), message: error.to_string() })?;
            Ok(file.into_inner())
        }
        RawFormat::Exr => {
            let samples: Vec<f32> = raw.values.iter().map(|&value| f32::from(value)).collect();
            let names: &[&str] = if is_grey { &["Y"] } else { &["R", "G", "B"] };
            exr_file::encode(path, size_px, names, &samples, ExrPixel::Float, compression)
        }
    }
}

#[cfg(test)]
mod tests {
    use exr::prelude::*;

    use super::*;

    #[test]
    fn numbers_come_back_from_every_format() {
        let size_px = [5, 3];
        for channels in [1, 3] {
            let values: Vec<u16> = (0..15 * channels as u16).map(|i| i.wrapping_mul(4099)).collect();
            let raw = RawPicture { channels, bits: 16, values: values.clone() };
            let bytes = |format| {
                encode(Path::new("raw"), size_px, &raw, format, ExrCompression::Zip1).expect("encoded")
            };
            for (format, of_image) in
                [(RawFormat::Png, image::ImageFormat::Png), (RawFormat::Tiff, image::ImageFormat::Tiff)]
            {
                let picture = image::load_from_memory_with_format(&bytes(format), of_image).expect("read");
                assert_eq!(picture.color().bytes_per_pixel(), 2 * channels as u8);
                let read = match channels {
                    1 => picture.into_luma16().into_raw(),
                    _ => picture.into_rgb16().into_raw(),
                };
                assert_eq!(read, values, "{format:?}");
            }
            let exr = read()
                .no_deep_data()
                .largest_resolution_level()
                .all_channels()
                .first_valid_layer()
                .all_attributes()
                .from_buffered(Cursor::new(bytes(RawFormat::Exr)))
                .expect("read");
            // Channels are in alphabetical order: the last is red or grey.
            let list = &exr.layer_data.channel_data.list;
            let last: Vec<f32> = list.last().expect("channels").sample_data.values_as_f32().collect();
            let expected: Vec<f32> =
                values.iter().step_by(channels as usize).map(|&value| f32::from(value)).collect();
            assert_eq!((list.len(), last), (channels as usize, expected));
        }
    }
}
