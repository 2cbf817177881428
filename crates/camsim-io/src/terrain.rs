//! Terrain from a GeoTIFF of heights and a picture of the ground.

mod crs;
mod georeference;
pub(crate) mod raster;
mod shade;

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use camsim_core::{
    scenario::TerrainSpec,
    scene::{Encoding, Terrain, TerrainError, Texture},
};
use glam::DVec3;
use rayon::prelude::*;

use crate::pictures::{PictureError, read_texture};
use crs::Crs;
use georeference::{Affine, world_file};
use raster::Raster;

/// NED position (metres) of latitude, longitude (radians) and ellipsoidal height (metres).
pub type NedFromGeodetic<'a> = &'a (dyn Fn(f64, f64, f64) -> DVec3 + Sync);

/// Metres to add to a height at latitude, longitude (radians): the geoid's undulation, where DEM and log differ in datum.
pub type HeightShift<'a> = &'a (dyn Fn(f64, f64) -> f64 + Sync);

/// Heights outside of this are garbage or undeclared "no data" marks, metres: from below the deepest sea to above the highest mountain.
const PLAUSIBLE_HEIGHTS_M: [f64; 2] = [-11_500.0, 9_500.0];

/// The mark that most often means "no data" where the file does not declare one.
const COMMON_NODATA: f64 = -9999.0;

/// A terrain and what to say about it.
#[derive(Clone, Debug)]
pub struct LoadedTerrain {
    /// Chunks and texture.
    pub terrain: Terrain,
    /// Where it lies.
    pub summary: TerrainSummary,
}

/// Where a terrain lies, and what was repaired.
#[derive(Clone, Debug, PartialEq)]
pub struct TerrainSummary {
    /// Coordinate system of the DEM.
    pub epsg: u16,
    /// Heights from west to east and from north to south.
    pub size: [u32; 2],
    /// Latitude, longitude of the south-western corner of the bounding rectangle, radians.
    pub south_west_rad: [f64; 2],
    /// Latitude, longitude of the north-eastern corner of the bounding rectangle, radians.
    pub north_east_rad: [f64; 2],
    /// Latitude, longitude of the middle, radians.
    pub centre_rad: [f64; 2],
    /// NED position of the middle, at the middle of the height range, metres.
    pub centre_ned_m: DVec3,
    /// Lowest and highest valid height of the file, metres.
    pub height_range_m: [f64; 2],
    /// Heights that are missing or not plausible.
    pub void_heights: u64,
    /// Heights that lie outside of the ortho-image; they get the colour of its border.
    pub outside_ortho: u64,
}

/// Why a terrain cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum TerrainFileError {
    /// A file that cannot be read or decoded.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// A picture where heights are wanted.
    #[error("{path}: has {bands} bands, so it is a picture and no DEM: heights are one band (scene.terrain.ortho takes the picture)")]
    NotHeights {
        /// The file.
        path: PathBuf,
        /// Its bands.
        bands: usize,
    },
    /// The DEM says nothing about where it is.
    #[error(
        "{path}: no georeference: neither GeoTIFF tags nor a world file ({world}) beside it. \
         Add them, for example with `gdal_translate -a_srs EPSG:CODE -a_ullr WEST NORTH EAST SOUTH IN OUT`"
    )]
    NoGeoreference {
        /// The DEM.
        path: PathBuf,
        /// Name of the world file that would do.
        world: String,
    },
    /// A world file that cannot be understood.
    #[error("{path}: a world file has six numbers, one a line: {reason}")]
    WorldFile {
        /// The world file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// A degenerate transformation.
    #[error("{path}: the georeference is degenerate (pixel size zero or not finite)")]
    DegenerateGeoreference {
        /// The file.
        path: PathBuf,
    },
    /// The coordinate system is not stated.
    #[error("{path}: the file does not state its coordinate system: set scene.terrain.epsg, for example scene.terrain.epsg = 32632")]
    NoCrs {
        /// The file.
        path: PathBuf,
    },
    /// The coordinate system is not known.
    #[error(
        "{path}: EPSG:{epsg} is not supported. Known are 4326, 4258, 3857, 21781, 2056, 32601-32660, 32701-32760 and 25828-25838: \
         reproject with `gdalwarp -t_srs EPSG:CODE IN OUT`, or set scene.terrain.epsg if the file states a wrong code"
    )]
    UnsupportedCrs {
        /// The file.
        path: PathBuf,
        /// Its code, 32767 if it defines its own.
        epsg: u16,
    },
    /// The file and the scenario disagree.
    #[error("{path}: the file states EPSG:{stated} but scene.terrain.epsg = {wanted}: remove the key, or reproject the file")]
    CrsConflict {
        /// The file.
        path: PathBuf,
        /// In the file.
        stated: u16,
        /// In the scenario.
        wanted: u16,
    },
    /// Units other than metres.
    #[error(
        "{path}: the {what} unit has EPSG code {code}; only metres (9001) and feet (9002, 9003, heights only) are known: convert the file"
    )]
    Unit {
        /// The file.
        path: PathBuf,
        /// "horizontal" or "vertical".
        what: &'static str,
        /// EPSG code of the unit.
        code: u16,
    },
    /// No grid.
    #[error("{path}: {source}")]
    Grid {
        /// The DEM.
        path: PathBuf,
        /// What is wrong with it.
        source: TerrainError,
    },
    /// Coordinates that the projection has no answer for.
    #[error("{path}: {count} heights lie outside of the domain of EPSG:{epsg}: check scene.terrain.epsg and the georeference")]
    OutsideCrs {
        /// The DEM.
        path: PathBuf,
        /// Coordinate system.
        epsg: u16,
        /// Such heights.
        count: u64,
    },
    /// Two files of different places.
    #[error("{ortho}: does not overlap {dem}: check scene.terrain.ortho")]
    NoOverlap {
        /// The picture.
        ortho: PathBuf,
        /// The DEM.
        dem: PathBuf,
    },
}

