//! Rasters as numbers and as pictures, with which of their pixels hold something.

use std::path::Path;

use camsim_core::{
    scene::{Encoding, Texture},
    sequence::GrayImage,
};
use rayon::prelude::*;

pub(crate) use super::tiff_file::{is_tiff, most_decoded};
use super::{
    bands::ColorBands,
    geo_tags::GeoTags,
    tiff_file::{Directory, Image, Sample, TiffFile, gdal_translate, tag},
};
use crate::pictures::PictureError;

/// A decoded raster.
pub(crate) struct Raster {
    pub size: [u32; 2],
    pub geo: GeoTags,
    pub image: Image,
    /// Whether there is something at a pixel, where masks or blocks that are left out say so.
    valid: Option<Vec<bool>>,
    /// 16-bit R, G, B planes of a palette.
    palette: Option<Vec<u64>>,
}

/// Bits of tag 254.
const REDUCED: u64 = 1;
const MASK: u64 = 4;

impl Raster {
    /// Reads the first picture of a file, with its mask.
    pub fn read(path: &Path) -> Result<Self, PictureError> {
        let mut tiff = TiffFile::open(path)?;
        Self::decode(&mut tiff).map_err(|reason| PictureError::decode(path, reason))
    }

    /// Of numbers that come from elsewhere.
    pub fn of_numbers(image: Image, geo: GeoTags) -> Self {
        Self { size: image.size, geo, image, valid: None, palette: None }
    }

    fn decode(tiff: &mut TiffFile) -> Result<Self, String> {
        let directories = tiff.directories.clone();
        let mut kinds = Vec::new();
        for of in &directories {
            kinds.push(tiff.integer(of, tag::NEW_SUBFILE_TYPE)?.unwrap_or(0));
        }
        let first = kinds.iter().position(|kind| kind & (REDUCED | MASK) == 0).unwrap_or(0);
        let of = &directories[first];
        let mut geo = GeoTags::read(tiff, of)?;
        let more = kinds.iter().filter(|kind| *kind & (REDUCED | MASK) == 0).count();
        if more > 1 {
            geo.notes.push(format!("holds {more} pictures, of which the first is used"));
        }
        let image = tiff.image(of)?;
        let palette = tiff.integers(of, tag::COLOR_MAP)?;
        let mut raster = Self { size: image.size, geo, image, valid: None, palette };
        raster.leave_out_absent();
        for (kind, of) in kinds.iter().zip(&directories) {
            if kind & MASK != 0 && kind & REDUCED == 0 {
                let mask = mask_of(tiff, of, raster.size)?;
                raster.leave_out(&mask);
            }
        }
        Ok(raster)
    }

    fn leave_out_absent(&mut self) {
        let width = self.size[0] as usize;
        if self.image.absent.is_empty() {
            return;
        }
        let valid = self.valid.get_or_insert_with(|| vec![true; self.image.pixels()]);
        for [x, y, columns, rows] in &self.image.absent {
            for row in *y..y + rows {
                let from = row as usize * width + *x as usize;
                valid[from..from + *columns as usize].fill(false);
            }
        }
    }

    /// What a mask beside the file leaves out.
    pub fn leave_out_by(&mut self, path: &Path) -> Result<(), PictureError> {
        let mut tiff = TiffFile::open(path)?;
        let of = tiff.directories[0].clone();
        let mask = mask_of(&mut tiff, &of, self.size).map_err(|reason| PictureError::decode(path, reason))?;
        self.leave_out(&mask);
        Ok(())
    }

    fn leave_out(&mut self, mask: &[bool]) {
        let valid = self.valid.get_or_insert_with(|| vec![true; mask.len()]);
        valid.iter_mut().zip(mask).for_each(|(valid, mask)| *valid &= mask);
    }

    /// Whether masks have something to show at a pixel.
    pub fn is_valid(&self, pixel: usize) -> bool {
        self.valid.as_ref().is_none_or(|valid| valid[pixel])
    }

