//! The meaning of each column of a table: from its header, else from `flight.format`, else from the values.

use std::path::Path;

use camsim_core::{
    flight_log::Note,
    scenario::{AttitudeSource, FlightSpec, LogFormat},
};

use super::{
    FlightLogError,
    attitude_columns::attitude_columns,
    column_meaning::{ColumnMeaning, FixCode},
    column_selection::{
        has_time_and_position, missing_columns_message, note_unused_columns, position_columns, time_columns,
    },
    columns::{AttitudeColumns, FieldSource, Frame, TimeColumns},
    detect,
    header::HeaderColumns,
    height_datum,
    text_table::{HeaderLine, Table},
    time_fields,
};

/// The meaning of the columns of a table.
#[derive(Clone, Debug)]
pub(super) struct TableLayout {
    pub(super) format: LogFormat,
    pub(super) time: TimeColumns,
    pub(super) frame: Frame,
    pub(super) position: [FieldSource; 3],
    pub(super) attitude: AttitudeColumns,
    /// Names of the columns: those of the header, or of the quantities.
    pub(super) names: Vec<String>,
    pub(super) has_header: bool,
    /// Column that identifies the vehicle of a row.
    pub(super) vehicle: Option<usize>,
    /// Column that numbers the receiver or estimator of a row.
    pub(super) receiver: Option<usize>,
    /// Column that says whether the receiver of a row was in use.
    pub(super) in_use: Option<usize>,
    /// Columns of the quality of a fix, with their codes.
    pub(super) fixes: Vec<(usize, FixCode)>,
}

impl TableLayout {
    pub(super) fn detect(
        path: &Path,
        table: &Table<'_>,
        spec: &FlightSpec,
        notes: &mut Vec<Note>,
    ) -> Result<Self, FlightLogError> {
        detect::refuse_pose_matrices(path, table)?;
        // The last header before the data counts. Comments that name no columns are skipped.
        for (index, line) in table.headers.iter().enumerate().rev() {
            let above = index.checked_sub(1).and_then(|above| table.headers.get(above));
            let Some(header) = parse_header(path, table, line, above)? else { continue };
            return Self::from_header(&header, table, spec, notes).map_err(|problem| {
                FlightLogError::Header { path: path.to_owned(), line: line.number, problem }
            });
        }
        let format = if spec.format == LogFormat::Auto {
            detect::detect_format(path, table, spec)?
        } else {
            spec.format
        };
        Ok(Self::without_header(table, format))
    }

    fn without_header(table: &Table<'_>, format: LogFormat) -> Self {
        let (frame, position) = match format {
            LogFormat::CsvXya => (Frame::NorthEastUp, ["north", "east", "altitude"]),
            LogFormat::CsvNed => (Frame::NorthEastDown, ["north", "east", "down"]),
            LogFormat::Tum | LogFormat::Euroc => (Frame::EastNorthUp, ["x", "y", "z"]),
            // The other formats are no tables.
            _ => (Frame::Geodetic, ["latitude", "longitude", "height"]),
        };
        let (attitude, attitude_names) = match format {
            LogFormat::Tum => (AttitudeColumns::Quaternion([4, 5, 6, 7]), &["qx", "qy", "qz", "qw"][..]),
            LogFormat::Euroc => (AttitudeColumns::Quaternion([5, 6, 7, 4]), &["qw", "qx", "qy", "qz"][..]),
            _ if table.columns >= 7 => (
                AttitudeColumns::Euler([4, 5, 6].map(|column| FieldSource::whole(column, None))),
                &["roll", "pitch", "yaw"][..],
            ),
            _ => (AttitudeColumns::None, &[][..]),
        };
        Self {
            format,
            time: TimeColumns {
                column: 0,
                unit_ns: None,
                integers_are_ns: format == LogFormat::Euroc,
                date: None,
                nanoseconds: None,
            },
            frame,
            position: [1, 2, 3].map(|column| FieldSource::whole(column, None)),
            attitude,
            names: ["time"]
                .iter()
                .chain(&position)
                .chain(attitude_names)
                .map(|name| (*name).to_owned())
                .collect(),
            has_header: false,
            vehicle: None,
            receiver: None,
            in_use: None,
            fixes: Vec::new(),
        }
    }

    fn from_header(
        header: &HeaderColumns,
        table: &Table<'_>,
        spec: &FlightSpec,
        notes: &mut Vec<Note>,
    ) -> Result<Self, String> {
        let time = time_columns(header, table, notes)?;
        let attitude = if spec.attitude == AttitudeSource::Track {
            AttitudeColumns::None
        } else {
            attitude_columns(header, notes)?
        };
        let (frame, position) = position_columns(header, table, spec, time.column, notes)?;
        let is_euroc =
            spec.format == LogFormat::Euroc || header.stem(position[0].column).starts_with("p_rs_r");
        let format = match frame {
            Frame::Geodetic => LogFormat::CsvLla,
            Frame::NorthEastUp => LogFormat::CsvXya,
            Frame::NorthEastDown => LogFormat::CsvNed,
            Frame::EastNorthUp if is_euroc => LogFormat::Euroc,
            Frame::EastNorthUp => LogFormat::Tum,
        };
        let time = TimeColumns { integers_are_ns: format == LogFormat::Euroc, ..time };
        note_unused_columns(header, frame, attitude, notes);
        height_datum::check(header, table, position[2].column, frame, spec, notes);
        let names = header.0.iter().map(|column| column.name.clone()).collect();
        let first = |meaning: ColumnMeaning| header.columns_where(|other| other == meaning).first().copied();
        let fixes = (0..header.0.len()).filter_map(|column| match header.parsed(column)?.meaning {
            ColumnMeaning::Fix(code) => Some((column, code)),
            _ => None,
        });
        Ok(Self {
            format,
            time,
            frame,
            position,
            attitude,
            names,
            has_header: true,
            vehicle: first(ColumnMeaning::Vehicle),
            receiver: first(ColumnMeaning::Receiver),
            in_use: first(ColumnMeaning::InUse),
            fixes: fixes.collect(),
        })
    }

