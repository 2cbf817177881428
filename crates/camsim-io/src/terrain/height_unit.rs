//! The unit of a DEM's heights: stated by tags, sidecar files, citations or scene.terrain.height_unit.

use std::path::Path;

use camsim_core::scenario::{HeightUnit, TerrainSpec};

use super::{
    TerrainFileError, citations,
    crs::Crs,
    descriptions,
    geo_tags::GeoTags,
    units::{HEIGHT_UNITS, SAME_UNIT_M, metres_per_unit_code, metres_per_unit_name},
    vertical_crs::StatedVerticalCrs,
};
use crate::wording::range;

/// Metres per unit of the heights. Where the file states several units or may have one of two, the key
/// decides.
// Long because: one list of stated units is filled from six sources and then compared.
pub(super) fn unit_m(
    path: &Path,
    spec: &TerrainSpec,
    geo: &GeoTags,
    verticals: &[&StatedVerticalCrs],
    by_name: &[(String, String)],
    crs: &Crs,
    notes: &mut Vec<String>,
) -> Result<f64, TerrainFileError> {
    let meaning = |problem: String| TerrainFileError::Meaning { path: path.into(), problem };
    let key_unit_m = spec.height_unit.map(HeightUnit::metres);
    let mut stated: Vec<(String, f64)> = Vec::new();
    if let Some(name) = geo.bands.first().and_then(|band| band.unit.as_ref()) {
        match metres_per_unit_name(name) {
            Some(unit) => stated.push((format!("unit `{name}`"), unit)),
            None if key_unit_m.is_none() => {
                return Err(meaning(format!(
                    "states `{name}` as the unit of its heights, which is unknown: set \
                     scene.terrain.height_unit = {HEIGHT_UNITS}"
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
                    "{from} is `{name}`, which is an unknown unit: set scene.terrain.height_unit = {HEIGHT_UNITS}"
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
                return Err(TerrainFileError::Unit { path: path.into(), kind: "vertical", code });
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
    // Citations are names for people: they count where nothing else states a unit.
    if stated.is_empty()
        && key_unit_m.is_none()
        && let Some((text, unit)) = citations::height_unit(&geo.keys)
    {
        if unit != 1.0 {
            notes.push(format!(
                "its heights are read in units of {unit} m, from its {text}: if that is not the unit of heights, \
                 set scene.terrain.height_unit = \"m\""
            ));
        }
        stated.push((text, unit));
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
        (None, Some(_)) if !agree => {
            Err(meaning(format!("states {}: set scene.terrain.height_unit = {HEIGHT_UNITS}", listed())))
        }
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

/// Units that values may have instead, with the heights that they make: for values of 40000 to 46000
/// `"cm" makes 400 to 460 m`. `usual_m` is the range of common heights.
pub(super) fn other_units([low, high]: [f64; 2], usual_m: [f64; 2]) -> String {
    let candidates =
        [("dm", HeightUnit::Dm), ("cm", HeightUnit::Cm), ("mm", HeightUnit::Mm), ("ft", HeightUnit::Ft)];
    let fitting = candidates.iter().filter_map(|(word, unit)| {
        let [low_m, high_m] = [low, high].map(|value| value * unit.metres());
        (low_m >= usual_m[0] && high_m <= usual_m[1])
            .then(|| format!("\"{word}\" makes {} m", range([low_m, high_m])))
    });
    let listed: Vec<String> = fitting.collect();
    if listed.is_empty() {
        format!("set scene.terrain.height_unit = {HEIGHT_UNITS}")
    } else {
        format!("set scene.terrain.height_unit: {}", listed.join(", "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_proposed_by_the_heights_that_they_make() {
        let text = other_units([40_000.0, 46_000.0], [-500.0, 9000.0]);
        assert_eq!(
            text,
            "set scene.terrain.height_unit: \"dm\" makes 4000 to 4600 m, \"cm\" makes 400 to 460 m, \"mm\" makes 40 to 46 m"
        );
        let text = other_units([4.0e5, 8.0e6], [-500.0, 9000.0]);
        assert_eq!(text, "set scene.terrain.height_unit: \"mm\" makes 400 to 8000 m");
        assert!(other_units([-1e6, 9e8], [-500.0, 9000.0]).ends_with("or \"mm\""));
    }
}
