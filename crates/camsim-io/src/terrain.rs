//! Terrain from a GeoTIFF of heights and a picture of the ground.

mod arc_prj;
mod bands;
mod beside;
mod crs;
mod dem;
mod docs;
mod geo_tags;
mod georeference;
mod height_files;
mod metadata;
mod ortho;
pub(crate) mod raster;
mod shade;
mod systems;
mod tiff_file;
mod wkt;
mod words;

use std::{
    path::PathBuf,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
};

use camsim_core::{
    scenario::{Beyond, TerrainSpec},
    scene::{Light, Terrain, TerrainError, TerrainGrid},
};
use glam::DVec3;

use crate::pictures::PictureError;
pub(crate) use beside::{
    files as files_beside_raster, read_mask as read_mask_beside, read_tags as read_tags_beside,
};
pub use docs::documentation;

pub(crate) use systems::unit_of_name;

use dem::{Dem, EMPTY_RANGE, Heights, widened};
use ortho::Ortho;

/// NED position (metres) of latitude, longitude (radians) and ellipsoidal height (metres).
pub type NedFromGeodetic<'a> = &'a (dyn Fn(f64, f64, f64) -> DVec3 + Sync);

/// Metres to add to a height at latitude, longitude (radians): the geoid's undulation, where DEM and log
/// differ in datum.
pub type HeightShift<'a> = &'a (dyn Fn(f64, f64) -> f64 + Sync);

/// A terrain and what to say about it.
#[derive(Clone, Debug)]
pub struct LoadedTerrain {
    /// Chunks and texture.
    pub terrain: Terrain,
    /// Where it lies.
    pub summary: TerrainSummary,
    /// What a user should know of its files.
    pub notes: Vec<String>,
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
    /// Heights for which the ortho-image has nothing: `scene.terrain.beyond` says what is seen there.
    pub outside_ortho: u64,
    /// Texture coordinates of the ortho-image's own corners, which is larger where the ground goes on in
    /// grey.
    pub picture_uv: [[f64; 2]; 2],
    /// How many times finer along each side the picture was made, so that it holds the light on each height;
    /// 1 without light.
    pub picture_times: u32,
}

/// Why a terrain cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum TerrainFileError {
    /// A file that cannot be read or decoded.
    #[error("{source}; check {key}")]
    Picture {
        /// Which one it is.
        key: &'static str,
        /// What is wrong.
        source: PictureError,
    },
    /// A picture where heights are wanted.
    #[error(
        "{path}: has {bands} bands, so it is a picture and no DEM: heights are one band (scene.terrain.ortho takes the picture)"
    )]
    NotHeights {
        /// The file.
        path: PathBuf,
        /// Its bands.
        bands: usize,
    },
    /// The DEM says nothing about where it is.
    #[error(
        "{path}: no georeference: neither GeoTIFF tags nor a world file ({world}) beside it{more}. \
         Add them, for example with `gdal_translate -a_srs EPSG:CODE -a_ullr WEST NORTH EAST SOUTH IN OUT`"
    )]
    NoGeoreference {
        /// The DEM.
        path: PathBuf,
        /// Name of the world file that would do.
        world: String,
        /// What there is in its place.
        more: String,
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
    #[error(
        "{path}: the file does not state its coordinate system: set scene.terrain.epsg, for example scene.terrain.epsg = 32632"
    )]
    NoCrs {
        /// The file.
        path: PathBuf,
    },
    /// The coordinate system is not known.
    #[error(
        "{path}: EPSG:{epsg} is not supported (docs/inputs/TERRAIN.md has those that are): \
         reproject with `gdalwarp -t_srs EPSG:CODE IN OUT`, or set scene.terrain.epsg if the file states a wrong code"
    )]
    UnsupportedCrs {
        /// The file.
        path: PathBuf,
        /// Its code, 32767 if it defines its own.
        epsg: u16,
    },
    /// The file and the scenario disagree.
    #[error(
        "{path}: the file states EPSG:{stated} but scene.terrain.epsg = {wanted}: remove the key, or reproject the file"
    )]
    CrsConflict {
        /// The file.
        path: PathBuf,
        /// In the file.
        stated: u16,
        /// In the scenario.
        wanted: u16,
    },
    /// A definition without a code.
    #[error(
        "{path}: defines a coordinate system of its own ({name}), without an EPSG code: give it one with `gdalwarp -t_srs EPSG:CODE IN OUT`, \
         or, for a DEM whose system has a code, set scene.terrain.epsg"
    )]
    OwnCrs {
        /// The file.
        path: PathBuf,
        /// What the file calls it.
        name: String,
    },
    /// Something that changes the numbers and cannot be applied.
    #[error("{path}: {problem}")]
    Meaning {
        /// The file.
        path: PathBuf,
        /// What it is and what to do.
        problem: String,
    },
    /// A unit that is not known, or not that of the coordinate system.
    #[error(
        "{path}: the {what} unit has EPSG code {code}, which is not known, or not that of its coordinate system: convert the file with `gdalwarp -t_srs EPSG:CODE IN OUT` \
         (for heights, scene.terrain.height_unit says it)"
    )]
    Unit {
        /// The file.
        path: PathBuf,
        /// "horizontal", "angular" or "vertical".
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
    #[error(
        "{path}: {count} heights lie outside of the domain of EPSG:{epsg}: check scene.terrain.epsg and the georeference"
    )]
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

