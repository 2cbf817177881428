//! Rasters as values and as pictures, with their validity masks.

use std::path::Path;

use camsim_core::{
    photometric::GrayImage,
    scene::{Encoding, Texture},
};
use rayon::prelude::*;

pub(crate) use super::tiff_file::{is_tiff, max_decoded_bytes};
use super::{
    bands::ColorBands,
    geo_tags::GeoTags,
    tiff_file::{Directory, Image, SampleType, TiffFile, gdal_translate, tag},
};
use crate::raster::pictures::PictureError;

/// A decoded raster.
pub(crate) struct Raster {
    pub size: [u32; 2],
    pub geo: GeoTags,
    pub image: Image,
    /// Whether each pixel has data, from masks and sparse blocks; `None` if all have.
    valid: Option<Vec<bool>>,
    /// Palette: 16-bit planes of red, green and blue.
    palette: Option<Vec<u64>>,
}

/// Bit of tag 254: an overview.
const REDUCED: u64 = 1;
/// Bit of tag 254: a mask.
const MASK: u64 = 4;

impl Raster {
    /// Reads the first picture of a TIFF file, with its mask.
    pub fn read(path: &Path) -> Result<Self, PictureError> {
        let mut tiff = TiffFile::open(path)?;
        Self::decode(&mut tiff).map_err(|reason| PictureError::decode(path, reason))
    }

    /// A raster of values from another format.
    pub fn from_image(image: Image, geo: GeoTags) -> Self {
        Self { size: image.size, geo, image, valid: None, palette: None }
    }

    fn decode(tiff: &mut TiffFile) -> Result<Self, String> {
        let directories = tiff.directories.clone();
        let mut types = Vec::new();
        for directory in &directories {
            types.push(tiff.integer(directory, tag::NEW_SUBFILE_TYPE)?.unwrap_or(0));
        }
        let is_picture = |subfile_type: &u64| subfile_type & (REDUCED | MASK) == 0;
        let first = types.iter().position(is_picture).unwrap_or(0);
        let directory = &directories[first];
        let mut geo = GeoTags::read(tiff, directory)?;
        let count = types.iter().filter(|subfile_type| is_picture(subfile_type)).count();
        if count > 1 {
            geo.notes.push(format!("has {count} pictures, of which the first is used"));
        }
        let image = tiff.image(directory)?;
        let palette = tiff.integers(directory, tag::COLOR_MAP)?;
        let mut raster = Self { size: image.size, geo, image, valid: None, palette };
        raster.mask_sparse_blocks();
        for (subfile_type, directory) in types.iter().zip(&directories) {
            if subfile_type & MASK != 0 && subfile_type & REDUCED == 0 {
                let mask = read_mask(tiff, directory, raster.size)?;
                raster.apply_mask(&mask);
            }
        }
        Ok(raster)
    }

    fn mask_sparse_blocks(&mut self) {
        let width = self.size[0] as usize;
        if self.image.sparse_blocks.is_empty() {
            return;
        }
        let valid = self.valid.get_or_insert_with(|| vec![true; self.image.pixels()]);
        for [x, y, columns, rows] in &self.image.sparse_blocks {
            for row in *y..y + rows {
                let start = row as usize * width + *x as usize;
                valid[start..start + *columns as usize].fill(false);
            }
        }
    }

    /// Applies a mask in another TIFF file.
    pub fn apply_mask_file(&mut self, path: &Path) -> Result<(), PictureError> {
        let mut tiff = TiffFile::open(path)?;
        let directory = tiff.directories[0].clone();
        let mask = read_mask(&mut tiff, &directory, self.size)
            .map_err(|reason| PictureError::decode(path, reason))?;
        self.apply_mask(&mask);
        Ok(())
    }

    fn apply_mask(&mut self, mask: &[bool]) {
        let valid = self.valid.get_or_insert_with(|| vec![true; mask.len()]);
        valid.iter_mut().zip(mask).for_each(|(valid, mask)| *valid &= mask);
    }

    /// Whether a pixel has data.
    pub fn is_valid(&self, pixel: usize) -> bool {
        self.valid.as_ref().is_none_or(|valid| valid[pixel])
    }

    /// Number of bands.
    pub fn bands(&self) -> usize {
        self.image.bands
    }

