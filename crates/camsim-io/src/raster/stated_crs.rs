//! Coordinate systems that a file states, horizontal and vertical.

use std::path::Path;

use super::{
    TerrainFileError,
    arc_prj::ArcPrj,
    crs::{Crs, compound},
    geo_tags::{GeoTags, USER_DEFINED},
    units::{SAME_UNIT_M, metres_per_unit_code, metres_per_unit_name},
    vertical_crs::StatedVerticalCrs,
    wkt,
};

/// Coordinate systems that a raster and its sidecar files state.
#[derive(Debug, Default)]
pub(super) struct StatedCrs {
    /// EPSG code of the horizontal system.
    pub horizontal: Option<u16>,
    /// Name of a user-defined system without a code.
    pub user_defined: Option<String>,
    /// EPSG code of the vertical system.
    pub vertical: Option<u16>,
    /// Note about a sidecar file that states another horizontal system than the raster itself.
    pub conflict_note: Option<String>,
    /// Vertical systems in sidecar files.
    pub sidecar_verticals: Vec<StatedVerticalCrs>,
    /// Units of heights: name and source.
    pub height_units: Vec<(String, String)>,
    /// Why the heights of a sidecar file cannot be applied.
    pub problem: Option<String>,
    /// File that gives the horizontal system, and metres per unit in it.
    sidecar_unit: Option<(String, f64)>,
    /// ARC/INFO file that gives the horizontal system, and its content.
    arc: Option<(String, ArcPrj)>,
}

/// A note about the first sidecar file that states another horizontal system than the raster's own.
fn conflict_note(geo: &GeoTags, own: u16) -> Option<String> {
    geo.texts.iter().find_map(|(from, text)| {
        let stated = wkt::codes(text).horizontal?;
        let stated = compound(stated).map_or(stated, |[horizontal, _]| horizontal);
        let file = from.file_name().unwrap_or_default().to_string_lossy();
        (stated != own).then(|| {
            format!(
                "{file} states EPSG:{stated} but the raster itself EPSG:{own}, which is used: correct one of \
                 them"
            )
        })
    })
}

impl StatedCrs {
    pub fn read(path: &Path, geo: &GeoTags) -> Result<Self, TerrainFileError> {
        let keys = &geo.keys;
        let meaning = |problem: String| TerrainFileError::Meaning { path: path.into(), problem };
        if keys.model_type == Some(3) {
            return Err(meaning(
                "is in geocentric coordinates: convert it with `gdalwarp -t_srs EPSG:CODE IN OUT`".into(),
            ));
        }
        let code = |key: Option<u16>| key.filter(|code| *code != USER_DEFINED);
        // A user-defined projection states its geographic base system too.
        let is_user_defined_projection = keys.projected == Some(USER_DEFINED)
            || (keys.projected.is_none()
                && (keys.model_type == Some(1) || keys.projection.is_some() || keys.method.is_some()));
        let mut stated = Self { vertical: keys.vertical, ..Self::default() };
        if is_user_defined_projection {
            stated.horizontal = utm_code(keys.projection, keys.geographic, keys.linear_unit);
            stated.user_defined = stated.horizontal.is_none().then(|| keys.citation.clone());
        } else if let Some(projected) = code(keys.projected) {
            stated.horizontal = Some(projected);
        } else if keys.geographic == Some(USER_DEFINED) {
            stated.user_defined = Some(keys.citation.clone());
        } else {
            stated.horizontal = keys.geographic;
        }
        if stated.horizontal.is_none()
            && stated.user_defined.is_none()
            && let Some((from, text)) = geo.texts.first()
        {
            let file = from.file_name().unwrap_or_default().to_string_lossy().into_owned();
            stated.arc = ArcPrj::parse(text).map(|arc| (file.clone(), arc));
            stated.sidecar_unit = wkt::horizontal_unit(text).map(|unit| (file.clone(), unit));
            stated.horizontal = wkt::codes(text).horizontal;
            let name = stated.arc.as_ref().map_or_else(|| wkt::name(text), |(_, arc)| &arc.name);
            let name = format!("{name} in {file}");
            stated.user_defined = stated.horizontal.is_none().then_some(name);
        }
        stated.read_vertical(geo);
        if let Some([horizontal, vertical]) = stated.horizontal.and_then(compound) {
            stated.horizontal = Some(horizontal);
            stated.vertical = stated.vertical.or(Some(vertical));
        }
        stated.conflict_note = stated.horizontal.and_then(|own| conflict_note(geo, own));
        Ok(stated)
    }