impl TerrainFileError {
    fn of_dem(source: PictureError) -> Self {
        Self::Picture { key: "scene.terrain.dem", source }
    }

    fn of_ortho(source: PictureError) -> Self {
        Self::Picture { key: "scene.terrain.ortho", source }
    }
}

/// Reads `scene.terrain`. Paths are used as they stand. `height_shift` is added to the heights of the file
/// where its vertical datum is not that of the flight log; horizontal datum transformations never touch
/// heights.
///
/// # Errors
///
/// [`TerrainFileError`] names the file and what to do.
pub fn read_terrain(
    spec: &TerrainSpec,
    ned_from_geodetic: NedFromGeodetic<'_>,
    height_shift: Option<HeightShift<'_>>,
) -> Result<LoadedTerrain, TerrainFileError> {
    read_terrain_in_light(spec, ned_from_geodetic, height_shift, None)
}

/// As [`read_terrain`], with light on the ground.
///
/// # Errors
///
/// As [`read_terrain`].
pub fn read_terrain_in_light(
    spec: &TerrainSpec,
    ned_from_geodetic: NedFromGeodetic<'_>,
    height_shift: Option<HeightShift<'_>>,
    light: Option<&Light>,
) -> Result<LoadedTerrain, TerrainFileError> {
    let dem = Dem::read(spec, height_shift.is_some())?;
    let heights = dem.heights();
    let ortho = spec.ortho.as_deref().map(|path| Ortho::read(path, spec, &dem)).transpose()?;
    let mut notes = dem.notes.clone();
    if heights.implausible > 0 {
        notes.push(format!(
            "{}: {} of its numbers are no heights in metres (-11 500 to 9500) and are taken as missing: if they are of another unit, set scene.terrain.height_unit",
            spec.dem.display(),
            heights.implausible
        ));
    }
    if heights.unlikely > 0 {
        notes.push(format!(
            "{}: {} of its heights are below -500 m or above 9000 m: where that is not the floor of a sea, check scene.terrain.height_unit and the file's mark of missing values",
            spec.dem.display(),
            heights.unlikely
        ));
    }
    let is_void = spec.beyond == Beyond::Void;
    let grid = Grid {
        dem: &dem,
        ned_from_geodetic,
        height_shift,
        ortho: ortho.as_ref(),
        is_void,
        outside_crs: AtomicBool::new(false),
    };
    let without_picture = ortho
        .as_ref()
        .map_or(0, |ortho| dem.count(|at| !dem.height_m(at).is_nan() && !ortho.shows(&dem, at)));
    if let Some(path) =
        spec.ortho.as_ref().filter(|_| without_picture > 0 && without_picture == dem.points() - heights.voids)
    {
        return Err(TerrainFileError::NoOverlap { ortho: path.clone(), dem: dem.path.clone() });
    }
    let texture = match &ortho {
        Some(ortho) => {
            notes.extend(ortho.notes.iter().cloned());
            notes.extend(spec.ortho.as_ref().filter(|_| without_picture > 0).map(|path| {
                let share = 100.0 * without_picture as f64 / (dem.points() - heights.voids) as f64;
                let (is, others) = match spec.beyond {
                    Beyond::Grey => ("grey", "\"edge\" or \"void\""),
                    Beyond::Edge => ("of the colours at its border", "\"grey\" or \"void\""),
                    Beyond::Void => ("left out", "\"grey\" or \"edge\""),
                };
                format!(
                    "{}: {share:.2} % of the terrain's area has no picture and is {is} (scene.terrain.beyond, else {others})",
                    path.display()
                )
            }));
            ortho.texture.clone()
        }
        // Colours of heights have a light of their own, but for that of the scene.
        None => shade::relief(
            dem.size,
            heights.range_m,
            &|at| dem.height_m(at),
            &|at| grid.point_ned_m(at),
            light.is_none(),
        ),
    };
    let [cols, rows] = dem.size;
    let made = Terrain::from_grid(cols, rows, &grid, Arc::new(texture));
    if grid.outside_crs.load(Ordering::Relaxed) {
        return Err(TerrainFileError::OutsideCrs {
            path: dem.path.clone(),
            epsg: dem.crs.epsg,
            count: dem.count_outside_crs(),
        });
    }
    let mut terrain = made.map_err(|source| TerrainFileError::Grid { path: spec.dem.clone(), source })?;
    terrain.beyond = ortho.as_ref().and_then(Ortho::color_beyond);
    let picture_times = light.map_or(1, |light| terrain.bake_light(light));
    let summary = TerrainSummary { picture_times, ..grid.summary(&heights, without_picture) };
    Ok(LoadedTerrain { terrain, summary, notes })
}

