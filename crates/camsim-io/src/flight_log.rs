//! Flight log files: CSV (geodetic or local), TUM and EuRoC trajectories, with or without a header line.
//!
//! | format | columns without a header | frames |
//! |---|---|---|
//! | `csv-lla` | t s, lat, lon, height, roll, pitch, yaw | degrees, metres; ZYX angles of the body (FRD) in the local tangent frame |
//! | `csv-xya` | t s, north, east, altitude (up), roll, pitch, yaw | metres, degrees |
//! | `csv-ned` | t s, north, east, down, roll, pitch, yaw | metres, degrees |
//! | `tum` | t s, x, y, z, qx, qy, qz, qw | see below |
//! | `euroc` | t ns, x, y, z, qw, qx, qy, qz | see below; a first column with a decimal point is seconds |
//!
//! Columns without use are named in notes; the CSV formats may end after the position (then `flight.attitude = "track"`
//! is needed). A header line, also as a comment, names the columns in any order and takes precedence over the
//! table; it may name units, which are converted (`column_names`, `units`). Separators are commas, semicolons
//! (then decimals may have commas), tabs or blanks; fields may stand in quotes; `#` and `%` begin comments;
//! BOM and CRLF are fine. An empty field is a missing value, and so are NA, NaN, null, none and `-`. Only
//! columns that are used must be numbers.
//!
//! Other files are recognised by their content, else by their ending (`kinds`): PX4 logs (`ulog`), ArduPilot
//! logs (`dataflash`), ROS poses (`mcap_file`), flight records of gliders (`igc`), GPX (`gpx`) and KML (`kml`).
//! Their positions and attitudes may be in streams of their own (`streams`). Further formats are refused with
//! the tool that converts them (`foreign_formats`). Ambiguities are refused, or resolved with a note in the
//! log: units that no header names (`time_unit`, `angle_unit`), clocks that roll over (`clock_rollover`),
//! tables merged from several streams (`sparse_rows`). docs/reference/inputs/LOGS.md lists all names and
//! units; it is generated from the tables in these modules.
//!
//! **TUM and EuRoC** worlds have z up: x is taken as east, y as north. Their quaternions (Hamilton, world
//! from body) belong to a body with x forward, y left, z up (FLU, as in ROS), and are converted to FRD. For
//! poses of a sensor with other axes, `camera.mount` corrects them. The JPL quaternion of rotation "global to
//! body" has the same numbers as the Hamilton "body to global", so files of `open_vins` need no conversion.

use std::path::Path;

use camsim_core::{
    flight_log::{
        FlightLog, HeightConversion, LogError, LogOptions, LogRow, Note, RawAttitude, RawPosition, RawRow,
    },
    geodesy::Geodetic,
    scenario::{AttitudeSource, FlightSpec, LogFormat},
};
use glam::{DQuat, DVec3};

mod angle_unit;
mod attitude_check;
mod attitude_columns;
mod clock_rollover;
mod column_meaning;
mod column_names;
mod columns;
mod dataflash;
mod detect;
mod error;
mod foreign_formats;
mod frame_columns;
mod gpx;
mod header;
mod header_lines;
mod height_column;
mod height_datum;
mod held_positions;
mod igc;
mod kinds;
mod kml;
mod layout;
mod mcap_file;
mod message_columns;
mod missing_columns;
mod motive;
mod page;
mod position_columns;
mod preamble;
mod quaternions;
mod receiver_logs;
mod row_selection;
mod row_states;
mod rows;
mod scalars;
mod sparse_rows;
mod split_stamps;
mod stamp_resolution;
mod statements;
mod streams;
mod tagged_lines;
mod text_table;
mod time_columns;
mod time_fields;
mod time_unit;
mod ulog;
mod units;
mod unused_columns;
mod unused_keys;
mod word_list;
mod written_numbers;
mod xml;

use columns::{AttitudeColumns, AttitudeKind, Frame};
use layout::TableLayout;
use text_table::Table;

use crate::{
    formats::axes::{enu, enu_from_flu},
    similar_file::suggestion,
};

pub use error::{FlightLogError, LogProblem};
pub use page::page;

