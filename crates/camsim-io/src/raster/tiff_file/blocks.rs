//! Decodes strips and tiles into an image.

use rayon::prelude::*;

use super::{
    compression::{self, JPEG, NONE, WEBP, expand, is_supported, name_of},
    directory::{Directory, TiffFile},
    gdal_translate, tag,
};

/// Number of blocks that are decoded in parallel.
const PARALLEL_BLOCKS: usize = 64;

/// Largest ratio of decoded to stored bytes (deflate reaches at most 1032).
const MAX_COMPRESSION: u64 = 2000;

/// Decoded size that is always allowed, bytes.
const MIN_LIMIT: u64 = 64 << 20;

/// Largest decoded size of a file, bytes, so that a small file cannot exhaust memory.
pub(crate) fn max_decoded_bytes(bytes: u64) -> u64 {
    bytes.saturating_mul(MAX_COMPRESSION).max(MIN_LIMIT)
}

/// Type of a decoded value. Values of 1 to 7 bits are expanded to 8 bits, those of 9 to 15 to 16 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SampleType {
    U8,
    U16,
    U32,
    U64,
    I8,
    I16,
    I32,
    I64,
    F16,
    F32,
    F64,
}

impl SampleType {
    /// By tags 339 and 258.
    fn new(format: u64, bits: u64) -> Option<Self> {
        Some(match (format, bits) {
            (1 | 4, 1..=8) => Self::U8,
            (1 | 4, 9..=16) => Self::U16,
            (1 | 4, 32) => Self::U32,
            (1 | 4, 64) => Self::U64,
            (2, 8) => Self::I8,
            (2, 16) => Self::I16,
            (2, 32) => Self::I32,
            (2, 64) => Self::I64,
            (3, 16) => Self::F16,
            (3, 32) => Self::F32,
            (3, 64) => Self::F64,
            _ => return None,
        })
    }

    /// Size of a value, bytes.
    pub fn bytes(self) -> usize {
        match self {
            Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 | Self::F16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::U64 | Self::I64 | Self::F64 => 8,
        }
    }
}

/// The pixels of a directory.
#[derive(Debug)]
pub(crate) struct Image {
    pub size: [u32; 2],
    /// Number of samples per pixel.
    pub bands: usize,
    /// Whether bands are stored one after the other instead of interleaved.
    pub is_planar: bool,
    pub sample: SampleType,
    /// Number of bits of a stored value.
    pub bits: u32,
    /// Tag 262; RGB where YCbCr has been converted.
    pub photometric: u64,
    /// Tag 338 (ExtraSamples), for the last bands.
    pub extra: Vec<u64>,
    /// Values in native byte order.
    data: Vec<u8>,
    /// Sparse blocks, without data in the file: column, row, width, height.
    pub sparse_blocks: Vec<[u32; 4]>,
}

impl Image {
    /// One band of values in native byte order.
    pub fn from_band(size: [u32; 2], sample: SampleType, data: Vec<u8>) -> Self {
        let bits = 8 * sample.bytes() as u32;
        Self {
            size,
            bands: 1,
            is_planar: false,
            sample,
            bits,
            photometric: 1,
            extra: Vec::new(),
            data,
            sparse_blocks: Vec::new(),
        }
    }

    /// A stored value. Integers of more than 53 bits are rounded.
    pub fn value(&self, pixel: usize, band: usize) -> f64 {
        let index = self.index(pixel, band);
        match self.sample {
            SampleType::U8 => self.data[index].into(),
            SampleType::I8 => (self.data[index] as i8).into(),
            SampleType::U16 => u16::from_ne_bytes(self.bytes_at(index)).into(),
            SampleType::I16 => i16::from_ne_bytes(self.bytes_at(index)).into(),
            SampleType::F16 => half::f16::from_ne_bytes(self.bytes_at(index)).to_f64(),
            SampleType::U32 => u32::from_ne_bytes(self.bytes_at(index)).into(),
            SampleType::I32 => i32::from_ne_bytes(self.bytes_at(index)).into(),
            SampleType::F32 => f32::from_ne_bytes(self.bytes_at(index)).into(),
            SampleType::U64 => u64::from_ne_bytes(self.bytes_at(index)) as f64,
            SampleType::I64 => i64::from_ne_bytes(self.bytes_at(index)) as f64,
            SampleType::F64 => f64::from_ne_bytes(self.bytes_at(index)),
        }
    }

