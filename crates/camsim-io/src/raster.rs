//! Terrain from a file of heights (DEM) and an ortho-image.

mod arc_prj;
mod bands;
mod citations;
mod crs;
pub(crate) mod decoded;
mod dem;
mod descriptions;
mod documentation;
pub(crate) mod files;
mod geo_tags;
mod georeference;
mod grid_tiles;
mod ground;
mod height_files;
mod height_unit;
mod metadata;
mod ortho;
pub mod pictures;
mod shaded_relief;
mod sidecar;
mod stated_crs;
mod tiff_file;
mod tile;
mod units;
mod vertical_crs;
mod wkt;

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

use crate::{raster::pictures::PictureError, text::wording::range};
pub use documentation::documentation;
pub use ground::Ground;
pub(crate) use sidecar::{read_sidecar_mask, read_sidecar_tags, sidecar_files};
pub(crate) use units::metres_per_unit_name;

use dem::{Dem, EMPTY_RANGE, HeightStatistics, USUAL_HEIGHTS_M, union, widened};
use ortho::Ortho;

/// NED position (metres) of latitude, longitude (radians) and ellipsoidal height (metres).
pub type NedFromGeodetic<'a> = &'a (dyn Fn(f64, f64, f64) -> DVec3 + Sync);

/// Metres to add to a height at latitude, longitude (radians): the geoid undulation, where DEM and flight log
/// have different vertical datums.
pub type HeightShift<'a> = &'a (dyn Fn(f64, f64) -> f64 + Sync);

/// A terrain with its summary and notes.
#[derive(Clone, Debug)]
pub struct LoadedTerrain {
    /// Chunks and texture.
    pub terrain: Terrain,
    /// Location and repairs.
    pub summary: TerrainSummary,
    /// Notes for the user about its files.
    pub notes: Vec<String>,
}

/// Location of a terrain, and what was repaired.
#[derive(Clone, Debug, PartialEq)]
pub struct TerrainSummary {
    /// EPSG code of the DEM's coordinate system.
    pub epsg: u16,
    /// The files of its heights; several are tiles of one grid.
    pub files: Vec<PathBuf>,
    /// Number of columns (west to east) and rows (north to south).
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
    /// Number of heights that are missing or implausible.
    pub void_heights: u64,
    /// Number of heights without ortho-image; `scene.terrain.beyond` defines the ground there.
    pub outside_ortho: u64,
    /// Texture coordinates of the ortho-image's corners; inside of 0 to 1 where the texture has a grey
    /// margin.
    pub ortho_uv: [[f64; 2]; 2],
    /// Factor by which the texture was enlarged along each side to hold the baked light; 1 without light.
    pub texture_scale: u32,
}

