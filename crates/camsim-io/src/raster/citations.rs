//! What the citations of a GeoTIFF, names for people, say about heights and units.

use super::{
    crs::Crs,
    geo_tags::GeoKeys,
    units::metres_per_unit_name,
    vertical_crs::{StatedVerticalCrs, VerticalDatum},
    wkt,
};

/// Words that only the name of a vertical system has, besides those of systems above the sea.
const VERTICAL_WORDS: [&str; 11] = [
    "height",
    "heights",
    "hgt",
    "elevation",
    "elevations",
    "elev",
    "ellipsoidal",
    "vertical",
    "vcs",
    "depth",
    "depths",
];

/// Words of vertical systems above the sea.
const SEA_LEVEL_WORDS: [&str; 19] = [
    "msl",
    "navd88",
    "navd",
    "ngvd29",
    "ngvd",
    "cgvd2013",
    "cgvd28",
    "egm96",
    "egm2008",
    "egm08",
    "egm84",
    "evrf2000",
    "evrf2007",
    "orthometric",
    "geoid",
    "dhhn2016",
    "ahd",
    "odn",
    "sea",
];

/// A citation: the name of its key, and the text of one of its parts.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Part<'a> {
    key: &'static str,
    pub text: &'a str,
    is_vertical: bool,
}

impl Part<'_> {
    /// Metres per unit that it names; `None` without a unit.
    pub fn unit_m(&self) -> Option<f64> {
        unit_m(self.text)
    }

    /// Key and text for messages.
    pub fn label(&self) -> String {
        format!("{} `{}`", self.key, excerpt(self.text))
    }
}

/// The beginning of a text for a message, in one line.
pub(super) fn excerpt(text: &str) -> String {
    let words: Vec<&str> = text.trim_matches(['\0', ' ']).split_whitespace().collect();
    words.join(" ").chars().take(80).collect()
}

/// Parts of the citations in `GTCitation`, `GeogCitation`, `PCSCitation` and `VerticalCitation`. The name of a
/// compound system has its vertical part after a plus.
fn parts(keys: &GeoKeys) -> impl Iterator<Item = Part<'_>> {
    let horizontal = keys.citations.iter().flat_map(|(key, text)| {
        let pieces = text.split(['|', ';', '\n']).filter(|piece| !piece.contains('['));
        pieces.flat_map(move |piece| {
            let pieces = piece.split(" + ").enumerate();
            pieces.map(move |(index, text)| {
                let is_vertical =
                    index > 0 || has_word(text, &VERTICAL_WORDS) || has_word(text, &SEA_LEVEL_WORDS);
                Part { key, text: text.trim(), is_vertical }
            })
        })
    });
    let vertical =
        Some(keys.vertical_citation.as_str()).filter(|text| !text.is_empty() && !text.contains('['));
    vertical
        .map(|text| Part { key: "VerticalCitation", text, is_vertical: true })
        .into_iter()
        .chain(horizontal)
}

/// Parts about heights.
pub(super) fn vertical_parts(keys: &GeoKeys) -> impl Iterator<Item = Part<'_>> {
    parts(keys).filter(|part| part.is_vertical)
}

/// The unit of heights that the citations name, with its text; `None` where none does, or two differ.
pub(super) fn height_unit(keys: &GeoKeys) -> Option<(String, f64)> {
    let mut stated = vertical_parts(keys).filter_map(|part| Some((part.label(), part.unit_m()?)));
    let first = stated.next()?;
    stated.all(|(_, unit)| (unit - first.1).abs() < 1e-6).then_some(first)
}

/// The vertical system that the citations name, if its datum is known.
pub(super) fn vertical_system(keys: &GeoKeys) -> Option<StatedVerticalCrs> {
    vertical_parts(keys).find_map(|part| {
        let datum = if words(part.text).iter().any(|word| word.starts_with("ellipsoid")) {
            VerticalDatum::Ellipsoid
        } else if has_word(part.text, &SEA_LEVEL_WORDS) {
            VerticalDatum::SeaLevel
        } else {
            return None;
        };
        let name = format!("{} in its {}", excerpt(part.text), part.key);
        Some(StatedVerticalCrs { code: None, datum: Some(datum), name, metres_per_unit: None })
    })
}

/// Vertical systems as well-known text within a citation, as ESRI writes them.
pub(super) fn vertical_texts(keys: &GeoKeys) -> Vec<StatedVerticalCrs> {
    let all = keys.citations.iter().map(|(key, text)| (*key, text.as_str()));
    let texts = all.chain([("VerticalCitation", keys.vertical_citation.as_str())]);
    let systems = texts.filter_map(|(key, text)| {
        let starts = ["COMPD_CS[", "PROJCS[", "GEOGCS[", "VERT_CS[", "VERTCS["];
        let start = starts.iter().filter_map(|word| text.find(word)).min()?;
        Some(StatedVerticalCrs::from_wkt(&wkt::vertical(&text[start..])?, key))
    });
    systems.flatten().collect()
}

