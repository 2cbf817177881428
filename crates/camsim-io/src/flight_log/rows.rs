//! Parsing of rows: numbers in the units that the header names, else as the file has them.

use camsim_core::flight_log::Note;

use super::{
    columns::{AttitudeColumns, FieldSource, Frame},
    layout::TableLayout,
    text_table::{self, Line, Table},
    time_fields::{self, Clock, TimeFormat},
    written_numbers,
};

/// The numbers of a row; NaN where a value is missing.
#[derive(Clone, Copy, Debug)]
pub(super) struct ParsedRow {
    /// Line in the file, from 1.
    pub(super) line: usize,
    /// Nanoseconds of clock times and dates, else the number in 1e-12 of its unit; `None` where it is
    /// missing.
    pub(super) time: Option<i128>,
    /// Position, in degrees and metres unless the header names no unit.
    pub(super) position: [f64; 3],
    /// Roll, pitch, yaw and NaN, or a quaternion x, y, z, w.
    pub(super) attitude: [f64; 4],
}

impl ParsedRow {
    pub(super) fn has_position(&self) -> bool {
        self.position.iter().all(|value| value.is_finite())
    }

    pub(super) fn has_attitude(&self) -> bool {
        self.attitude[..3].iter().any(|value| !value.is_nan())
    }
}

/// All rows of a table.
#[derive(Debug)]
pub(super) struct ParsedRows {
    /// What the times are.
    pub(super) clock: Clock,
    /// Rows in the order of the file.
    pub(super) rows: Vec<ParsedRow>,
}

/// Parses all rows.
///
/// # Errors
/// A field is no number, a row is too short or too long, a position is out of range, or there are several
/// vehicles.
pub(super) fn read(
    table: &Table<'_>,
    layout: &TableLayout,
    notes: &mut Vec<Note>,
) -> Result<ParsedRows, String> {
    let format = table.column(layout.time.column).find_map(TimeFormat::detect);
    check_single_vehicle(table, layout)?;
    let date = layout.time.date.filter(|_| format == Some(TimeFormat::Clock));
    let unread = date.and_then(|date| constant_text(table, date));
    if let Some((column, text)) = date.zip(unread).filter(|(_, text)| !text_table::is_missing(text)) {
        notes.push(Note::warning(format!(
            "{} holds dates that are not read (`{text}`): write year-month-day; the times count from \
                midnight",
            layout.describe(column)
        )));
    }
    let reader = RowReader {
        date: date.filter(|_| unread.is_none()),
        table,
        layout,
        format: format.unwrap_or(TimeFormat::Number),
        max_columns: if layout.has_header { layout.names.len() } else { table.columns },
    };
    let mut fields = Vec::new();
    let rows = table.rows.iter().map(|line| reader.row(line, &mut fields)).collect::<Result<_, _>>()?;
    let clock = Clock { format: reader.format, has_dates: reader.date.is_some() };
    Ok(ParsedRows { clock, rows })
}

/// Parses the rows of a table.
struct RowReader<'a> {
    table: &'a Table<'a>,
    layout: &'a TableLayout,
    format: TimeFormat,
    /// The column of dates, unless it has one constant, unreadable text.
    date: Option<usize>,
    /// Number of columns that a row may have.
    max_columns: usize,
}

/// Refuses rows of several vehicles.
fn check_single_vehicle(table: &Table<'_>, layout: &TableLayout) -> Result<(), String> {
    let Some(column) = layout.vehicle else { return Ok(()) };
    let rows = table.rows.iter().map(|row| (row.number, table.field(row, column)));
    let mut named = rows.filter(|(_, name)| !text_table::is_missing(name));
    let Some((_, first)) = named.next() else { return Ok(()) };
    match named.find(|(_, name)| *name != first) {
        Some((line, name)) => Err(format!(
            "line {line}: `{name}` in {}, but `{first}` before: keep the rows of one vehicle, or remove the \
                column if they are all of one",
            layout.describe(column)
        )),
        None => Ok(()),
    }
}

/// The text that a column holds throughout, if it is no date. Such dates are not read.
fn constant_text<'a>(table: &Table<'a>, column: usize) -> Option<&'a str> {
    let first = table.column(column).next()?;
    let is_unread = |field: &str| time_fields::date_ns(field).is_none() && field == first;
    table.column(column).all(is_unread).then_some(first)
}

