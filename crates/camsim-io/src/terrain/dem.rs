//! A DEM as its file has it: heights are kept in the file's own type and turned into metres one by one.

use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::{
    TerrainFileError,
    crs::Crs,
    georeference::{self, Affine, world_file},
    raster::Raster,
};

/// Heights outside of this are garbage or undeclared "no data" marks, metres: from below the deepest sea to above the highest mountain.
const PLAUSIBLE_HEIGHTS_M: [f64; 2] = [-11_500.0, 9_500.0];

/// The mark that most often means "no data" where the file does not declare one.
const COMMON_NODATA: f64 = -9999.0;

/// A grid of heights with its place on Earth; row 0 is the northernmost, column 0 the westernmost.
pub(super) struct Dem {
    pub path: PathBuf,
    pub size: [u32; 2],
    /// As the file has them: a sixth of what points in f64 would take.
    raster: Raster,
    /// Whether the file counts columns from the east, rows from the south.
    is_reversed: [bool; 2],
    /// What a height of the file is multiplied by.
    metres_per_unit: f64,
    /// Value of heights that are not there.
    nodata: f64,
    /// Model coordinates of pixel corners.
    pub model_from_pixel: Affine,
    pub crs: Crs,
}

/// What all heights come to.
pub(super) struct Heights {
    pub range_m: [f64; 2],
    pub voids: u64,
}

pub(super) const EMPTY_RANGE: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];

pub(super) fn widened([low, high]: [f64; 2], value: f64) -> [f64; 2] {
    [low.min(value), high.max(value)]
}

impl Dem {
    pub fn read(path: &Path, wanted_epsg: Option<u16>) -> Result<Self, TerrainFileError> {
        let raster = Raster::read(path).map_err(TerrainFileError::of_dem)?;
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
        if raster.bands() > 2 {
            return Err(TerrainFileError::NotHeights { path: path.into(), bands: raster.bands() });
        }
        let (size, nodata) = (raster.size, geo.nodata.unwrap_or(COMMON_NODATA));
        let mut dem = Self { path: path.into(), size, raster, is_reversed: [false; 2], metres_per_unit, nodata, model_from_pixel, crs };
        dem.turn_north_up();
        Ok(dem)
    }

    /// Some files count rows from the south (or columns from the east); the diagonals of the cells are defined with the north on top.
    fn turn_north_up(&mut self) {
        let [cols, rows] = self.size.map(f64::from);
        if self.model_from_pixel.row[1] > 0.0 {
            self.is_reversed[1] = true;
            self.model_from_pixel = self.model_from_pixel.with_rows_reversed(rows);
        }
        if self.model_from_pixel.column[0] < 0.0 {
            self.is_reversed[0] = true;
            self.model_from_pixel = self.model_from_pixel.with_columns_reversed(cols);
        }
    }

    pub fn points(&self) -> u64 {
        u64::from(self.size[0]) * u64::from(self.size[1])
    }

    pub fn column_and_row(&self, index: usize) -> [u32; 2] {
        let cols = self.size[0] as usize;
        [(index % cols) as u32, (index / cols) as u32]
    }

    /// Metres; NaN = void.
    pub fn height_m(&self, at: [u32; 2]) -> f64 {
        let [column, row] = [0, 1].map(|k: usize| if self.is_reversed[k] { self.size[k] - 1 - at[k] } else { at[k] } as usize);
        let height = self.raster.value(row * self.size[0] as usize + column);
        let [lowest, highest] = PLAUSIBLE_HEIGHTS_M;
        // A float32 file may declare its mark with more digits than it holds.
        let is_nodata = height == self.nodata || height as f32 == self.nodata as f32;
        let metres = height * self.metres_per_unit;
        if is_nodata || !(lowest..=highest).contains(&metres) { f64::NAN } else { metres }
    }

    pub fn heights(&self) -> Heights {
        let rows = (0..self.size[1]).into_par_iter().map(|row| {
            let heights = (0..self.size[0]).map(|column| self.height_m([column, row]));
            heights.fold((EMPTY_RANGE, 0), |(range, voids), m| if m.is_nan() { (range, voids + 1) } else { (widened(range, m), voids) })
        });
        let (range_m, voids) =
            rows.reduce(|| (EMPTY_RANGE, 0), |(range, voids), ([low, high], more)| (widened(widened(range, low), high), voids + more));
        Heights { range_m, voids }
    }

    /// Pixel coordinates (corner convention) of a sample.
    pub fn pixel_centre(at: [u32; 2]) -> [f64; 2] {
        at.map(|n| f64::from(n) + 0.5)
    }

    pub fn model(&self, at: [u32; 2]) -> [f64; 2] {
        self.model_from_pixel.apply(Self::pixel_centre(at))
    }

    /// Latitude, longitude; `None` outside of the projection's domain.
    pub fn geodetic_rad(&self, at: [u32; 2]) -> Option<[f64; 2]> {
        self.crs.geodetic_from_model(self.model(at))
    }

    pub fn count_outside_crs(&self) -> u64 {
        (0..self.points() as usize).into_par_iter().filter(|&index| self.geodetic_rad(self.column_and_row(index)).is_none()).count() as u64
    }

    /// The outermost samples.
    pub fn border(&self) -> impl Iterator<Item = [u32; 2]> {
        let [cols, rows] = self.size;
        (0..cols).flat_map(move |i| [[i, 0], [i, rows - 1]]).chain((0..rows).flat_map(move |j| [[0, j], [cols - 1, j]]))
    }
}

/// From the file's own tags, or from a world file beside it.
pub(super) fn georeference_of(path: &Path, from_tags: Option<Affine>) -> Result<Option<Affine>, TerrainFileError> {
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
