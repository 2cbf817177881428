//! Strips and tiles, put together.

use rayon::prelude::*;

use super::{
    compression::{self, JPEG, NONE, WEBP, expand, is_known, name_of},
    directory::{Directory, TiffFile},
    gdal_translate, tag,
};

/// Blocks that are decoded together, each by a thread.
const AT_ONCE: usize = 64;

/// A decoded file may be this much larger than the file itself (the best that deflate can do is 1032).
const MAX_COMPRESSION: u64 = 2000;

/// Small files may always decode to this, bytes.
const MIN_LIMIT: u64 = 64 << 20;

/// What a file of so many bytes may decode to, bytes: a few bytes must not ask for all memory.
pub(crate) fn most_decoded(bytes: u64) -> u64 {
    bytes.saturating_mul(MAX_COMPRESSION).max(MIN_LIMIT)
}

/// Type of a stored number. Values of 1 to 7 bits are stored as bytes, of 9 to 15 as words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Sample {
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

impl Sample {
    fn of(format: u64, bits: u64) -> Option<Self> {
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
    /// Samples a pixel.
    pub bands: usize,
    /// Whole bands one after the other, instead of pixel after pixel.
    pub is_planar: bool,
    pub sample: Sample,
    /// Bits that a stored number has.
    pub bits: u32,
    /// Tag 262; RGB where YCbCr has been turned into it.
    pub photometric: u64,
    /// Tag 338, for the last bands.
    pub extra: Vec<u64>,
    /// Numbers in the machine's byte order.
    data: Vec<u8>,
    /// Blocks that the file leaves out: column, row, width, height.
    pub absent: Vec<[u32; 4]>,
}

impl Image {
    /// One band of numbers in the machine's byte order.
    pub fn of_band(size: [u32; 2], sample: Sample, data: Vec<u8>) -> Self {
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
            absent: Vec::new(),
        }
    }

    /// A stored number. Whole numbers of more than 53 bits are rounded.
    pub fn value(&self, pixel: usize, band: usize) -> f64 {
        let index = self.index(pixel, band);
        match self.sample {
            Sample::U8 => self.data[index].into(),
            Sample::I8 => (self.data[index] as i8).into(),
            Sample::U16 => u16::from_ne_bytes(self.at(index)).into(),
            Sample::I16 => i16::from_ne_bytes(self.at(index)).into(),
            Sample::F16 => half::f16::from_ne_bytes(self.at(index)).to_f64(),
            Sample::U32 => u32::from_ne_bytes(self.at(index)).into(),
            Sample::I32 => i32::from_ne_bytes(self.at(index)).into(),
            Sample::F32 => f32::from_ne_bytes(self.at(index)).into(),
            Sample::U64 => u64::from_ne_bytes(self.at(index)) as f64,
            Sample::I64 => i64::from_ne_bytes(self.at(index)) as f64,
            Sample::F64 => f64::from_ne_bytes(self.at(index)),
        }
    }

    /// A stored number of [`Sample::U8`] or [`Sample::U16`].
    pub fn unsigned(&self, pixel: usize, band: usize) -> u32 {
        let index = self.index(pixel, band);
        if self.sample == Sample::U8 {
            self.data[index].into()
        } else {
            u16::from_ne_bytes(self.at(index)).into()
        }
    }

    pub fn pixels(&self) -> usize {
        self.size[0] as usize * self.size[1] as usize
    }

    fn index(&self, pixel: usize, band: usize) -> usize {
        if self.is_planar { band * self.pixels() + pixel } else { pixel * self.bands + band }
    }

    fn at<const N: usize>(&self, index: usize) -> [u8; N] {
        std::array::from_fn(|k| self.data[index * N + k])
    }
}

/// How a directory's pixels are stored.
struct Layout {
    size: [u32; 2],
    bands: usize,
    is_planar: bool,
    bits: u64,
    sample: Sample,
    compression: u64,
    predictor: u64,
    photometric: u64,
    block: [u32; 2],
    is_tiled: bool,
    is_big_endian: bool,
    jpeg_tables: Option<Vec<u8>>,
}