/// The rows of a file before cleaning, with notes about them.
#[derive(Clone, Debug, PartialEq)]
pub struct RawLog {
    /// Rows, in the file's order.
    pub rows: Vec<RawRow>,
    /// Notes about what was inferred, chosen, or skipped.
    pub notes: Vec<Note>,
    /// How quaternions of a table were read; `None` of other files and other attitudes.
    quaternions: Option<attitude_check::QuaternionReading>,
}

/// Speed between two rows above which a jump of the position is reported.
const JUMP_M_S: f64 = 1000.0;

/// Reads and cleans the log at `path` as `spec` says. `path` replaces `spec.log`, which may be relative.
///
/// `height` depends on the terrain's vertical datum too: no conversion where both agree.
///
/// # Errors
/// [`FlightLogError`] names the file, the line and the column or key, and what to do.
pub fn read_flight_log(
    path: &Path,
    spec: &FlightSpec,
    height: HeightConversion,
) -> Result<FlightLog, FlightLogError> {
    let cleaned = read(path, spec).and_then(|raw| cleaned(&raw, spec, height));
    cleaned.map_err(|problem| FlightLogError { path: path.to_owned(), problem })
}

/// Reads the rows of a log before any cleaning, in nanoseconds, degrees and metres.
///
/// # Errors
/// As [`read_flight_log`].
pub fn read_raw_rows(path: &Path, spec: &FlightSpec) -> Result<RawLog, FlightLogError> {
    read(path, spec).map_err(|problem| FlightLogError { path: path.to_owned(), problem })
}

/// The log of raw rows, with all notes.
fn cleaned(raw: &RawLog, spec: &FlightSpec, height: HeightConversion) -> Result<FlightLog, LogProblem> {
    let options = LogOptions::from_spec(spec, height);
    let mut log = FlightLog::from_raw(&raw.rows, &options).map_err(|error| {
        // Notes about incomplete attitudes explain a missing one.
        let attitude_notes: Vec<&str> =
            raw.notes.iter().map(|note| &*note.text).filter(|text| text.contains("attitude")).collect();
        if error == LogError::NoAttitude && !attitude_notes.is_empty() {
            return LogProblem::Content(format!("{error}: {}", attitude_notes.join("; ")));
        }
        error.into()
    })?;
    log.notes.clone_from(&raw.notes);
    if spec.attitude == AttitudeSource::Log {
        let notes = attitude_check::notes(&log, raw);
        log.notes.extend(notes);
    }
    without_repetitions(&mut log.notes);
    // Only geodetic positions are known to be in metres; local ones may have any unit of length.
    if raw.rows.iter().any(|row| matches!(row.position, RawPosition::Geodetic(_))) {
        log.notes.extend(jump_note(&log));
    }
    Ok(log)
}

/// Removes notes that repeat another one, as those of several streams of a file may.
fn without_repetitions(notes: &mut Vec<Note>) {
    let all = notes.clone();
    let mut index = 0;
    notes.retain(|note| {
        index += 1;
        !all[..index - 1].contains(note)
    });
}

/// A warning about jumps of the position that are left after cleaning.
fn jump_note(log: &FlightLog) -> Option<Note> {
    let is_jump = |pair: &&[LogRow]| {
        pair[0].position_ned_m.distance(pair[1].position_ned_m) > JUMP_M_S * (pair[1].t_s - pair[0].t_s)
    };
    let mut jumps = log.rows.windows(2).filter(is_jump);
    let first = jumps.next()?;
    let (from, to) = (first[0], first[1]);
    let more = jumps.count();
    Some(Note::warning(format!(
        "the flight jumps by {:.0} m within {:.3} s at {:.3} s from its start{}: check the positions and \
                times there",
        from.position_ned_m.distance(to.position_ned_m),
        to.t_s - from.t_s,
        from.t_s,
        if more > 0 { format!(", and at {more} more times") } else { String::new() }
    )))
}

