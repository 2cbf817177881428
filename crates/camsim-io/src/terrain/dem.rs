//! A digital elevation model: heights stay in the file's type and are converted to metres on access.

use std::{
    f64::consts::PI,
    path::{Path, PathBuf},
};

use rayon::prelude::*;

use camsim_core::scenario::{HeightReference, TerrainSpec};

use super::{
    TerrainFileError,
    bands::may_be_alpha,
    crs::{Crs, compound},
    descriptions,
    geo_tags::GeoTags,
    georeference::{self, Affine, world_file},
    height_files,
    raster::Raster,
    sidecar,
    stated_crs::StatedCrs,
    tiff_file::SampleType,
    units::{SAME_UNIT_M, metres_per_unit_code, metres_per_unit_name},
    vertical_crs::{StatedVerticalCrs, VerticalDatum},
};

/// Range of plausible heights, metres: from below the deepest sea to above the highest mountain. Others are
/// undeclared no-data values.
const PLAUSIBLE_HEIGHTS_M: [f64; 2] = [-11_500.0, 9_500.0];

/// The Earth's mean radius.
const MEAN_RADIUS_M: f64 = 6_371_000.0;

/// Range of common heights, metres; others are reported.
const USUAL_HEIGHTS_M: [f64; 2] = [-500.0, 9_000.0];

/// Relative difference at which a value equals the no-data value, for programs that interpolate it. No-data
/// values that may be heights are compared exactly.
const NODATA_TOLERANCE: f64 = 1e-5;

/// Implausible heights below this may have another unit; undeclared no-data values are larger.
const MAX_OTHER_UNIT: f64 = 1e6;

/// The most common no-data value of files that do not declare one.
const COMMON_NODATA: f64 = -9999.0;

/// A georeferenced grid of heights (posts); row 0 is the northernmost, column 0 the westernmost.
pub(super) struct Dem {
    pub path: PathBuf,
    pub size: [u32; 2],
    /// Stored values: a sixth of the memory of points in f64.
    raster: Raster,
    /// Whether the second band is alpha.
    has_alpha: bool,
    /// Whether the file counts columns from the east, rows from the south.
    is_reversed: [bool; 2],
    /// Scale and offset from stored values to metres.
    metres_from_stored: [f64; 2],
    /// No-data values, as stored.
    nodata: [f64; 2],
    /// Model coordinates from pixel coordinates (corner convention).
    pub model_from_pixel: Affine,
    pub crs: Crs,
    /// Notes for the user.
    pub notes: Vec<String>,
}

/// Statistics of all heights.
pub(super) struct HeightStatistics {
    /// Lowest and highest height, metres.
    pub range_m: [f64; 2],
    /// Number of missing or implausible heights.
    pub voids: u64,
    /// Number of voids whose values may be heights in another unit.
    pub implausible: u64,
    /// Number of heights outside of the common range.
    pub unlikely: u64,
}

/// A range without values.
pub(super) const EMPTY_RANGE: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];

/// A range extended to a value.
pub(super) fn widened([low, high]: [f64; 2], value: f64) -> [f64; 2] {
    [low.min(value), high.max(value)]
}

