//! A header line: what each name means, in which unit, and which column stands for a quantity where several
//! do.

use super::{
    names::{self, Meaning},
    units::{self, Datum, Dimension, Unit, Word},
};

/// A column of a header.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Column {
    /// As written.
    pub(super) name: String,
    /// `None` where the name says nothing to us.
    pub(super) means: Option<Means>,
}

/// What a known name says.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Means {
    pub(super) meaning: Meaning,
    /// The part of the name that has the meaning, in normal form.
    pub(super) stem: String,
    pub(super) unit: Option<&'static Unit>,
    /// The name is nothing but a unit: it may be a part of a time in several columns.
    pub(super) is_bare_unit: bool,
    /// Words beside the name that nobody knows, or that contradict each other: an error if the column is
    /// used.
    problem: Option<String>,
}

/// The columns of a header.
#[derive(Clone, Debug)]
pub(super) struct Header(pub(super) Vec<Column>);

impl Header {
    pub(super) fn parse(names: &[&str]) -> Self {
        Self(
            names
                .iter()
                .map(|name| Column { name: (*name).to_owned(), means: parse_name(name, None) })
                .collect(),
        )
    }

    /// The same with a line of units below the names; `None` if that line says anything else.
    pub(super) fn parse_with_units(names: &[&str], words: &[&str]) -> Option<Self> {
        if names.len() != words.len()
            || !words.iter().all(|text| units::word(text.trim_matches(['[', ']', '(', ')'])).is_some())
        {
            return None;
        }
        let columns = names.iter().zip(words);
        Some(Self(
            columns
                .map(|(name, words)| Column {
                    name: (*name).to_owned(),
                    means: parse_name(name, Some(words)),
                })
                .collect(),
        ))
    }

    pub(super) fn name(&self, column: usize) -> &str {
        self.0.get(column).map_or("", |column| &column.name)
    }

    pub(super) fn means(&self, column: usize) -> Option<&Means> {
        self.0.get(column).and_then(|column| column.means.as_ref())
    }

    pub(super) fn all(&self, is: impl Fn(Meaning) -> bool) -> Vec<usize> {
        let is_it = |column: &Column| column.means.as_ref().is_some_and(|means| is(means.meaning));
        self.0.iter().enumerate().filter(|(_, column)| is_it(column)).map(|(index, _)| index).collect()
    }

    /// The column of this meaning, if there is one.
    ///
    /// # Errors
    /// There are several, or its unit makes no sense: what to say.
    pub(super) fn one(&self, meaning: Meaning) -> Result<Option<usize>, String> {
        let all = self.all(|other| other == meaning);
        match all[..] {
            [] => Ok(None),
            [column] => self.check(column).map(|()| Some(column)),
            _ => Err(self.two(&all)),
        }
    }

    /// All of these, or `None` if one is missing.
    pub(super) fn all_of<const N: usize>(
        &self,
        meanings: [Meaning; N],
    ) -> Result<Option<[usize; N]>, String> {
        if meanings.iter().any(|&meaning| self.all(|other| other == meaning).is_empty()) {
            return Ok(None);
        }
        let mut columns = [0; N];
        for (column, meaning) in columns.iter_mut().zip(meanings) {
            *column = self.one(meaning)?.unwrap_or_default();
        }
        Ok(Some(columns))
    }

    pub(super) fn check(&self, column: usize) -> Result<(), String> {
        match self.means(column).and_then(|means| means.problem.as_ref()) {
            Some(problem) => Err(format!("column {} (`{}`): {problem}", column + 1, self.name(column))),
            None => Ok(()),
        }
    }

    /// Of one quantity several columns.
    pub(super) fn two(&self, columns: &[usize]) -> String {
        format!(
            "the columns {} are of one quantity: remove or rename all but the right one",
            self.list(columns)
        )
    }

    pub(super) fn list(&self, columns: &[usize]) -> String {
        let named: Vec<String> =
            columns.iter().map(|&column| format!("{} (`{}`)", column + 1, self.name(column))).collect();
        named.join(" and ")
    }

    /// Factor of a column's unit, if it names one.
    pub(super) fn factor(&self, column: usize) -> Option<f64> {
        self.means(column).and_then(|means| means.unit).map(|unit| unit.factor)
    }
}