impl Layout {
    fn read(tiff: &mut TiffFile, of: &Directory) -> Result<Self, String> {
        let size = tiff.size(of)?;
        let bands = tiff.integer(of, tag::SAMPLES_PER_PIXEL)?.unwrap_or(1);
        let mut alike = |number: u16, default: u64, what: &str| {
            let list =
                tiff.integers(of, number)?.filter(|list| !list.is_empty()).unwrap_or_else(|| vec![default]);
            if list.iter().any(|value| *value != list[0]) {
                return Err(format!(
                    "its bands have different {what} ({list:?}): {}",
                    gdal_translate("-b 1", &tiff.path)
                ));
            }
            Ok(list[0])
        };
        let bits = alike(tag::BITS_PER_SAMPLE, 1, "bits")?;
        let format = alike(tag::SAMPLE_FORMAT, 1, "sample formats")?;
        let sample = Sample::of(format, bits).ok_or_else(|| {
            format!(
                "samples of {bits} bits and format {format} are not read: {}",
                gdal_translate("-ot Float32", &tiff.path)
            )
        })?;
        let mut number =
            |number: u16, default: u64| Ok::<_, String>(tiff.integer(of, number)?.unwrap_or(default));
        let compression = number(tag::COMPRESSION, NONE)?;
        let predictor = number(tag::PREDICTOR, 1)?;
        let fill_order = number(tag::FILL_ORDER, 1)?;
        let is_planar = bands > 1 && number(tag::PLANAR_CONFIGURATION, 1)? == 2;
        let photometric = tiff.integer(of, tag::PHOTOMETRIC)?.unwrap_or(if bands >= 3 { 2 } else { 1 });
        let again = || gdal_translate("-co COMPRESS=DEFLATE", &tiff.path);
        if !is_known(compression) {
            return Err(format!(
                "compression {} is not read; convert it with `{}`",
                name_of(compression),
                again()
            ));
        }
        if !matches!(predictor, 1..=3) || (predictor == 2 && bits % 8 != 0) || (predictor == 3 && format != 3)
        {
            return Err(format!(
                "predictor {predictor} for samples of {bits} bits is not read; convert it with `{}`",
                again()
            ));
        }
        if fill_order != 1 && bits < 8 {
            return Err(format!(
                "bits from the lowest on (FillOrder {fill_order}) are not read; convert it with `{}`",
                again()
            ));
        }
        let is_picture = matches!(compression, JPEG | WEBP);
        if is_picture && (bits != 8 || (compression == WEBP && (is_planar || !(3..=4).contains(&bands)))) {
            return Err(format!(
                "{bands} bands of {bits} bits in JPEG or WebP are not read; convert it with `{}`",
                again()
            ));
        }
        if photometric == 6 && compression != JPEG {
            return Err(format!("YCbCr colours without JPEG are not read; convert it with `{}`", again()));
        }
        if bands == 0 || bands > 1 << 16 {
            return Err(format!("{bands} samples a pixel are impossible"));
        }
        let is_tiled = of.has(tag::TILE_OFFSETS);
        let block = if is_tiled {
            [tag::TILE_WIDTH, tag::TILE_LENGTH].map(|side| tiff.integer(of, side).ok().flatten().unwrap_or(0))
        } else {
            [size[0].into(), tiff.integer(of, tag::ROWS_PER_STRIP)?.unwrap_or(u64::MAX).min(size[1].into())]
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
            jpeg_tables: tiff.bytes_of(of, tag::JPEG_TABLES)?,
        })
    }

    fn grid(&self) -> [u32; 2] {
        [0, 1].map(|k: usize| self.size[k].div_ceil(self.block[k]))
    }

    /// Samples of a pixel within a block.
    fn block_bands(&self) -> usize {
        if self.is_planar { 1 } else { self.bands }
    }

    /// Column, row, width, height of a block within the picture.
    fn place(&self, block: usize) -> [u32; 4] {
        let [across, down] = self.grid();
        let block = (block as u64 % (u64::from(across) * u64::from(down))) as u32;
        let at = [block % across * self.block[0], block / across * self.block[1]];
        [at[0], at[1], (self.size[0] - at[0]).min(self.block[0]), (self.size[1] - at[1]).min(self.block[1])]
    }

    /// A block's pixels, row after row, its numbers in the machine's byte order; its rows may be longer than
    /// what is wanted of them.
    fn decode(&self, block: usize, raw: &[u8]) -> Result<(usize, Vec<u8>), String> {
        let bands = self.block_bands();
        let [_, _, width, rows] = self.place(block);
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
        // Tiles are whole, also where they reach beyond the picture; the last strip is not.
        let rows = if self.is_tiled { self.block[1] } else { rows } as usize;
        let samples = self.block[0] as usize * bands;
        let row_bytes = (samples as u64 * self.bits).div_ceil(8) as usize;
        let mut data = expand(self.compression, raw, row_bytes * rows)?;
        if !self.bits.is_multiple_of(8) {
            return Ok((
                samples,
                data.chunks_exact(row_bytes).flat_map(|row| spread(row, self.bits as u32, samples)).collect(),
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
                undo_differences(row, bytes, bands);
            }
        }
        Ok((samples, data))
    }
}

/// Numbers of fewer bits than a byte or a word has, one after the other from the highest bit.
fn spread(row: &[u8], bits: u32, samples: usize) -> Vec<u8> {
    let mut spread = Vec::with_capacity(samples * if bits < 8 { 1 } else { 2 });
    let (mut held, mut count) = (0_u32, 0);
    let mut bytes = row.iter();
    for _ in 0..samples {
        while count < bits {
            held = held << 8 | u32::from(bytes.next().copied().unwrap_or(0));
            count += 8;
        }
        count -= bits;
        let value = held >> count & ((1 << bits) - 1);
        held &= (1 << count) - 1;
        if bits < 8 { spread.push(value as u8) } else { spread.extend((value as u16).to_ne_bytes()) }
    }
    spread
}