    /// A stored value of [`SampleType::U8`] or [`SampleType::U16`].
    pub fn unsigned(&self, pixel: usize, band: usize) -> u32 {
        let index = self.index(pixel, band);
        if self.sample == SampleType::U8 {
            self.data[index].into()
        } else {
            u16::from_ne_bytes(self.bytes_at(index)).into()
        }
    }

    /// Number of pixels.
    pub fn pixels(&self) -> usize {
        self.size[0] as usize * self.size[1] as usize
    }

    fn index(&self, pixel: usize, band: usize) -> usize {
        if self.is_planar { band * self.pixels() + pixel } else { pixel * self.bands + band }
    }

    fn bytes_at<const N: usize>(&self, index: usize) -> [u8; N] {
        std::array::from_fn(|k| self.data[index * N + k])
    }
}

/// Storage of a directory's pixels.
struct BlockLayout {
    size: [u32; 2],
    bands: usize,
    is_planar: bool,
    bits: u64,
    sample: SampleType,
    compression: u64,
    predictor: u64,
    photometric: u64,
    /// Width and height of a block, pixels.
    block: [u32; 2],
    is_tiled: bool,
    is_big_endian: bool,
    jpeg_tables: Option<Vec<u8>>,
}

impl BlockLayout {
    /// Reads and checks the tags. An error names the remedy.
    // Long because: it checks a list of independent tags.
    fn read(tiff: &mut TiffFile, directory: &Directory) -> Result<Self, String> {
        let size = tiff.size(directory)?;
        let bands = tiff.integer(directory, tag::SAMPLES_PER_PIXEL)?.unwrap_or(1);
        let mut common_value = |number: u16, default: u64, name: &str| {
            let list = tiff
                .integers(directory, number)?
                .filter(|list| !list.is_empty())
                .unwrap_or_else(|| vec![default]);
            if list.iter().any(|value| *value != list[0]) {
                return Err(format!(
                    "its bands have different {name} ({list:?}): {}",
                    gdal_translate("-b 1", &tiff.path)
                ));
            }
            Ok(list[0])
        };
        let bits = common_value(tag::BITS_PER_SAMPLE, 1, "bits")?;
        let format = common_value(tag::SAMPLE_FORMAT, 1, "sample formats")?;
        let sample = SampleType::new(format, bits).ok_or_else(|| {
            format!(
                "samples of {bits} bits and format {format} are not read: {}",
                gdal_translate("-ot Float32", &tiff.path)
            )
        })?;
        let mut number =
            |number: u16, default: u64| Ok::<_, String>(tiff.integer(directory, number)?.unwrap_or(default));
        let compression = number(tag::COMPRESSION, NONE)?;
        let predictor = number(tag::PREDICTOR, 1)?;
        let fill_order = number(tag::FILL_ORDER, 1)?;
        let is_planar = bands > 1 && number(tag::PLANAR_CONFIGURATION, 1)? == 2;
        let photometric =
            tiff.integer(directory, tag::PHOTOMETRIC)?.unwrap_or(if bands >= 3 { 2 } else { 1 });
        let convert = || gdal_translate("-co COMPRESS=DEFLATE", &tiff.path);
        if !is_supported(compression) {
            return Err(format!(
                "compression {} is not read; convert it with `{}`",
                name_of(compression),
                convert()
            ));
        }
        if !matches!(predictor, 1..=3) || (predictor == 2 && bits % 8 != 0) || (predictor == 3 && format != 3)
        {
            return Err(format!(
                "predictor {predictor} for samples of {bits} bits is not read; convert it with `{}`",
                convert()
            ));
        }
        if fill_order != 1 && bits < 8 {
            return Err(format!(
                "values with the lowest bit first (FillOrder {fill_order}) are not read; convert it with \
                 `{}`",
                convert()
            ));
        }
        let is_picture = matches!(compression, JPEG | WEBP);
        if is_picture && (bits != 8 || (compression == WEBP && (is_planar || !(3..=4).contains(&bands)))) {
            return Err(format!(
                "{bands} bands of {bits} bits in JPEG or WebP are not read; convert it with `{}`",
                convert()
            ));
        }
        if photometric == 6 && compression != JPEG {
            return Err(format!("YCbCr colours without JPEG are not read; convert it with `{}`", convert()));
        }
        if bands == 0 || bands > 1 << 16 {
            return Err(format!("{bands} samples a pixel are impossible"));
        }
        let is_tiled = directory.has(tag::TILE_OFFSETS);
        let block = if is_tiled {
            [tag::TILE_WIDTH, tag::TILE_LENGTH]
                .map(|side| tiff.integer(directory, side).ok().flatten().unwrap_or(0))
        } else {
            [
                size[0].into(),
                tiff.integer(directory, tag::ROWS_PER_STRIP)?.unwrap_or(u64::MAX).min(size[1].into()),
            ]
        };
        let [Ok(width @ 1..), Ok(height @ 1..)] = block.map(u32::try_from) else {
            return Err(format!("blocks of {block:?} pixels are impossible"));
        };
        Ok(Self {
            size,
            bands: bands as usize,
            is_planar,
            bits,
            sample,
            compression,
            predictor,
            photometric,
            block: [width, height],
            is_tiled,
            is_big_endian: tiff.is_big_endian(),
            jpeg_tables: tiff.bytes_of(directory, tag::JPEG_TABLES)?,
        })
    }

