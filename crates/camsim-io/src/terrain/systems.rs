//! Which coordinate systems a file states, of place and of height.

use std::path::Path;

use camsim_core::scenario::HeightReference;

use super::{
    TerrainFileError,
    arc_prj::ArcPrj,
    crs::{Crs, VerticalCrs, compound},
    geo_tags::{GeoTags, USER_DEFINED},
    wkt,
};

/// What a file states.
#[derive(Debug, Default)]
pub(super) struct Stated {
    pub horizontal: Option<u16>,
    /// What it calls a system of its own, which has no code.
    pub own: Option<String>,
    pub vertical: Option<u16>,
    /// A text beside the raster that states another horizontal system than the raster itself.
    pub other: Option<String>,
    /// Vertical systems in texts beside the raster.
    pub beside: Vec<Vertical>,
    /// Units of heights by name, with where they are from.
    pub height_units: Vec<(String, String)>,
    /// Why heights cannot be what a text says.
    pub problem: Option<String>,
    /// Of the text that gives the horizontal system, if it does: its file, and metres in its unit.
    unit_of_text: Option<(String, f64)>,
    /// The same of ARC/INFO.
    arc: Option<(String, ArcPrj)>,
}

/// Units that differ by less are one: the two feet differ by six times as much.
pub(super) const SAME_UNIT_M: f64 = 1e-7;

/// Of the texts beside a raster the first that states another horizontal system than its own, `own`.
fn other_system(geo: &GeoTags, own: u16) -> Option<String> {
    geo.texts.iter().find_map(|(from, text)| {
        let stated = wkt::codes(text).horizontal?;
        let stated = compound(stated).map_or(stated, |[horizontal, _]| horizontal);
        let file = from.file_name().unwrap_or_default().to_string_lossy();
        (stated != own)
            .then(|| format!("{file} states EPSG:{stated} and the raster itself EPSG:{own}, which is taken: correct one of them"))
    })
}

impl Stated {
    pub fn of(path: &Path, geo: &GeoTags) -> Result<Self, TerrainFileError> {
        let keys = &geo.keys;
        let meaning = |problem: String| TerrainFileError::Meaning { path: path.into(), problem };
        if keys.model_type == Some(3) {
            return Err(meaning(
                "is in geocentric coordinates: convert it with `gdalwarp -t_srs EPSG:CODE IN OUT`".into(),
            ));
        }
        let code = |key: Option<u16>| key.filter(|code| *code != USER_DEFINED);
        // A projection of the file's own has a geographic system too, as its base.
        let is_own_projection = keys.projected == Some(USER_DEFINED)
            || (keys.projected.is_none()
                && (keys.model_type == Some(1) || keys.projection.is_some() || keys.method.is_some()));
        let mut stated = Self { vertical: keys.vertical, ..Self::default() };
        if is_own_projection {
            stated.horizontal = utm_by_zone(keys.projection, keys.geographic, keys.linear_unit);
            stated.own = stated.horizontal.is_none().then(|| keys.citation.clone());
        } else if let Some(projected) = code(keys.projected) {
            stated.horizontal = Some(projected);
        } else if keys.geographic == Some(USER_DEFINED) {
            stated.own = Some(keys.citation.clone());
        } else {
            stated.horizontal = keys.geographic;
        }
        if stated.horizontal.is_none()
            && stated.own.is_none()
            && let Some((from, text)) = geo.texts.first()
        {
            let file = from.file_name().unwrap_or_default().to_string_lossy().into_owned();
            stated.arc = ArcPrj::of(text).map(|arc| (file.clone(), arc));
            stated.unit_of_text = wkt::horizontal_unit(text).map(|unit| (file.clone(), unit));
            stated.horizontal = wkt::codes(text).horizontal;
            let name = stated.arc.as_ref().map_or_else(|| wkt::name(text), |(_, arc)| &arc.name);
            let what = format!("{name} in {file}");
            stated.own = stated.horizontal.is_none().then_some(what);
        }
        stated.read_heights(geo);
        if let Some([horizontal, vertical]) = stated.horizontal.and_then(compound) {
            stated.horizontal = Some(horizontal);
            stated.vertical = stated.vertical.or(Some(vertical));
        }
        stated.other = stated.horizontal.and_then(|own| other_system(geo, own));
        Ok(stated)
    }

    /// What texts beside the raster say of heights.
    fn read_heights(&mut self, geo: &GeoTags) {
        for (from, text) in &geo.texts {
            let file = from.file_name().unwrap_or_default().to_string_lossy();
            if let Some(unit) = ArcPrj::of(text).and_then(|arc| arc.height_unit) {
                self.height_units.push((unit, format!("Zunits in {file}")));
            }
            let Some(vertical) = wkt::vertical(text) else { continue };
            if vertical.shift != 0.0 {
                self.problem = Some(format!(
                    "{file} states a shift of its heights (Vertical_Shift {}), which is not applied: apply it with `gdal_calc.py`, and set it to 0 there",
                    vertical.shift
                ));
            }
            self.beside.extend(Vertical::of_text(&vertical, &file));
        }
    }