impl<'a> RowReader<'a> {
    fn row(&self, line: &Line<'a>, fields: &mut Vec<&'a str>) -> Result<ParsedRow, String> {
        self.table.separator.split(line.text, fields);
        if fields.iter().skip(self.max_columns).any(|field| !field.is_empty()) {
            return Err(format!(
                "line {} has {} columns, but only {} are known: a separator within a field shifts the ones \
                    behind it (put the field in quotes)",
                line.number,
                fields.len(),
                self.max_columns
            ));
        }
        let row = RowFields { reader: self, line: line.number, fields };
        let time = row.time()?;
        let mut position = [f64::NAN; 3];
        for (axis, source) in self.layout.position.into_iter().enumerate() {
            let number = row.number(source);
            position[axis] = number.or_else(|error| row.written_number(axis, source).ok_or(error))?;
        }
        if self.layout.frame == Frame::Geodetic {
            row.check_geodetic_range(position)?;
        }
        let sources = match self.layout.attitude {
            AttitudeColumns::None => Vec::new(),
            AttitudeColumns::Euler(sources) => sources.to_vec(),
            AttitudeColumns::Quaternion(columns) => {
                columns.map(|column| FieldSource::whole(column, None)).to_vec()
            }
        };
        let mut attitude = [f64::NAN; 4];
        for (value, source) in attitude.iter_mut().zip(sources) {
            *value = row.number(source)?;
        }
        Ok(ParsedRow { line: line.number, time, position, attitude })
    }
}

/// The fields of one row.
struct RowFields<'a, 'b> {
    reader: &'b RowReader<'a>,
    line: usize,
    fields: &'b [&'a str],
}

impl<'a> RowFields<'a, '_> {
    fn field(&self, column: usize) -> Result<&'a str, String> {
        let layout = self.reader.layout;
        self.fields.get(column).copied().ok_or_else(|| {
            format!(
                "line {} has {} columns, {} needs {}; complete the line or set flight.format",
                self.line,
                self.fields.len(),
                layout.format.name(),
                layout.required_columns()
            )
        })
    }

    /// Line and column of a field, for messages.
    fn location(&self, column: usize) -> String {
        format!("line {}, {}", self.line, self.reader.layout.describe(column))
    }

    fn not_a_number(&self, column: usize, text: &str) -> String {
        format!("{}: `{text}` is not a number{}", self.location(column), hint(text))
    }

    fn number(&self, source: FieldSource) -> Result<f64, String> {
        let field = self.field(source.column)?;
        let bad = || self.not_a_number(source.column, field);
        let value = match source.part {
            None => self.reader.table.number(field).ok_or_else(bad)?,
            Some(_) if text_table::is_missing(field) => f64::NAN,
            Some(part) => {
                let parts: Vec<&str> =
                    field.split([' ', ',', ';', '/']).filter(|part| !part.is_empty()).collect();
                let number = |text: &str| text_table::number(text, false);
                if parts.len() == 2 { number(parts[part]).ok_or_else(bad)? } else { return Err(bad()) }
            }
        };
        Ok(value * source.factor.unwrap_or(1.0))
    }

    /// A latitude, longitude (axes 0 and 1) or height with its unit in the field, as exiftool writes it.
    fn written_number(&self, axis: usize, source: FieldSource) -> Option<f64> {
        let is_base_unit = source.factor.is_none_or(|factor| factor == 1.0);
        if self.reader.layout.frame != Frame::Geodetic || !is_base_unit {
            return None;
        }
        let field = self.fields.get(source.column)?;
        match source.part {
            Some(part) => written_numbers::degrees(field.split(',').nth(part)?),
            None if axis < 2 => written_numbers::degrees(field),
            None => written_numbers::metres(field),
        }
    }

    fn time(&self) -> Result<Option<i128>, String> {
        let columns = self.reader.layout.time;
        let field = self.field(columns.column)?;
        if text_table::is_missing(field) {
            return Ok(None);
        }
        let bad = |column: usize, text: &str| self.not_a_number(column, text);
        match self.reader.format {
            TimeFormat::DateTime => {
                time_fields::date_time_ns(field).map(Some).ok_or_else(|| bad(columns.column, field))
            }
            TimeFormat::Clock => {
                let clock = time_fields::clock_ns(field).ok_or_else(|| bad(columns.column, field))?;
                let Some(column) = self.reader.date else { return Ok(Some(clock)) };
                let date = self.field(column)?;
                if text_table::is_missing(date) {
                    return Ok(None);
                }
                time_fields::date_ns(date).map(|day| Some(day + clock)).ok_or_else(|| bad(column, date))
            }
            TimeFormat::Number => {
                let decimal_commas = self.reader.table.has_decimal_commas;
                let seconds = time_fields::fixed_point(field, decimal_commas)
                    .ok_or_else(|| bad(columns.column, field))?;
                let Some(column) = columns.nanoseconds else { return Ok(seconds) };
                let field = self.field(column)?;
                let part =
                    time_fields::fixed_point(field, decimal_commas).ok_or_else(|| bad(column, field))?;
                // Seconds in steps of 1e-12 s, nanoseconds in steps of 1e-12 ns.
                Ok(seconds.zip(part).map(|(seconds, part)| seconds + part / 1_000_000_000))
            }
        }
    }

    /// Refuses latitudes, longitudes and heights that are out of range.
    fn check_geodetic_range(&self, [latitude, longitude, height_m]: [f64; 3]) -> Result<(), String> {
        let sources = self.reader.layout.position;
        let fail = |source: FieldSource, what: &str, value: f64, advice: &str| {
            Err(format!("{}: {value} is no {what}; {advice}", self.location(source.column)))
        };
        for (source, what, value, limit) in
            [(sources[0], "latitude", latitude, 90.0), (sources[1], "longitude", longitude, 360.0)]
        {
            if value.is_finite() && value.abs() > limit {
                let advice = if what == "latitude" && value.abs() <= 180.0 && longitude.abs() <= 90.0 {
                    "are latitude and longitude swapped? Then swap the names of their columns"
                } else if value.abs() > 1e5 && source.factor.is_none() && value.fract() == 0.0 {
                    "are these 1e-7 degrees? Then name the columns lat_e7 and lon_e7"
                } else if are_degrees_and_minutes([latitude, longitude]) {
                    "are these degrees and minutes (ddmm.mmmm, as in NMEA: 4703.0 is 47 degrees and 3 minutes, \
                        47.05)? Then write degrees with decimals"
                } else {
                    "are these metres? Then set flight.format = \"csv-xya\" or \"csv-ned\""
                };
                return fail(source, what, value, advice);
            }
        }
        if height_m.is_finite() && !(-1000.0..=1e5).contains(&height_m) {
            let advice = "leave the field empty where the height is missing, or name the unit in the header \
                (alt_mm, alt_cm, alt_ft)";
            return fail(sources[2], "height in metres", height_m, advice);
        }
        Ok(())
    }
}

