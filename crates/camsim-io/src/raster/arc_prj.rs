//! ARC/INFO `.prj` files: a key and its value on each line.

/// Content of an ARC/INFO `.prj` file. It states no EPSG code, so that `scene.terrain.epsg` is needed.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct ArcPrj {
    /// Projection, zone and datum as the file names them.
    pub name: String,
    /// UTM zone; `None` for other projections.
    pub utm_zone: Option<u16>,
    /// Unit of heights (Zunits).
    pub height_unit: Option<String>,
    /// Unit of coordinates (Units).
    pub unit: Option<String>,
    /// Offsets that were added to coordinates (Xshift, Yshift).
    pub shifts: [f64; 2],
}

impl ArcPrj {
    /// `None` for other text.
    pub fn parse(text: &str) -> Option<Self> {
        let mut lines = text.trim().trim_start_matches('\u{feff}').lines().map(str::trim);
        let mut prj = Self::default();
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
                prj.height_unit = Some(value.to_owned()).filter(|value| !value.eq_ignore_ascii_case("no"));
            } else if let Some(value) = value_of(line, "units") {
                prj.unit = Some(value.to_owned());
            } else if let Some(value) = value_of(line, "xshift") {
                prj.shifts[0] = value.parse().unwrap_or(f64::NAN);
            } else if let Some(value) = value_of(line, "yshift") {
                prj.shifts[1] = value.parse().unwrap_or(f64::NAN);
            }
        }
        prj.utm_zone = zone.filter(|_| projection.eq_ignore_ascii_case("utm"));
        prj.name = words.join(", ");
        Some(prj)
    }
}

/// Value of a line with this key.
fn value_of<'a>(line: &'a str, key: &str) -> Option<&'a str> {
    let (word, value) = line.split_once(char::is_whitespace)?;
    word.trim_end_matches(':').eq_ignore_ascii_case(key).then_some(value.trim())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]
    use super::*;

    #[test]
    fn keys_are_parsed() {
        let text = "Projection    UTM\nZone          32\nDatum         WGS84\nZunits        \
                    FEET\nUnits         METERS\nXshift 0.0\nYshift 5\nParameters\n";
        let expected = ArcPrj {
            name: "UTM, zone 32, WGS84".into(),
            utm_zone: Some(32),
            height_unit: Some("FEET".into()),
            unit: Some("METERS".into()),
            shifts: [0.0, 5.0],
        };
        assert_eq!(ArcPrj::parse(text), Some(expected));
        assert_eq!(ArcPrj::parse(&text.replace("FEET", "NO")).unwrap().height_unit, None);
        assert_eq!(ArcPrj::parse("PROJCS[\"a b\"]"), None);
    }
}