/// Reads a file as the reader of its kind does.
fn read(path: &Path, spec: &FlightSpec) -> Result<RawLog, LogProblem> {
    let bytes =
        std::fs::read(path).map_err(|source| LogProblem::Read { source, suggestion: suggestion(path) })?;
    if let Some(format) = kinds::detect(path, &bytes, spec) {
        return kinds::read(format, &bytes, spec);
    }
    if let Some(format) = foreign_formats::detect(&bytes) {
        return Err(foreign_formats::refusal(format).into());
    }
    let content = std::str::from_utf8(&bytes).map_err(|error| LogProblem::NotText(error.valid_up_to()))?;
    let content = content.strip_prefix('\u{feff}').unwrap_or(content);
    if content.trim_start().starts_with('<') {
        return Ok(gpx::read(content.trim_start(), spec)?);
    }
    if matches!(spec.format, LogFormat::Gpx | LogFormat::Kml) {
        let name = spec.format.name();
        return Err(format!("flight.format is \"{name}\" but the file is no XML; remove the key").into());
    }
    if motive::is_motive(content) {
        return Ok(motive::read(content, spec)?);
    }
    read_table(content, spec)
}

/// Reads a table: each step makes new values of those of the steps before it, and notes what it does.
fn read_table(content: &str, spec: &FlightSpec) -> Result<RawLog, LogProblem> {
    let table = Table::with_rows(content)?;
    let mut notes = table.notes.clone();
    let log = &mut notes;
    log.extend(unused_keys::unused_topic_note(spec));
    let layout = TableLayout::detect(&table, spec, log)?;
    let (is_geodetic, kind) = (layout.frame == Frame::Geodetic, layout.attitude.kind());

    let table = row_selection::good_rows(table, &layout, log)?;
    let parsed = rows::read(&table, &layout, log)?;
    let (table, parsed) = row_states::one_track(table, &layout, parsed, log);
    row_states::warn_of_states(&table, &layout, &parsed.rows, log);
    angle_unit::check_degrees(&parsed.rows, &layout)?;
    let (clock, rows) = time_unit::in_nanoseconds(parsed, &layout, spec, log)?;
    let rows = angle_unit::in_degrees(rows, &layout, spec, log)?;
    let rows = quaternions::normalised(rows, kind, log)?;
    let (frame, rows) = frame_columns::turned(rows, &table, &layout, log)?;
    let week = layout.time.week.and_then(|column| table.first_number(column));
    let rows = clock_rollover::continuous(rows, clock, week, log)?;
    let rows = stamp_resolution::spread_equal_stamps(rows, log);
    let rows = held_positions::interpolated(rows, is_geodetic, log);
    let rows = sparse_rows::interpolated(rows, is_geodetic, kind, log);

    if table.has_decimal_commas {
        notes.push(Note::information("commas are read as the beginning of decimals"));
    }
    let quaternions = match layout.attitude {
        AttitudeColumns::Quaternion([x, _, _, w]) => Some(attitude_check::QuaternionReading {
            is_scalar_first: w < x,
            is_enu: frame == Frame::EastNorthUp,
        }),
        _ => None,
    };
    let rows = rows.iter().map(|row| raw_row(row, frame, kind)).collect();
    Ok(RawLog { rows, notes, quaternions })
}

/// A row in the frames of camsim: geodetic or north-east-down positions, forward-right-down bodies.
fn raw_row(row: &rows::ParsedRow, frame: Frame, kind: AttitudeKind) -> RawRow {
    let [a, b, c] = row.position;
    let position = match frame {
        Frame::Geodetic => RawPosition::Geodetic(Geodetic::from_deg(a, b, c)),
        Frame::NorthEastUp => RawPosition::Ned(DVec3::new(a, b, -c)),
        Frame::NorthEastDown => RawPosition::Ned(DVec3::new(a, b, c)),
        Frame::EastNorthUp => RawPosition::Ned(enu(DVec3::new(a, b, c))),
    };
    let attitude = match kind {
        // A partial attitude is kept, with NaN: the cleaning treats it as faulty.
        _ if !row.has_attitude() => RawAttitude::None,
        AttitudeKind::None => RawAttitude::None,
        AttitudeKind::Euler => RawAttitude::EulerDeg([row.attitude[0], row.attitude[1], row.attitude[2]]),
        AttitudeKind::Quaternion => {
            let world_from_body = DQuat::from_array(row.attitude);
            RawAttitude::Quaternion(match frame {
                Frame::EastNorthUp => enu_from_flu(world_from_body),
                _ => world_from_body,
            })
        }
    };
    RawRow { line: row.line, t_ns: row.time.and_then(|time| i64::try_from(time).ok()), position, attitude }
}

#[cfg(test)]
mod hostile;
#[cfg(test)]
mod tests;
