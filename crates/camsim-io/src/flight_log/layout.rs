//! Which column is what: from the header, or from `flight.format`, or from the values.

use std::path::Path;

use camsim_core::{
    flight_log::Note,
    scenario::{AttitudeSource, FlightSpec, LogFormat},
};

use super::{
    FlightLogError,
    choose::{
        attitude_columns, names_a_flight, position_columns, say_what_is_not_used, stem, time_columns,
        what_is_missing,
    },
    columns::{AttitudeColumns, Frame, Source, TimeColumns},
    detect,
    header::Header,
    names::Meaning,
    text::{HeaderLine, Table},
};

/// Columns of a file and what they mean.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    pub(super) format: LogFormat,
    pub(super) time: TimeColumns,
    pub(super) frame: Frame,
    pub(super) position: [Source; 3],
    pub(super) attitude: AttitudeColumns,
    /// As a header writes them, or by what they mean.
    pub(super) names: Vec<String>,
    pub(super) has_header: bool,
    /// Says whose row it is.
    pub(super) vehicle: Option<usize>,
}

impl Layout {
    pub(super) fn find(
        path: &Path,
        table: &Table<'_>,
        spec: &FlightSpec,
        notes: &mut Vec<Note>,
    ) -> Result<Self, FlightLogError> {
        detect::refuse_pose_matrices(path, table)?;
        // The header nearest to the data counts; prose in comments names no columns.
        for (index, line) in table.headers.iter().enumerate().rev() {
            let above = index.checked_sub(1).and_then(|above| table.headers.get(above));
            let Some(header) = header_of(path, table, line, above)? else { continue };
            return Self::from_header(&header, table, spec, notes).map_err(|problem| {
                FlightLogError::Header { path: path.to_owned(), line: line.number, problem }
            });
        }
        let format =
            if spec.format == LogFormat::Auto { detect::format(path, table, spec)? } else { spec.format };
        Ok(Self::without_header(table, format))
    }

    fn without_header(table: &Table<'_>, format: LogFormat) -> Self {
        let (frame, position) = match format {
            LogFormat::CsvXya => (Frame::NorthEastUp, ["north", "east", "altitude"]),
            LogFormat::CsvNed => (Frame::NorthEastDown, ["north", "east", "down"]),
            LogFormat::Tum | LogFormat::Euroc => (Frame::EastNorthUp, ["x", "y", "z"]),
            LogFormat::CsvLla | LogFormat::Auto | LogFormat::Gpx => {
                (Frame::Geodetic, ["latitude", "longitude", "height"])
            }
        };
        let (attitude, attitude_names) = match format {
            LogFormat::Tum => (AttitudeColumns::Quaternion([4, 5, 6, 7]), &["qx", "qy", "qz", "qw"][..]),
            LogFormat::Euroc => (AttitudeColumns::Quaternion([5, 6, 7, 4]), &["qw", "qx", "qy", "qz"][..]),
            _ if table.columns >= 7 => (
                AttitudeColumns::Euler([4, 5, 6].map(|column| Source::whole(column, None))),
                &["roll", "pitch", "yaw"][..],
            ),
            _ => (AttitudeColumns::None, &[][..]),
        };
        Self {
            format,
            time: TimeColumns {
                column: 0,
                unit_ns: None,
                whole_are_ns: format == LogFormat::Euroc,
                date: None,
                nanoseconds: None,
            },
            frame,
            position: [1, 2, 3].map(|column| Source::whole(column, None)),
            attitude,
            names: ["time"]
                .iter()
                .chain(&position)
                .chain(attitude_names)
                .map(|name| (*name).to_owned())
                .collect(),
            has_header: false,
            vehicle: None,
        }
    }