/// Reads `scene.terrain`. Paths are used as they stand. `height_shift` is added to the heights of the file where its vertical datum is not
/// that of the flight log; horizontal datum transformations never touch heights.
///
/// # Errors
///
/// [`TerrainFileError`] names the file and what to do.
pub fn read_terrain(
    spec: &TerrainSpec,
    ned_from_geodetic: NedFromGeodetic<'_>,
    height_shift: Option<HeightShift<'_>>,
) -> Result<LoadedTerrain, TerrainFileError> {
    let dem = Dem::read(&spec.dem, spec.epsg)?;
    let samples = dem.samples(ned_from_geodetic, height_shift)?;
    let (texture, uvs, outside_ortho) = match &spec.ortho {
        Some(path) => ortho(path, &dem, &samples)?,
        None => (shade::relief(dem.size, &samples.heights_m, &samples.points_ned_m), dem.covering_uvs(), 0),
    };
    let [cols, rows] = dem.size;
    let grid_error = |source| TerrainFileError::Grid { path: spec.dem.clone(), source };
    let terrain = Terrain::new(cols, rows, &samples.points_ned_m, &uvs, Arc::new(texture)).map_err(grid_error)?;
    let summary = dem.summary(&samples, outside_ortho, ned_from_geodetic, height_shift);
    Ok(LoadedTerrain { terrain, summary })
}

/// A grid of heights with its place on Earth; row 0 is the northernmost, column 0 the westernmost.
struct Dem {
    path: PathBuf,
    size: [u32; 2],
    /// Metres; NaN = void.
    heights_m: Vec<f64>,
    /// Model coordinates of pixel corners.
    model_from_pixel: Affine,
    crs: Crs,
}

/// Each point of a [`Dem`].
struct Samples {
    geodetic_rad: Vec<[f64; 2]>,
    points_ned_m: Vec<DVec3>,
    heights_m: Vec<f64>,
}

impl Dem {
    fn read(path: &Path, wanted_epsg: Option<u16>) -> Result<Self, TerrainFileError> {
        let raster = Raster::read(path)?;
        let geo = &raster.geo;
        let epsg = match (geo.epsg, wanted_epsg) {
            (Some(stated), Some(wanted)) if stated != wanted && Crs::new(stated).is_some() => {
                return Err(TerrainFileError::CrsConflict { path: path.into(), stated, wanted });
            }
            (_, Some(wanted)) => wanted,
            (Some(stated), None) => stated,
            (None, None) => return Err(missing(path, &raster)?),
        };
        let crs = Crs::new(epsg).ok_or_else(|| TerrainFileError::UnsupportedCrs { path: path.into(), epsg })?;
        let model_from_pixel = georeference_of(path, geo.model_from_pixel)?.ok_or_else(|| no_georeference(path))?;
        if !crs.is_geographic() && geo.horizontal_unit.is_some_and(|unit| unit != 9001) {
            return Err(TerrainFileError::Unit { path: path.into(), what: "horizontal", code: geo.horizontal_unit.unwrap_or(0) });
        }
        let metres_per_unit = match geo.vertical_unit {
            None | Some(9001) => 1.0,
            Some(9002) => 0.3048,
            Some(9003) => 1200.0 / 3937.0,
            Some(code) => return Err(TerrainFileError::Unit { path: path.into(), what: "vertical", code }),
        };
        let [lowest, highest] = PLAUSIBLE_HEIGHTS_M;
        let mark = geo.nodata.unwrap_or(COMMON_NODATA);
        if raster.bands() > 2 {
            return Err(TerrainFileError::NotHeights { path: path.into(), bands: raster.bands() });
        }
        let mut heights_m = raster.first_band();
        heights_m.par_iter_mut().for_each(|height| {
            // A float32 file may declare its mark with more digits than it holds.
            let is_nodata = *height == mark || *height as f32 == mark as f32;
            let metres = *height * metres_per_unit;
            *height = if is_nodata || !(lowest..=highest).contains(&metres) { f64::NAN } else { metres };
        });
        let mut dem = Self { path: path.into(), size: raster.size, heights_m, model_from_pixel, crs };
        dem.turn_north_up();
        Ok(dem)
    }