    /// Samples a pixel.
    pub fn bands(&self) -> usize {
        self.image.bands
    }

    /// Of a depth picture: whether it holds 16-bit whole numbers, or floats; `None` if neither, or of several
    /// bands.
    pub fn depth_is_whole(&self) -> Option<bool> {
        match (self.image.sample, self.image.bands, self.image.bits) {
            (Sample::U16, 1, 16) => Some(true),
            (Sample::F16 | Sample::F32 | Sample::F64, 1, _) => Some(false),
            _ => None,
        }
    }

    /// A value of the first band.
    pub fn value(&self, pixel: usize) -> f64 {
        self.image.value(pixel, 0)
    }

    /// As a colour picture; white is the largest number that its bits can hold.
    pub fn to_texture(&self, path: &Path, encoding: Encoding) -> Result<Texture, PictureError> {
        self.to_picture(path, encoding, None).map(|(texture, _)| texture)
    }

    /// As a colour picture, with what there is to say about it. `white` is the stored number that is full
    /// light. Pixels without content are transparent: those of the "no data" mark, of masks, and of blocks
    /// that are left out.
    pub fn to_picture(
        &self,
        path: &Path,
        encoding: Encoding,
        white: Option<f64>,
    ) -> Result<(Texture, Vec<String>), PictureError> {
        let wrong = |reason: String| PictureError::decode(path, reason);
        let image = &self.image;
        if !matches!(image.sample, Sample::U8 | Sample::U16) {
            return Err(wrong(format!(
                "colours must be of at most 16 bits, unsigned: convert it with `{}`",
                gdal_translate("-ot Byte -scale", path)
            )));
        }
        let bands = ColorBands::of(image, &self.geo.bands, self.palette.is_some()).map_err(|reason| {
            wrong(format!(
                "{reason}: convert it with `{}`",
                gdal_translate("-expand rgb -co PHOTOMETRIC=RGB", path)
            ))
        })?;
        let mut notes = bands.notes.clone();
        let most = f64::from((1_u32 << image.bits) - 1);
        notes.extend(self.say_scale(&bands, white, most));
        let white = white.unwrap_or(most);
        let byte = |pixel: usize, band: usize| {
            (f64::from(image.unsigned(pixel, band)) * 255.0 / white).round().min(255.0) as u8
        };
        let mark = self
            .geo
            .nodata
            .filter(|mark| mark.fract() == 0.0 && (0.0..=most).contains(mark))
            .map(|mark| mark as u32);
        let color = |pixel: usize| -> [u8; 4] {
            let mut rgb = match (&self.palette, bands.is_palette) {
                (Some(palette), true) => palette_color(palette, image.unsigned(pixel, bands.rgb[0])),
                _ => bands.rgb.map(|band| byte(pixel, band)),
            };
            if bands.is_inverted {
                rgb = rgb.map(|byte| 255 - byte);
            }
            let is_void = mark
                .is_some_and(|mark| bands.rgb.iter().all(|&band| image.unsigned(pixel, band) == mark))
                || !self.is_valid(pixel);
            let alpha = match bands.alpha {
                _ if is_void => 0,
                None => 255,
                Some(band) if bands.alpha_is_full_scale => {
                    (f64::from(image.unsigned(pixel, band)) * 255.0 / most).round() as u8
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

    /// Where the largest stored number is far from what is taken for white.
    fn say_scale(&self, bands: &ColorBands, white: Option<f64>, most: f64) -> Option<String> {
        let image = &self.image;
        if bands.is_palette && white.is_some() {
            return Some(
                "its colours are those of a palette: scene.terrain.ortho_white is not used".to_owned(),
            );
        }
        if bands.is_palette || (image.bits <= 8 && white.is_none()) {
            return None;
        }
        let mark = self.geo.nodata;
        let largest_of = |pixel: usize| {
            let stored = bands.rgb.iter().map(|&band| image.unsigned(pixel, band));
            let is_void = !self.is_valid(pixel) || stored.clone().all(|value| mark == Some(f64::from(value)));
            if is_void { 0 } else { stored.max().unwrap_or(0) }
        };
        let largest = (0..image.pixels()).into_par_iter().map(largest_of).max().unwrap_or(0);
        match white {
            Some(white) => {
                let cut = (0..image.pixels())
                    .into_par_iter()
                    .filter(|&pixel| f64::from(largest_of(pixel)) > white)
                    .count();
                (cut > 0).then(|| {
                    let share = 100.0 * cut as f64 / image.pixels() as f64;
                    format!("{share:.1} % of its pixels are brighter than scene.terrain.ortho_white = {white}, and are cut there; the largest value is {largest}")
                })
            }
            None if largest > 0 && 4.0 * f64::from(largest) <= most => {
                let bits = u32::BITS - largest.leading_zeros();
                let full = (1_u64 << bits) - 1;
                Some(format!(
                    "its values of {} bits end at {largest} of {most}, as those of {bits} bits do: with white at {most} the picture is nearly black. \
                     Set scene.terrain.ortho_white = {full} if that is white, or = {most} if it is to be as dark as this",
                    image.bits
                ))
            }
            None => None,
        }
    }

    /// As a grey picture of values 0..=1: integers by their full range, floats as they are (cut to the
    /// range).
    pub fn to_gray(&self, path: &Path) -> Result<GrayImage, PictureError> {
        let image = &self.image;
        let is_float = matches!(image.sample, Sample::F16 | Sample::F32 | Sample::F64);
        if image.bands == 1
            && image.photometric == 1
            && (is_float || matches!(image.sample, Sample::U8 | Sample::U16))
        {
            let scale = if is_float { 1.0 } else { f64::from((1_u32 << image.bits) - 1) };
            let values: Vec<f32> =
                (0..image.pixels()).map(|pixel| (self.value(pixel) / scale).clamp(0.0, 1.0) as f32).collect();
            if values.iter().any(|v| v.is_nan()) {
                return Err(PictureError::decode(path, "holds NaN"));
            }
            return Ok(GrayImage { size_px: self.size, values });
        }
        if !matches!(image.sample, Sample::U8 | Sample::U16) {
            return Err(PictureError::decode(
                path,
                "grey values must be of at most 16 bits, unsigned, or floats",
            ));
        }
        Ok(crate::pictures::gray_from_texture(&self.to_texture(path, Encoding::Linear)?))
    }
}

/// Where a mask's picture is not zero, in any band.
fn mask_of(tiff: &mut TiffFile, of: &Directory, size: [u32; 2]) -> Result<Vec<bool>, String> {
    let mask = tiff.image(of)?;
    if mask.size != size {
        return Err(format!("its mask has {:?} pixels, and the picture {size:?}", mask.size));
    }
    let mut valid: Vec<bool> =
        (0..mask.pixels()).map(|pixel| (0..mask.bands).any(|band| mask.value(pixel, band) != 0.0)).collect();
    // What a mask leaves out, it does not show.
    for [x, y, columns, rows] in &mask.absent {
        (*y..y + rows).for_each(|row| {
            valid[(row * size[0] + x) as usize..(row * size[0] + x + columns) as usize].fill(false)
        });
    }
    Ok(valid)
}

fn palette_color(palette: &[u64], index: u32) -> [u8; 3] {
    let entries = palette.len() / 3;
    // Some writers fill bytes where words are meant.
    let is_of_bytes = palette.iter().all(|value| *value < 256);
    [0, 1, 2].map(|k| {
        palette
            .get(k * entries + index as usize)
            .map_or(0, |v| if is_of_bytes { *v as u8 } else { (v >> 8) as u8 })
    })
}