/// What a terrain is made of: points are found when they are asked for.
struct Grid<'a> {
    dem: &'a Dem,
    ned_from_geodetic: NedFromGeodetic<'a>,
    height_shift: Option<HeightShift<'a>>,
    ortho: Option<&'a Ortho>,
    /// Whether there is ground only where there is a picture.
    is_void: bool,
    /// Whether a point was found for which the projection has no answer.
    outside_crs: AtomicBool,
}

impl TerrainGrid for Grid<'_> {
    fn point_ned_m(&self, at: [u32; 2]) -> DVec3 {
        let Some([lat, lon]) = self.dem.geodetic_rad(at) else {
            self.outside_crs.store(true, Ordering::Relaxed);
            return DVec3::NAN;
        };
        let height_m = self.dem.height_m(at);
        let is_left_out = self.is_void && self.ortho.is_some_and(|ortho| !ortho.shows(self.dem, at));
        if height_m.is_nan() || is_left_out {
            DVec3::NAN
        } else {
            (self.ned_from_geodetic)(lat, lon, height_m + self.shift_m([lat, lon]))
        }
    }

    fn uv(&self, at: [u32; 2]) -> [f32; 2] {
        let centre = Dem::pixel_centre(at);
        match self.ortho.and_then(|ortho| ortho.place.as_ref()) {
            Some(place) => place.uv(self.dem, at),
            // It covers the DEM's extent.
            None => [0, 1].map(|k| (centre[k] / f64::from(self.dem.size[k])) as f32),
        }
    }
}

impl Grid<'_> {
    fn shift_m(&self, [lat, lon]: [f64; 2]) -> f64 {
        self.height_shift.map_or(0.0, |shift| shift(lat, lon))
    }

    fn summary(&self, heights: &Heights, outside_ortho: u64) -> TerrainSummary {
        let dem = self.dem;
        // No projection has its extremes anywhere but on the border.
        let [[south, north], [west, east]] = dem
            .border()
            .filter_map(|at| dem.geodetic_rad(at))
            .fold([EMPTY_RANGE; 2], |ranges, place| [0, 1].map(|k: usize| widened(ranges[k], place[k])));
        let middle = dem.model_from_pixel.apply(dem.size.map(|n| 0.5 * f64::from(n)));
        let centre_rad =
            dem.crs.geodetic_from_model(middle).unwrap_or([0.5 * (south + north), 0.5 * (west + east)]);
        // 190 degrees east are 170 degrees west.
        let turns = std::f64::consts::TAU * (centre_rad[1] / std::f64::consts::TAU).round();
        let [west, east, centre_lon] = [west, east, centre_rad[1]].map(|lon| lon - turns);
        let centre_rad = [centre_rad[0], centre_lon];
        let height_m = 0.5 * (heights.range_m[0] + heights.range_m[1]) + self.shift_m(centre_rad);
        TerrainSummary {
            epsg: dem.crs.epsg,
            size: dem.size,
            south_west_rad: [south, west],
            north_east_rad: [north, east],
            centre_rad,
            centre_ned_m: (self.ned_from_geodetic)(centre_rad[0], centre_rad[1], height_m),
            height_range_m: heights.range_m,
            void_heights: heights.voids,
            outside_ortho,
            picture_uv: self.ortho.map_or([[0.0; 2], [1.0; 2]], Ortho::own_uv),
            picture_times: 1,
        }
    }
}

#[cfg(test)]
mod tests;