    fn from_header(
        header: &Header,
        table: &Table<'_>,
        spec: &FlightSpec,
        notes: &mut Vec<Note>,
    ) -> Result<Self, String> {
        let time = time_columns(header, notes)?;
        let attitude = if spec.attitude == AttitudeSource::Track {
            AttitudeColumns::None
        } else {
            attitude_columns(header, notes)?
        };
        let (frame, position) = position_columns(header, table, spec, time.column, notes)?;
        let is_euroc =
            spec.format == LogFormat::Euroc || stem(header, position[0].column).starts_with("p_rs_r");
        let format = match frame {
            Frame::Geodetic => LogFormat::CsvLla,
            Frame::NorthEastUp => LogFormat::CsvXya,
            Frame::NorthEastDown => LogFormat::CsvNed,
            Frame::EastNorthUp if is_euroc => LogFormat::Euroc,
            Frame::EastNorthUp => LogFormat::Tum,
        };
        let time = TimeColumns { whole_are_ns: format == LogFormat::Euroc, ..time };
        say_what_is_not_used(header, frame, attitude, notes);
        let names = header.0.iter().map(|column| column.name.clone()).collect();
        let vehicle = header.all(|meaning| meaning == Meaning::Vehicle).first().copied();
        Ok(Self { format, time, frame, position, attitude, names, has_header: true, vehicle })
    }

    /// Columns that a row must have.
    pub(super) fn columns_needed(&self) -> usize {
        let attitude = match self.attitude {
            AttitudeColumns::None => 0,
            AttitudeColumns::Euler(sources) => sources.iter().map(|source| source.column).max().unwrap_or(0),
            AttitudeColumns::Quaternion(columns) => columns.into_iter().max().unwrap_or(0),
        };
        let time = self.time.column.max(self.time.date.unwrap_or(0)).max(self.time.nanoseconds.unwrap_or(0));
        1 + self.position.iter().map(|source| source.column).fold(attitude.max(time), usize::max)
    }

    /// ` (`name`)`, for messages about a column.
    pub(super) fn named(&self, column: usize) -> String {
        self.names.get(column).map_or(String::new(), |name| {
            if self.has_header { format!(" (`{name}`)") } else { format!(" ({name})") }
        })
    }
}
/// The header that a line is, with its line of units; `None` if it is prose.
fn header_of(
    path: &Path,
    table: &Table<'_>,
    line: &HeaderLine<'_>,
    above: Option<&HeaderLine<'_>>,
) -> Result<Option<Header>, FlightLogError> {
    let names = table.names(line.text);
    let units = |above: &HeaderLine<'_>| {
        Header::parse_with_units(&table.names(above.text), &names).filter(names_a_flight)
    };
    if let Some(header) = above.and_then(units) {
        return Ok(Some(header));
    }
    let problem =
        |problem: String| FlightLogError::Header { path: path.to_owned(), line: line.number, problem };
    let mut header = Header::parse(&names);
    let is_whole = table.fits(names.len()) && names_a_flight(&header);
    if line.is_comment
        && !is_whole
        && let Some(without_prose) = without_prose(table, line.text)
    {
        header = without_prose;
    }
    if !names_a_flight(&header) {
        return if line.is_comment { Ok(None) } else { Err(problem(what_is_missing(&header))) };
    }
    if !table.fits(header.0.len()) {
        return Err(problem(format!(
            "it names {} columns, but the rows have {}: give every column one name (a comma within a name needs quotes, decimal commas need semicolons between the columns)",
            header.0.len(),
            table.columns
        )));
    }
    Ok(Some(header))
}

/// `# format: timestamp tx ty ...`, `# columns are t x y ...`: the names behind a colon, or the last ones, as
/// many as there are columns.
fn without_prose(table: &Table<'_>, text: &str) -> Option<Header> {
    let behind = text.match_indices([':', '=']).map(|(at, _)| &text[at + 1..]);
    let mut headers = behind.map(|text| Header::parse(&table.names(text.trim())));
    let fits = |header: &Header| table.fits(header.0.len()) && names_a_flight(header);
    headers.find(fits).or_else(|| {
        let names = table.names(text);
        let prose = names.len().checked_sub(table.columns)?;
        let is_prose = names
            .get(..prose)?
            .iter()
            .all(|word| Header::parse(&[word]).0.iter().all(|column| column.means.is_none()));
        is_prose.then(|| Header::parse(&names[prose..])).filter(fits)
    })
}