impl Dem {
    /// Reads `scene.terrain.dem`. `uses_geoid` is whether heights are converted by the geoid.
    pub fn read(spec: &TerrainSpec, uses_geoid: bool) -> Result<Self, TerrainFileError> {
        let path = spec.dem.as_path();
        let mut raster = height_files::read(path)?;
        sidecar::read_sidecar_tags(path, &mut raster.geo)?;
        sidecar::read_sidecar_mask(path, &mut raster).map_err(TerrainFileError::dem)?;
        let geo = &raster.geo;
        let (model_from_pixel, mut notes) = read_georeference(path, geo.model_from_pixel)?;
        let stated = StatedCrs::read(path, geo)?;
        // A missing georeference is reported before a missing coordinate system.
        let model_from_pixel = model_from_pixel.ok_or_else(|| no_georeference(path, geo))?;
        let crs = stated.crs(path, geo, spec.epsg)?;
        if raster.bands() > 2 {
            return Err(TerrainFileError::NotHeights { path: path.into(), bands: raster.bands() });
        }
        notes.extend(geo.notes.iter().cloned());
        let key_vertical = spec.epsg.and_then(compound).map(|[_, vertical]| vertical);
        if let Some(problem) = &stated.problem {
            return Err(TerrainFileError::Meaning { path: path.into(), problem: problem.clone() });
        }
        notes.extend(stated.conflict_note.clone());
        let own_vertical = stated
            .vertical
            .or(key_vertical)
            .map(|code| StatedVerticalCrs::from_code(code, &geo.keys.vertical_citation));
        let verticals: Vec<&StatedVerticalCrs> =
            own_vertical.iter().chain(&stated.sidecar_verticals).collect();
        notes.extend(verticals.iter().find_map(|vertical| vertical.note(spec.height, uses_geoid)));
        if verticals.is_empty()
            && matches!(crs.epsg, 4979 | 4937 | 6319 | 4955)
            && spec.height == HeightReference::Msl
        {
            let ellipsoidal = StatedVerticalCrs {
                code: Some(crs.epsg),
                datum: Some(VerticalDatum::Ellipsoid),
                name: crs.name.clone(),
                metres_per_unit: Some(1.0),
            };
            notes.extend(ellipsoidal.note(spec.height, uses_geoid));
        }
        notes.extend(crs.accuracy_m.filter(|metres| *metres >= 2.0).map(|metres| {
            format!(
                "EPSG:{} ({}) is transformed to WGS-84 with an accuracy of {metres} m: log and terrain may \
                 be offset by as much",
                crs.epsg, crs.name
            )
        }));
        let has_alpha = raster.bands() == 2
            && raster.image.extra.last().is_some_and(|extra| matches!(extra, 1 | 2))
            && may_be_alpha(geo.bands.get(1));
        if raster.bands() == 2 && !has_alpha {
            notes.push("has a second band, which is ignored".to_owned());
        }
        if let Some(orientation) = geo.orientation {
            notes.push(format!(
                "its orientation (tag 274: {orientation}) is ignored: the georeference defines rows and \
                 columns"
            ));
        }
        let unit_m = unit_m(spec, geo, &verticals, &stated.height_units, &crs, &mut notes)?;
        let [scale, offset] = scale_and_offset(path, geo, own_vertical.is_some(), &mut notes)?;
        notes.extend(descriptions::notes(geo, unit_m, [scale, offset], spec.height_unit.is_some()));
        // Without a declared no-data value the common ones apply.
        let lowest = if raster.image.sample == SampleType::I16 { f64::from(i16::MIN) } else { COMMON_NODATA };
        let nodata = geo.nodata.map_or([COMMON_NODATA, lowest], |nodata| [nodata; 2]);
        let notes = notes.into_iter().map(|note| format!("{}: {note}", path.display())).collect();
        let metres_from_stored = [unit_m * scale, unit_m * offset];
        let mut dem = Self {
            path: path.into(),
            size: raster.size,
            raster,
            has_alpha,
            is_reversed: [false; 2],
            metres_from_stored,
            nodata,
            model_from_pixel,
            crs,
            notes,
        };
        dem.orient_north_up();
        Ok(dem)
    }

