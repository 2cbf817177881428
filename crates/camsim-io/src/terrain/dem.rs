//! A DEM as its file has it: heights are kept in the file's own type and turned into metres one by one.

use std::path::{Path, PathBuf};

use rayon::prelude::*;

use camsim_core::scenario::{HeightReference, TerrainSpec};

use super::{
    TerrainFileError,
    bands::may_be_alpha,
    beside,
    crs::{Crs, compound},
    geo_tags::GeoTags,
    georeference::{self, Affine, world_file},
    height_files,
    raster::Raster,
    systems::{Datum, SAME_UNIT_M, Stated, Vertical, unit_of_code, unit_of_name},
    tiff_file::Sample,
    words,
};

/// Heights outside of this are garbage or undeclared "no data" marks, metres: from below the deepest sea to
/// above the highest mountain.
const PLAUSIBLE_HEIGHTS_M: [f64; 2] = [-11_500.0, 9_500.0];

/// Heights outside of this are rare enough to be spoken of, metres.
const USUAL_HEIGHTS_M: [f64; 2] = [-500.0, 9_000.0];

/// Programs that compute with a mark miss it by as much, in parts of it. Marks that may be heights are met
/// exactly.
const MARK_TOLERANCE: f64 = 1e-5;

/// What lies outside of it but within this may be a height in another unit; marks lie farther away.
const NUMBERS_NOT_MARKS: f64 = 1e6;

/// The mark that most often means "no data" where the file does not declare one.
const COMMON_NODATA: f64 = -9999.0;

/// A grid of heights with its place on Earth; row 0 is the northernmost, column 0 the westernmost.
pub(super) struct Dem {
    pub path: PathBuf,
    pub size: [u32; 2],
    /// As the file has them: a sixth of what points in f64 would take.
    raster: Raster,
    /// Whether its second band says where there is something.
    has_alpha: bool,
    /// Whether the file counts columns from the east, rows from the south.
    is_reversed: [bool; 2],
    /// Metres of a stored number: this times it, and this more.
    metres: [f64; 2],
    /// Stored numbers of heights that are not there.
    nodata: [f64; 2],
    /// Model coordinates of pixel corners.
    pub model_from_pixel: Affine,
    pub crs: Crs,
    /// What there is to say about it.
    pub notes: Vec<String>,
}

/// What all heights come to.
pub(super) struct Heights {
    pub range_m: [f64; 2],
    pub voids: u64,
    /// Of the voids: numbers that may be heights in another unit.
    pub implausible: u64,
    /// Heights that are deeper or higher than nearly all land.
    pub unlikely: u64,
}

pub(super) const EMPTY_RANGE: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];

pub(super) fn widened([low, high]: [f64; 2], value: f64) -> [f64; 2] {
    [low.min(value), high.max(value)]
}