/// The dimension that a column of this meaning has; `None` where it has none.
fn dimension(meaning: Meaning) -> Option<Dimension> {
    use Meaning::*;
    match meaning {
        Time | NanosecondsPart => Some(Dimension::Time),
        Latitude | Longitude | LatitudeLongitude | Roll | Pitch | Yaw | MagneticYaw | Course | Gimbal => {
            Some(Dimension::Angle)
        }
        Height(_) | PressureHeight | RelativeHeight | Ground | North | East | Down | Grid | X | Y | Z => {
            Some(Dimension::Length)
        }
        DateTime | Date | Hemisphere | TimePart | Vehicle | Qx | Qy | Qz | Qw => None,
    }
}

/// `timestamp [ns]`, `lat_deg`, `p_RS_R_x [m]`, `Yaw(rad)`, `lat, deg`, `latE7`, `TimeUS`; `below` is what a
/// line of units says.
fn parse_name(name: &str, below: Option<&str>) -> Option<Means> {
    let name = name.trim_matches(['"', '\'', ' ']);
    let (bare, mut beside) = without_brackets(name);
    let (bare, after_comma) = bare.split_once(',').map_or((bare.as_str(), ""), |(bare, rest)| (bare, rest));
    beside
        .extend([after_comma.to_owned(), below.unwrap_or("").trim_matches(['[', ']', '(', ')']).to_owned()]);

    let normal = normal_form(bare);
    let (known, stem, mut words) = known_and_suffixes(&normal)?;
    let mut problem = None;
    for text in beside.iter().map(|text| text.trim()).filter(|text| !text.is_empty()) {
        match words_of(text) {
            Some(found) => words.extend(found),
            None => {
                problem = Some(format!(
                    "`{text}` is no unit known; docs/inputs/LOGS.md lists them, and a column that needs none should name none"
                ))
            }
        }
    }
    let mut meaning = known.meaning;
    let mut unit = known.unit;
    for word in words {
        match word {
            Word::Unit(other) if dimension(meaning) != Some(other.dimension) => {
                problem = Some(match dimension(meaning) {
                    Some(dimension) => format!("{} is no unit of {}", other.name, dimension.name()),
                    None => format!("it has no unit, but {} is named", other.name),
                });
            }
            Word::Unit(other) if unit.is_some_and(|unit| unit != other) => {
                problem = Some(format!(
                    "it names two units, {} and {}",
                    unit.map_or("", |unit| unit.name),
                    other.name
                ));
            }
            Word::Unit(other) => unit = Some(other),
            Word::Datum(datum) => match meaning {
                Meaning::Height(None) => meaning = Meaning::Height(Some(datum)),
                Meaning::Height(Some(other)) if other != datum => {
                    problem = Some("it names two vertical datums".to_owned())
                }
                Meaning::PressureHeight if datum == Datum::Ellipsoid => {
                    problem = Some("air pressure knows no ellipsoid".to_owned())
                }
                _ => {}
            },
            Word::Magnetic if meaning == Meaning::Yaw => meaning = Meaning::MagneticYaw,
            Word::Magnetic | Word::Noise => {}
        }
    }
    Some(Means { meaning, stem, unit, is_bare_unit: known.unit.is_some(), problem })
}

/// The name without what stands in brackets, and that.
fn without_brackets(name: &str) -> (String, Vec<String>) {
    let (mut bare, mut inside) = (String::new(), Vec::new());
    let mut rest = name;
    while let Some(open) = rest.find(['[', '(']) {
        bare.push_str(&rest[..open]);
        let after = &rest[open + 1..];
        let close = after.find([']', ')']).unwrap_or(after.len());
        inside.push(after[..close].to_owned());
        rest = after.get(close + 1..).unwrap_or("");
    }
    bare.push_str(rest);
    (bare, inside)
}

/// Lower case, words joined by single underscores; `TimeUS` is two words.
fn normal_form(name: &str) -> String {
    let mut normal = String::with_capacity(name.len() + 4);
    let mut before = ' ';
    for c in name.trim().chars() {
        if matches!(c, ' ' | '-' | '.' | '/' | ':' | '_') {
            if !normal.ends_with('_') {
                normal.push('_');
            }
        } else {
            if c.is_uppercase() && before.is_lowercase() && !normal.ends_with('_') {
                normal.push('_');
            }
            normal.extend(c.to_lowercase());
        }
        before = c;
    }
    normal.trim_matches('_').to_owned()
}