    /// For depth pictures: true for 16-bit integers, false for floats, `None` for others or several bands.
    pub fn is_integer_depth(&self) -> Option<bool> {
        match (self.image.sample, self.image.bands, self.image.bits) {
            (SampleType::U16, 1, 16) => Some(true),
            (SampleType::F16 | SampleType::F32 | SampleType::F64, 1, _) => Some(false),
            _ => None,
        }
    }

    /// The value of the first band, as stored.
    pub fn value(&self, pixel: usize) -> f64 {
        self.image.value(pixel, 0)
    }

    /// Converts to a colour picture; white is the largest value of the bits.
    pub fn to_texture(&self, path: &Path, encoding: Encoding) -> Result<Texture, PictureError> {
        self.to_picture(path, encoding, None).map(|(texture, _)| texture)
    }

    /// Converts to a colour picture, with notes. `white` is the stored value of white. Pixels without data
    /// are transparent: those with the no-data value, masked ones, and those of sparse blocks.
    // Long because: the closures that compute a pixel share the bands and levels.
    pub fn to_picture(
        &self,
        path: &Path,
        encoding: Encoding,
        white: Option<f64>,
    ) -> Result<(Texture, Vec<String>), PictureError> {
        let error = |reason: String| PictureError::decode(path, reason);
        let image = &self.image;
        if !matches!(image.sample, SampleType::U8 | SampleType::U16) {
            return Err(error(format!(
                "colours must be unsigned of at most 16 bits: convert it with `{}`",
                gdal_translate("-ot Byte -scale", path)
            )));
        }
        let bands = ColorBands::new(image, &self.geo.bands, self.palette.is_some()).map_err(|reason| {
            error(format!(
                "{reason}: convert it with `{}`",
                gdal_translate("-expand rgb -co PHOTOMETRIC=RGB", path)
            ))
        })?;
        let mut notes = bands.notes.clone();
        let max_value = f64::from((1_u32 << image.bits) - 1);
        notes.extend(self.white_note(&bands, white, max_value));
        let white = white.unwrap_or(max_value);
        let byte = |pixel: usize, band: usize| {
            (f64::from(image.unsigned(pixel, band)) * 255.0 / white).round().min(255.0) as u8
        };
        let nodata = self
            .geo
            .nodata
            .filter(|nodata| nodata.fract() == 0.0 && (0.0..=max_value).contains(nodata))
            .map(|nodata| nodata as u32);
        let color = |pixel: usize| -> [u8; 4] {
            let mut rgb = match (&self.palette, bands.is_palette) {
                (Some(palette), true) => palette_color(palette, image.unsigned(pixel, bands.rgb[0])),
                _ => bands.rgb.map(|band| byte(pixel, band)),
            };
            if bands.is_inverted {
                rgb = rgb.map(|byte| 255 - byte);
            }
            let is_void = nodata
                .is_some_and(|nodata| bands.rgb.iter().all(|&band| image.unsigned(pixel, band) == nodata))
                || !self.is_valid(pixel);
            let alpha = match bands.alpha {
                _ if is_void => 0,
                None => 255,
                Some(band) if bands.alpha_is_full_scale => {
                    (f64::from(image.unsigned(pixel, band)) * 255.0 / max_value).round() as u8
                }
                Some(band) => {
                    (f64::from(image.unsigned(pixel, band)) * 255.0 / white).round().min(255.0) as u8
                }
            };
            if bands.is_premultiplied && alpha > 0 {
                rgb = rgb.map(|byte| (u32::from(byte) * 255 / u32::from(alpha)).min(255) as u8);
            }
            [rgb[0], rgb[1], rgb[2], alpha]
        };
        let mut rgba8 = vec![0; 4 * image.pixels()];
        let width = self.size[0] as usize;
        rgba8.par_chunks_mut(4 * width).enumerate().for_each(|(row, bytes)| {
            for (column, bytes) in bytes.chunks_exact_mut(4).enumerate() {
                bytes.copy_from_slice(&color(row * width + column));
            }
        });
        Ok((Texture { size_px: self.size, rgba8, encoding }, notes))
    }