impl Dem {
    /// `converts`: whether heights go through the geoid.
    pub fn read(spec: &TerrainSpec, converts: bool) -> Result<Self, TerrainFileError> {
        let path = spec.dem.as_path();
        let mut raster = height_files::read(path)?;
        beside::read_tags(path, &mut raster.geo)?;
        beside::read_mask(path, &mut raster).map_err(TerrainFileError::of_dem)?;
        let geo = &raster.geo;
        let (found, mut notes) = georeference_of(path, geo.model_from_pixel)?;
        let stated = Stated::of(path, geo)?;
        // The more basic lack is reported first.
        let model_from_pixel = found.ok_or_else(|| no_georeference(path, geo))?;
        let crs = stated.crs(path, geo, spec.epsg)?;
        if raster.bands() > 2 {
            return Err(TerrainFileError::NotHeights { path: path.into(), bands: raster.bands() });
        }
        notes.extend(geo.notes.iter().cloned());
        let of_key = spec.epsg.and_then(compound).map(|[_, vertical]| vertical);
        if let Some(problem) = &stated.problem {
            return Err(TerrainFileError::Meaning { path: path.into(), problem: problem.clone() });
        }
        notes.extend(stated.other.clone());
        let own_vertical =
            stated.vertical.or(of_key).map(|code| Vertical::of(code, &geo.keys.vertical_citation));
        let verticals: Vec<&Vertical> = own_vertical.iter().chain(&stated.beside).collect();
        notes.extend(verticals.iter().find_map(|vertical| vertical.note(spec.height, converts)));
        if verticals.is_empty()
            && matches!(crs.epsg, 4979 | 4937 | 6319 | 4955)
            && spec.height == HeightReference::Msl
        {
            let three = Vertical {
                code: Some(crs.epsg),
                datum: Some(Datum::Ellipsoid),
                name: crs.name.clone(),
                metres_per_unit: Some(1.0),
            };
            notes.extend(three.note(spec.height, converts));
        }
        notes.extend(crs.accuracy_m.filter(|metres| *metres >= 2.0).map(|metres| {
            format!(
                "EPSG:{} ({}) comes to WGS-84 by a shift that may be off by {metres} m: the log may lie beside the terrain by as much",
                crs.epsg, crs.name
            )
        }));
        let has_alpha = raster.bands() == 2
            && raster.image.extra.last().is_some_and(|extra| matches!(extra, 1 | 2))
            && may_be_alpha(geo.bands.get(1));
        if raster.bands() == 2 && !has_alpha {
            notes.push("holds a second band, which is left out".to_owned());
        }
        if let Some(orientation) = geo.orientation {
            notes.push(format!("its orientation (tag 274: {orientation}) is not used: rows and columns lie where the georeference says"));
        }
        let unit_m = unit_m(spec, geo, &verticals, &stated.height_units, &crs, &mut notes)?;
        let [scale, offset] = scale_and_offset(path, geo, own_vertical.is_some(), &mut notes)?;
        notes.extend(words::notes(geo, unit_m, [scale, offset], spec.height_unit.is_some()));
        // Where no mark is declared, the usual ones are marks.
        let lowest = if raster.image.sample == Sample::I16 { f64::from(i16::MIN) } else { COMMON_NODATA };
        let nodata = geo.nodata.map_or([COMMON_NODATA, lowest], |mark| [mark; 2]);
        let notes = notes.into_iter().map(|note| format!("{}: {note}", path.display())).collect();
        let metres = [unit_m * scale, unit_m * offset];
        let mut dem = Self {
            path: path.into(),
            size: raster.size,
            raster,
            has_alpha,
            is_reversed: [false; 2],
            metres,
            nodata,
            model_from_pixel,
            crs,
            notes,
        };
        dem.turn_north_up();
        Ok(dem)
    }

    /// Some files count rows from the south (or columns from the east); the diagonals of the cells are
    /// defined with the north on top.
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
        let metres = self.stored_m(at);
        let [lowest, highest] = PLAUSIBLE_HEIGHTS_M;
        if (lowest..=highest).contains(&metres) { metres } else { f64::NAN }
    }

    /// Whether plausible or not; NaN where the file says that there is nothing.
    fn stored_m(&self, at: [u32; 2]) -> f64 {
        let [column, row] = [0, 1]
            .map(|k: usize| if self.is_reversed[k] { self.size[k] - 1 - at[k] } else { at[k] } as usize);
        let pixel = row * self.size[0] as usize + column;
        let stored = self.raster.value(pixel);
        let is_nodata = self.nodata.iter().any(|mark| is_mark(stored, *mark));
        let is_clear = self.has_alpha && self.raster.image.value(pixel, 1) == 0.0;
        if is_nodata || is_clear || !self.raster.is_valid(pixel) {
            f64::NAN
        } else {
            stored * self.metres[0] + self.metres[1]
        }
    }

    pub fn heights(&self) -> Heights {
        let none = || Heights { range_m: EMPTY_RANGE, voids: 0, implausible: 0, unlikely: 0 };
        let [lowest, highest] = PLAUSIBLE_HEIGHTS_M;
        let rows = (0..self.size[1]).into_par_iter().map(|row| {
            (0..self.size[0]).fold(none(), |all, column| match self.stored_m([column, row]) {
                m if (lowest..=highest).contains(&m) => {
                    let is_usual = (USUAL_HEIGHTS_M[0]..=USUAL_HEIGHTS_M[1]).contains(&m);
                    Heights {
                        range_m: widened(all.range_m, m),
                        unlikely: all.unlikely + u64::from(!is_usual),
                        ..all
                    }
                }
                m => Heights {
                    voids: all.voids + 1,
                    implausible: all.implausible + u64::from(m.abs() < NUMBERS_NOT_MARKS),
                    ..all
                },
            })
        });
        rows.reduce(none, |a, b| Heights {
            range_m: widened(widened(a.range_m, b.range_m[0]), b.range_m[1]),
            voids: a.voids + b.voids,
            implausible: a.implausible + b.implausible,
            unlikely: a.unlikely + b.unlikely,
        })
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
        self.count(|at| self.geodetic_rad(at).is_none())
    }

    /// Samples of which something holds.
    pub fn count(&self, holds: impl Fn([u32; 2]) -> bool + Sync) -> u64 {
        (0..self.points() as usize).into_par_iter().filter(|&index| holds(self.column_and_row(index))).count()
            as u64
    }

    /// The outermost samples.
    pub fn border(&self) -> impl Iterator<Item = [u32; 2]> {
        let [cols, rows] = self.size;
        (0..cols)
            .flat_map(move |i| [[i, 0], [i, rows - 1]])
            .chain((0..rows).flat_map(move |j| [[0, j], [cols - 1, j]]))
    }
}