/// Predictor 2: each number was stored less the one of the pixel to its left.
fn undo_differences(row: &mut [u8], bytes: usize, bands: usize) {
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
    for at in (step..row.len()).step_by(N) {
        let [here, left] = [at, at - step].map(|at| std::array::from_fn(|k| row[at + k]));
        row[at..at + N].copy_from_slice(&add(here, left));
    }
}

/// Predictor 3: all highest bytes of a row first, then the next ones; and each byte less the one `bands`
/// before it.
fn undo_float_predictor(row: &mut [u8], bytes: usize, bands: usize) {
    for at in bands..row.len() {
        row[at] = row[at].wrapping_add(row[at - bands]);
    }
    let planes = row.to_vec();
    let count = row.len() / bytes;
    for (at, number) in row.chunks_exact_mut(bytes).enumerate() {
        for (k, byte) in number.iter_mut().enumerate() {
            let from_highest = if cfg!(target_endian = "big") { k } else { bytes - 1 - k };
            *byte = planes[from_highest * count + at];
        }
    }
}

impl TiffFile {
    /// The pixels of a directory.
    pub fn image(&mut self, of: &Directory) -> Result<Image, String> {
        let layout = Layout::read(self, of)?;
        let bytes = layout.sample.bytes();
        let impossible = "the stated size is impossible for a file of this length";
        let most = most_decoded(self.bytes);
        let checked = |sides: [u32; 2]| {
            let all = u64::from(sides[0])
                .checked_mul(sides[1].into())?
                .checked_mul((layout.bands * bytes) as u64)?;
            (all <= most).then_some(all as usize)
        };
        let total = checked(layout.size).ok_or(impossible)?;
        checked(layout.block).ok_or(impossible)?;
        let [across, down] = layout.grid().map(u64::from);
        let count = across * down * if layout.is_planar { layout.bands as u64 } else { 1 };
        let [offsets, counts] = if layout.is_tiled {
            [tag::TILE_OFFSETS, tag::TILE_BYTE_COUNTS]
        } else {
            [tag::STRIP_OFFSETS, tag::STRIP_BYTE_COUNTS]
        };
        let offsets = self.integers(of, offsets)?.ok_or("it says nothing about where its blocks are")?;
        // Old writers left the lengths of what is not compressed out.
        let counts = match self.integers(of, counts)? {
            Some(counts) => counts,
            None if layout.compression == NONE => {
                let of_block =
                    (u64::from(layout.block[0]) * layout.block_bands() as u64 * layout.bits).div_ceil(8);
                (0..offsets.len())
                    .map(|block| {
                        of_block
                            * u64::from(if layout.is_tiled {
                                layout.block[1]
                            } else {
                                layout.place(block)[3]
                            })
                    })
                    .collect()
            }
            None => return Err("it says nothing about how long its blocks are".into()),
        };
        if offsets.len() as u64 != count || counts.len() as u64 != count {
            return Err(format!("{} blocks are listed, and {count} are needed", offsets.len()));
        }
        let mut image = Image {
            size: layout.size,
            bands: layout.bands,
            is_planar: layout.is_planar,
            sample: layout.sample,
            bits: layout.bits as u32,
            photometric: if layout.photometric == 6 { 2 } else { layout.photometric },
            extra: self.integers(of, tag::EXTRA_SAMPLES)?.unwrap_or_default(),
            data: vec![0; total],
            absent: Vec::new(),
        };
        let all: Vec<usize> = (0..offsets.len()).collect();
        for some in all.chunks(AT_ONCE) {
            let mut raw = Vec::with_capacity(some.len());
            for &block in some {
                if offsets[block] == 0 || counts[block] == 0 {
                    image.absent.push(layout.place(block));
                    continue;
                }
                raw.push((block, self.read_at(offsets[block], counts[block])?));
            }
            let decoded: Vec<_> = raw
                .par_iter()
                .map(|(block, raw)| layout.decode(*block, raw).map(|of_block| (*block, of_block)))
                .collect();
            for block in decoded {
                let (block, (row_samples, data)) = block?;
                image.put(&layout, block, row_samples, &data);
            }
        }
        Ok(image)
    }
}

impl Image {
    fn put(&mut self, layout: &Layout, block: usize, row_samples: usize, data: &[u8]) {
        let [column, row, width, height] = layout.place(block).map(|n| n as usize);
        let (bytes, bands) = (self.sample.bytes(), layout.block_bands());
        let plane = if self.is_planar {
            block / layout.grid().map(|n| n as usize).iter().product::<usize>()
        } else {
            0
        };
        let length = width * bands * bytes;
        for (j, from) in data.chunks_exact(row_samples * bytes).take(height).enumerate() {
            let to = (plane * self.pixels() + (row + j) * self.size[0] as usize + column) * bands * bytes;
            self.data[to..to + length].copy_from_slice(&from[..length]);
        }
    }
}