    /// Some files count rows from the south (or columns from the east); the diagonals of the cells are defined with the north on top.
    fn turn_north_up(&mut self) {
        let [cols, rows] = self.size.map(|n| n as usize);
        if self.model_from_pixel.row[1] > 0.0 {
            for row in 0..rows / 2 {
                let (upper, lower) = self.heights_m.split_at_mut((rows - 1 - row) * cols);
                upper[row * cols..(row + 1) * cols].swap_with_slice(&mut lower[..cols]);
            }
            self.model_from_pixel = self.model_from_pixel.with_rows_reversed(rows as f64);
        }
        if self.model_from_pixel.column[0] < 0.0 {
            self.heights_m.chunks_exact_mut(cols).for_each(<[f64]>::reverse);
            self.model_from_pixel = self.model_from_pixel.with_columns_reversed(cols as f64);
        }
    }

    /// Pixel coordinates (corner convention) of sample `index`.
    fn pixel_centre(&self, index: usize) -> [f64; 2] {
        let cols = self.size[0] as usize;
        [(index % cols) as f64 + 0.5, (index / cols) as f64 + 0.5]
    }

    fn samples(&self, ned_from_geodetic: NedFromGeodetic<'_>, shift: Option<HeightShift<'_>>) -> Result<Samples, TerrainFileError> {
        let geodetic_rad: Vec<[f64; 2]> = (0..self.heights_m.len())
            .into_par_iter()
            .map(|index| self.crs.geodetic_from_model(self.model_from_pixel.apply(self.pixel_centre(index))).unwrap_or([f64::NAN; 2]))
            .collect();
        let count = geodetic_rad.iter().filter(|place| place[0].is_nan()).count() as u64;
        if count > 0 {
            return Err(TerrainFileError::OutsideCrs { path: self.path.clone(), epsg: self.crs.epsg, count });
        }
        let point = |(&[lat, lon], &height): (&[f64; 2], &f64)| {
            if height.is_nan() { DVec3::NAN } else { ned_from_geodetic(lat, lon, height + shift.map_or(0.0, |shift| shift(lat, lon))) }
        };
        let points_ned_m = geodetic_rad.par_iter().zip(&self.heights_m).map(point).collect();
        Ok(Samples { geodetic_rad, points_ned_m, heights_m: self.heights_m.clone() })
    }

    /// Texture coordinates of a picture that covers the DEM's extent.
    fn covering_uvs(&self) -> Vec<[f32; 2]> {
        let [cols, rows] = self.size.map(f64::from);
        (0..self.heights_m.len()).map(|index| self.pixel_centre(index)).map(|[x, y]| [(x / cols) as f32, (y / rows) as f32]).collect()
    }

    fn summary(&self, samples: &Samples, outside_ortho: u64, ned: NedFromGeodetic<'_>, shift: Option<HeightShift<'_>>) -> TerrainSummary {
        let bounds = |values: &mut dyn Iterator<Item = f64>| {
            values.filter(|v| !v.is_nan()).fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)])
        };
        let [south, north] = bounds(&mut samples.geodetic_rad.iter().map(|place| place[0]));
        let [west, east] = bounds(&mut samples.geodetic_rad.iter().map(|place| place[1]));
        let height_range_m = bounds(&mut self.heights_m.iter().copied());
        let middle = self.model_from_pixel.apply(self.size.map(|n| 0.5 * f64::from(n)));
        let centre_rad = self.crs.geodetic_from_model(middle).unwrap_or([0.5 * (south + north), 0.5 * (west + east)]);
        let height_m = 0.5 * (height_range_m[0] + height_range_m[1]) + shift.map_or(0.0, |shift| shift(centre_rad[0], centre_rad[1]));
        TerrainSummary {
            epsg: self.crs.epsg,
            size: self.size,
            south_west_rad: [south, west],
            north_east_rad: [north, east],
            centre_rad,
            centre_ned_m: ned(centre_rad[0], centre_rad[1], height_m),
            height_range_m,
            void_heights: self.heights_m.iter().filter(|height| height.is_nan()).count() as u64,
            outside_ortho,
        }
    }
}

