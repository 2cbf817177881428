//! Coordinate systems as well-known text (WKT 1, WKT 2 and ESRI's).
//!
//! They are identified by their EPSG code, or by name where there is none, as in ESRI's. Parameters are not
//! compared: systems with similar parameters can have different datums.

use super::crs::SYSTEMS;

/// EPSG codes of the horizontal and the vertical part.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Codes {
    pub horizontal: Option<u16>,
    pub vertical: Option<u16>,
}

/// A vertical system in well-known text.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct VerticalText {
    /// EPSG code, if stated.
    pub code: Option<u16>,
    pub name: String,
    /// Metres per unit, negative for depths; `None` if not stated.
    pub metres_per_unit: Option<f64>,
    /// Whether heights are ellipsoidal; `None` if not stated.
    pub is_ellipsoid: Option<bool>,
    /// ESRI's Vertical_Shift, in its unit.
    pub shift: f64,
}

/// ESRI's names of systems with other names in the EPSG registry, with spaces for underscores.
const ESRI_NAMES: &[(&str, u16)] = &[
    ("GCS WGS 1984", 4326),
    ("GCS ETRS 1989", 4258),
    ("GCS North American 1983", 4269),
    ("WGS 1984 Web Mercator Auxiliary Sphere", 3857),
    ("CH1903 LV03", 21781),
    ("CH1903+ LV95", 2056),
    ("RGF 1993 Lambert 93", 2154),
    ("British National Grid", 27700),
    ("ETRS 1989 LAEA", 3035),
    ("RD New", 28992),
    ("Belge Lambert 1972", 31370),
    ("NZGD 2000 New Zealand Transverse Mercator", 2193),
];

/// Codes of a text; `None` where they are not known.
pub(super) fn codes(text: &str) -> Codes {
    let text = text.trim().trim_start_matches('\u{feff}');
    let parts = children(text);
    let is_compound = ["COMPD_CS", "COMPOUNDCRS"].iter().any(|word| text.starts_with(word));
    if is_compound {
        let vertical = parts.iter().find(|part| {
            ["VERT_CS", "VERTCRS", "VERTICALCRS", "VERTCS"].iter().any(|word| part.starts_with(word))
        });
        let horizontal = parts.iter().find(|part| part.starts_with("PROJ") || part.starts_with("GEO"));
        return Codes {
            horizontal: horizontal.and_then(|part| code(part)),
            vertical: vertical.and_then(|part| stated_code(part)),
        };
    }
    Codes { horizontal: code(text), vertical: None }
}

/// The vertical system of a text: part of a compound system, or after the horizontal one as ESRI writes it.
pub(super) fn vertical(text: &str) -> Option<VerticalText> {
    let all = format!("ALL[{}]", text.trim().trim_start_matches('\u{feff}'));
    let definitions = children(&all).into_iter().flat_map(|part| {
        let parts = if ["COMPD_CS", "COMPOUNDCRS"].iter().any(|word| part.starts_with(word)) {
            children(part)
        } else {
            Vec::new()
        };
        std::iter::once(part).chain(parts)
    });
    let definition = definitions.into_iter().find(|part| {
        ["VERT_CS", "VERTCRS", "VERTICALCRS", "VERTCS"].iter().any(|word| part.starts_with(word))
    })?;
    let parts = children(definition);
    let part_named =
        |words: &[&str]| parts.iter().copied().find(|part| words.iter().any(|word| part.starts_with(word)));
    let parameter = |name: &str| {
        parts
            .iter()
            .find(|part| part.starts_with("PARAMETER") && self::name(part).eq_ignore_ascii_case(name))
            .and_then(|part| second_value(part))
    };
    let axis = part_named(&["AXIS"]);
    let is_down = parameter("Direction").is_some_and(|direction| direction < 0.0)
        || axis
            .is_some_and(|axis| children(axis).iter().skip(1).any(|word| word.eq_ignore_ascii_case("down")));
    let size = length_unit(definition).or_else(|| axis.and_then(length_unit)).filter(|size| *size > 0.0);
    let datum =
        part_named(&["VDATUM", "VERT_DATUM", "VERTDATUM", "VERTICALDATUM", "VRF", "ENSEMBLE", "DATUM"]);
    let is_ellipsoid = datum
        .filter(|datum| !matches!(name(datum).to_lowercase().as_str(), "unknown" | "unnamed" | "local"))
        .map(|datum| {
            datum.starts_with("DATUM")
                || datum.starts_with("VERT_DATUM") && second_value(datum) == Some(2002.0)
        });
    Some(VerticalText {
        code: stated_code(definition),
        name: name(definition).to_owned(),
        metres_per_unit: if is_down { Some(-size.unwrap_or(1.0)) } else { size },
        is_ellipsoid,
        shift: parameter("Vertical_Shift").unwrap_or(0.0),
    })
}

