//! What people and programs write of heights outside of the tags that have a meaning: units, scales, depths.

use super::{geo_tags::GeoTags, systems::unit_of_name};

/// Names of items that have the unit of heights.
const UNITS: [&str; 9] = [
    "units",
    "unit",
    "zunits",
    "zunit",
    "verticalunits",
    "verticalunit",
    "heightunits",
    "heightunit",
    "elevationunits",
];

/// Variables of netCDF that are no heights.
const COORDINATES: [&str; 10] =
    ["x", "y", "lat", "lon", "latitude", "longitude", "time", "t", "easting", "northing"];

/// `Band1#units` is of a variable; those of coordinates are none of these.
fn key(name: &str) -> Option<String> {
    let lower = name.to_lowercase();
    let (variable, key) = lower.split_once('#').unwrap_or(("", &lower));
    (!COORDINATES.contains(&variable)).then(|| key.replace(['_', ' ', '-'], ""))
}

/// Items that have a unit: name and value.
pub(super) fn units(geo: &GeoTags) -> impl Iterator<Item = (&str, &str)> {
    let is_unit = |name: &str| key(name).is_some_and(|key| UNITS.contains(&key.as_str()));
    geo.items
        .iter()
        .filter(move |(name, value)| is_unit(name) && !value.is_empty())
        .map(|(name, value)| (name.as_str(), value.as_str()))
}

/// Notes on what is not applied. `metres` are those of the unit that is, `scale` is the band's own;
/// `is_asked`: whether a key gave the unit.
pub(super) fn notes(geo: &GeoTags, metres: f64, scale: [f64; 2], is_asked: bool) -> Vec<String> {
    let mut notes = Vec::new();
    let number = |wanted: &str| {
        let found = geo.items.iter().find(|(name, _)| key(name).is_some_and(|key| key == wanted));
        found.and_then(|(_, value)| value.parse::<f64>().ok())
    };
    let (factor, more) = (number("scalefactor"), number("addoffset"));
    let named = [factor.unwrap_or(1.0), more.unwrap_or(0.0)];
    if (factor.is_some() || more.is_some()) && named != [1.0, 0.0] && named != scale {
        notes.push(format!(
            "the items scale_factor {} and add_offset {} are not applied, since they may have been already: if not, `gdal_translate -a_scale {} -a_offset {} IN OUT` makes them count",
            named[0], named[1], named[0], named[1]
        ));
    }
    for (name, value) in units(geo).filter(|(_, value)| unit_of_name(value).is_none()) {
        notes.push(format!(
            "the item {name} is `{value}`, which is no unit of heights that is known, and is not used"
        ));
    }
    let of_items = geo.items.iter().filter(|(name, _)| {
        key(name).is_some_and(|key| matches!(key.as_str(), "longname" | "standardname" | "description"))
    });
    let vertical = Some(&geo.keys.vertical_citation).filter(|text| !text.is_empty());
    for text in geo.descriptions.iter().chain(of_items.map(|(_, value)| value)).chain(vertical) {
        let shown: String = text.trim_end_matches('\0').trim().chars().take(80).collect();
        if !is_asked && (metres - 1.0).abs() < 1e-9 && speaks_of_feet(text) {
            notes.push(format!(
                "is described as `{shown}`, but its heights are taken in metres: if they are in feet, set scene.terrain.height_unit = \"ft\" or \"us-ft\""
            ));
        }
        if speaks_of_depths(text) {
            notes.push(depths(&format!("is described as `{shown}`")));
        }
    }
    if geo.items.iter().any(|(name, value)| {
        key(name).is_some_and(|key| key == "positive") && value.eq_ignore_ascii_case("down")
    }) {
        notes.push(depths("has an item positive = down"));
    }
    notes
}

fn depths(what: &str) -> String {
    format!(
        "{what}, but its numbers are taken as heights, upwards: if they count downwards, turn them over with `gdal_calc.py -A IN --calc=-A --outfile OUT`"
    )
}

fn words(text: &str) -> Vec<String> {
    text.to_lowercase().split(|c: char| !c.is_alphanumeric()).map(str::to_owned).collect()
}

fn speaks_of_feet(text: &str) -> bool {
    words(text).iter().any(|word| matches!(word.as_str(), "feet" | "foot" | "ft" | "usft" | "ftus" | "sft"))
}

fn speaks_of_depths(text: &str) -> bool {
    let words = words(text);
    words.iter().any(|word| matches!(word.as_str(), "depth" | "depths"))
        || words.windows(2).any(|pair| pair[0] == "positive" && pair[1] == "down")
}