/// A note about a citation that names another unit of coordinates than the coordinate system has.
pub(super) fn horizontal_note(keys: &GeoKeys, crs: &Crs) -> Option<String> {
    let own = crs.metres_per_unit().unwrap_or(1.0);
    parts(keys).filter(|part| !part.is_vertical).find_map(|part| {
        let stated = part.unit_m().filter(|stated| (stated - own).abs() > 1e-6)?;
        let unit = if crs.metres_per_unit().is_some() { format!("units of {own} m") } else { "degrees".to_owned() };
        Some(format!(
            "its {} names units of {stated} m, but EPSG:{} ({}) has coordinates in {unit}, which are used: correct one \
             of them",
            part.label(),
            crs.epsg,
            crs.name
        ))
    })
}

/// Metres per unit of a unit within a text: one in brackets, or feet by any of their names.
fn unit_m(text: &str) -> Option<f64> {
    let in_brackets = text.split('(').skip(1).filter_map(|rest| rest.split(')').next());
    if let Some(unit) = in_brackets.filter_map(metres_per_unit_name).last() {
        return Some(unit);
    }
    if has_word(text, &["feet", "foot", "ft", "usft", "ftus", "sft"]) {
        let is_us = has_word(text, &["us", "survey", "usft", "ftus", "sft"]);
        return metres_per_unit_name(if is_us { "us-ft" } else { "ft" });
    }
    words(text).iter().filter(|word| word.len() > 2).find_map(|word| metres_per_unit_name(word))
}

fn has_word(text: &str, of: &[&str]) -> bool {
    words(text).iter().any(|word| of.contains(&&**word))
}

fn words(text: &str) -> Vec<String> {
    text.to_lowercase().split(|c: char| !c.is_alphanumeric()).map(str::to_owned).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const US_FOOT_M: f64 = 1200.0 / 3937.0;

    fn keys(gt: &str, vertical: &str) -> GeoKeys {
        let citations = vec![("GTCitation", gt.to_owned())];
        GeoKeys { citations, vertical_citation: vertical.to_owned(), ..GeoKeys::default() }
    }

    #[test]
    fn units_of_heights_are_read_from_the_vertical_part() {
        let unit = |gt: &str, vertical: &str| height_unit(&keys(gt, vertical)).map(|(_, unit)| unit);
        for (gt, vertical, expected) in [
            ("WGS 84 / UTM zone 32N + NAVD88 height - Geoid18 (ftUS)", "", Some(US_FOOT_M)),
            ("NAD83 / UTM zone 10N + NAVD88 height (ft)", "", Some(0.3048)),
            ("NAD83 / California zone 5 (ftUS) + NAVD88 height", "", None),
            ("NAD83 / California zone 5 (ftUS) + NAVD88 height (m)", "", Some(1.0)),
            ("NAD83 / California zone 5 (ftUS)", "", None),
            ("PCS Name = NAD83 UTM 10N|VCS Name = NAVD88_height_(ftUS)|", "", Some(US_FOOT_M)),
            ("NAD83 / UTM zone 10N; elevations in US survey feet", "", Some(US_FOOT_M)),
            ("WGS 84 / UTM zone 32N", "NAVD88 height (ftUS)", Some(US_FOOT_M)),
            ("WGS 84 / UTM zone 32N", "NAVD88, feet", Some(0.3048)),
            ("WGS 84 / UTM zone 32N", "EGM96 height", None),
            // Two that differ state nothing.
            ("WGS 84 / UTM zone 32N + NAVD88 height (ft)", "NAVD88 height (m)", None),
        ] {
            let found = unit(gt, vertical);
            let is_same = match (found, expected) {
                (Some(found), Some(expected)) => (found - expected).abs() < 1e-12,
                (found, expected) => found == expected,
            };
            assert!(is_same, "{gt} {vertical}: {found:?}");
        }
    }

    #[test]
    fn datums_are_known_by_their_words() {
        let datum = |gt: &str| vertical_system(&keys(gt, "")).and_then(|system| system.datum);
        assert_eq!(datum("NAD83 / UTM zone 10N + NAVD88 height (ftUS)"), Some(VerticalDatum::SeaLevel));
        assert_eq!(datum("WGS 84 + Ellipsoidal height (metre)"), Some(VerticalDatum::Ellipsoid));
        assert_eq!(datum("WGS 84 / UTM zone 32N"), None);
        let esri = r#"ESRI PE String = PROJCS["a",UNIT["Meter",1.0]],VERTCS["NAVD88_ft",VDATUM["n"],UNIT["Foot_US",0.3048006]]"#;
        let [system] = &vertical_texts(&keys(esri, ""))[..] else { panic!("{esri}") };
        assert!(system.metres_per_unit.is_some_and(|unit| (unit - US_FOOT_M).abs() < 1e-7), "{system:?}");
    }

    #[test]
    fn another_unit_of_coordinates_is_noted() {
        let note = |gt: &str, epsg: u16| Crs::new(epsg).and_then(|crs| horizontal_note(&keys(gt, ""), &crs));
        assert!(note("NAD83 / UTM zone 10N (ftUS)", 26910).is_some_and(|note| note.contains("0.3048")));
        assert_eq!(note("NAD83 / California zone 5 (ftUS)", 2229), None);
        assert_eq!(note("WGS 84 / UTM zone 32N + NAVD88 height (ftUS)", 32632), None);
        assert_eq!(note("NAD83(2011) / UTM zone 10N", 26910), None);
        assert_eq!(note("WGS 84", 4326), None);
    }
}
