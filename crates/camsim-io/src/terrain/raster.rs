//! TIFF files as numbers, with what their tags say about place and meaning.

use std::{
    fs::File,
    io::{BufReader, Read},
    path::Path,
};

use camsim_core::{
    scene::{Encoding, Texture},
    sequence::GrayImage,
};
use tiff::{
    ColorType,
    decoder::{ChunkType, Decoder, DecodingResult, Limits},
    tags::Tag,
};

use super::georeference::Affine;
use crate::pictures::PictureError;

/// A decoded file may be this much larger than the file itself (the best that deflate can do is 1032).
const MAX_COMPRESSION: u64 = 2000;

/// Small files may always decode to this, bytes.
const MIN_LIMIT: u64 = 64 << 20;

/// What a file of so many bytes may decode to, bytes: a few bytes must not ask for all memory.
pub(crate) fn most_decoded(bytes: u64) -> u64 {
    bytes.saturating_mul(MAX_COMPRESSION).max(MIN_LIMIT)
}

/// A decoded TIFF.
pub(crate) struct Raster {
    pub size: [u32; 2],
    pub geo: GeoTags,
    color: ColorType,
    /// Samples a pixel.
    bands: usize,
    /// Whole bands one after the other, instead of pixel after pixel.
    is_planar: bool,
    data: DecodingResult,
    /// 16-bit R, G, B planes of a palette.
    palette: Option<Vec<u16>>,
}

/// What the tags say.
#[derive(Clone, Debug, Default)]
pub(crate) struct GeoTags {
    pub model_from_pixel: Option<Affine>,
    pub epsg: Option<u16>,
    pub nodata: Option<f64>,
    /// EPSG codes of units.
    pub horizontal_unit: Option<u16>,
    pub vertical_unit: Option<u16>,
}

/// Whether a file begins as a TIFF does.
pub(crate) fn is_tiff(path: &Path) -> Result<bool, PictureError> {
    let mut start = [0; 4];
    let mut file = File::open(path).map_err(|source| PictureError::open(path, source))?;
    // A file of less than four bytes is no TIFF either.
    let _ = file.read(&mut start).map_err(|source| PictureError::open(path, source))?;
    Ok(matches!(start, [b'I', b'I', 42 | 43, 0] | [b'M', b'M', 0, 42 | 43]))
}

impl Raster {
    /// Reads the first image of a file.
    pub fn read(path: &Path) -> Result<Self, PictureError> {
        if !is_tiff(path)? {
            return Err(PictureError::decode(path, "not a TIFF file"));
        }
        let file = File::open(path).map_err(|source| PictureError::open(path, source))?;
        let bytes = file.metadata().map_err(|source| PictureError::open(path, source))?.len();
        Self::decode(BufReader::new(file), bytes).map_err(|reason| PictureError::decode(path, reason))
    }

    fn decode(file: BufReader<File>, bytes: u64) -> Result<Self, String> {
        let mut limits = Limits::default();
        limits.decoding_buffer_size = usize::try_from(most_decoded(bytes)).unwrap_or(usize::MAX);
        limits.intermediate_buffer_size = limits.decoding_buffer_size;
        // A large image in strips of one row has large lists of offsets.
        limits.ifd_value_size = 64 << 20;
        let mut decoder = Decoder::new(file).map_err(say)?.with_limits(limits);
        let (width, height) = decoder.dimensions().map_err(say)?;
        let color = decoder.colortype().map_err(say)?;
        if color.bit_depth() < 8 {
            return Err(format!("{} bits a sample are not supported: convert to 8 or more", color.bit_depth()));
        }
        let geo = GeoTags::read(&mut decoder)?;
        let find_u16s = |decoder: &mut Decoder<_>, tag| decoder.find_tag_unsigned_vec::<u16>(tag).map_err(say);
        let palette = find_u16s(&mut decoder, Tag::ColorMap)?;
        let samples = find_u16s(&mut decoder, Tag::SamplesPerPixel)?.and_then(|list| list.first().copied()).unwrap_or(1);
        let is_planar = samples > 1 && find_u16s(&mut decoder, Tag::PlanarConfiguration)?.is_some_and(|list| list.first() == Some(&2));
        if is_planar && decoder.get_chunk_type() == ChunkType::Tile {
            // The decoder mixes up the tiles of the second and further bands.
            return Err("tiles with separate bands are not supported: convert with `gdal_translate -co INTERLEAVE=PIXEL IN OUT`".into());
        }
        let mut data = DecodingResult::U8(Vec::new());
        decoder.read_image_to_buffer(&mut data).map_err(say)?;
        let pixels = width as usize * height as usize;
        let length = length(&data);
        if pixels == 0 || length == 0 || !length.is_multiple_of(pixels) {
            return Err(format!("{length} samples do not make {width} x {height} pixels"));
        }
        Ok(Self { size: [width, height], geo, color, bands: length / pixels, is_planar, data, palette })
    }