/// Splits units and the like off the end of a name until the rest is known.
fn known_and_suffixes(normal: &str) -> Option<(&'static names::Known, String, Vec<Word>)> {
    let mut stem = normal;
    let mut words = Vec::new();
    loop {
        if let Some(known) = names::find(stem) {
            // `alt_min` is no height in minutes but the lowest one: a name of another kind.
            let fits = |word: &Word| !matches!(word, Word::Unit(unit) if dimension(known.meaning) != Some(unit.dimension));
            return words.iter().all(fits).then(|| (known, stem.to_owned(), words));
        }
        let starts: Vec<usize> = stem.match_indices('_').map(|(at, _)| at).collect();
        // The longest first: `us_survey_ft` ends in a `ft` too.
        let split = starts.iter().rev().take(3).rev().find_map(|&at| {
            let text = &stem[at + 1..];
            let is_word = text.chars().any(char::is_alphabetic);
            units::word(text).filter(|_| is_word).map(|word| (at, word))
        });
        let (at, word) = split?;
        words.push(word);
        stem = stem[..at].trim_end_matches("_in");
    }
}

/// Words of one pair of brackets; `None` if one is unknown.
fn words_of(text: &str) -> Option<Vec<Word>> {
    match units::word(text) {
        Some(word) => Some(vec![word]),
        None => text.split([',', ';', ' ']).filter(|part| !part.is_empty()).map(units::word).collect(),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn names_give_meaning_unit_and_datum() {
        use Meaning::*;
        let mean_sea_level = Height(Some(Datum::MeanSeaLevel));
        for (name, meaning, unit) in [
            ("time(millisecond)", Time, "ms"),
            ("TimeUS", Time, "us"),
            ("time_boot_ms", Time, "ms"),
            ("timestamp [ns]", Time, "ns"),
            ("OSD.flyTime [s]", Time, "s"),
            ("seconds", Time, "s"),
            ("lat, deg", Latitude, "deg"),
            ("latE7", Latitude, "1e-7 deg"),
            ("lat [deg*1e7]", Latitude, "1e-7 deg"),
            ("lat (1e-7 deg)", Latitude, "1e-7 deg"),
            ("LATITUDE [rad]", Latitude, "rad"),
            ("Lon (°)", Longitude, "deg"),
            ("altitude_ft_msl", mean_sea_level, "ft"),
            ("altitude_above_seaLevel(feet)", mean_sea_level, "ft"),
            ("Alt [m, AMSL]", mean_sea_level, "m"),
            ("alt [ft] (msl)", mean_sea_level, "ft"),
            ("alt_us_survey_ft", Height(None), "US survey foot"),
            ("height_usft", Height(None), "US survey foot"),
            ("alt [ft_us]", Height(None), "US survey foot"),
            ("h_mm", Height(None), "mm"),
            ("gnss_alt_m", Height(None), "m"),
            ("altitude in feet", Height(None), "ft"),
            ("HAE (m)", Height(Some(Datum::Ellipsoid)), "m"),
            ("Yaw(rad)", Yaw, "rad"),
            ("yaw_cdeg", Yaw, "cdeg"),
            ("heading (deg, magnetic)", MagneticYaw, "deg"),
            ("p_RS_R_x [m]", X, "m"),
            ("north_km", North, "km"),
        ] {
            let means = parse_name(name, None).unwrap_or_else(|| panic!("{name}"));
            assert_eq!(
                (means.meaning, means.unit.unwrap().name, means.problem),
                (meaning, unit, None),
                "{name}"
            );
        }
        for (name, meaning) in [
            ("timestamp(s)", Time),
            ("q_RS_w []", Qw),
            ("alt_ellipsoid", Height(Some(Datum::Ellipsoid))),
            ("datetime(utc)", DateTime),
        ] {
            let means = parse_name(name, None).unwrap();
            assert_eq!((means.meaning, means.problem), (meaning, None), "{name}");
        }
        for name in [
            "delta_alt",
            "max_altitude(feet)",
            "alt_min",
            "timestamp_sample",
            "imu_x",
            "gps_h",
            "rollRate",
            "vx",
            "",
            "ImageFile",
        ] {
            assert_eq!(parse_name(name, None), None, "{name}");
        }
        for (name, problem) in [
            ("alt [furlong]", "furlong"),
            ("alt_m [ft]", "two units"),
            ("lat [m]", "no unit of angle"),
            ("alt [m/s]", "m/s"),
        ] {
            assert!(parse_name(name, None).unwrap().problem.unwrap().contains(problem), "{name}");
        }
        assert_eq!(parse_name("alt", Some("[ft]")).unwrap().unit.unwrap().name, "ft");
    }
}