/// Metres per unit of a projected system; `None` if not stated.
pub(super) fn horizontal_unit(text: &str) -> Option<f64> {
    let text = text.trim().trim_start_matches('\u{feff}');
    let parts = children(text);
    let projected = if text.starts_with("PROJ") {
        Some(text)
    } else {
        parts.into_iter().find(|part| part.starts_with("PROJ") && part.contains('['))
    };
    projected.and_then(length_unit)
}

/// Metres per unit of a definition.
fn length_unit(text: &str) -> Option<f64> {
    children(text)
        .into_iter()
        .find(|part| part.starts_with("UNIT[") || part.starts_with("LENGTHUNIT["))
        .and_then(second_value)
}

/// The number after the name.
fn second_value(text: &str) -> Option<f64> {
    children(text).get(1)?.trim_matches('"').parse().ok()
}

/// Name of a definition: its first quoted text.
pub(super) fn name(text: &str) -> &str {
    text.split('"').nth(1).unwrap_or("no name")
}

/// EPSG code of a definition.
fn code(text: &str) -> Option<u16> {
    stated_code(text).or_else(|| code_by_name(name(text)))
}

/// `AUTHORITY["EPSG","N"]` or `ID["EPSG",N]` of the definition itself, not of its parts.
fn stated_code(text: &str) -> Option<u16> {
    let authority =
        children(text).into_iter().find(|part| part.starts_with("AUTHORITY") || part.starts_with("ID["))?;
    if !authority.contains("\"EPSG\"") {
        return None;
    }
    authority.split(',').nth(1)?.trim_matches(['"', ' ', ']']).parse().ok()
}

/// EPSG code by the name of ESRI or of the registry.
fn code_by_name(name: &str) -> Option<u16> {
    let name = name.replace('_', " ");
    for (start, north, south) in [
        ("WGS 1984 UTM Zone ", 32600, Some(32700)),
        ("ETRS 1989 UTM Zone ", 25800, None),
        ("NAD 1983 UTM Zone ", 26900, None),
    ] {
        let Some(zone) = name.strip_prefix(start) else { continue };
        let base = if zone.ends_with('S') { south? } else { north };
        let zone: u16 =
            zone.trim_end_matches(['N', 'S']).parse().ok().filter(|zone| (1..=60).contains(zone))?;
        return Some(base + zone);
    }
    if let Some(zone) = name.strip_prefix("GDA 1994 MGA Zone ") {
        return zone.parse::<u16>().ok().map(|zone| 28300 + zone);
    }
    if let Some((_, code)) = ESRI_NAMES.iter().find(|(known, _)| *known == name) {
        return Some(*code);
    }
    let utm_code = |start: &str, base: u16, end: char| {
        let zone = name.strip_prefix(start)?.strip_suffix(end)?;
        zone.parse::<u16>().ok().filter(|zone| (1..=60).contains(zone)).map(|zone| base + zone)
    };
    // Names of the EPSG registry.
    utm_code("WGS 84 / UTM zone ", 32600, 'N').or_else(|| utm_code("WGS 84 / UTM zone ", 32700, 'S')).or_else(
        || {
            SYSTEMS.lines().find_map(|line| {
                let mut words = line.split(';');
                let (kind, code, known) = (words.next()?, words.next()?, words.next()?);
                (matches!(kind, "projected" | "geographic") && known == name).then(|| code.parse().ok())?
            })
        },
    )
}