/// Why a terrain cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum TerrainFileError {
    /// A file cannot be read or decoded.
    #[error("{source}; check {key}")]
    Picture {
        /// Key of the file.
        key: &'static str,
        /// The cause.
        source: PictureError,
    },
    /// The DEM is a picture.
    #[error(
        "{path}: has {bands} bands, so it is a picture, not a DEM: give it as scene.terrain.ortho, and \
         heights of one band as the DEM"
    )]
    NotHeights {
        /// The file.
        path: PathBuf,
        /// Number of bands.
        bands: usize,
    },
    /// The DEM has no georeference.
    #[error(
        "{path}: no georeference: neither GeoTIFF tags nor a world file ({world}) beside it{details}. \
         Add them, for example with `gdal_translate -a_srs EPSG:CODE -a_ullr WEST NORTH EAST SOUTH IN OUT`"
    )]
    NoGeoreference {
        /// The DEM.
        path: PathBuf,
        /// Name of the world file that was looked for.
        world: String,
        /// Further details.
        details: String,
    },
    /// A world file is invalid.
    #[error("{path}: a world file has six numbers, one a line: {reason}")]
    WorldFile {
        /// The world file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// The georeference is degenerate.
    #[error("{path}: the georeference is degenerate (pixel size zero or not finite)")]
    DegenerateGeoreference {
        /// The file.
        path: PathBuf,
    },
    /// The coordinate system is not stated.
    #[error(
        "{path}: the file does not state its coordinate system: set scene.terrain.epsg, for example \
         scene.terrain.epsg = 32632"
    )]
    NoCrs {
        /// The file.
        path: PathBuf,
    },
    /// The coordinate system is not supported.
    #[error(
        "{path}: EPSG:{epsg} is not supported (docs/reference/inputs/TERRAIN.md has those that are): \
         reproject with `gdalwarp -t_srs EPSG:CODE IN OUT`, or set scene.terrain.epsg if the file states a \
         wrong code"
    )]
    UnsupportedCrs {
        /// The file.
        path: PathBuf,
        /// EPSG code, 32767 for a user-defined system.
        epsg: u16,
    },
    /// The file and scene.terrain.epsg state different systems.
    #[error(
        "{path}: the file states EPSG:{stated} but scene.terrain.epsg = {key}: remove the key, or reproject \
         the file"
    )]
    CrsConflict {
        /// The file.
        path: PathBuf,
        /// EPSG code in the file.
        stated: u16,
        /// EPSG code in the scenario.
        key: u16,
    },
    /// The coordinate system is user-defined, without an EPSG code.
    #[error(
        "{path}: has a user-defined coordinate system ({name}) without an EPSG code: convert it with \
         `gdalwarp -t_srs EPSG:CODE IN OUT`, or, for a DEM whose system has a code, set scene.terrain.epsg"
    )]
    UserDefinedCrs {
        /// The file.
        path: PathBuf,
        /// Name of the system in the file.
        name: String,
    },
    /// Metadata that change the values cannot be applied.
    #[error("{path}: {problem}")]
    Meaning {
        /// The file.
        path: PathBuf,
        /// The problem and the remedy.
        problem: String,
    },
    /// A unit is unknown, or not that of the coordinate system.
    #[error(
        "{path}: the {kind} unit has EPSG code {code}, which is unknown, or not that of its coordinate \
         system: convert the file with `gdalwarp -t_srs EPSG:CODE IN OUT` (for heights, set \
         scene.terrain.height_unit)"
    )]
    Unit {
        /// The file.
        path: PathBuf,
        /// "horizontal", "angular" or "vertical".
        kind: &'static str,
        /// EPSG code of the unit.
        code: u16,
    },
    /// The heights do not make a terrain.
    #[error("{path}: {source}")]
    Grid {
        /// The DEM.
        path: PathBuf,
        /// The cause.
        source: TerrainError,
    },
    /// Heights lie outside of the projection's domain.
    #[error(
        "{path}: {count} heights lie outside of the domain of EPSG:{epsg}: check scene.terrain.epsg and the \
         georeference"
    )]
    OutsideCrs {
        /// The DEM.
        path: PathBuf,
        /// EPSG code.
        epsg: u16,
        /// Number of such heights.
        count: u64,
    },
    /// DEM and ortho-image do not overlap.
    #[error("{ortho}: does not overlap {dem}: check scene.terrain.ortho")]
    NoOverlap {
        /// The ortho-image.
        ortho: PathBuf,
        /// The DEM.
        dem: PathBuf,
    },
}

impl TerrainFileError {
    /// An error of reading scene.terrain.dem.
    fn dem(source: PictureError) -> Self {
        Self::Picture { key: "scene.terrain.dem", source }
    }

    /// An error of reading scene.terrain.ortho.
    fn ortho(source: PictureError) -> Self {
        Self::Picture { key: "scene.terrain.ortho", source }
    }
}

/// Reads `scene.terrain`; relative paths are relative to the working directory. `height_shift` is added to
/// the file's heights where its vertical datum is not that of the flight log. Horizontal datum
/// transformations leave heights unchanged.
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