    /// Where a text beside the raster and the system that is taken do not agree.
    fn contradiction(&self, crs: &Crs) -> Option<String> {
        let unit = crs.metres_per_unit();
        let of_crs = || format!("EPSG:{} ({})", crs.epsg, crs.name);
        if let Some((file, stated)) = &self.unit_of_text
            && unit.is_none_or(|unit| (unit - stated).abs() > SAME_UNIT_M)
        {
            return Some(format!(
                "{file} states coordinates in units of {stated} m, which are not those of {}: correct one of them",
                of_crs()
            ));
        }
        let (file, arc) = self.arc.as_ref()?;
        if let Some(name) = &arc.unit {
            let is_same = match unit {
                // Its feet may be either.
                Some(unit) => unit_of_name(name).is_some_and(|stated| (stated - unit).abs() < 1e-6),
                None => matches!(name.to_lowercase().as_str(), "dd" | "degrees" | "decimal degrees"),
            };
            if !is_same {
                return Some(format!(
                    "{file} states `Units {name}`, which are not those of {}: correct one of them",
                    of_crs()
                ));
            }
        }
        let is_utm = matches!(crs.epsg, 25801..=25860 | 26901..=26960 | 32601..=32660 | 32701..=32760);
        if let Some(zone) = arc.utm_zone.filter(|zone| is_utm && crs.epsg % 100 != *zone) {
            return Some(format!(
                "{file} states UTM zone {zone}, which is not that of {}: correct one of them",
                of_crs()
            ));
        }
        (arc.shifts != [0.0; 2]).then(|| {
            format!(
                "{file} states Xshift and Yshift {:?}, which are not taken off: do so in the header of the grid, and set them to 0",
                arc.shifts
            )
        })
    }

    /// The horizontal system; `wanted` is the key's.
    pub fn crs(&self, path: &Path, geo: &GeoTags, wanted: Option<u16>) -> Result<Crs, TerrainFileError> {
        let wanted_horizontal = wanted.map(|code| compound(code).map_or(code, |[horizontal, _]| horizontal));
        let epsg = match (self.horizontal, wanted_horizontal) {
            (Some(stated), Some(wanted)) if stated != wanted && Crs::new(stated).is_some() => {
                return Err(TerrainFileError::CrsConflict { path: path.into(), stated, wanted });
            }
            (_, Some(wanted)) => wanted,
            (Some(stated), None) => stated,
            (None, None) => {
                return Err(match &self.own {
                    Some(name) => TerrainFileError::OwnCrs {
                        path: path.into(),
                        name: if name.is_empty() { "no name".into() } else { name.clone() },
                    },
                    None => TerrainFileError::NoCrs { path: path.into() },
                });
            }
        };
        let crs =
            Crs::new(epsg).ok_or_else(|| TerrainFileError::UnsupportedCrs { path: path.into(), epsg })?;
        if let Some(problem) = self.contradiction(&crs) {
            return Err(TerrainFileError::Meaning { path: path.into(), problem });
        }
        let unit = |what, code| TerrainFileError::Unit { path: path.into(), what, code };
        match crs.metres_per_unit() {
            // 9122: degrees, however a file may write them.
            None => match geo.keys.angular_unit {
                Some(code) if !matches!(code, 9102 | 9122) => return Err(unit("angular", code)),
                _ => {}
            },
            Some(metres) => {
                if let Some(code) = geo
                    .keys
                    .linear_unit
                    .filter(|code| unit_of_code(*code).is_none_or(|unit| (unit - metres).abs() > 1e-9))
                {
                    return Err(unit("horizontal", code));
                }
            }
        }
        Ok(crs)
    }
}

/// UTM by its zone and its geographic system, where no code is stated for both together.
fn utm_by_zone(projection: Option<u16>, geographic: Option<u16>, linear_unit: Option<u16>) -> Option<u16> {
    if linear_unit.is_some_and(|unit| unit != 9001) {
        return None;
    }
    let (zone, is_south) = match projection? {
        code @ 16001..=16060 => (code - 16000, false),
        code @ 16101..=16160 => (code - 16100, true),
        _ => return None,
    };
    match (geographic?, is_south) {
        (4326, false) => Some(32600 + zone),
        (4326, true) => Some(32700 + zone),
        (4258, false) => Some(25800 + zone),
        (4269, false) => Some(26900 + zone),
        _ => None,
    }
}

/// Metres in a unit by its EPSG code.
pub(super) fn unit_of_code(code: u16) -> Option<f64> {
    Some(match code {
        9001 => 1.0,
        9002 => 0.3048,
        9003 => 1200.0 / 3937.0,
        9036 => 1000.0,
        1025 => 0.001,
        1033 => 0.01,
        _ => return None,
    })
}

