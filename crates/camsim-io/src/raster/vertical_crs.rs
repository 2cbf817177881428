//! Vertical coordinate systems that a file states, by code or by text.

use camsim_core::scenario::HeightReference;

use super::{crs::VerticalCrs, units::SAME_UNIT_M, wkt};

/// Origin of a vertical system's heights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum VerticalDatum {
    Ellipsoid,
    /// Mean sea level, by any gauge or geoid.
    SeaLevel,
}

/// Vertical codes of GeoTIFF 1.0, which were datum codes.
fn geotiff_1_0_datum(code: u16) -> Option<(VerticalDatum, &'static str)> {
    Some(match code {
        5001..=5033 => (VerticalDatum::Ellipsoid, "an ellipsoid"),
        5101 => (VerticalDatum::SeaLevel, "Newlyn"),
        5102 => (VerticalDatum::SeaLevel, "NGVD29"),
        5103 => (VerticalDatum::SeaLevel, "NAVD88"),
        5104 => (VerticalDatum::SeaLevel, "Yellow Sea"),
        5105 => (VerticalDatum::SeaLevel, "Baltic Sea"),
        5106 => (VerticalDatum::SeaLevel, "Caspian Sea"),
        _ => return None,
    })
}

/// A vertical system that a file states.
#[derive(Debug)]
pub(super) struct StatedVerticalCrs {
    /// EPSG code, if stated.
    pub code: Option<u16>,
    /// `None` if unknown.
    pub datum: Option<VerticalDatum>,
    pub name: String,
    /// Metres per unit, negative for depths; `None` if not stated.
    pub metres_per_unit: Option<f64>,
}

impl StatedVerticalCrs {
    /// By code; `citation` is the name of a code that is not known.
    pub fn from_code(code: u16, citation: &str) -> Self {
        if let Some(crs) = VerticalCrs::new(code) {
            return Self {
                code: Some(code),
                datum: Some(VerticalDatum::SeaLevel),
                name: crs.name.into(),
                metres_per_unit: Some(crs.metres_per_unit),
            };
        }
        match geotiff_1_0_datum(code) {
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

    /// By well-known text in a file. Two systems if the code and the text have different units.
    pub fn from_wkt(text: &wkt::VerticalText, file: &str) -> Vec<Self> {
        let datum = text.is_ellipsoid.map(|is_ellipsoid| {
            if is_ellipsoid { VerticalDatum::Ellipsoid } else { VerticalDatum::SeaLevel }
        });
        let by_text = Self {
            code: text.code,
            datum,
            name: format!("{} in {file}", text.name),
            metres_per_unit: text.metres_per_unit,
        };
        let Some(known) = text.code.filter(|code| VerticalCrs::new(*code).is_some()) else {
            return vec![by_text];
        };
        let mut by_code = Self::from_code(known, "");
        by_code.name = format!("{} in {file}", by_code.name);
        let is_same = match (by_code.metres_per_unit, text.metres_per_unit) {
            (Some(a), Some(b)) => (a - b).abs() < SAME_UNIT_M,
            _ => true,
        };
        if is_same { vec![by_code] } else { vec![by_code, Self { code: None, ..by_text }] }
    }

    /// Code and name for messages.
    pub fn label(&self) -> String {
        self.code.map_or_else(|| self.name.clone(), |code| format!("EPSG:{code}, {}", self.name))
    }

    /// A note if it contradicts `scene.terrain.height` or is unknown. `uses_geoid` is whether heights are
    /// converted by the geoid.
    pub fn note(&self, height: HeightReference, uses_geoid: bool) -> Option<String> {
        let label = self.label();
        match (self.datum, height) {
            (Some(VerticalDatum::SeaLevel), HeightReference::Ellipsoid) => Some(format!(
                "states heights above sea level ({label}), but scene.terrain.height is \"ellipsoid\": set \
                 scene.terrain.height = \"msl\" (geoid and ellipsoid differ by up to 100 m), and \
                 flight.height as the log has it"
            )),
            (Some(VerticalDatum::Ellipsoid), HeightReference::Msl) => Some(format!(
                "states heights above the ellipsoid ({label}), but scene.terrain.height is \"msl\": set it \
                 to \"ellipsoid\""
            )),
            (Some(VerticalDatum::SeaLevel), HeightReference::Msl)
                if uses_geoid && self.code != Some(5773) =>
            {
                Some(format!(
                    "its heights refer to {label}; they are converted with EGM96, which may differ from it \
                     by about a metre"
                ))
            }
            (None, _) => Some(format!(
                "states an unknown vertical system ({label}); its heights are read as scene.terrain.height \
                 says"
            )),
            _ => None,
        }
    }
}