    /// Number of blocks in a row and in a column.
    fn grid(&self) -> [u32; 2] {
        [0, 1].map(|k: usize| self.size[k].div_ceil(self.block[k]))
    }

    /// Number of samples per pixel in a block.
    fn block_bands(&self) -> usize {
        if self.is_planar { 1 } else { self.bands }
    }

    /// Column, row, width, height of a block in the image.
    fn block_rect(&self, block: usize) -> [u32; 4] {
        let [across, down] = self.grid();
        let block = (block as u64 % (u64::from(across) * u64::from(down))) as u32;
        let [column, row] = [block % across * self.block[0], block / across * self.block[1]];
        [column, row, (self.size[0] - column).min(self.block[0]), (self.size[1] - row).min(self.block[1])]
    }

    /// Samples per row and values of a block, row by row in native byte order; rows may be longer than the
    /// block's part of the image.
    fn decode(&self, block: usize, raw: &[u8]) -> Result<(usize, Vec<u8>), String> {
        let bands = self.block_bands();
        let [_, _, width, rows] = self.block_rect(block);
        if matches!(self.compression, JPEG | WEBP) {
            let picture = if self.compression == JPEG {
                compression::jpeg(self.jpeg_tables.as_deref(), raw, self.photometric == 6)?
            } else {
                compression::webp(raw, bands)?
            };
            if picture.samples != bands || picture.size[0] < width || picture.size[1] < rows {
                return Err(format!(
                    "a block of {width} x {rows} pixels with {bands} bands holds a picture of {:?} with {}",
                    picture.size, picture.samples
                ));
            }
            return Ok((picture.size[0] as usize * bands, picture.data));
        }
        // Tiles at the border have their full size; the last strip has not.
        let rows = if self.is_tiled { self.block[1] } else { rows } as usize;
        let samples = self.block[0] as usize * bands;
        let row_bytes = (samples as u64 * self.bits).div_ceil(8) as usize;
        let mut data = expand(self.compression, raw, row_bytes * rows)?;
        if !self.bits.is_multiple_of(8) {
            return Ok((
                samples,
                data.chunks_exact(row_bytes)
                    .flat_map(|row| unpack_row(row, self.bits as u32, samples))
                    .collect(),
            ));
        }
        let bytes = self.sample.bytes();
        for row in data.chunks_exact_mut(row_bytes) {
            if self.predictor == 3 {
                undo_float_predictor(row, bytes, bands);
                continue;
            }
            if bytes > 1 && self.is_big_endian != cfg!(target_endian = "big") {
                row.chunks_exact_mut(bytes).for_each(<[u8]>::reverse);
            }
            if self.predictor == 2 {
                undo_horizontal_differencing(row, bytes, bands);
            }
        }
        Ok((samples, data))
    }
}