    /// Reverses rows that run from the south and columns that run from the east: the diagonals of cells are
    /// defined with north up.
    fn orient_north_up(&mut self) {
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

    /// Number of posts.
    pub fn post_count(&self) -> u64 {
        u64::from(self.size[0]) * u64::from(self.size[1])
    }

    /// Column and row of a post index.
    pub fn column_and_row(&self, index: usize) -> [u32; 2] {
        let cols = self.size[0] as usize;
        [(index % cols) as u32, (index / cols) as u32]
    }

    /// Height, metres; NaN for a void.
    pub fn height_m(&self, post: [u32; 2]) -> f64 {
        let height_m = self.stored_m(post);
        let [lowest, highest] = PLAUSIBLE_HEIGHTS_M;
        if (lowest..=highest).contains(&height_m) { height_m } else { f64::NAN }
    }

    /// Height, metres, plausible or not; NaN for no-data values and masked posts.
    fn stored_m(&self, post: [u32; 2]) -> f64 {
        let [column, row] = [0, 1]
            .map(|k: usize| if self.is_reversed[k] { self.size[k] - 1 - post[k] } else { post[k] } as usize);
        let pixel = row * self.size[0] as usize + column;
        let stored = self.raster.value(pixel);
        let is_nodata = self.nodata.iter().any(|nodata| equals_nodata(stored, *nodata));
        let is_transparent = self.has_alpha && self.raster.image.value(pixel, 1) == 0.0;
        if is_nodata || is_transparent || !self.raster.is_valid(pixel) {
            f64::NAN
        } else {
            stored * self.metres_from_stored[0] + self.metres_from_stored[1]
        }
    }

    /// Statistics of all heights.
    pub fn statistics(&self) -> HeightStatistics {
        let none = || HeightStatistics { range_m: EMPTY_RANGE, voids: 0, implausible: 0, unlikely: 0 };
        let [lowest, highest] = PLAUSIBLE_HEIGHTS_M;
        let rows = (0..self.size[1]).into_par_iter().map(|row| {
            (0..self.size[0]).fold(none(), |sum, column| match self.stored_m([column, row]) {
                height_m if (lowest..=highest).contains(&height_m) => {
                    let is_usual = (USUAL_HEIGHTS_M[0]..=USUAL_HEIGHTS_M[1]).contains(&height_m);
                    HeightStatistics {
                        range_m: widened(sum.range_m, height_m),
                        unlikely: sum.unlikely + u64::from(!is_usual),
                        ..sum
                    }
                }
                height_m => HeightStatistics {
                    voids: sum.voids + 1,
                    implausible: sum.implausible + u64::from(height_m.abs() < MAX_OTHER_UNIT),
                    ..sum
                },
            })
        });
        rows.reduce(none, |a, b| HeightStatistics {
            range_m: widened(widened(a.range_m, b.range_m[0]), b.range_m[1]),
            voids: a.voids + b.voids,
            implausible: a.implausible + b.implausible,
            unlikely: a.unlikely + b.unlikely,
        })
    }

    /// Pixel coordinates (corner convention) of a post.
    pub fn pixel_centre(post: [u32; 2]) -> [f64; 2] {
        post.map(|n| f64::from(n) + 0.5)
    }

    /// Model coordinates of a post.
    pub fn model(&self, post: [u32; 2]) -> [f64; 2] {
        self.model_from_pixel.apply(Self::pixel_centre(post))
    }

    /// Latitude, longitude of a post, radians; `None` outside of the projection's domain.
    pub fn geodetic_rad(&self, post: [u32; 2]) -> Option<[f64; 2]> {
        self.crs.geodetic_from_model(self.model(post))
    }

    /// Width along the middle row and height along the middle column on the ground; `None` where the projection
    /// ends within.
    pub fn ground_size_m(&self) -> Option<[f64; 2]> {
        let [width, height] = self.size;
        let between = |from: [u32; 2], to: [u32; 2]| {
            let [[from_lat, from_lon], [to_lat, to_lon]] = [self.geodetic_rad(from)?, self.geodetic_rad(to)?];
            let turn = (to_lon - from_lon + PI).rem_euclid(2.0 * PI) - PI;
            let east = turn * (0.5 * (from_lat + to_lat)).cos();
            Some(MEAN_RADIUS_M * east.hypot(to_lat - from_lat))
        };
        let across = between([0, height / 2], [width - 1, height / 2])?;
        let down = between([width / 2, 0], [width / 2, height - 1])?;
        // From posts to cells.
        let cells = |length: f64, posts: u32| length * f64::from(posts) / f64::from(posts - 1);
        Some([cells(across, width), cells(down, height)])
    }

    /// Number of posts outside of the projection's domain.
    pub fn count_outside_crs(&self) -> u64 {
        self.count(|post| self.geodetic_rad(post).is_none())
    }

    /// Number of posts that fulfil a predicate.
    pub fn count(&self, predicate: impl Fn([u32; 2]) -> bool + Sync) -> u64 {
        (0..self.post_count() as usize)
            .into_par_iter()
            .filter(|&index| predicate(self.column_and_row(index)))
            .count() as u64
    }

    /// The outermost posts.
    pub fn border(&self) -> impl Iterator<Item = [u32; 2]> {
        let [cols, rows] = self.size;
        (0..cols)
            .flat_map(move |i| [[i, 0], [i, rows - 1]])
            .chain((0..rows).flat_map(move |j| [[0, j], [cols - 1, j]]))
    }
}

/// Whether a stored value is the no-data value.
fn equals_nodata(stored: f64, nodata: f64) -> bool {
    let may_be_height = (USUAL_HEIGHTS_M[0]..=USUAL_HEIGHTS_M[1]).contains(&nodata);
    // A float32 file may declare its no-data value with more digits.
    stored == nodata
        || stored as f32 == nodata as f32
        || !may_be_height && (stored - nodata).abs() <= NODATA_TOLERANCE * nodata.abs()
}

/// Metres per unit of the heights. Where the file states several units or may have one of two, the key
/// decides.
// Long because: one list of stated units is filled from five sources and then compared.
fn unit_m(
    spec: &TerrainSpec,
    geo: &GeoTags,
    verticals: &[&StatedVerticalCrs],
    by_name: &[(String, String)],
    crs: &Crs,
    notes: &mut Vec<String>,
) -> Result<f64, TerrainFileError> {
    let path = &spec.dem;
    let meaning = |problem: String| TerrainFileError::Meaning { path: path.clone(), problem };
    let key_unit_m = spec.height_unit.map(|unit| unit.metres());
    let mut stated: Vec<(String, f64)> = Vec::new();
    if let Some(name) = geo.bands.first().and_then(|band| band.unit.as_ref()) {
        match metres_per_unit_name(name) {
            Some(unit) => stated.push((format!("unit `{name}`"), unit)),
            None if key_unit_m.is_none() => {
                return Err(meaning(format!(
                    "states `{name}` as the unit of its heights, which is unknown: set \
                     scene.terrain.height_unit = \"m\", \"ft\" or \"us-ft\""
                )));
            }
            None => {}
        }
    }
    for (name, from) in by_name {
        match metres_per_unit_name(name) {
            // ARC/INFO has one name for both feet.
            Some(unit) if key_unit_m.is_some_and(|key| (key - unit).abs() < 1e-6) => {}
            Some(unit) => stated.push((format!("{from} {name}"), unit)),
            None if key_unit_m.is_none() => {
                return Err(meaning(format!(
                    "{from} is `{name}`, which is an unknown unit: set scene.terrain.height_unit = \"m\", \
                     \"ft\" or \"us-ft\""
                )));
            }
            None => {}
        }
    }
    for vertical in verticals {
        let Some(unit) = &vertical.metres_per_unit else { continue };
        let label = vertical
            .code
            .map_or_else(|| vertical.name.clone(), |code| format!("EPSG:{code} ({})", vertical.name));
        if *unit < 0.0 {
            return Err(meaning(format!(
                "states depths ({}), positive downwards: negate them with `gdal_calc.py -A IN --calc=-A \
                 --outfile OUT`",
                vertical.label()
            )));
        }
        stated.push((label, *unit));
    }
    if let Some(code) = geo.keys.vertical_unit {
        match metres_per_unit_code(code) {
            Some(unit) => stated.push((format!("VerticalUnits {code}"), unit)),
            None if key_unit_m.is_none() => {
                return Err(TerrainFileError::Unit { path: path.clone(), kind: "vertical", code });
            }
            None => {}
        }
    }
    let tag_count = stated.len();
    stated.extend(
        descriptions::units(geo).filter_map(|(name, value)| {
            Some((format!("item {name} `{value}`"), metres_per_unit_name(value)?))
        }),
    );
    if let (0, None, Some((text, unit))) =
        (tag_count, key_unit_m, stated.first().filter(|(_, unit)| *unit != 1.0))
    {
        notes.push(format!(
            "its heights are read in units of {unit} m, from its {text}: if that is not the unit of heights, \
             remove it and set scene.terrain.height_unit"
        ));
    }
    let is_same = |a: f64, b: f64| (a - b).abs() < SAME_UNIT_M;
    let agree = stated.windows(2).all(|pair| is_same(pair[0].1, pair[1].1));
    let listed =
        || stated.iter().map(|(text, unit)| format!("{text} of {unit} m")).collect::<Vec<_>>().join(" and ");
    match (key_unit_m, stated.first()) {
        (Some(unit), Some(_)) if !stated.iter().any(|(_, stated)| is_same(*stated, unit)) => {
            Err(meaning(format!(
                "states {}, but scene.terrain.height_unit has {unit} m: remove the key, or correct the file",
                listed()
            )))
        }
        (Some(unit), _) => Ok(unit),
        (None, Some(_)) if !agree => Err(meaning(format!(
            "states {}: set scene.terrain.height_unit = \"m\", \"ft\" or \"us-ft\"",
            listed()
        ))),
        (None, Some((_, unit))) => Ok(*unit),
        // Files with coordinates in feet may have heights in feet or metres.
        (None, None) if crs.metres_per_unit().is_some_and(|unit| !is_same(unit, 1.0)) => {
            Err(meaning(format!(
                "EPSG:{} ({}) has coordinates in feet, and the unit of the heights is not stated: set \
                 scene.terrain.height_unit = \"m\", \"ft\" or \"us-ft\"",
                crs.epsg, crs.name
            )))
        }
        (None, None) => Ok(1.0),
    }
}

/// Scale and offset from stored values to heights in their unit: `scale x stored + offset`.
fn scale_and_offset(
    path: &Path,
    geo: &GeoTags,
    has_vertical: bool,
    notes: &mut Vec<String>,
) -> Result<[f64; 2], TerrainFileError> {
    let meaning = |problem: String| TerrainFileError::Meaning { path: path.into(), problem };
    let band = geo
        .bands
        .first()
        .map(|band| (band.scale, band.offset))
        .filter(|(scale, offset)| scale.is_some() || offset.is_some());
    let band_scale = band.map(|(scale, offset)| [scale.unwrap_or(1.0), offset.unwrap_or(0.0)]);
    if band_scale.is_some_and(|[scale, _]| scale == 0.0) {
        return Err(meaning("states a scale of 0 for its heights (GDAL_METADATA): correct the file".into()));
    }
    match (band_scale, geo.vertical_scale) {
        (Some(band), Some(tags)) if has_vertical && band != tags => Err(meaning(format!(
            "states two scales of its heights, {band:?} (GDAL_METADATA) and {tags:?} (ModelPixelScale and \
             ModelTiepoint): remove one with `gdal_translate`"
        ))),
        // As in GDAL, the georeference scales heights only with a vertical system; without one, writers leave
        // arbitrary values there.
        (None, Some(tags)) if has_vertical => Ok(tags),
        (band_scale, Some([scale, offset])) if !has_vertical => {
            notes.push(format!(
                "the third values of ModelPixelScale and ModelTiepoint (scale {scale}, offset {offset}) are \
                 not applied: the file states no vertical system"
            ));
            Ok(band_scale.unwrap_or([1.0, 0.0]))
        }
        (band_scale, _) => Ok(band_scale.unwrap_or([1.0, 0.0])),
    }
}

/// The georeference of the file's tags or of a world file, with notes.
pub(super) fn read_georeference(
    path: &Path,
    from_tags: Option<Affine>,
) -> Result<(Option<Affine>, Vec<String>), TerrainFileError> {
    let (affine, notes) = match from_tags {
        Some(affine) => {
            // A world file that cannot be read is ignored, because it is not needed.
            let other = world_file(path).ok().flatten().filter(|other| !is_same_georeference(&affine, other));
            (Some(affine), other.map(|_| "a world file differs from its tags and is ignored".to_owned()))
        }
        None => (world_file(path)?, None),
    };
    match affine {
        Some(affine) if affine.inverse().is_none() => {
            Err(TerrainFileError::DegenerateGeoreference { path: path.into() })
        }
        affine => Ok((affine, notes.into_iter().collect())),
    }
}

/// Whether two georeferences agree to a hundredth of a pixel at the corner and a millionth in size.
fn is_same_georeference(a: &Affine, b: &Affine) -> bool {
    let Some(pixel_from_model) = a.inverse() else { return true };
    let is_near = |pixel: [f64; 2]| {
        let other_pixel = pixel_from_model.apply(b.apply(pixel));
        (0..2).all(|k| (other_pixel[k] - pixel[k]).abs() < 0.01 + 1e-6 * pixel[k])
    };
    is_near([0.0, 0.0]) && is_near([1000.0, 1000.0])
}

fn no_georeference(path: &Path, geo: &GeoTags) -> TerrainFileError {
    let world = georeference::world_file_names(path).into_iter().next().unwrap_or_default();
    let world = world.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    TerrainFileError::NoGeoreference {
        path: path.into(),
        world,
        details: geo.notes.iter().map(|note| format!(" ({note})")).collect(),
    }
}
