//! Free-text metadata about heights, outside of the tags with a defined meaning: units, scales, depths.

use super::{
    citations::{excerpt, vertical_parts},
    geo_tags::GeoTags,
    units::metres_per_unit_name,
};

/// Names of items that state the unit of heights, without separators.
const UNIT_KEYS: [&str; 9] = [
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

/// netCDF variables that are coordinates, not heights.
const COORDINATES: [&str; 10] =
    ["x", "y", "lat", "lon", "latitude", "longitude", "time", "t", "easting", "northing"];

/// Key of an item in lower case without separators: `units` for `Band1#units`; `None` for items of
/// coordinates.
fn normalized_key(name: &str) -> Option<String> {
    let lower = name.to_lowercase();
    let (variable, key) = lower.split_once('#').unwrap_or(("", &lower));
    (!COORDINATES.contains(&variable)).then(|| key.replace(['_', ' ', '-'], ""))
}

/// Items that state a unit: name and value.
pub(super) fn units(geo: &GeoTags) -> impl Iterator<Item = (&str, &str)> {
    let is_unit = |name: &str| normalized_key(name).is_some_and(|key| UNIT_KEYS.contains(&key.as_str()));
    geo.items
        .iter()
        .filter(move |(name, value)| is_unit(name) && !value.is_empty())
        .map(|(name, value)| (name.as_str(), value.as_str()))
}

/// Notes about metadata that are not applied. `unit_m` is the applied unit, metres; `scale_and_offset` are
/// the band's; `has_unit_key` is whether scene.terrain.height_unit is set.
pub(super) fn notes(
    geo: &GeoTags,
    unit_m: f64,
    scale_and_offset: [f64; 2],
    has_unit_key: bool,
) -> Vec<String> {
    let mut notes = Vec::new();
    let number = |key: &str| {
        let item = geo.items.iter().find(|(name, _)| normalized_key(name).is_some_and(|name| name == key));
        item.and_then(|(_, value)| value.parse::<f64>().ok())
    };
    let (scale, offset) = (number("scalefactor"), number("addoffset"));
    let items = [scale.unwrap_or(1.0), offset.unwrap_or(0.0)];
    if (scale.is_some() || offset.is_some()) && items != [1.0, 0.0] && items != scale_and_offset {
        notes.push(format!(
            "the items scale_factor {} and add_offset {} are not applied, because they may have been applied \
             already: if not, run `gdal_translate -a_scale {} -a_offset {} IN OUT`",
            items[0], items[1], items[0], items[1]
        ));
    }
    for (name, value) in units(geo).filter(|(_, value)| metres_per_unit_name(value).is_none()) {
        notes.push(format!(
            "the item {name} is `{value}`, which is not a known unit of heights, and is ignored"
        ));
    }
    let item_texts = geo.items.iter().filter(|(name, _)| {
        normalized_key(name)
            .is_some_and(|key| matches!(key.as_str(), "longname" | "standardname" | "description"))
    });
    let texts = geo.descriptions.iter().chain(item_texts.map(|(_, value)| value)).map(String::as_str);
    for text in texts.chain(vertical_parts(&geo.keys).map(|part| part.text)) {
        let excerpt = excerpt(text);
        if !has_unit_key && (unit_m - 1.0).abs() < 1e-9 && mentions_feet(text) {
            notes.push(format!(
                "is described as `{excerpt}`, but its heights are read as metres: if they are in feet, set \
                 scene.terrain.height_unit = \"ft\" or \"us-ft\""
            ));
        }
        if mentions_depths(text) {
            notes.push(depth_note(&format!("is described as `{excerpt}`")));
        }
    }
    if geo.items.iter().any(|(name, value)| {
        normalized_key(name).is_some_and(|key| key == "positive") && value.eq_ignore_ascii_case("down")
    }) {
        notes.push(depth_note("has an item positive = down"));
    }
    notes
}

fn depth_note(what: &str) -> String {
    format!(
        "{what}, but its values are read as heights, positive upwards: if they are depths, negate them with \
         `gdal_calc.py -A IN --calc=-A --outfile OUT`"
    )
}

fn words(text: &str) -> Vec<String> {
    text.to_lowercase().split(|c: char| !c.is_alphanumeric()).map(str::to_owned).collect()
}

fn mentions_feet(text: &str) -> bool {
    words(text).iter().any(|word| matches!(word.as_str(), "feet" | "foot" | "ft" | "usft" | "ftus" | "sft"))
}

fn mentions_depths(text: &str) -> bool {
    let words = words(text);
    words.iter().any(|word| matches!(word.as_str(), "depth" | "depths"))
        || words.windows(2).any(|pair| pair[0] == "positive" && pair[1] == "down")
}
