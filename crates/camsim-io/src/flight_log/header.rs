//! Header lines: the meaning and unit of each name, and lookup of columns by meaning.

use camsim_core::{flight_log::Note, scenario::HeightReference};

use super::{
    column_meaning::ColumnMeaning,
    column_names,
    columns::FieldSource,
    message_columns, split_stamps,
    units::{Qualifier, Unit, parse_qualifier},
};

/// A column of a header.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct HeaderColumn {
    /// Name as the file has it.
    pub(super) name: String,
    /// Meaning of the name; `None` where it is not known.
    pub(super) parsed: Option<ParsedName>,
}

/// Meaning and unit of a known name.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ParsedName {
    /// What the column holds.
    pub(super) meaning: ColumnMeaning,
    /// The known part of the name, without units and the like, in normal form.
    pub(super) stem: String,
    /// Unit that the header states.
    pub(super) unit: Option<&'static Unit>,
    /// Whether the name is only a unit (`ms`), which may be one part of a time in several columns.
    pub(super) is_bare_unit: bool,
    /// Error message for unknown or contradictory qualifiers, reported if the column is used.
    pub(super) problem: Option<String>,
}

/// The columns of a header.
#[derive(Clone, Debug)]
pub(super) struct HeaderColumns(pub(super) Vec<HeaderColumn>);

impl ParsedName {
    /// The meaning and unit of a column that a table of messages states.
    pub(super) fn stated(meaning: ColumnMeaning, stem: &str, unit: Option<&'static Unit>) -> Self {
        Self { meaning, stem: stem.to_owned(), unit, is_bare_unit: false, problem: None }
    }
}

impl HeaderColumns {
    pub(super) fn parse(names: &[&str]) -> Self {
        let column = |name: &&str| HeaderColumn { name: (*name).to_owned(), parsed: parse_name(name, None) };
        let mut columns = names.iter().map(column).collect::<Vec<_>>();
        message_columns::apply(&mut columns);
        split_stamps::apply(&mut columns);
        Self(columns)
    }

    pub(super) fn name(&self, column: usize) -> &str {
        self.0.get(column).map_or("", |column| &column.name)
    }

    pub(super) fn parsed(&self, column: usize) -> Option<&ParsedName> {
        self.0.get(column).and_then(|column| column.parsed.as_ref())
    }

    /// The known part of a column's name, in normal form; empty where the name is not known.
    pub(super) fn stem(&self, column: usize) -> &str {
        self.parsed(column).map_or("", |parsed| &parsed.stem)
    }

    /// Indices of the columns whose meaning fulfils a condition.
    pub(super) fn columns_where(&self, condition: impl Fn(ColumnMeaning) -> bool) -> Vec<usize> {
        let fulfils =
            |column: &HeaderColumn| column.parsed.as_ref().is_some_and(|parsed| condition(parsed.meaning));
        self.0.iter().enumerate().filter(|(_, column)| fulfils(column)).map(|(index, _)| index).collect()
    }

    /// Indices of the columns of a meaning.
    pub(super) fn columns(&self, meaning: ColumnMeaning) -> Vec<usize> {
        self.columns_where(|other| other == meaning)
    }

    pub(super) fn has(&self, meaning: ColumnMeaning) -> bool {
        self.has_any(|other| other == meaning)
    }

    pub(super) fn has_any(&self, condition: impl Fn(ColumnMeaning) -> bool) -> bool {
        self.0.iter().any(|column| column.parsed.as_ref().is_some_and(|parsed| condition(parsed.meaning)))
    }

    /// The column of this meaning, if there is one.
    ///
    /// # Errors
    /// There are several, or its unit makes no sense: the error message.
    pub(super) fn unique(&self, meaning: ColumnMeaning) -> Result<Option<usize>, String> {
        let all = self.columns(meaning);
        match all[..] {
            [] => Ok(None),
            [column] => self.check_usable(column).map(|()| Some(column)),
            _ => Err(self.ambiguity_message(&all)),
        }
    }

