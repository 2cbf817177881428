//! Decompression of blocks.

use std::io::{Cursor, Read};

use zune_jpeg::{
    JpegDecoder,
    zune_core::{bytestream::ZCursor, colorspace::ColorSpace, options::DecoderOptions},
};

/// Supported values of tag 259 (Compression) with their names.
pub(crate) const COMPRESSIONS: &[(u64, &str)] = &[
    (NONE, "none"),
    (LZW, "LZW"),
    (JPEG, "JPEG, also of YCbCr colours"),
    (DEFLATE, "deflate"),
    (OLD_DEFLATE, "deflate, older code"),
    (PACK_BITS, "PackBits"),
    (ZSTD, "Zstandard"),
    (WEBP, "WebP"),
];

pub(crate) const NONE: u64 = 1;
const LZW: u64 = 5;
pub(crate) const JPEG: u64 = 7;
const DEFLATE: u64 = 8;
const OLD_DEFLATE: u64 = 32946;
const PACK_BITS: u64 = 32773;
const ZSTD: u64 = 50000;
pub(crate) const WEBP: u64 = 50001;

/// Unsupported values of tag 259 with their names.
pub(crate) const REFUSED: &[(u64, &str)] = &[
    (2, "CCITT run lengths"),
    (3, "CCITT fax 3"),
    (4, "CCITT fax 4"),
    (6, "old JPEG"),
    (34712, "JPEG 2000"),
    (34887, "LERC"),
    (34925, "LZMA"),
    (50002, "JPEG XL"),
    (52546, "JPEG XL"),
];

/// Whether a compression is supported.
pub(super) fn is_supported(compression: u64) -> bool {
    COMPRESSIONS.iter().any(|(code, _)| *code == compression)
}

/// Name of an unsupported compression.
pub(super) fn name_of(compression: u64) -> String {
    let name = REFUSED.iter().find(|(code, _)| *code == compression);
    name.map_or_else(|| format!("number {compression}"), |(code, name)| format!("{name} ({code})"))
}

/// A block that is stored as a picture, with 8 bits per sample.
pub(super) struct Picture {
    pub size: [u32; 2],
    pub samples: usize,
    pub data: Vec<u8>,
}

/// Decompresses `expected` bytes; fewer are an error.
pub(super) fn expand(compression: u64, raw: &[u8], expected: usize) -> Result<Vec<u8>, String> {
    let mut data = Vec::new();
    let limit = expected as u64;
    let read = match compression {
        NONE => Cursor::new(raw).take(limit).read_to_end(&mut data),
        DEFLATE | OLD_DEFLATE => flate2::read::ZlibDecoder::new(raw).take(limit).read_to_end(&mut data),
        ZSTD => match ruzstd::decoding::StreamingDecoder::new(raw) {
            Ok(decoder) => decoder.take(limit).read_to_end(&mut data),
            Err(error) => return Err(format!("a block is not a Zstandard stream: {error}")),
        },
        PACK_BITS => {
            data = unpack_bits(raw, expected);
            Ok(data.len())
        }
        LZW => return expand_lzw(raw, expected),
        other => return Err(format!("compression {} is not read", name_of(other))),
    };
    read.map_err(|error| format!("a block cannot be decompressed: {error}"))?;
    if data.len() < expected {
        return Err(if compression == NONE {
            "the file is truncated".into()
        } else {
            size_error(data.len(), expected)
        });
    }
    Ok(data)
}

fn size_error(actual: usize, expected: usize) -> String {
    format!("a block has {actual} bytes instead of {expected}")
}

fn expand_lzw(raw: &[u8], expected: usize) -> Result<Vec<u8>, String> {
    let mut decoder = weezl::decode::Configuration::with_tiff_size_switch(weezl::BitOrder::Msb, 8)
        .with_yield_on_full_buffer(true)
        .build();
    let mut data = vec![0; expected];
    let (mut read, mut written) = (0, 0);
    while written < expected {
        let result = decoder.decode_bytes(&raw[read..], &mut data[written..]);
        read += result.consumed_in;
        written += result.consumed_out;
        match result.status {
            Ok(weezl::LzwStatus::Ok) => {}
            Ok(weezl::LzwStatus::Done | weezl::LzwStatus::NoProgress) => break,
            Err(error) => return Err(format!("a block cannot be decompressed: {error}")),
        }
    }
    if written < expected { Err(size_error(written, expected)) } else { Ok(data) }
}

/// PackBits. Each run begins with a signed byte n: for n >= 0 follow n + 1 literal bytes; for -127 <= n < 0
/// the next byte repeats 1 - n times; -128 is ignored.
fn unpack_bits(raw: &[u8], expected: usize) -> Vec<u8> {
    let mut data = Vec::new();
    let mut rest = raw;
    while let [head, tail @ ..] = rest
        && data.len() < expected
    {
        let run = i32::from(*head as i8);
        rest = match (run, tail) {
            (0.., _) => {
                let (bytes, after) = tail.split_at((run as usize + 1).min(tail.len()));
                data.extend(bytes);
                after
            }
            (-127..0, [byte, after @ ..]) => {
                data.extend(std::iter::repeat_n(*byte, (1 - run) as usize));
                after
            }
            _ => tail,
        };
    }
    data.truncate(expected);
    data
}

/// Decodes a JPEG block with its tables, which may be in tag 347. `to_rgb` converts YCbCr to RGB.
pub(super) fn jpeg(tables: Option<&[u8]>, raw: &[u8], to_rgb: bool) -> Result<Picture, String> {
    let stream = match tables {
        // Both are complete JPEG streams: without the end marker of the first and the start marker of the
        // second they are one.
        Some([head @ .., 0xff, 0xd9]) if raw.len() >= 2 => [head, &raw[2..]].concat(),
        _ => raw.to_vec(),
    };
    let message = |error: zune_jpeg::errors::DecodeErrors| format!("a JPEG block cannot be decoded: {error}");
    let mut decoder = JpegDecoder::new(ZCursor::new(&stream));
    decoder.decode_headers().map_err(message)?;
    let stored = decoder.input_colorspace().ok_or("a JPEG block has no colours")?;
    let output = match (stored, to_rgb) {
        (ColorSpace::YCbCr, true) => ColorSpace::RGB,
        (other, _) => other,
    };
    decoder.set_options(DecoderOptions::default().jpeg_set_out_colorspace(output));
    let data = decoder.decode().map_err(message)?;
    let (width, height) = decoder.dimensions().ok_or("a JPEG block has no size")?;
    Ok(Picture { size: [width as u32, height as u32], samples: output.num_components(), data })
}

/// Decodes a WebP block to `samples` bytes per pixel; without alpha it is opaque.
pub(super) fn webp(raw: &[u8], samples: usize) -> Result<Picture, String> {
    let message = |error: image_webp::DecodingError| format!("a WebP block cannot be decoded: {error}");
    let mut decoder = image_webp::WebPDecoder::new(Cursor::new(raw)).map_err(message)?;
    let (width, height) = decoder.dimensions();
    let channels = if decoder.has_alpha() { 4 } else { 3 };
    let mut data = vec![0; decoder.output_buffer_size().ok_or("a WebP block is too large")?];
    decoder.read_image(&mut data).map_err(message)?;
    if channels != samples {
        let channel = |pixel: &[u8], k: usize| pixel.get(k).copied().unwrap_or(255);
        data = data
            .chunks_exact(channels)
            .flat_map(|pixel| (0..samples).map(move |k| channel(pixel, k)))
            .collect();
    }
    Ok(Picture { size: [width, height], samples, data })
}