    /// Number of columns that a row must have.
    pub(super) fn required_columns(&self) -> usize {
        let attitude = match self.attitude {
            AttitudeColumns::None => 0,
            AttitudeColumns::Euler(sources) => sources.iter().map(|source| source.column).max().unwrap_or(0),
            AttitudeColumns::Quaternion(columns) => columns.into_iter().max().unwrap_or(0),
        };
        let time = self.time.column.max(self.time.date.unwrap_or(0)).max(self.time.nanoseconds.unwrap_or(0));
        1 + self.position.iter().map(|source| source.column).fold(attitude.max(time), usize::max)
    }

    /// Name of a column in brackets, with a blank before it, for messages: ` (`name`)`.
    pub(super) fn bracketed_name(&self, column: usize) -> String {
        self.names.get(column).map_or(String::new(), |name| {
            if self.has_header { format!(" (`{name}`)") } else { format!(" ({name})") }
        })
    }
}

/// Parses a line as a header, or as the line of units below the header `above`; `None` if it is a comment
/// that names no columns.
fn parse_header(
    path: &Path,
    table: &Table<'_>,
    line: &HeaderLine<'_>,
    above: Option<&HeaderLine<'_>>,
) -> Result<Option<HeaderColumns>, FlightLogError> {
    let names = names_of_columns(table, line.text);
    let with_units = |above: &HeaderLine<'_>| {
        HeaderColumns::parse_with_units(&table.names(above.text), &names).filter(has_time_and_position)
    };
    if let Some(header) = above.and_then(with_units) {
        return Ok(Some(header));
    }
    let problem =
        |problem: String| FlightLogError::Header { path: path.to_owned(), line: line.number, problem };
    let mut header = HeaderColumns::parse(&names);
    let is_complete = table.fits(names.len()) && has_time_and_position(&header);
    if line.is_comment
        && !is_complete
        && let Some(names_only) = header_after_prose(table, line.text)
    {
        header = names_only;
    }
    if !has_time_and_position(&header) {
        return if line.is_comment { Ok(None) } else { Err(problem(missing_columns_message(&header))) };
    }
    if !table.fits(header.0.len()) {
        // RTKLIB's names of such columns.
        if line.text.contains("latitude(d'\")") {
            return Err(problem(
                "degrees, minutes and seconds stand in columns of their own: write degrees with decimals \
                    (RTKLIB: Lat/Lon format ddd.ddddddd)"
                    .to_owned(),
            ));
        }
        return Err(problem(format!(
            "it names {} columns, but the rows have {}: give every column one name (a comma within a name \
                needs quotes, decimal commas need semicolons between the columns)",
            header.0.len(),
            table.columns
        )));
    }
    Ok(Some(header))
}

/// The names of a header, one for each column. A time in two columns, a date and a clock or a GPS week and
/// its seconds, may have one name.
fn names_of_columns<'a>(table: &Table<'a>, text: &'a str) -> Vec<&'a str> {
    let mut names = table.names(text);
    if names.len() + 1 != table.columns {
        return names;
    }
    let Some(first) = table.rows.first().map(|row| table.fields(row)) else { return names };
    let is_number_in = |field: &str, range: std::ops::Range<f64>| {
        table.number(field).is_some_and(|value| range.contains(&value))
    };
    for (index, pair) in first.windows(2).enumerate().take(names.len()) {
        let meaning = HeaderColumns::parse(&names[index..=index]).parsed(0).map(|parsed| parsed.meaning);
        if !matches!(meaning, Some(ColumnMeaning::Time | ColumnMeaning::DateTime)) {
            continue;
        }
        if time_fields::date_ns(pair[0]).is_some() && time_fields::clock_ns(pair[1]).is_some() {
            names.insert(index, "date");
            break;
        }
        // Weeks since 1980, of this century.
        if meaning == Some(ColumnMeaning::DateTime)
            && pair[0].bytes().all(|byte| byte.is_ascii_digit())
            && is_number_in(pair[0], 1000.0..6000.0)
            && is_number_in(pair[1], 0.0..604_801.0)
        {
            names.splice(index..=index, ["week", "tow_s"]);
            break;
        }
    }
    names
}

/// The header at the end of a comment, as in `# format: timestamp tx ty ...` and `# columns are t x y ...`:
/// the names after a colon or an equals sign, else as many of the last words as the table has columns.
fn header_after_prose(table: &Table<'_>, text: &str) -> Option<HeaderColumns> {
    let after_mark = text.match_indices([':', '=']).map(|(mark, _)| &text[mark + 1..]);
    let mut headers = after_mark.map(|text| HeaderColumns::parse(&table.names(text.trim())));
    let fits = |header: &HeaderColumns| table.fits(header.0.len()) && has_time_and_position(header);
    headers.find(fits).or_else(|| {
        let names = table.names(text);
        let prose_words = names.len().checked_sub(table.columns)?;
        let is_prose = names
            .get(..prose_words)?
            .iter()
            .all(|word| HeaderColumns::parse(&[word]).0.iter().all(|column| column.parsed.is_none()));
        is_prose.then(|| HeaderColumns::parse(&names[prose_words..])).filter(fits)
    })
}