/// Expands packed values of less than 8 or 16 bits, highest bit first.
fn unpack_row(row: &[u8], bits: u32, samples: usize) -> Vec<u8> {
    let mut values = Vec::with_capacity(samples * if bits < 8 { 1 } else { 2 });
    let (mut buffer, mut count) = (0_u32, 0);
    let mut bytes = row.iter();
    for _ in 0..samples {
        while count < bits {
            buffer = buffer << 8 | u32::from(bytes.next().copied().unwrap_or(0));
            count += 8;
        }
        count -= bits;
        let value = buffer >> count & ((1 << bits) - 1);
        buffer &= (1 << count) - 1;
        if bits < 8 { values.push(value as u8) } else { values.extend((value as u16).to_ne_bytes()) }
    }
    values
}

/// Predictor 2: each value is stored as the difference from the pixel to its left.
fn undo_horizontal_differencing(row: &mut [u8], bytes: usize, bands: usize) {
    match bytes {
        1 => add_left(row, bands, |a: [u8; 1], b| [a[0].wrapping_add(b[0])]),
        2 => add_left(row, bands, |a, b| {
            u16::from_ne_bytes(a).wrapping_add(u16::from_ne_bytes(b)).to_ne_bytes()
        }),
        4 => add_left(row, bands, |a, b| {
            u32::from_ne_bytes(a).wrapping_add(u32::from_ne_bytes(b)).to_ne_bytes()
        }),
        _ => add_left(row, bands, |a, b| {
            u64::from_ne_bytes(a).wrapping_add(u64::from_ne_bytes(b)).to_ne_bytes()
        }),
    }
}

fn add_left<const N: usize>(row: &mut [u8], bands: usize, add: impl Fn([u8; N], [u8; N]) -> [u8; N]) {
    let step = N * bands;
    for start in (step..row.len()).step_by(N) {
        let [difference, left] = [start, start - step].map(|start| std::array::from_fn(|k| row[start + k]));
        row[start..start + N].copy_from_slice(&add(difference, left));
    }
}

/// Predictor 3: the bytes of a row are grouped by significance, highest first, and each is stored as the
/// difference from the byte `bands` before.
fn undo_float_predictor(row: &mut [u8], bytes: usize, bands: usize) {
    for index in bands..row.len() {
        row[index] = row[index].wrapping_add(row[index - bands]);
    }
    let planes = row.to_vec();
    let count = row.len() / bytes;
    for (index, value) in row.chunks_exact_mut(bytes).enumerate() {
        for (k, byte) in value.iter_mut().enumerate() {
            let significance = if cfg!(target_endian = "big") { k } else { bytes - 1 - k };
            *byte = planes[significance * count + index];
        }
    }
}

