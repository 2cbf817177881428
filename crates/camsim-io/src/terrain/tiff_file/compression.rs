//! What is in a block, as it was before it was compressed.

use std::io::{Cursor, Read};

use zune_jpeg::{
    JpegDecoder,
    zune_core::{bytestream::ZCursor, colorspace::ColorSpace, options::DecoderOptions},
};

/// What can be read of tag 259, with how it is called.
pub(crate) const COMPRESSIONS: &[(u64, &str)] = &[
    (NONE, "none"),
    (LZW, "LZW"),
    (JPEG, "JPEG, also of YCbCr colours"),
    (DEFLATE, "deflate"),
    (OLD_DEFLATE, "deflate by its older number"),
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

/// Names of what is refused, by its number.
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

pub(super) fn is_known(compression: u64) -> bool {
    COMPRESSIONS.iter().any(|(code, _)| *code == compression)
}

pub(super) fn name_of(compression: u64) -> String {
    let name = REFUSED.iter().find(|(code, _)| *code == compression);
    name.map_or_else(|| format!("number {compression}"), |(code, name)| format!("{name} ({code})"))
}

/// A block that is a picture of its own: 8 bits a sample.
pub(super) struct Picture {
    pub size: [u32; 2],
    pub samples: usize,
    pub data: Vec<u8>,
}

/// As many bytes as a block has. Fewer are an error.
pub(super) fn expand(compression: u64, raw: &[u8], expected: usize) -> Result<Vec<u8>, String> {
    let mut data = Vec::new();
    let all = expected as u64;
    let read = match compression {
        NONE => Cursor::new(raw).take(all).read_to_end(&mut data),
        DEFLATE | OLD_DEFLATE => flate2::read::ZlibDecoder::new(raw).take(all).read_to_end(&mut data),
        ZSTD => match ruzstd::decoding::StreamingDecoder::new(raw) {
            Ok(decoder) => decoder.take(all).read_to_end(&mut data),
            Err(error) => return Err(format!("a block is no Zstandard stream: {error}")),
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
            "the file is cut off".into()
        } else {
            short(data.len(), expected)
        });
    }
    Ok(data)
}

fn short(found: usize, expected: usize) -> String {
    format!("a block holds {found} bytes, and {expected} are needed")
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
    if written < expected { Err(short(written, expected)) } else { Ok(data) }
}

/// Runs: n >= 0: n + 1 bytes as they are; n < 0: 1 - n times the next byte; -128: nothing.
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

/// A JPEG, whose tables may be in a tag of their own. `to_rgb`: its colours are YCbCr and become RGB; else
/// its samples stay as they are.
pub(super) fn jpeg(tables: Option<&[u8]>, raw: &[u8], to_rgb: bool) -> Result<Picture, String> {
    let stream = match tables {
        // Both are streams from start to end: together they are one.
        Some([head @ .., 0xff, 0xd9]) if raw.len() >= 2 => [head, &raw[2..]].concat(),
        _ => raw.to_vec(),
    };
    let wrong = |error: zune_jpeg::errors::DecodeErrors| format!("a JPEG block cannot be decoded: {error}");
    let mut decoder = JpegDecoder::new(ZCursor::new(&stream));
    decoder.decode_headers().map_err(wrong)?;
    let stored = decoder.input_colorspace().ok_or("a JPEG block has no colours")?;
    let wanted = match (stored, to_rgb) {
        (ColorSpace::YCbCr, true) => ColorSpace::RGB,
        (other, _) => other,
    };
    decoder.set_options(DecoderOptions::default().jpeg_set_out_colorspace(wanted));
    let data = decoder.decode().map_err(wrong)?;
    let (width, height) = decoder.dimensions().ok_or("a JPEG block has no size")?;
    Ok(Picture { size: [width as u32, height as u32], samples: wanted.num_components(), data })
}

/// A WebP picture as `samples` bytes a pixel; one without alpha is opaque.
pub(super) fn webp(raw: &[u8], samples: usize) -> Result<Picture, String> {
    let wrong = |error: image_webp::DecodingError| format!("a WebP block cannot be decoded: {error}");
    let mut decoder = image_webp::WebPDecoder::new(Cursor::new(raw)).map_err(wrong)?;
    let (width, height) = decoder.dimensions();
    let own = if decoder.has_alpha() { 4 } else { 3 };
    let mut data = vec![0; decoder.output_buffer_size().ok_or("a WebP block is too large")?];
    decoder.read_image(&mut data).map_err(wrong)?;
    if own != samples {
        let channel = |pixel: &[u8], k: usize| pixel.get(k).copied().unwrap_or(255);
        data =
            data.chunks_exact(own).flat_map(|pixel| (0..samples).map(move |k| channel(pixel, k))).collect();
    }
    Ok(Picture { size: [width, height], samples, data })
}