    /// Reads vertical systems and units of heights from sidecar files.
    fn read_vertical(&mut self, geo: &GeoTags) {
        for (from, text) in &geo.texts {
            let file = from.file_name().unwrap_or_default().to_string_lossy();
            if let Some(unit) = ArcPrj::parse(text).and_then(|arc| arc.height_unit) {
                self.height_units.push((unit, format!("Zunits in {file}")));
            }
            let Some(vertical) = wkt::vertical(text) else { continue };
            if vertical.shift != 0.0 {
                self.problem = Some(format!(
                    "{file} states a shift of its heights (Vertical_Shift {}), which is not applied: apply \
                     it with `gdal_calc.py`, and set it to 0 there",
                    vertical.shift
                ));
            }
            self.sidecar_verticals.extend(StatedVerticalCrs::from_wkt(&vertical, &file));
        }
    }

    /// How a sidecar file contradicts the coordinate system in use.
    fn contradiction(&self, crs: &Crs) -> Option<String> {
        let unit = crs.metres_per_unit();
        let crs_label = || format!("EPSG:{} ({})", crs.epsg, crs.name);
        if let Some((file, stated)) = &self.sidecar_unit
            && unit.is_none_or(|unit| (unit - stated).abs() > SAME_UNIT_M)
        {
            return Some(format!(
                "{file} states coordinates in units of {stated} m, which are not those of {}: correct one of \
                 them",
                crs_label()
            ));
        }
        let (file, arc) = self.arc.as_ref()?;
        if let Some(name) = &arc.unit {
            let is_same = match unit {
                // ARC/INFO has one name for both feet.
                Some(unit) => metres_per_unit_name(name).is_some_and(|stated| (stated - unit).abs() < 1e-6),
                None => matches!(name.to_lowercase().as_str(), "dd" | "degrees" | "decimal degrees"),
            };
            if !is_same {
                return Some(format!(
                    "{file} states `Units {name}`, which are not those of {}: correct one of them",
                    crs_label()
                ));
            }
        }
        let is_utm = matches!(crs.epsg, 25801..=25860 | 26901..=26960 | 32601..=32660 | 32701..=32760);
        if let Some(zone) = arc.utm_zone.filter(|zone| is_utm && crs.epsg % 100 != *zone) {
            return Some(format!(
                "{file} states UTM zone {zone}, which is not that of {}: correct one of them",
                crs_label()
            ));
        }
        (arc.shifts != [0.0; 2]).then(|| {
            format!(
                "{file} states Xshift and Yshift {:?}, which are not applied: subtract them in the header of \
                 the grid, and set them to 0",
                arc.shifts
            )
        })
    }

    /// The horizontal system to use; `epsg_key` is scene.terrain.epsg.
    pub fn crs(&self, path: &Path, geo: &GeoTags, epsg_key: Option<u16>) -> Result<Crs, TerrainFileError> {
        let key_horizontal = epsg_key.map(|code| compound(code).map_or(code, |[horizontal, _]| horizontal));
        let epsg = match (self.horizontal, key_horizontal) {
            (Some(stated), Some(key)) if stated != key && Crs::new(stated).is_some() => {
                return Err(TerrainFileError::CrsConflict { path: path.into(), stated, key });
            }
            (_, Some(key)) => key,
            (Some(stated), None) => stated,
            (None, None) => {
                return Err(match &self.user_defined {
                    Some(name) => TerrainFileError::UserDefinedCrs {
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
        let unit_error = |kind, code| TerrainFileError::Unit { path: path.into(), kind, code };
        match crs.metres_per_unit() {
            // 9122: degrees in any notation.
            None => match geo.keys.angular_unit {
                Some(code) if !matches!(code, 9102 | 9122) => return Err(unit_error("angular", code)),
                _ => {}
            },
            Some(metres) => {
                if let Some(code) = geo.keys.linear_unit.filter(|code| {
                    metres_per_unit_code(*code).is_none_or(|unit| (unit - metres).abs() > 1e-9)
                }) {
                    return Err(unit_error("horizontal", code));
                }
            }
        }
        Ok(crs)
    }
}

/// EPSG code of UTM by the codes of its zone and its geographic system.
fn utm_code(projection: Option<u16>, geographic: Option<u16>, linear_unit: Option<u16>) -> Option<u16> {
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