    /// Samples a pixel.
    pub fn bands(&self) -> usize {
        self.bands
    }

    /// Of a depth picture: whether it holds 16-bit whole numbers, or floats; `None` if neither, or of several bands.
    pub fn depth_is_whole(&self) -> Option<bool> {
        match (&self.data, self.bands) {
            (DecodingResult::U16(_), 1) => Some(true),
            (DecodingResult::F16(_) | DecodingResult::F32(_) | DecodingResult::F64(_), 1) => Some(false),
            _ => None,
        }
    }

    /// A value of the first band.
    pub fn value(&self, pixel: usize) -> f64 {
        let at = if self.is_planar { pixel } else { pixel * self.bands };
        match &self.data {
            DecodingResult::U8(v) => v[at].into(),
            DecodingResult::U16(v) => v[at].into(),
            DecodingResult::U32(v) => v[at].into(),
            DecodingResult::U64(v) => v[at] as f64,
            DecodingResult::F16(v) => v[at].to_f64(),
            DecodingResult::F32(v) => v[at].into(),
            DecodingResult::F64(v) => v[at],
            DecodingResult::I8(v) => v[at].into(),
            DecodingResult::I16(v) => v[at].into(),
            DecodingResult::I32(v) => v[at].into(),
            DecodingResult::I64(v) => v[at] as f64,
        }
    }

    /// As a colour picture. Pixels whose colours all equal the "no data" mark become transparent.
    pub fn to_texture(&self, path: &Path, encoding: Encoding) -> Result<Texture, PictureError> {
        let sample = self.byte_sampler().map_err(|reason| PictureError::decode(path, reason))?;
        let nodata = self.geo.nodata.filter(|mark| mark.fract() == 0.0 && (0.0..=255.0).contains(mark)).map(|mark| mark as u8);
        let mut rgba8 = Vec::with_capacity(4 * self.pixels());
        for pixel in 0..self.pixels() {
            let at = |band: usize| sample(pixel, band);
            let [r, g, b, a] = match self.color {
                ColorType::Palette(_) => self.palette_color(at(0)),
                ColorType::GrayA(_) if self.bands >= 2 => [at(0), at(0), at(0), at(1)],
                ColorType::RGBA(_) if self.bands >= 4 => [at(0), at(1), at(2), at(3)],
                ColorType::CMYK(_) | ColorType::CMYKA(_) | ColorType::Lab(_) | ColorType::YCbCr(_) => {
                    return Err(PictureError::decode(path, format!("{:?} colours are not supported: convert to RGB", self.color)));
                }
                _ if self.bands >= 3 => [at(0), at(1), at(2), 255],
                _ => [at(0), at(0), at(0), 255],
            };
            let is_void = nodata.is_some_and(|mark| [r, g, b] == [mark; 3]);
            rgba8.extend([r, g, b, if is_void { 0 } else { a }]);
        }
        Ok(Texture { size_px: self.size, rgba8, encoding })
    }

    /// As a grey picture of values 0..=1: integers by their full range, floats as they are (cut to the range).
    pub fn to_gray(&self, path: &Path) -> Result<GrayImage, PictureError> {
        if self.bands == 1 && !matches!(self.color, ColorType::Palette(_)) {
            let scale = match &self.data {
                DecodingResult::U8(_) => 255.0,
                DecodingResult::U16(_) => 65535.0,
                DecodingResult::F16(_) | DecodingResult::F32(_) | DecodingResult::F64(_) => 1.0,
                _ => return Err(PictureError::decode(path, "grey values must be 8 or 16 bit unsigned, or float")),
            };
            let values: Vec<f32> = (0..self.pixels()).map(|pixel| (self.value(pixel) / scale).clamp(0.0, 1.0) as f32).collect();
            if values.iter().any(|v| v.is_nan()) {
                return Err(PictureError::decode(path, "holds NaN"));
            }
            return Ok(GrayImage { size_px: self.size, values });
        }
        Ok(crate::pictures::gray_from_texture(&self.to_texture(path, Encoding::Linear)?))
    }

    fn pixels(&self) -> usize {
        self.size[0] as usize * self.size[1] as usize
    }