/// The comma-separated parts inside the outermost brackets.
fn children(text: &str) -> Vec<&str> {
    let Some(open) = text.find(['[', '(']) else { return Vec::new() };
    let (mut depth, mut is_quoted, mut start, mut parts) = (0, false, open + 1, Vec::new());
    for (index, c) in text.char_indices().skip_while(|(index, _)| *index < open) {
        match c {
            '"' => is_quoted = !is_quoted,
            _ if is_quoted => {}
            '[' | '(' => depth += 1,
            ']' | ')' => {
                depth -= 1;
                if depth == 0 {
                    parts.push(text[start..index].trim());
                    break;
                }
            }
            ',' if depth == 1 => {
                parts.push(text[start..index].trim());
                start = index + 1;
            }
            _ => {}
        }
    }
    parts
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]
    use super::*;

    const UTM: &str = concat!(
        r#"PROJCS["WGS 84 / UTM zone 32N",GEOGCS["WGS 84",DATUM["WGS_1984","#,
        r#"SPHEROID["WGS 84",6378137,298.257223563,AUTHORITY["EPSG","7030"]],AUTHORITY["EPSG","6326"]],"#,
        r#"AUTHORITY["EPSG","4326"]],UNIT["metre",1],AUTHORITY["EPSG","32632"]]"#
    );

    #[test]
    fn codes_are_those_of_the_outermost_definition() {
        let code = |text: &str| codes(text).horizontal;
        assert_eq!(code(UTM), Some(32632));
        // Without its own code it is identified by name, not by its base's code.
        assert_eq!(code(&UTM.replace(r#","32632"]"#, r#"x"]"#)), Some(32632));
        assert_eq!(code(&UTM.replace(r#","32632"]"#, r#"x"]"#).replace("zone 32N", "of mine")), None);
        assert_eq!(
            code(r#"PROJCS["WGS_1984_UTM_Zone_33S",GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984"]]]"#),
            Some(32733)
        );
        assert_eq!(
            code(r#"PROJCS["ETRS_1989_UTM_Zone_32N",GEOGCS["GCS_ETRS_1989",DATUM["D"]]]"#),
            Some(25832)
        );
        assert_eq!(code(r#"GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984"]]"#), Some(4326));
        assert_eq!(
            code(r#"PROJCRS["RGF93 v1 / Lambert-93",BASEGEOGCRS["RGF93 v1"],ID["EPSG",2154]]"#),
            Some(2154)
        );
        assert_eq!(code("Projection UTM\nZone 32"), None);
        assert_eq!(code("PROJCS[\"a\"[[["), None);
        let both = format!(
            r#"COMPD_CS["both",{UTM},
                VERT_CS["EGM96 height",UNIT["metre",1],AUTHORITY["EPSG","5773"]],AUTHORITY["EPSG","9999"]]"#
        );
        assert_eq!(codes(&both), Codes { horizontal: Some(32632), vertical: Some(5773) });
    }

    #[test]
    fn vertical_parts_have_unit_datum_and_direction() {
        let esri = r#"VERTCS["NAVD88_height_(ftUS)",VDATUM["North_American_Vertical_Datum_1988"],
            PARAMETER["Vertical_Shift",0.0],PARAMETER["Direction",1.0],UNIT["Foot_US",0.304800609601219]]"#;
        let expected = VerticalText {
            code: None,
            name: "NAVD88_height_(ftUS)".into(),
            metres_per_unit: Some(0.304_800_609_601_219),
            is_ellipsoid: Some(false),
            shift: 0.0,
        };
        assert_eq!(vertical(&format!("{UTM},{esri}")), Some(expected.clone()));
        let other = esri.replace("Direction\",1.0", "Direction\",-1.0").replace("Shift\",0.0", "Shift\",2.5");
        let down = VerticalText { metres_per_unit: Some(-0.304_800_609_601_219), shift: 2.5, ..expected };
        assert_eq!(vertical(&format!("{UTM},{other}")), Some(down));
        let ellipsoid = vertical(
            r#"VERTCS["WGS_1984",DATUM["D_WGS_1984",SPHEROID["WGS_1984",6378137.0,298.25]],
                UNIT["Meter",1.0]]"#,
        )
        .unwrap();
        assert_eq!((ellipsoid.is_ellipsoid, ellipsoid.metres_per_unit), (Some(true), Some(1.0)));
        let new = vertical(
            r#"COMPOUNDCRS["c",PROJCRS["p",ID["EPSG",32632]],
                VERTCRS["d",VDATUM["v"],CS[vertical,1],
                    AXIS["depth (D)",down,LENGTHUNIT["foot",0.3048]],ID["EPSG",5]]]"#,
        )
        .unwrap();
        assert_eq!((new.code, new.metres_per_unit), (Some(5), Some(-0.3048)));
        assert_eq!((vertical(UTM), horizontal_unit(UTM)), (None, Some(1.0)));
    }
}