/// The picture, texture coordinates of each sample, and how many of them lie outside.
fn ortho(path: &Path, dem: &Dem, samples: &Samples) -> Result<(Texture, Vec<[f32; 2]>, u64), TerrainFileError> {
    let (mut texture, geo) = if raster::is_tiff(path)? {
        let raster = Raster::read(path)?;
        (raster.to_texture(path, Encoding::Srgb)?, Some(raster.geo))
    } else {
        (read_texture(path, Encoding::Srgb)?, None)
    };
    let place = georeference_of(path, geo.as_ref().and_then(|geo| geo.model_from_pixel))?;
    let Some(model_from_pixel) = place else {
        texture.bleed_into_transparent();
        return Ok((texture, dem.covering_uvs(), 0));
    };
    // A world file states no coordinate system: then it is the DEM's.
    let epsg = geo.as_ref().and_then(|geo| geo.epsg).unwrap_or(dem.crs.epsg);
    let crs = Crs::new(epsg).ok_or_else(|| TerrainFileError::UnsupportedCrs { path: path.into(), epsg })?;
    let pixel_from_model = model_from_pixel.inverse().ok_or_else(|| TerrainFileError::DegenerateGeoreference { path: path.into() })?;
    let same_crs = crs.epsg == dem.crs.epsg;
    let size = texture.size_px.map(f64::from);
    let uvs: Vec<[f32; 2]> = (0..dem.heights_m.len())
        .into_par_iter()
        .map(|index| {
            let model = if same_crs {
                Some(dem.model_from_pixel.apply(dem.pixel_centre(index)))
            } else {
                crs.model_from_geodetic(samples.geodetic_rad[index])
            };
            // A point that the picture's projection does not reach is outside of the picture.
            let pixel = model.map_or([-1.0, -1.0], |model| pixel_from_model.apply(model));
            [(pixel[0] / size[0]) as f32, (pixel[1] / size[1]) as f32]
        })
        .collect();
    let is_outside = |uv: &[f32; 2]| uv.iter().any(|x| !(0.0..=1.0).contains(x));
    let outside = uvs.par_iter().filter(|uv| is_outside(uv)).count();
    if outside == uvs.len() {
        return Err(TerrainFileError::NoOverlap { ortho: path.into(), dem: dem.path.clone() });
    }
    mark_void_pixels(&mut texture, dem, &model_from_pixel);
    texture.bleed_into_transparent();
    Ok((texture, uvs, outside as u64))
}

/// Black pixels over voids of a DEM on the same grid are no content: otherwise they would darken the rim of what is there.
fn mark_void_pixels(texture: &mut Texture, dem: &Dem, ortho_from_pixel: &Affine) {
    if texture.size_px != dem.size || *ortho_from_pixel != dem.model_from_pixel {
        return;
    }
    for (pixel, height) in texture.rgba8.chunks_exact_mut(4).zip(&dem.heights_m) {
        if height.is_nan() && pixel[..3] == [0, 0, 0] {
            pixel[3] = 0;
        }
    }
}

/// From the file's own tags, or from a world file beside it.
fn georeference_of(path: &Path, from_tags: Option<Affine>) -> Result<Option<Affine>, TerrainFileError> {
    let found = match from_tags {
        Some(affine) => Some(affine),
        None => world_file(path)?,
    };
    match found {
        Some(affine) if affine.inverse().is_none() => Err(TerrainFileError::DegenerateGeoreference { path: path.into() }),
        found => Ok(found),
    }
}

/// A DEM without a coordinate system: the more basic lack is reported first.
fn missing(path: &Path, raster: &Raster) -> Result<TerrainFileError, TerrainFileError> {
    Ok(match georeference_of(path, raster.geo.model_from_pixel)? {
        None => no_georeference(path),
        Some(_) => TerrainFileError::NoCrs { path: path.into() },
    })
}

fn no_georeference(path: &Path) -> TerrainFileError {
    let world = georeference::world_file_names(path).into_iter().next().unwrap_or_default();
    let world = world.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    TerrainFileError::NoGeoreference { path: path.into(), world }
}

#[cfg(test)]
mod tests;
