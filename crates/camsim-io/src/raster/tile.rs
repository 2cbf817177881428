//! One file of heights, which stay in the file's type and are converted to metres on access.

use std::path::{Path, PathBuf};

use camsim_core::scenario::{HeightReference, TerrainSpec};

use super::{
    TerrainFileError,
    bands::may_be_alpha,
    citations,
    crs::{Crs, compound},
    decoded::Raster,
    dem::USUAL_HEIGHTS_M,
    descriptions,
    geo_tags::GeoTags,
    georeference::{self, Affine, world_file},
    height_files,
    height_unit::unit_m,
    sidecar,
    stated_crs::StatedCrs,
    tiff_file::SampleType,
    vertical_crs::{StatedVerticalCrs, VerticalDatum},
};

/// Relative difference at which a value equals the no-data value, for programs that interpolate it. No-data
/// values that may be heights are compared exactly.
const NODATA_TOLERANCE: f64 = 1e-5;

/// The most common no-data value of files that do not declare one.
const COMMON_NODATA: f64 = -9999.0;

/// A georeferenced grid of heights (posts); row 0 is the northernmost, column 0 the westernmost.
pub(super) struct Tile {
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
    /// Metres per unit of the heights.
    pub unit_m: f64,
    /// Origin of the heights, if the file states one.
    pub datum: Option<VerticalDatum>,
    /// Notes for the user, without the file's name.
    pub notes: Vec<String>,
}

impl Tile {
    /// Reads a file of `scene.terrain.dem`. `uses_geoid` is whether heights are converted by the geoid.
    // Long because: it is the list of what a file may state.
    pub fn read(path: &Path, spec: &TerrainSpec, uses_geoid: bool) -> Result<Self, TerrainFileError> {
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
        let in_citations = citations::vertical_texts(&geo.keys);
        let verticals: Vec<&StatedVerticalCrs> =
            own_vertical.iter().chain(&stated.sidecar_verticals).chain(&in_citations).collect();
        notes.extend(verticals.iter().find_map(|vertical| vertical.note(spec.height, uses_geoid)));
        let by_name =
            Some(()).filter(|()| verticals.is_empty()).and_then(|()| citations::vertical_system(&geo.keys));
        notes.extend(by_name.iter().find_map(|vertical| vertical.note(spec.height, uses_geoid)));
        notes.extend(citations::horizontal_note(&geo.keys, &crs));
        if verticals.is_empty()
            && by_name.is_none()
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
        let unit_m = unit_m(path, spec, geo, &verticals, &stated.height_units, &crs, &mut notes)?;
        let [scale, offset] = scale_and_offset(path, geo, own_vertical.is_some(), &mut notes)?;
        notes.extend(descriptions::notes(geo, unit_m, [scale, offset], spec.height_unit.is_some()));
        // Without a declared no-data value the common ones apply.
        let lowest = if raster.image.sample == SampleType::I16 { f64::from(i16::MIN) } else { COMMON_NODATA };
        let nodata = geo.nodata.map_or([COMMON_NODATA, lowest], |nodata| [nodata; 2]);
        let metres_from_stored = [unit_m * scale, unit_m * offset];
        let datum = verticals.iter().copied().chain(&by_name).find_map(|vertical| vertical.datum);
        let mut tile = Self {
            path: path.into(),
            size: raster.size,
            raster,
            has_alpha,
            is_reversed: [false; 2],
            metres_from_stored,
            nodata,
            model_from_pixel,
            crs,
            unit_m,
            datum,
            notes,
        };
        tile.orient_north_up();
        Ok(tile)
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

    /// Height, metres, plausible or not; NaN for no-data values and masked posts.
    pub fn stored_m(&self, post: [u32; 2]) -> f64 {
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
}

/// Whether a stored value is the no-data value.
fn equals_nodata(stored: f64, nodata: f64) -> bool {
    let may_be_height = (USUAL_HEIGHTS_M[0]..=USUAL_HEIGHTS_M[1]).contains(&nodata);
    // A float32 file may declare its no-data value with more digits.
    stored == nodata
        || stored as f32 == nodata as f32
        || !may_be_height && (stored - nodata).abs() <= NODATA_TOLERANCE * nodata.abs()
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