    /// The column of each meaning, or `None` if one is missing.
    ///
    /// # Errors
    /// As [`Self::unique`].
    pub(super) fn unique_each<const N: usize>(
        &self,
        meanings: [ColumnMeaning; N],
    ) -> Result<Option<[usize; N]>, String> {
        if !meanings.iter().all(|&meaning| self.has(meaning)) {
            return Ok(None);
        }
        let mut columns = [0; N];
        for (column, meaning) in columns.iter_mut().zip(meanings) {
            *column = self.unique(meaning)?.unwrap_or_default();
        }
        Ok(Some(columns))
    }

    /// Reports the problem of a column's name, if it has one.
    pub(super) fn check_usable(&self, column: usize) -> Result<(), String> {
        match self.parsed(column).and_then(|parsed| parsed.problem.as_ref()) {
            Some(problem) => Err(format!("column {} (`{}`): {problem}", column + 1, self.name(column))),
            None => Ok(()),
        }
    }

    /// Message for several columns of one quantity.
    pub(super) fn ambiguity_message(&self, columns: &[usize]) -> String {
        format!(
            "the columns {} are of one quantity: remove or rename all but the right one",
            self.describe(columns)
        )
    }

    /// Numbers and names of columns, for messages: ``1 (`t`) and 2 (`time`)``.
    pub(super) fn describe(&self, columns: &[usize]) -> String {
        let named: Vec<String> =
            columns.iter().map(|&column| format!("{} (`{}`)", column + 1, self.name(column))).collect();
        named.join(" and ")
    }

    /// Note that one of several columns of a quantity counts.
    pub(super) fn choice_note(&self, quantity: &str, columns: &[usize], chosen: usize) -> Note {
        Note::information(format!(
            "of the {quantity} {} `{}` counts",
            self.describe(columns),
            self.name(chosen)
        ))
    }

    /// Columns whose name, in lower case, fulfils a condition.
    pub(super) fn columns_by_name(&self, condition: impl Fn(&str) -> bool) -> Vec<usize> {
        (0..self.0.len())
            .filter(|&column| condition(&self.name(column).trim_matches(['"', ' ']).to_lowercase()))
            .collect()
    }

    /// The field of a column, with its unit.
    pub(super) fn source(&self, column: usize) -> FieldSource {
        FieldSource::whole(column, self.factor(column))
    }

    /// Factor of a column's unit, if the header states one.
    pub(super) fn factor(&self, column: usize) -> Option<f64> {
        self.parsed(column).and_then(|parsed| parsed.unit).map(|unit| unit.factor)
    }
}

