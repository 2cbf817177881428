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
//! Further columns are ignored; the CSV formats may end after the position (then `flight.attitude = "track"`
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
mod column_selection;
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
mod preamble;
mod quaternions;
mod receiver_logs;
mod reference;
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
mod time_fields;
mod time_unit;
mod ulog;
mod units;
mod unknown_unit;
mod unused_keys;
mod written_numbers;
mod xml_prose;

use columns::{AttitudeColumns, AttitudeKind, Frame};
use layout::TableLayout;

use crate::calibration::axes::{enu, enu_from_flu};
pub use error::FlightLogError;
pub use reference::reference;

/// The rows of a file before cleaning, with notes about them.
#[derive(Clone, Debug, PartialEq)]
pub struct RawLog {
    /// Rows, in the file's order.
    pub rows: Vec<RawRow>,
    /// Notes about what was inferred, chosen, or left out.
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
    let raw = read_raw_rows(path, spec)?;
    let options = LogOptions::from_spec(spec, height);
    let mut log = FlightLog::from_raw(&raw.rows, &options).map_err(|source| {
        // Notes about incomplete attitudes explain a missing one.
        let attitude_notes: Vec<&str> = raw
            .notes
            .iter()
            .filter(|note| note.text.contains("attitude"))
            .map(|note| note.text.as_str())
            .collect();
        if source == LogError::NoAttitude && !attitude_notes.is_empty() {
            return FlightLogError::Values {
                path: path.to_owned(),
                problem: format!("{source}: {}", attitude_notes.join("; ")),
            };
        }
        FlightLogError::Log { path: path.to_owned(), source }
    })?;
    log.notes.clone_from(&raw.notes);
    if spec.attitude == AttitudeSource::Log {
        let notes = attitude_check::notes(&log, &raw);
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
    Some(Note {
        is_warning: true,
        text: format!(
            "the flight jumps by {:.0} m within {:.3} s at {:.3} s from its start{}: check the positions and \
                times there",
            from.position_ned_m.distance(to.position_ned_m),
            to.t_s - from.t_s,
            from.t_s,
            if more > 0 { format!(", and in {more} more places") } else { String::new() }
        ),
    })
}

/// Reads the rows of a log before any cleaning, in nanoseconds, degrees and metres.
///
/// # Errors
/// As [`read_flight_log`].
pub fn read_raw_rows(path: &Path, spec: &FlightSpec) -> Result<RawLog, FlightLogError> {
    let bytes =
        std::fs::read(path).map_err(|source| FlightLogError::Read { path: path.to_owned(), source })?;
    if let Some(format) = kinds::detect(path, &bytes, spec) {
        return kinds::read(format, path, &bytes, spec);
    }
    if let Some((what, advice)) = foreign_formats::detect(&bytes) {
        return Err(FlightLogError::OtherFormat { path: path.to_owned(), what, advice });
    }
    let content = std::str::from_utf8(&bytes)
        .map_err(|error| FlightLogError::NotText { path: path.to_owned(), offset: error.valid_up_to() })?;
    let content = content.strip_prefix('\u{feff}').unwrap_or(content);
    if content.trim_start().starts_with('<') {
        return gpx::read(path, content.trim_start(), spec);
    }
    let problem = |problem: String| FlightLogError::Values { path: path.to_owned(), problem };
    if matches!(spec.format, LogFormat::Gpx | LogFormat::Kml) {
        return Err(problem(format!(
            "flight.format is \"{}\" but the file is no XML; remove the key",
            columns::format_name(spec.format)
        )));
    }
    if motive::is_motive(content) {
        return motive::read(path, content, spec);
    }
    let mut table = text_table::Table::new(content);
    if table.rows.is_empty() {
        let lines = table.headers.len();
        // One comment or two are a file without data, not data behind marks.
        let only_comments = lines > 2 && table.headers.iter().all(|line| line.is_comment);
        return Err(match only_comments {
            true => FlightLogError::OnlyComments { path: path.to_owned(), lines },
            false => FlightLogError::Empty { path: path.to_owned() },
        });
    }
    let mut notes = table.notes.clone();
    notes.extend(unused_keys::unused_topic_note(spec));
    let layout = TableLayout::detect(path, &table, spec, &mut notes)?;
    row_selection::keep_rows(&mut table, &layout, &mut notes).map_err(problem)?;
    let mut rows = rows::read(path, &table, &layout, &mut notes)?;
    row_states::keep_one_track(&mut table, &layout, &mut rows.rows, &mut notes);
    row_states::warn_of_states(&table, &layout, &rows.rows, &mut notes);
    angle_unit::check_degrees(&rows, &layout).map_err(problem)?;
    let unit_ns = time_unit::time_unit_ns(&rows, &layout, spec, &mut notes).map_err(problem)?;
    angle_unit::angles_to_degrees(&mut rows, &layout, spec, &mut notes).map_err(problem)?;
    if let AttitudeColumns::Quaternion(_) = layout.attitude {
        quaternions::normalise(&mut rows.rows, &mut notes).map_err(problem)?;
    }
    let frame = frame_columns::apply(&table, &layout, &mut rows.rows, &mut notes).map_err(problem)?;
    if rows.time_format == time_fields::TimeFormat::Number {
        for row in &mut rows.rows {
            row.time = row.time.and_then(|time| time_fields::to_ns(time, unit_ns)).map(i128::from);
        }
    }
    let has_dates = rows.time_format == time_fields::TimeFormat::DateTime || rows.has_dates;
    if !has_dates {
        clock_rollover::unroll_rollovers(
            &mut rows.rows,
            rows.time_format == time_fields::TimeFormat::Clock,
            &mut notes,
        );
    }
    if rows.time_format == time_fields::TimeFormat::Number
        && let Some(week) = layout.time.week.and_then(|column| table.first_number(column))
    {
        clock_rollover::add_week(&mut rows.rows, week, &mut notes);
    }
    clock_rollover::leave_out_unset_clock(&mut rows.rows, &mut notes).map_err(problem)?;
    clock_rollover::check_single_flight(&rows.rows).map_err(problem)?;
    let (is_geodetic, reads_attitude) =
        (layout.frame == Frame::Geodetic, layout.attitude != AttitudeColumns::None);
    stamp_resolution::spread_equal_stamps(&mut rows.rows, &mut notes);
    held_positions::interpolate_held(&mut rows.rows, is_geodetic, &mut notes);
    sparse_rows::interpolate_positions(&mut rows.rows, is_geodetic, reads_attitude, &mut notes);
    if table.has_decimal_commas {
        notes.push(Note {
            is_warning: false,
            text: "commas are read as the beginning of decimals".to_owned(),
        });
    }
    let kind = layout.attitude.kind();
    let quaternions = match layout.attitude {
        AttitudeColumns::Quaternion([x, _, _, w]) => Some(attitude_check::QuaternionReading {
            is_scalar_first: w < x,
            is_enu: frame == Frame::EastNorthUp,
        }),
        _ => None,
    };
    let rows = rows.rows.iter().map(|row| raw_row(row, frame, kind)).collect();
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
