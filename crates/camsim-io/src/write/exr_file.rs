//! Encodes OpenEXR scanline files with named channels.
//!
//! `exr` writes the file and compresses RLE and PIZ. ZIP blocks are compressed here by `zlib-rs`, which takes a
//! third of the time of the encoder within `exr` for files of about the same size.

use std::{io::Cursor, path::Path};

use camsim_core::scenario::{ExrCompression, ExrPixel};
use exr::{
    block::{
        chunk::{Chunk, CompressedBlock, CompressedScanLineBlock},
        writer::ChunksWriter,
    },
    error::UnitResult,
    meta::{
        attribute::ChannelDescription,
        header::{Header, LayerAttributes},
    },
    prelude::{
        AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, LineOrder, SampleType,
        SmallVec, Text, Vec2, WritableImage,
    },
};
use half::{f16, slice::HalfFloatSliceExt};

use super::WriteError;

/// Level of zlib for ZIP blocks. Level 2 takes twice the time for files smaller by a tenth.
const ZIP_LEVEL: i32 = 1;

/// Encodes interleaved samples as one channel per name. `path` is for messages only.
pub(crate) fn encode(
    path: &Path,
    size_px: [u32; 2],
    names: &[&str],
    samples: &[f32],
    pixel: ExrPixel,
    compression: ExrCompression,
) -> Result<Vec<u8>, WriteError> {
    let picture = Picture { size_px: size_px.map(|side| side as usize), names, samples, pixel };
    let mut file = Cursor::new(Vec::with_capacity(samples.len() * 2));
    match compression {
        ExrCompression::None => picture.write_blocks(&mut file, Compression::Uncompressed),
        ExrCompression::Zip1 => picture.write_blocks(&mut file, Compression::ZIP1),
        ExrCompression::Zip16 => picture.write_blocks(&mut file, Compression::ZIP16),
        ExrCompression::Rle => picture.write_by_crate(&mut file, Compression::RLE),
        ExrCompression::Piz => picture.write_by_crate(&mut file, Compression::PIZ),
    }
    .map_err(|error| WriteError::Encode { path: path.into(), message: error.to_string() })?;
    Ok(file.into_inner())
}

/// What a file holds.
struct Picture<'a> {
    size_px: [usize; 2],
    names: &'a [&'a str],
    samples: &'a [f32],
    pixel: ExrPixel,
}