    fn palette_color(&self, index: u8) -> [u8; 4] {
        let Some(palette) = &self.palette else { return [index, index, index, 255] };
        let entries = palette.len() / 3;
        let channel = |k: usize| palette.get(k * entries + index as usize).map_or(0, |v| (v >> 8) as u8);
        [channel(0), channel(1), channel(2), 255]
    }

    /// (pixel, band) -> byte.
    fn byte_sampler(&self) -> Result<Box<dyn Fn(usize, usize) -> u8 + '_>, String> {
        let (bands, pixels, is_planar) = (self.bands, self.pixels(), self.is_planar);
        let index = move |pixel: usize, band: usize| if is_planar { band * pixels + pixel } else { pixel * bands + band };
        match &self.data {
            DecodingResult::U8(v) => Ok(Box::new(move |pixel, band| v[index(pixel, band)])),
            // 65535 / 257 = 255.
            DecodingResult::U16(v) => Ok(Box::new(move |pixel, band| ((u32::from(v[index(pixel, band)]) + 128) / 257) as u8)),
            _ => Err("colours must be 8 or 16 bit unsigned: convert with `gdal_translate -ot Byte -scale IN OUT`".into()),
        }
    }
}

impl GeoTags {
    fn read(decoder: &mut Decoder<BufReader<File>>) -> Result<Self, String> {
        let mut numbers = |tag: Tag| match decoder.find_tag(tag) {
            Ok(Some(value)) => value.into_f64_vec().map(Some).map_err(say),
            Ok(None) => Ok(None),
            Err(error) => Err(say(error)),
        };
        let scale = numbers(Tag::ModelPixelScaleTag)?;
        let tie = numbers(Tag::ModelTiepointTag)?;
        let matrix = numbers(Tag::ModelTransformationTag)?;
        let keys = decoder.find_tag_unsigned_vec::<u16>(Tag::GeoKeyDirectoryTag).map_err(say)?.unwrap_or_default();
        let nodata = match decoder.find_tag(Tag::GdalNodata) {
            Ok(Some(value)) => value.into_string().ok().and_then(|text| text.trim_matches(['\0', ' ']).parse().ok()),
            _ => None,
        };
        // Entries: key, place (0 = here), count, value.
        let key = |wanted: u16| {
            keys.get(4..)?.chunks_exact(4).find(|entry| entry[0] == wanted && entry[1] == 0).map(|entry| entry[3]).filter(|&code| code != 0)
        };
        let raster_type = key(1025);
        let affine = affine(scale.as_deref(), tie.as_deref(), matrix.as_deref());
        Ok(Self {
            // 2: whole pixel coordinates are pixel centres ("pixel is point").
            model_from_pixel: if raster_type == Some(2) { affine.map(Affine::with_centres_at_half) } else { affine },
            // 3072: projected; 2048: geographic, which a projected file may state too, as its base.
            epsg: key(3072).or_else(|| key(2048)),
            nodata,
            horizontal_unit: key(3076),
            vertical_unit: key(4099),
        })
    }
}

fn affine(scale: Option<&[f64]>, tie: Option<&[f64]>, matrix: Option<&[f64]>) -> Option<Affine> {
    if let Some([a, b, _, c, d, e, _, f, ..]) = matrix {
        return Some(Affine { origin: [*c, *f], column: [*a, *d], row: [*b, *e] });
    }
    let ([sx, sy, ..], [i, j, _, x, y, ..]) = (scale?, tie?) else { return None };
    // Rows go south: the scale is positive by convention.
    Some(Affine { origin: [x - i * sx, y + j * sy], column: [*sx, 0.0], row: [0.0, -sy] })
}

fn say(error: tiff::TiffError) -> String {
    match error {
        tiff::TiffError::IoError(error) if error.kind() == std::io::ErrorKind::UnexpectedEof => "the file is cut off".into(),
        tiff::TiffError::LimitsExceeded => "the stated size is impossible for a file of this length".into(),
        other => other.to_string(),
    }
}

fn length(data: &DecodingResult) -> usize {
    match data {
        DecodingResult::U8(v) => v.len(),
        DecodingResult::U16(v) => v.len(),
        DecodingResult::U32(v) => v.len(),
        DecodingResult::U64(v) => v.len(),
        DecodingResult::F16(v) => v.len(),
        DecodingResult::F32(v) => v.len(),
        DecodingResult::F64(v) => v.len(),
        DecodingResult::I8(v) => v.len(),
        DecodingResult::I16(v) => v.len(),
        DecodingResult::I32(v) => v.len(),
        DecodingResult::I64(v) => v.len(),
    }
}