/// Whether a stored number is the mark of missing values.
fn is_mark(stored: f64, mark: f64) -> bool {
    let may_be_height = (USUAL_HEIGHTS_M[0]..=USUAL_HEIGHTS_M[1]).contains(&mark);
    // A float32 file may declare its mark with more digits than it holds.
    stored == mark
        || stored as f32 == mark as f32
        || !may_be_height && (stored - mark).abs() <= MARK_TOLERANCE * mark.abs()
}

/// Metres in the unit of the heights. Where the file says two units or where it may be one of two, the key
/// decides.
fn unit_m(
    spec: &TerrainSpec,
    geo: &GeoTags,
    verticals: &[&Vertical],
    by_name: &[(String, String)],
    crs: &Crs,
    notes: &mut Vec<String>,
) -> Result<f64, TerrainFileError> {
    let path = &spec.dem;
    let meaning = |problem: String| TerrainFileError::Meaning { path: path.clone(), problem };
    let unit_of_key = spec.height_unit.map(|unit| unit.metres());
    let mut stated: Vec<(String, f64)> = Vec::new();
    if let Some(name) = geo.bands.first().and_then(|band| band.unit.as_ref()) {
        match unit_of_name(name) {
            Some(unit) => stated.push((format!("unit `{name}`"), unit)),
            None if unit_of_key.is_none() => {
                return Err(meaning(format!(
                    "states `{name}` as the unit of its heights, which is not known: set scene.terrain.height_unit = \"m\", \"ft\" or \"us-ft\""
                )));
            }
            None => {}
        }
    }
    for (name, from) in by_name {
        match unit_of_name(name) {
            // ARC/INFO's feet may be either.
            Some(unit) if unit_of_key.is_some_and(|key| (key - unit).abs() < 1e-6) => {}
            Some(unit) => stated.push((format!("{from} {name}"), unit)),
            None if unit_of_key.is_none() => {
                return Err(meaning(format!(
                    "{from} is `{name}`, which is no unit that is known: set scene.terrain.height_unit = \"m\", \"ft\" or \"us-ft\""
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
                "states depths ({}), which count downwards: turn them into heights with `gdal_calc.py -A IN --calc=-A --outfile OUT`",
                vertical.label()
            )));
        }
        stated.push((label, *unit));
    }
    if let Some(code) = geo.keys.vertical_unit {
        match unit_of_code(code) {
            Some(unit) => stated.push((format!("VerticalUnits {code}"), unit)),
            None if unit_of_key.is_none() => {
                return Err(TerrainFileError::Unit { path: path.clone(), what: "vertical", code });
            }
            None => {}
        }
    }
    let of_tags = stated.len();
    stated.extend(
        words::units(geo)
            .filter_map(|(name, value)| Some((format!("item {name} `{value}`"), unit_of_name(value)?))),
    );
    if let (0, None, Some((text, unit))) =
        (of_tags, unit_of_key, stated.first().filter(|(_, unit)| *unit != 1.0))
    {
        notes.push(format!(
            "its heights are taken in units of {unit} m, by its {text}: if that is not of heights, set scene.terrain.height_unit after removing it"
        ));
    }
    let close = |a: f64, b: f64| (a - b).abs() < SAME_UNIT_M;
    let agree = stated.windows(2).all(|pair| close(pair[0].1, pair[1].1));
    let all =
        || stated.iter().map(|(text, unit)| format!("{text} of {unit} m")).collect::<Vec<_>>().join(" and ");
    match (unit_of_key, stated.first()) {
        (Some(unit), Some(_)) if !stated.iter().any(|(_, stated)| close(*stated, unit)) => {
            Err(meaning(format!(
                "states {}, but scene.terrain.height_unit has {unit} m: remove the key, or correct the file",
                all()
            )))
        }
        (Some(unit), _) => Ok(unit),
        (None, Some(_)) if !agree => Err(meaning(format!(
            "states {}: set scene.terrain.height_unit = \"m\", \"ft\" or \"us-ft\"",
            all()
        ))),
        (None, Some((_, unit))) => Ok(*unit),
        // Who maps in feet may have heights in feet, or not.
        (None, None) if crs.metres_per_unit().is_some_and(|unit| !close(unit, 1.0)) => Err(meaning(format!(
            "EPSG:{} ({}) counts in feet, and nothing says whether the heights do: set scene.terrain.height_unit = \"m\", \"ft\" or \"us-ft\"",
            crs.epsg, crs.name
        ))),
        (None, None) => Ok(1.0),
    }
}

/// `scale x stored + offset` in the unit of the heights.
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
    let of_band = band.map(|(scale, offset)| [scale.unwrap_or(1.0), offset.unwrap_or(0.0)]);
    if of_band.is_some_and(|[scale, _]| scale == 0.0) {
        return Err(meaning("states a scale of 0 for its heights (GDAL_METADATA): correct the file".into()));
    }
    match (of_band, geo.vertical_scale) {
        (Some(band), Some(place)) if has_vertical && band != place => Err(meaning(format!(
            "states two scales of its heights, {band:?} (GDAL_METADATA) and {place:?} (ModelPixelScale and ModelTiepoint): remove one with `gdal_translate`"
        ))),
        // It scales heights where there is a vertical system, as for GDAL; elsewhere writers leave anything
        // there.
        (None, Some(place)) if has_vertical => Ok(place),
        (of_band, Some([scale, offset])) if !has_vertical => {
            notes.push(format!(
                "the third numbers of ModelPixelScale and ModelTiepoint (scale {scale}, offset {offset}) are not applied: the file states no vertical system"
            ));
            Ok(of_band.unwrap_or([1.0, 0.0]))
        }
        (of_band, _) => Ok(of_band.unwrap_or([1.0, 0.0])),
    }
}

