//! The meaning of each column of a table: from its header, else from `flight.format`, else from the values.

use camsim_core::{
    flight_log::Note,
    scenario::{AttitudeSource, FlightSpec, LogFormat},
};

use super::{
    attitude_columns::attitude_columns,
    column_meaning::{ColumnMeaning, FixCode},
    columns::{AttitudeColumns, AttitudeKind, FieldSource, Frame, TimeColumns},
    detect,
    error::LogProblem,
    header::HeaderColumns,
    header_lines::{HeaderLines, width_message},
    height_datum,
    position_columns::position_columns,
    statements,
    text_table::Table,
    time_columns::time_columns,
    unused_columns::note_unused_columns,
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
        table: &Table<'_>,
        spec: &FlightSpec,
        notes: &mut Vec<Note>,
    ) -> Result<Self, LogProblem> {
        detect::refuse_pose_matrices(table)?;
        let mut header_lines = HeaderLines::sort(table, spec, notes)?;
        let mut layout = match (&header_lines.names, &header_lines.misfit) {
            (Some((line, header)), _) => Self::from_header(header, table, spec, notes)
                .map_err(|problem| format!("line {line}: {problem}"))?,
            (None, misfit) => {
                let misfit = misfit.as_ref().map(|(line, names)| (*line, &names[..]));
                Self::without_names(table, spec, misfit, notes)?
            }
        };
        // The comment that is read in full.
        header_lines.prose.retain(|line| height_datum::of_comment(line).is_none());
        // Names are no prose.
        if let Some((misfit, _)) = &header_lines.misfit {
            header_lines.prose.retain(|line| line.number != *misfit);
        }
        statements::apply(&mut layout, table, &header_lines.prose, spec, notes);
        Ok(layout)
    }

    /// The layout of a table without names, by flight.format or by the values. `misfit` are names of a comment
    /// that are not as many as the columns: those of the first columns must mean the same.
    fn without_names(
        table: &Table<'_>,
        spec: &FlightSpec,
        misfit: Option<(usize, &[&str])>,
        notes: &mut Vec<Note>,
    ) -> Result<Self, LogProblem> {
        let detected = match spec.format {
            LogFormat::Auto => detect::detect_format(table, spec),
            format => Ok(format),
        };
        let Some((line, names)) = misfit else {
            return Ok(Self::without_header(table, detected?, spec));
        };
        let first = HeaderColumns::parse(names.get(..table.columns).unwrap_or(names));
        let named = Self::from_header(&first, table, spec, &mut Vec::new());
        // Names of other columns before those of the attitude leave the attitude to the values.
        let track = FlightSpec { attitude: AttitudeSource::Track, ..spec.clone() };
        let path_named = Self::from_header(&first, table, &track, &mut Vec::new());
        let agrees = |layout: &Self| match &named {
            Ok(named) if named.attitude.kind() != AttitudeKind::None => named.has_columns_of(layout),
            _ => {
                names.len() > table.columns
                    && path_named.as_ref().is_ok_and(|named| named.has_path_columns_of(layout))
            }
        };
        match detected.map(|format| Self::without_header(table, format, spec)) {
            Ok(mut layout) if spec.format != LogFormat::Auto || agrees(&layout) => {
                if let Some(named) = named.as_ref().ok().filter(|named| named.has_columns_of(&layout)) {
                    layout.time.unit_ns = named.time.unit_ns;
                    layout.position = named.position;
                    layout.attitude = named.attitude;
                }
                notes.push(Note::warning(format!(
                    "line {line} names {} columns, but the rows have {}: they are read as {}",
                    names.len(),
                    table.columns,
                    layout.names.join(", ")
                )));
                Ok(layout)
            }
            _ => Err(format!("line {line}: {}", width_message(names, table)).into()),
        }
    }

    /// Whether time, position and attitude are in the same columns as those of another layout.
    fn has_columns_of(&self, other: &Self) -> bool {
        self.has_path_columns_of(other) && self.attitude.columns() == other.attitude.columns()
    }

    /// Whether time and position are in the same columns as those of another layout.
    fn has_path_columns_of(&self, other: &Self) -> bool {
        let columns = |layout: &Self| (layout.time.column, layout.position.map(|source| source.column));
        self.frame == other.frame && columns(self) == columns(other)
    }

    fn without_header(table: &Table<'_>, format: LogFormat, spec: &FlightSpec) -> Self {
        let (frame, position) = match format {
            LogFormat::CsvXya => (Frame::NorthEastUp, ["north", "east", "altitude"]),
            LogFormat::CsvNed => (Frame::NorthEastDown, ["north", "east", "down"]),
            LogFormat::Tum | LogFormat::Euroc => (Frame::EastNorthUp, ["x", "y", "z"]),
            // The other formats are no tables.
            _ => (Frame::Geodetic, ["latitude", "longitude", "height"]),
        };
        let (attitude, attitude_names) = match format {
            _ if spec.attitude == AttitudeSource::Track => (AttitudeColumns::None, &[][..]),
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
            time: TimeColumns { integers_are_ns: format == LogFormat::Euroc, ..TimeColumns::default() },
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
        let first = |meaning| header.columns(meaning).first().copied();
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
        let attitude = self.attitude.columns().into_iter().max().unwrap_or(0);
        let time = self.time.column.max(self.time.date.unwrap_or(0)).max(self.time.nanoseconds.unwrap_or(0));
        1 + self.position.iter().map(|source| source.column).fold(attitude.max(time), usize::max)
    }

    /// A column for messages: ``column 2 (`name`)``.
    pub(super) fn describe(&self, column: usize) -> String {
        format!("column {}{}", column + 1, self.bracketed_name(column))
    }

    /// Name of a column in brackets, with a blank before it, for messages: ` (`name`)`.
    pub(super) fn bracketed_name(&self, column: usize) -> String {
        self.names.get(column).map_or(String::new(), |name| {
            if self.has_header { format!(" (`{name}`)") } else { format!(" ({name})") }
        })
    }
}