/// Like [`read_terrain`], with the scene's light baked into the texture.
///
/// # Errors
///
/// Those of [`read_terrain`].
pub fn read_terrain_in_light(
    spec: &TerrainSpec,
    ned_from_geodetic: NedFromGeodetic<'_>,
    height_shift: Option<HeightShift<'_>>,
    light: Option<&Light>,
) -> Result<LoadedTerrain, TerrainFileError> {
    let dem = Dem::read(spec, height_shift.is_some())?;
    let heights = dem.statistics();
    let path = dem.path.display();
    if heights.implausible > 0 && heights.implausible == dem.post_count() - missing(&heights) {
        let problem = format!("its values are {}", implausible_values(&dem, &heights, ""));
        return Err(TerrainFileError::Meaning { path: dem.path.clone(), problem });
    }
    let ortho = spec.ortho.as_ref().map(|files| Ortho::read(files, spec, &dem)).transpose()?;
    let mut notes = dem.notes.clone();
    if heights.implausible > 0 {
        notes.push(format!(
            "{path}: {} of its values are {}",
            heights.implausible,
            implausible_values(&dem, &heights, ", and are read as missing")
        ));
    }
    if heights.unlikely > 0 {
        notes.push(format!(
            "{path}: {} of its heights are below -500 m or above 9000 m: unless they are sea floor, check \
             scene.terrain.height_unit and the file's no-data value",
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
    let outside_ortho = ortho
        .as_ref()
        .map_or(0, |ortho| dem.count(|post| !dem.height_m(post).is_nan() && !ortho.covers(&dem, post)));
    if let Some(ortho) =
        ortho.as_ref().filter(|_| outside_ortho > 0 && outside_ortho == dem.post_count() - heights.voids)
    {
        return Err(TerrainFileError::NoOverlap { ortho: ortho.path.clone(), dem: dem.path.clone() });
    }
    let texture = match &ortho {
        Some(ortho) => {
            notes.extend(ortho.notes.iter().cloned());
            notes.extend((outside_ortho > 0).then(|| {
                let fraction = 100.0 * outside_ortho as f64 / (dem.post_count() - heights.voids) as f64;
                let (is, others) = match spec.beyond {
                    Beyond::Grey => ("grey", "\"edge\" or \"void\""),
                    Beyond::Edge => ("of the colours at its border", "\"grey\" or \"void\""),
                    Beyond::Void => ("void", "\"grey\" or \"edge\""),
                };
                format!(
                    "{}: {fraction:.2} % of the terrain's area has no ortho-image and is {is} \
                     (scene.terrain.beyond; alternatives: {others})",
                    ortho.path.display()
                )
            }));
            ortho.texture.clone()
        }
        // Hypsometric tints are hillshaded unless the scene has light.
        None => shaded_relief::shaded_relief(
            dem.size,
            heights.range_m,
            &|post| dem.height_m(post),
            &|post| grid.point_ned_m(post),
            light.is_none(),
        ),
    };
    let [cols, rows] = dem.size;
    let terrain = Terrain::from_grid(cols, rows, &grid, Arc::new(texture));
    if grid.outside_crs.load(Ordering::Relaxed) {
        return Err(TerrainFileError::OutsideCrs {
            path: dem.path.clone(),
            epsg: dem.crs.epsg,
            count: dem.count_outside_crs(),
        });
    }
    let mut terrain = terrain.map_err(|source| TerrainFileError::Grid { path: dem.path.clone(), source })?;
    terrain.beyond = ortho.as_ref().and_then(Ortho::margin_color);
    let texture_scale = light.map_or(1, |light| terrain.bake_light(light));
    let summary = TerrainSummary { texture_scale, ..grid.summary(&heights, outside_ortho) };
    Ok(LoadedTerrain { terrain, summary, notes })
}

/// Number of heights without a value that may be one in another unit.
fn missing(heights: &HeightStatistics) -> u64 {
    heights.voids - heights.implausible
}

/// What implausible values are, what is done with them, and the units that would make heights of all values.
fn implausible_values(dem: &Dem, heights: &HeightStatistics, treatment: &str) -> String {
    let in_file = |range_m: [f64; 2]| range_m.map(|metres| metres / dem.unit_m());
    let all = in_file(union(heights.range_m, heights.implausible_range_m));
    let unit = if dem.unit_m() == 1.0 { "metres".to_owned() } else { format!("units of {} m", dem.unit_m()) };
    format!(
        "no plausible heights in {unit} (-11 500 to 9500 m), but {}{treatment}: if they have another unit, {}",
        range(in_file(heights.implausible_range_m)),
        height_unit::other_units(all, USUAL_HEIGHTS_M)
    )
}

/// Posts of a DEM as NED points, computed on demand.
struct Grid<'a> {
    dem: &'a Dem,
    ned_from_geodetic: NedFromGeodetic<'a>,
    height_shift: Option<HeightShift<'a>>,
    ortho: Option<&'a Ortho>,
    /// Whether ground without ortho-image is void.
    is_void: bool,
    /// Whether a point outside of the projection's domain was requested.
    outside_crs: AtomicBool,
}

impl TerrainGrid for Grid<'_> {
    fn point_ned_m(&self, post: [u32; 2]) -> DVec3 {
        let Some([lat, lon]) = self.dem.geodetic_rad(post) else {
            self.outside_crs.store(true, Ordering::Relaxed);
            return DVec3::NAN;
        };
        let height_m = self.dem.height_m(post);
        let is_left_out = self.is_void && self.ortho.is_some_and(|ortho| !ortho.covers(self.dem, post));
        if height_m.is_nan() || is_left_out {
            DVec3::NAN
        } else {
            (self.ned_from_geodetic)(lat, lon, height_m + self.shift_m([lat, lon]))
        }
    }

    fn uv(&self, post: [u32; 2]) -> [f32; 2] {
        let centre = Dem::pixel_centre(post);
        match self.ortho.and_then(|ortho| ortho.georeference.as_ref()) {
            Some(georeference) => georeference.uv(self.dem, post),
            // An ortho-image without georeference covers the DEM's extent.
            None => [0, 1].map(|k| (centre[k] / f64::from(self.dem.size[k])) as f32),
        }
    }
}

impl Grid<'_> {
    fn shift_m(&self, [lat, lon]: [f64; 2]) -> f64 {
        self.height_shift.map_or(0.0, |shift| shift(lat, lon))
    }

    fn summary(&self, heights: &HeightStatistics, outside_ortho: u64) -> TerrainSummary {
        let dem = self.dem;
        // The extremes of latitude and longitude lie on the border.
        let [[south, north], [west, east]] = dem
            .border()
            .filter_map(|post| dem.geodetic_rad(post))
            .fold([EMPTY_RANGE; 2], |ranges, point| [0, 1].map(|k: usize| widened(ranges[k], point[k])));
        let centre = dem.model_from_pixel.apply(dem.size.map(|n| 0.5 * f64::from(n)));
        let centre_rad =
            dem.crs.geodetic_from_model(centre).unwrap_or([0.5 * (south + north), 0.5 * (west + east)]);
        // 190 degrees east is 170 degrees west.
        let turns = std::f64::consts::TAU * (centre_rad[1] / std::f64::consts::TAU).round();
        let [west, east, centre_lon] = [west, east, centre_rad[1]].map(|lon| lon - turns);
        let centre_rad = [centre_rad[0], centre_lon];
        let height_m = 0.5 * (heights.range_m[0] + heights.range_m[1]) + self.shift_m(centre_rad);
        TerrainSummary {
            epsg: dem.crs.epsg,
            files: dem.files(),
            size: dem.size,
            south_west_rad: [south, west],
            north_east_rad: [north, east],
            centre_rad,
            centre_ned_m: (self.ned_from_geodetic)(centre_rad[0], centre_rad[1], height_m),
            height_range_m: heights.range_m,
            void_heights: heights.voids,
            outside_ortho,
            ortho_uv: self.ortho.map_or([[0.0; 2], [1.0; 2]], Ortho::image_uv),
            texture_scale: 1,
        }
    }
}

#[cfg(test)]
mod tests;