/// From the file's own tags, or from a world file beside it; with what there is to say.
pub(super) fn georeference_of(
    path: &Path,
    from_tags: Option<Affine>,
) -> Result<(Option<Affine>, Vec<String>), TerrainFileError> {
    let (found, notes) = match from_tags {
        Some(affine) => {
            // One that cannot be read has no say, since it is not needed.
            let other = world_file(path).ok().flatten().filter(|other| !is_same_place(&affine, other));
            (
                Some(affine),
                other.map(|_| {
                    "a world file beside it says another place than its own tags, and is not used".to_owned()
                }),
            )
        }
        None => (world_file(path)?, None),
    };
    match found {
        Some(affine) if affine.inverse().is_none() => {
            Err(TerrainFileError::DegenerateGeoreference { path: path.into() })
        }
        found => Ok((found, notes.into_iter().collect())),
    }
}

/// To a hundredth of a pixel at the corner, and a millionth in size.
fn is_same_place(a: &Affine, b: &Affine) -> bool {
    let Some(pixel_from_model) = a.inverse() else { return true };
    let near = |at: [f64; 2]| {
        let there = pixel_from_model.apply(b.apply(at));
        (0..2).all(|k| (there[k] - at[k]).abs() < 0.01 + 1e-6 * at[k])
    };
    near([0.0, 0.0]) && near([1000.0, 1000.0])
}

fn no_georeference(path: &Path, geo: &GeoTags) -> TerrainFileError {
    let world = georeference::world_file_names(path).into_iter().next().unwrap_or_default();
    let world = world.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    TerrainFileError::NoGeoreference {
        path: path.into(),
        world,
        more: geo.notes.iter().map(|note| format!(" ({note})")).collect(),
    }
}