impl Picture<'_> {
    /// Compresses the blocks here; `exr` writes the file around them.
    fn write_blocks(&self, file: &mut Cursor<Vec<u8>>, compression: Compression) -> UnitResult {
        let [width, height] = self.size_px;
        let sample_type = match self.pixel {
            ExrPixel::Half => SampleType::F16,
            ExrPixel::Float => SampleType::F32,
        };
        // Channels are in alphabetical order.
        let mut channels: Vec<usize> = (0..self.names.len()).collect();
        channels.sort_by_key(|&channel| self.names[channel]);
        let describe =
            |&channel: &usize| ChannelDescription::new(Text::from(self.names[channel]), sample_type, false);
        let header = Header::new(
            Text::from(""),
            Vec2(width, height),
            channels.iter().map(describe).collect::<SmallVec<[_; 5]>>(),
        )
        .with_attributes(LayerAttributes::default())
        .with_encoding(compression, exr::meta::BlockDescription::ScanLines, LineOrder::Increasing);
        let lines = compression.scan_lines_per_block();
        exr::block::write(file, SmallVec::from_elem(header, 1), false, |_, writer| {
            let (mut bytes, mut line) = (Vec::new(), vec![0.0; width]);
            for (index, top) in (0..height).step_by(lines).enumerate() {
                bytes.clear();
                for y in top..(top + lines).min(height) {
                    channels.iter().for_each(|&channel| self.append_line(y, channel, &mut line, &mut bytes));
                }
                let compressed_pixels_le = match compression {
                    Compression::Uncompressed => bytes.clone(),
                    _ => zip(&bytes),
                };
                let block = CompressedScanLineBlock { y_coordinate: top as i32, compressed_pixels_le };
                let chunk = Chunk { layer_index: 0, compressed_block: CompressedBlock::ScanLine(block) };
                writer.write_chunk(index, chunk)?;
            }
            Ok(())
        })
    }

    /// Appends the samples of a line of one channel, little-endian. `line` is memory of the picture's width.
    fn append_line(&self, y: usize, channel: usize, line: &mut [f32], bytes: &mut Vec<u8>) {
        let (width, count) = (line.len(), self.names.len());
        let samples = self.samples[y * width * count..].iter().skip(channel).step_by(count);
        line.iter_mut().zip(samples).for_each(|(to, from)| *to = *from);
        // Whole lines at a time: byte by byte this would take as long as the compression.
        match self.pixel {
            ExrPixel::Float => {
                line.iter_mut().for_each(|value| *value = f32::from_bits(value.to_bits().to_le()));
                bytes.extend_from_slice(bytemuck::cast_slice(line));
            }
            ExrPixel::Half => {
                line.iter_mut().for_each(|value| *value = within_half(*value));
                let mut halves = vec![f16::ZERO; width];
                halves.convert_from_f32_slice(line);
                halves.iter_mut().for_each(|value| *value = f16::from_bits(value.to_bits().to_le()));
                bytes.extend_from_slice(bytemuck::cast_slice(&halves));
            }
        }
    }

    /// Leaves all to `exr`.
    fn write_by_crate(&self, file: &mut Cursor<Vec<u8>>, compression: Compression) -> UnitResult {
        let mut list = SmallVec::<[AnyChannel<FlatSamples>; 4]>::new();
        for (channel, name) in self.names.iter().enumerate() {
            let plane = self.samples.iter().skip(channel).step_by(self.names.len());
            let plane = match self.pixel {
                ExrPixel::Half => {
                    FlatSamples::F16(plane.map(|&value| f16::from_f32(within_half(value))).collect())
                }
                ExrPixel::Float => FlatSamples::F32(plane.copied().collect()),
            };
            list.push(AnyChannel::new(*name, plane));
        }
        let encoding = Encoding { compression, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
        let [width, height] = self.size_px;
        let image = Image::from_encoded_channels(Vec2(width, height), encoding, AnyChannels::sort(list));
        // One thread per file, as frames are written in parallel.
        image.write().non_parallel().to_buffered(file)
    }
}

/// Values beyond the range of half are clamped, as infinities would break readers.
fn within_half(value: f32) -> f32 {
    value.clamp(-65504.0, 65504.0)
}

/// A ZIP block of OpenEXR: the bytes at even indices, then those at odd ones, each as its difference to the one
/// before plus 128, by zlib. A block that does not become smaller is stored as it is.
fn zip(bytes: &[u8]) -> Vec<u8> {
    let half = bytes.len().div_ceil(2);
    let mut sorted = vec![0_u8; bytes.len()];
    let (even, odd) = sorted.split_at_mut(half);
    for (pair, (even, odd)) in
        bytes.chunks(2).zip(even.iter_mut().zip(odd.iter_mut().map(Some).chain([None])))
    {
        *even = pair[0];
        if let (Some(odd), Some(&second)) = (odd, pair.get(1)) {
            *odd = second;
        }
    }
    // Backwards, so that no difference is taken of a difference.
    for index in (1..sorted.len()).rev() {
        sorted[index] = sorted[index].wrapping_sub(sorted[index - 1]).wrapping_add(128);
    }
    let mut compressed = vec![0; zlib_rs::compress_bound(sorted.len())];
    let config = zlib_rs::DeflateConfig::new(ZIP_LEVEL);
    match zlib_rs::compress_slice(&mut compressed, &sorted, config) {
        (compressed, zlib_rs::ReturnCode::Ok) if compressed.len() < bytes.len() => compressed.to_vec(),
        _ => bytes.to_vec(),
    }
}
