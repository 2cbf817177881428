//! Coordinate systems in the words of ARC/INFO: a `.prj` file of a key and its value a line.

/// What such a file says. It has no code, so that `scene.terrain.epsg` must give it.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct ArcPrj {
    /// Projection, zone and datum, as it calls them.
    pub name: String,
    /// The zone, of UTM.
    pub utm_zone: Option<u16>,
    /// The unit of heights.
    pub height_unit: Option<String>,
    /// The unit of coordinates.
    pub unit: Option<String>,
    /// What was added to coordinates.
    pub shifts: [f64; 2],
}

impl ArcPrj {
    /// `None` for text that is no such file.
    pub fn of(text: &str) -> Option<Self> {
        let mut lines = text.trim().trim_start_matches('\u{feff}').lines().map(str::trim);
        let mut found = Self::default();
        let first = lines.next()?;
        let projection = value_of(first, "projection")?;
        let mut words = vec![projection.to_owned()];
        let mut zone = None;
        for line in lines {
            if let Some(value) = value_of(line, "zone") {
                zone = value.parse().ok();
                words.push(format!("zone {value}"));
            } else if let Some(value) = value_of(line, "datum") {
                words.push(value.to_owned());
            } else if let Some(value) = value_of(line, "zunits") {
                found.height_unit = Some(value.to_owned()).filter(|value| !value.eq_ignore_ascii_case("no"));
            } else if let Some(value) = value_of(line, "units") {
                found.unit = Some(value.to_owned());
            } else if let Some(value) = value_of(line, "xshift") {
                found.shifts[0] = value.parse().unwrap_or(f64::NAN);
            } else if let Some(value) = value_of(line, "yshift") {
                found.shifts[1] = value.parse().unwrap_or(f64::NAN);
            }
        }
        found.utm_zone = zone.filter(|_| projection.eq_ignore_ascii_case("utm"));
        found.name = words.join(", ");
        Some(found)
    }
}

fn value_of<'a>(line: &'a str, key: &str) -> Option<&'a str> {
    let (word, value) = line.split_once(char::is_whitespace)?;
    word.trim_end_matches(':').eq_ignore_ascii_case(key).then_some(value.trim())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]
    use super::*;

    #[test]
    fn keys_have_their_values() {
        let text = "Projection    UTM\nZone          32\nDatum         WGS84\nZunits        FEET\nUnits         METERS\nXshift 0.0\nYshift 5\nParameters\n";
        let expected = ArcPrj {
            name: "UTM, zone 32, WGS84".into(),
            utm_zone: Some(32),
            height_unit: Some("FEET".into()),
            unit: Some("METERS".into()),
            shifts: [0.0, 5.0],
        };
        assert_eq!(ArcPrj::of(text), Some(expected));
        assert_eq!(ArcPrj::of(&text.replace("FEET", "NO")).unwrap().height_unit, None);
        assert_eq!(ArcPrj::of("PROJCS[\"a b\"]"), None);
    }
}