/// Whether a latitude and a longitude may be degrees and minutes written as one number.
fn are_degrees_and_minutes(position: [f64; 2]) -> bool {
    let limits = [90.0, 180.0];
    position
        .into_iter()
        .zip(limits)
        .all(|(value, limit)| (value.abs() / 100.0).trunc() <= limit && value.abs() % 100.0 < 60.0)
}

/// Advice for a field that is no number, by its appearance.
fn hint(text: &str) -> &'static str {
    let digits = text.bytes().filter(u8::is_ascii_digit).count();
    if time_fields::clock_ns(text).is_some() || time_fields::date_time_ns(text).is_some() {
        "; it is a time, but other rows have numbers there"
    } else if digits >= 6 && text.contains(['/', '-', '.']) && text.split(['/', '-', '.']).count() >= 3 {
        "; dates are year-month-day, times 2023-05-01T10:00:00Z"
    } else if digits > 0 && text.contains(':') {
        "; times are numbers, hours:minutes:seconds or 2023-05-01T10:00:00Z"
    } else if digits > 0 && text.contains(',') {
        "; write decimals with a point, or all numbers of the file with a comma and semicolons between them"
    } else if digits > 0 && text.ends_with(['N', 'S', 'E', 'W']) {
        "; write signed degrees without a letter"
    } else if digits > 0 && text.contains(['°', '\'', '"']) {
        "; write degrees with decimals, and units in the header"
    } else if text.contains('"') {
        "; a quote is not closed or not at the beginning of the field"
    } else if text.chars().all(|c| c.is_alphabetic() || c == '_') {
        "; leave it empty where the value is missing; a second header line does not belong here"
    } else {
        ""
    }
}