impl TiffFile {
    /// Decodes the pixels of a directory.
    // Long because: it checks the block list and then decodes in parallel.
    pub fn image(&mut self, directory: &Directory) -> Result<Image, String> {
        let layout = BlockLayout::read(self, directory)?;
        let sample_bytes = layout.sample.bytes();
        let impossible = "the stated size is impossible for a file of this length";
        let max_bytes = max_decoded_bytes(self.bytes);
        let checked_bytes = |sides: [u32; 2]| {
            let bytes = u64::from(sides[0])
                .checked_mul(sides[1].into())?
                .checked_mul((layout.bands * sample_bytes) as u64)?;
            (bytes <= max_bytes).then_some(bytes as usize)
        };
        let total = checked_bytes(layout.size).ok_or(impossible)?;
        checked_bytes(layout.block).ok_or(impossible)?;
        let [across, down] = layout.grid().map(u64::from);
        let count = across * down * if layout.is_planar { layout.bands as u64 } else { 1 };
        let [offsets, counts] = if layout.is_tiled {
            [tag::TILE_OFFSETS, tag::TILE_BYTE_COUNTS]
        } else {
            [tag::STRIP_OFFSETS, tag::STRIP_BYTE_COUNTS]
        };
        let offsets = self.integers(directory, offsets)?.ok_or("it has no offsets of its blocks")?;
        // Old writers omit the byte counts of uncompressed blocks.
        let counts = match self.integers(directory, counts)? {
            Some(counts) => counts,
            None if layout.compression == NONE => {
                let row_bytes =
                    (u64::from(layout.block[0]) * layout.block_bands() as u64 * layout.bits).div_ceil(8);
                (0..offsets.len())
                    .map(|block| {
                        row_bytes
                            * u64::from(if layout.is_tiled {
                                layout.block[1]
                            } else {
                                layout.block_rect(block)[3]
                            })
                    })
                    .collect()
            }
            None => return Err("it has no byte counts of its blocks".into()),
        };
        if offsets.len() as u64 != count || counts.len() as u64 != count {
            return Err(format!("{} blocks are listed, but {count} are needed", offsets.len()));
        }
        let mut image = Image {
            size: layout.size,
            bands: layout.bands,
            is_planar: layout.is_planar,
            sample: layout.sample,
            bits: layout.bits as u32,
            photometric: if layout.photometric == 6 { 2 } else { layout.photometric },
            extra: self.integers(directory, tag::EXTRA_SAMPLES)?.unwrap_or_default(),
            data: vec![0; total],
            sparse_blocks: Vec::new(),
        };
        let blocks: Vec<usize> = (0..offsets.len()).collect();
        for group in blocks.chunks(PARALLEL_BLOCKS) {
            let mut raw = Vec::with_capacity(group.len());
            for &block in group {
                if offsets[block] == 0 || counts[block] == 0 {
                    image.sparse_blocks.push(layout.block_rect(block));
                    continue;
                }
                raw.push((block, self.read_at(offsets[block], counts[block])?));
            }
            let decoded: Vec<_> = raw
                .par_iter()
                .map(|(block, raw)| layout.decode(*block, raw).map(|rows| (*block, rows)))
                .collect();
            for block in decoded {
                let (block, (row_samples, data)) = block?;
                image.insert_block(&layout, block, row_samples, &data);
            }
        }
        Ok(image)
    }
}

impl Image {
    /// Copies a decoded block into the image.
    fn insert_block(&mut self, layout: &BlockLayout, block: usize, row_samples: usize, data: &[u8]) {
        let [column, row, width, height] = layout.block_rect(block).map(|n| n as usize);
        let (bytes, bands) = (self.sample.bytes(), layout.block_bands());
        let plane = if self.is_planar {
            block / layout.grid().map(|n| n as usize).iter().product::<usize>()
        } else {
            0
        };
        let length = width * bands * bytes;
        for (j, source) in data.chunks_exact(row_samples * bytes).take(height).enumerate() {
            let start = (plane * self.pixels() + (row + j) * self.size[0] as usize + column) * bands * bytes;
            self.data[start..start + length].copy_from_slice(&source[..length]);
        }
    }
}