/// Parses a name such as `timestamp [ns]`, `lat_deg`, `p_RS_R_x [m]`, `Yaw(rad)`, `lat, deg`, `latE7` or
/// `TimeUS`; `unit_line` is its cell of a line of units.
// Long because the rules for qualifiers share the meaning, unit and problem found so far.
pub(super) fn parse_name(name: &str, unit_line: Option<&str>) -> Option<ParsedName> {
    let name = name.trim_matches(['"', '\'', ' ']);
    if let Some((meaning, stem)) = numbered_part(name) {
        return Some(ParsedName::stated(meaning, stem, None));
    }
    let (mut bare, mut qualifier_texts) = split_brackets(name);
    join_bracketed_quantity(&mut bare, &mut qualifier_texts);
    let (bare, after_comma) = bare.split_once(',').map_or((bare.as_str(), ""), |(bare, rest)| (bare, rest));
    let unit_line = unit_line.unwrap_or("").trim_matches(['[', ']', '(', ')']);
    qualifier_texts.extend([after_comma.to_owned(), unit_line.to_owned()]);

    let (known, stem, mut qualifiers) = split_suffixes(&normal_form(bare))
        .or_else(|| split_suffixes(&normal_form(&with_split_acronyms(bare))))?;
    let mut problem = None;
    for text in qualifier_texts.iter().map(|text| text.trim()).filter(|text| !text.is_empty()) {
        match parse_qualifiers(text) {
            Some(parsed) => qualifiers.extend(parsed),
            None => {
                problem = Some(format!(
                    "`{text}` is no unit known; docs/reference/inputs/LOGS.md lists them, and a column that \
                        needs none should name none"
                ))
            }
        }
    }
    let mut meaning = known.meaning;
    let mut unit = known.unit;
    for qualifier in qualifiers {
        match qualifier {
            Qualifier::Unit(other) if meaning.dimension() != Some(other.dimension) => {
                problem = Some(match meaning.dimension() {
                    Some(dimension) => format!("{} is no unit of {}", other.name, dimension.name()),
                    None => format!("it has no unit, but {} is named", other.name),
                });
            }
            Qualifier::Unit(other) if unit.is_some_and(|unit| unit != other) => {
                problem = Some(format!(
                    "it names two units, {} and {}",
                    unit.map_or("", |unit| unit.name),
                    other.name
                ));
            }
            Qualifier::Unit(other) => unit = Some(other),
            Qualifier::Datum(datum) => match meaning {
                ColumnMeaning::Height(None) => meaning = ColumnMeaning::Height(Some(datum)),
                ColumnMeaning::Height(Some(other)) if other != datum => {
                    problem = Some("it names two vertical datums".to_owned())
                }
                ColumnMeaning::PressureHeight if datum == HeightReference::Ellipsoid => {
                    problem = Some("a height by air pressure is not above the ellipsoid".to_owned())
                }
                _ => {}
            },
            Qualifier::Magnetic if meaning == ColumnMeaning::Yaw => meaning = ColumnMeaning::MagneticYaw,
            Qualifier::Magnetic | Qualifier::Ignored => {}
        }
    }
    // `header.stamp.sec` says whose seconds it counts, unlike `sec`.
    let is_bare_unit = known.unit.is_some() && !stem.contains("stamp");
    Some(ParsedName { meaning, stem, unit, is_bare_unit, problem })
}

/// The part that exports number, of PX4's quaternion (`q[0]`, `vehicle_attitude.q[3]`) or of a position in
/// a black box (`GPS_coord[0]`).
fn numbered_part(name: &str) -> Option<(ColumnMeaning, &'static str)> {
    match name {
        "GPS_coord[0]" => return Some((ColumnMeaning::Latitude, "lat")),
        "GPS_coord[1]" => return Some((ColumnMeaning::Longitude, "lon")),
        _ => {}
    }
    let (before, number) = name.strip_suffix(']')?.rsplit_once("q[")?;
    if !(before.is_empty() || before.ends_with(['.', '/', ':']) || before.ends_with("attitude_")) {
        return None;
    }
    use ColumnMeaning::{Qw, Qx, Qy, Qz};
    let index: usize = number.parse().ok()?;
    [Qw, Qx, Qy, Qz].get(index).map(|&meaning| (meaning, "q"))
}

