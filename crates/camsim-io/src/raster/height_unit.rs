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
use crate::text::wording::range;

/// A unit in metres, with what states it.
type Stated = (String, f64);

/// Metres per unit of the heights. Where the file states several units or may have one of two, the key
/// decides.
pub(super) fn unit_m(
    path: &Path,
    spec: &TerrainSpec,
    geo: &GeoTags,
    verticals: &[&StatedVerticalCrs],
    by_name: &[(String, String)],
    crs: &Crs,
    notes: &mut Vec<String>,
) -> Result<f64, TerrainFileError> {
    let key_unit_m = spec.height_unit.map(HeightUnit::metres);
    let mut stated = by_tags(path, key_unit_m, geo, verticals, by_name)?;
    let has_tags = !stated.is_empty();
    stated.extend(
        descriptions::units(geo).filter_map(|(name, value)| {
            Some((format!("item {name} `{value}`"), metres_per_unit_name(value)?))
        }),
    );
    // Citations are names for people: they count where nothing else states a unit.
    let (citation, advice) = match (&stated[..], key_unit_m) {
        ([], None) => (citations::height_unit(&geo.keys), "set scene.terrain.height_unit = \"m\""),
        ([first, ..], None) if !has_tags => {
            (Some(first.clone()), "remove it and set scene.terrain.height_unit")
        }
        _ => (None, ""),
    };
    if let Some((text, unit)) = citation.as_ref().filter(|(_, unit)| *unit != 1.0) {
        notes.push(format!(
            "its heights are read in units of {unit} m, from its {text}: if that is not the unit of heights, \
                {advice}"
        ));
    }
    if stated.is_empty() {
        stated.extend(citation);
    }
    agreed(key_unit_m, &stated, crs)
        .map_err(|problem| TerrainFileError::Meaning { path: path.into(), problem })
}

/// The units that the tags of the file, its sidecar files and its vertical reference systems state.
///
/// # Errors
/// A unit is not known, and there is no key; or a system has depths.
fn by_tags(
    path: &Path,
    key_unit_m: Option<f64>,
    geo: &GeoTags,
    verticals: &[&StatedVerticalCrs],
    by_name: &[(String, String)],
) -> Result<Vec<Stated>, TerrainFileError> {
    let meaning = |problem: String| TerrainFileError::Meaning { path: path.into(), problem };
    // The key stands for a unit that is not known.
    let known = |unit: Option<f64>, error: &dyn Fn() -> TerrainFileError| match unit {
        None if key_unit_m.is_none() => Err(error()),
        unit => Ok(unit),
    };
    let mut stated: Vec<Stated> = Vec::new();
    if let Some(name) = geo.bands.first().and_then(|band| band.unit.as_ref()) {
        let unknown = || {
            meaning(format!(
                "states `{name}` as the unit of its heights, which is unknown: set scene.terrain.height_unit \
                    = {HEIGHT_UNITS}"
            ))
        };
        let unit = known(metres_per_unit_name(name), &unknown)?;
        stated.extend(unit.map(|unit| (format!("unit `{name}`"), unit)));
    }
    for (name, from) in by_name {
        let unknown = || {
            meaning(format!(
                "{from} is `{name}`, which is an unknown unit: set scene.terrain.height_unit = {HEIGHT_UNITS}"
            ))
        };
        let unit = known(metres_per_unit_name(name), &unknown)?;
        // ARC/INFO has one name for both feet.
        let other = unit.filter(|unit| !key_unit_m.is_some_and(|key| (key - unit).abs() < 1e-6));
        stated.extend(other.map(|unit| (format!("{from} {name}"), unit)));
    }
    for vertical in verticals {
        let Some(unit) = vertical.metres_per_unit else { continue };
        if unit < 0.0 {
            return Err(meaning(format!(
                "states depths ({}), positive downwards: negate them with `gdal_calc.py -A IN --calc=-A \
                 --outfile OUT`",
                vertical.label()
            )));
        }
        let name = &vertical.name;
        stated
            .push((vertical.code.map_or_else(|| name.clone(), |code| format!("EPSG:{code} ({name})")), unit));
    }
    if let Some(code) = geo.keys.vertical_unit {
        let unknown = || TerrainFileError::Unit { path: path.into(), kind: "vertical", code };
        let unit = known(metres_per_unit_code(code), &unknown)?;
        stated.extend(unit.map(|unit| (format!("VerticalUnits {code}"), unit)));
    }
    Ok(stated)
}

/// The unit of the key, which must be one of those that are stated; without a key these must agree.
fn agreed(key_unit_m: Option<f64>, stated: &[Stated], crs: &Crs) -> Result<f64, String> {
    let is_same = |a: f64, b: f64| (a - b).abs() < SAME_UNIT_M;
    let listed =
        || stated.iter().map(|(text, unit)| format!("{text} of {unit} m")).collect::<Vec<_>>().join(" and ");
    match (key_unit_m, stated.first()) {
        (Some(unit), Some(_)) if !stated.iter().any(|(_, stated)| is_same(*stated, unit)) => Err(format!(
            "states {}, but scene.terrain.height_unit has {unit} m: remove the key, or correct the file",
            listed()
        )),
        (Some(unit), _) => Ok(unit),
        (None, Some(_)) if stated.windows(2).any(|pair| !is_same(pair[0].1, pair[1].1)) => {
            Err(format!("states {}: set scene.terrain.height_unit = {HEIGHT_UNITS}", listed()))
        }
        (None, Some((_, unit))) => Ok(*unit),
        // Files with coordinates in feet may have heights in feet or metres.
        (None, None) if crs.metres_per_unit().is_some_and(|unit| !is_same(unit, 1.0)) => Err(format!(
            "EPSG:{} ({}) has coordinates in feet, and the unit of the heights is not stated: set \
             scene.terrain.height_unit = \"m\", \"ft\" or \"us-ft\"",
            crs.epsg, crs.name
        )),
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
