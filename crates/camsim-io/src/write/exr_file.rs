//! Encodes OpenEXR scanline files with named channels.

use std::{io::Cursor, path::Path};

use camsim_core::scenario::{ExrCompression, ExrPixel};
use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, LineOrder, SmallVec, Vec2,
    WritableImage,
};
use half::f16;

use super::WriteError;

/// Encodes interleaved samples as one channel per name. `path` is for messages only.
pub(super) fn encode(
    path: &Path,
    size_px: [u32; 2],
    names: &[&str],
    samples: &[f32],
    pixel: ExrPixel,
    compression: ExrCompression,
) -> Result<Vec<u8>, WriteError> {
    let mut list = SmallVec::<[AnyChannel<FlatSamples>; 4]>::new();
    for (channel, name) in names.iter().enumerate() {
        let plane = samples.iter().skip(channel).step_by(names.len());
        let plane = match pixel {
            // Values beyond the range of half are clamped, as infinities would break readers.
            ExrPixel::Half => {
                FlatSamples::F16(plane.map(|&v| f16::from_f32(v.clamp(-65504.0, 65504.0))).collect())
            }
            ExrPixel::Float => FlatSamples::F32(plane.copied().collect()),
        };
        list.push(AnyChannel::new(*name, plane));
    }
    let encoding = Encoding {
        compression: match compression {
            ExrCompression::None => Compression::Uncompressed,
            ExrCompression::Rle => Compression::RLE,
            ExrCompression::Zip1 => Compression::ZIP1,
            ExrCompression::Zip16 => Compression::ZIP16,
            ExrCompression::Piz => Compression::PIZ,
        },
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let size = Vec2(size_px[0] as usize, size_px[1] as usize);
    let image = Image::from_encoded_channels(size, encoding, AnyChannels::sort(list));
    let mut bytes = Cursor::new(Vec::with_capacity(samples.len() * 2));
    // One thread per file, as frames are written in parallel.
    let result = image.write().non_parallel().to_buffered(&mut bytes);
    result.map_err(|error| WriteError::Encode { path: path.into(), message: error.to_string() })?;
    Ok(bytes.into_inner())
}