/// Splits a name into the text outside of brackets and the texts inside.
fn split_brackets(name: &str) -> (String, Vec<String>) {
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

/// Appends a quantity in brackets to the name of its instrument: `GPS (Lat.) [deg]` is `GPS Lat. [deg]`.
fn join_bracketed_quantity(bare: &mut String, inside: &mut Vec<String>) {
    let Some(first) = inside.first().filter(|text| parse_qualifiers(text).is_none()) else { return };
    let is_instrument =
        column_names::PREFIXES.split(' ').any(|prefix| prefix.trim_end_matches('_') == normal_form(bare));
    if is_instrument {
        *bare = format!("{} {first}", bare.trim_end());
        inside.remove(0);
    }
}

/// A name whose acronyms are words of their own: `GPSLatitude` is `GPS Latitude`.
fn with_split_acronyms(name: &str) -> String {
    let characters: Vec<char> = name.chars().collect();
    let mut split = String::with_capacity(name.len() + 4);
    for (index, &c) in characters.iter().enumerate() {
        let ends_acronym = index > 0
            && c.is_uppercase()
            && characters[index - 1].is_uppercase()
            && characters.get(index + 1).is_some_and(|next| next.is_lowercase());
        if ends_acronym {
            split.push(' ');
        }
        split.push(c);
    }
    split
}

/// The normal form of a name: lower case, words joined by single underscores. `TimeUS` is two words.
pub(super) fn normal_form(name: &str) -> String {
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

/// Splits qualifiers off the end of a name until the rest is a known name.
fn split_suffixes(normal: &str) -> Option<(&'static column_names::KnownName, String, Vec<Qualifier>)> {
    let mut stem = normal;
    let mut qualifiers = Vec::new();
    loop {
        if let Some(known) = column_names::find(stem) {
            // `alt_min` is the minimum of a height, not a height in minutes: another, unknown name.
            let fits = |qualifier: &Qualifier| match qualifier {
                Qualifier::Unit(unit) => known.meaning.dimension() == Some(unit.dimension),
                _ => true,
            };
            return qualifiers.iter().all(fits).then(|| (known, stem.to_owned(), qualifiers));
        }
        let separators: Vec<usize> = stem.match_indices('_').map(|(index, _)| index).collect();
        // The longest suffix first: `us_survey_ft` also ends in `ft`.
        let split = separators.iter().rev().take(3).rev().find_map(|&separator| {
            let text = &stem[separator + 1..];
            let has_letter = text.chars().any(char::is_alphabetic);
            parse_qualifier(text).filter(|_| has_letter).map(|qualifier| (separator, qualifier))
        });
        let (separator, qualifier) = split?;
        qualifiers.push(qualifier);
        stem = stem[..separator].trim_end_matches("_in");
    }
}

/// Parses the qualifiers in one pair of brackets; `None` if one is unknown.
pub(super) fn parse_qualifiers(text: &str) -> Option<Vec<Qualifier>> {
    match parse_qualifier(text) {
        Some(qualifier) => Some(vec![qualifier]),
        None => text.split([',', ';', ' ']).filter(|part| !part.is_empty()).map(parse_qualifier).collect(),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn names_are_parsed_into_meaning_unit_and_datum() {
        use ColumnMeaning::*;
        let mean_sea_level = Height(Some(HeightReference::Msl));
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
            ("HAE (m)", Height(Some(HeightReference::Ellipsoid)), "m"),
            ("Yaw(rad)", Yaw, "rad"),
            ("yaw_cdeg", Yaw, "cdeg"),
            ("heading (deg, magnetic)", MagneticYaw, "deg"),
            ("p_RS_R_x [m]", X, "m"),
            ("north_km", North, "km"),
            ("GPS (Lat.) [deg]", Latitude, "deg"),
            ("FlightYawDegree", Yaw, "deg"),
        ] {
            let parsed = parse_name(name, None).unwrap_or_else(|| panic!("{name}"));
            assert_eq!(
                (parsed.meaning, parsed.unit.unwrap().name, parsed.problem),
                (meaning, unit, None),
                "{name}"
            );
        }
        for (name, meaning) in [
            ("timestamp(s)", Time),
            ("q_RS_w []", Qw),
            ("alt_ellipsoid", Height(Some(HeightReference::Ellipsoid))),
            ("datetime(utc)", DateTime),
            ("GPSLatitude", Latitude),
            ("SubSecDateTimeOriginal", DateTime),
        ] {
            let parsed = parse_name(name, None).unwrap();
            assert_eq!((parsed.meaning, parsed.problem), (meaning, None), "{name}");
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
            "GPS (2D speed) [m/s]",
            "Accelerometer (x) [m/s2]",
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