/// Metres in a unit by its name.
pub(crate) fn unit_of_name(name: &str) -> Option<f64> {
    let name = name.trim().to_lowercase().replace(['_', '-'], " ").replace(['.', '[', ']', '(', ')'], "");
    Some(match name.as_str() {
        "m" | "metre" | "metres" | "meter" | "meters" => 1.0,
        "ft" | "foot" | "feet" | "international foot" | "international feet" | "foot international"
        | "ft intl" => 0.3048,
        "us survey foot" | "us survey feet" | "survey foot" | "survey feet" | "us foot" | "us feet"
        | "us ft" | "usft" | "ftus" | "ft us" | "foot us" | "sft" => 1200.0 / 3937.0,
        "cm" | "centimetre" | "centimetres" | "centimeter" | "centimeters" => 0.01,
        "dm" | "decimetre" | "decimetres" | "decimeter" | "decimeters" => 0.1,
        "mm" | "millimetre" | "millimetres" | "millimeter" | "millimeters" => 0.001,
        "km" | "kilometre" | "kilometres" | "kilometer" | "kilometers" => 1000.0,
        _ => return None,
    })
}

/// What a vertical system counts from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Datum {
    Ellipsoid,
    /// Mean sea level, by whichever measure of it.
    SeaLevel,
}

/// Codes of old files: vertical systems that were their datums' numbers, GeoTIFF 1.0.
fn old_datum(code: u16) -> Option<(Datum, &'static str)> {
    Some(match code {
        5001..=5033 => (Datum::Ellipsoid, "an ellipsoid"),
        5101 => (Datum::SeaLevel, "Newlyn"),
        5102 => (Datum::SeaLevel, "NGVD29"),
        5103 => (Datum::SeaLevel, "NAVD88"),
        5104 => (Datum::SeaLevel, "Yellow Sea"),
        5105 => (Datum::SeaLevel, "Baltic Sea"),
        5106 => (Datum::SeaLevel, "Caspian Sea"),
        _ => return None,
    })
}

/// What a vertical code or text says: its datum and name, and metres in its unit.
#[derive(Debug)]
pub(super) struct Vertical {
    pub code: Option<u16>,
    pub datum: Option<Datum>,
    pub name: String,
    pub metres_per_unit: Option<f64>,
}

impl Vertical {
    pub fn of(code: u16, citation: &str) -> Self {
        if let Some(crs) = VerticalCrs::new(code) {
            return Self {
                code: Some(code),
                datum: Some(Datum::SeaLevel),
                name: crs.name.into(),
                metres_per_unit: Some(crs.metres_per_unit),
            };
        }
        match old_datum(code) {
            Some((datum, name)) => {
                Self { code: Some(code), datum: Some(datum), name: name.into(), metres_per_unit: None }
            }
            None => Self {
                code: Some(code),
                datum: None,
                name: if citation.is_empty() { "no name".into() } else { citation.into() },
                metres_per_unit: None,
            },
        }
    }

    /// Of a text in a file: by its code and by its own words, where these are two things.
    fn of_text(text: &wkt::VerticalText, file: &str) -> Vec<Self> {
        let datum = text
            .is_ellipsoid
            .map(|is_ellipsoid| if is_ellipsoid { Datum::Ellipsoid } else { Datum::SeaLevel });
        let by_words = Self {
            code: text.code,
            datum,
            name: format!("{} in {file}", text.name),
            metres_per_unit: text.metres_per_unit,
        };
        let Some(known) = text.code.filter(|code| VerticalCrs::new(*code).is_some()) else {
            return vec![by_words];
        };
        let mut by_code = Self::of(known, "");
        by_code.name = format!("{} in {file}", by_code.name);
        let is_same = match (by_code.metres_per_unit, text.metres_per_unit) {
            (Some(a), Some(b)) => (a - b).abs() < SAME_UNIT_M,
            _ => true,
        };
        if is_same { vec![by_code] } else { vec![by_code, Self { code: None, ..by_words }] }
    }

    /// Code and name.
    pub fn label(&self) -> String {
        self.code.map_or_else(|| self.name.clone(), |code| format!("EPSG:{code}, {}", self.name))
    }

    /// Where it and `scene.terrain.height` do not agree. `converts`: whether heights go through the geoid.
    pub fn note(&self, height: HeightReference, converts: bool) -> Option<String> {
        let label = self.label();
        match (self.datum, height) {
            (Some(Datum::SeaLevel), HeightReference::Ellipsoid) => Some(format!(
                "states heights above sea level ({label}), but scene.terrain.height is \"ellipsoid\": set scene.terrain.height = \"msl\" \
                 (the geoid is up to 100 m away from the ellipsoid), and flight.height as the log has it"
            )),
            (Some(Datum::Ellipsoid), HeightReference::Msl) => Some(format!(
                "states heights above the ellipsoid ({label}), but scene.terrain.height is \"msl\": set it to \"ellipsoid\""
            )),
            (Some(Datum::SeaLevel), HeightReference::Msl) if converts && self.code != Some(5773) => {
                Some(format!(
                    "its heights are of {label}; EGM96, which they are converted with, may be a metre or so from it"
                ))
            }
            (None, _) => Some(format!(
                "states a vertical system that is not known ({label}); its heights are taken as scene.terrain.height says"
            )),
            _ => None,
        }
    }
}