    /// A note if the largest stored value differs much from white.
    fn white_note(&self, bands: &ColorBands, white: Option<f64>, max_value: f64) -> Option<String> {
        let image = &self.image;
        if bands.is_palette && white.is_some() {
            return Some("its colours are from a palette: scene.terrain.ortho_white is ignored".to_owned());
        }
        if bands.is_palette || (image.bits <= 8 && white.is_none()) {
            return None;
        }
        let nodata = self.geo.nodata;
        let largest_value = |pixel: usize| {
            let stored = bands.rgb.iter().map(|&band| image.unsigned(pixel, band));
            let is_void =
                !self.is_valid(pixel) || stored.clone().all(|value| nodata == Some(f64::from(value)));
            if is_void { 0 } else { stored.max().unwrap_or(0) }
        };
        let largest = (0..image.pixels()).into_par_iter().map(largest_value).max().unwrap_or(0);
        match white {
            Some(white) => {
                let clipped = (0..image.pixels())
                    .into_par_iter()
                    .filter(|&pixel| f64::from(largest_value(pixel)) > white)
                    .count();
                (clipped > 0).then(|| {
                    let fraction = 100.0 * clipped as f64 / image.pixels() as f64;
                    format!(
                        "{fraction:.1} % of its pixels are brighter than scene.terrain.ortho_white = {white} \
                         and are clipped; the largest value is {largest}"
                    )
                })
            }
            None if largest > 0 && 4.0 * f64::from(largest) <= max_value => {
                let bits = u32::BITS - largest.leading_zeros();
                let suggested_white = (1_u64 << bits) - 1;
                Some(format!(
                    "its {} bit values reach only {largest} of {max_value}, like {bits} bit values: with \
                     white at {max_value} the picture is nearly black. Set scene.terrain.ortho_white = \
                     {suggested_white} if that is white, or = {max_value} to keep it dark",
                    image.bits
                ))
            }
            None => None,
        }
    }

    /// Converts to a grey picture of values 0..=1: integers relative to their full range, floats clamped.
    pub fn to_gray(&self, path: &Path) -> Result<GrayImage, PictureError> {
        let image = &self.image;
        let is_float = matches!(image.sample, SampleType::F16 | SampleType::F32 | SampleType::F64);
        if image.bands == 1
            && image.photometric == 1
            && (is_float || matches!(image.sample, SampleType::U8 | SampleType::U16))
        {
            let scale = if is_float { 1.0 } else { f64::from((1_u32 << image.bits) - 1) };
            let values: Vec<f32> =
                (0..image.pixels()).map(|pixel| (self.value(pixel) / scale).clamp(0.0, 1.0) as f32).collect();
            if values.iter().any(|v| v.is_nan()) {
                return Err(PictureError::decode(path, "has NaN values"));
            }
            return Ok(GrayImage { size_px: self.size, values });
        }
        if !matches!(image.sample, SampleType::U8 | SampleType::U16) {
            return Err(PictureError::decode(
                path,
                "grey values must be unsigned of at most 16 bits, or floats",
            ));
        }
        Ok(crate::raster::pictures::gray_from_texture(&self.to_texture(path, Encoding::Linear)?))
    }
}

/// Whether a mask is nonzero in any band, by pixel.
fn read_mask(tiff: &mut TiffFile, directory: &Directory, size: [u32; 2]) -> Result<Vec<bool>, String> {
    let mask = tiff.image(directory)?;
    if mask.size != size {
        return Err(format!("its mask has {:?} pixels, but the picture {size:?}", mask.size));
    }
    let mut valid: Vec<bool> =
        (0..mask.pixels()).map(|pixel| (0..mask.bands).any(|band| mask.value(pixel, band) != 0.0)).collect();
    // Sparse blocks of the mask are zero.
    for [x, y, columns, rows] in &mask.sparse_blocks {
        (*y..y + rows).for_each(|row| {
            valid[(row * size[0] + x) as usize..(row * size[0] + x + columns) as usize].fill(false)
        });
    }
    Ok(valid)
}

/// Red, green and blue of a palette entry.
fn palette_color(palette: &[u64], index: u32) -> [u8; 3] {
    let entries = palette.len() / 3;
    // Some writers store 8-bit values instead of 16-bit ones.
    let is_8_bit = palette.iter().all(|value| *value < 256);
    [0, 1, 2].map(|k| {
        palette
            .get(k * entries + index as usize)
            .map_or(0, |v| if is_8_bit { *v as u8 } else { (v >> 8) as u8 })
    })
}
