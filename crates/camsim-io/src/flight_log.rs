//! Flight log files: CSV (geodetic or local), TUM and EuRoC trajectories, with or without a header line.
//!
//! | format | columns without a header | frames |
//! |---|---|---|
//! | `csv-lla` | t s, lat, lon, height, roll, pitch, yaw | degrees, metres; ZYX angles of the body (FRD) in the tangent frame at the row |
//! | `csv-xya` | t s, north, east, altitude (up), roll, pitch, yaw | metres, degrees |
//! | `csv-ned` | t s, north, east, down, roll, pitch, yaw | metres, degrees |
//! | `tum` | t s, x, y, z, qx, qy, qz, qw | see below |
//! | `euroc` | t ns, x, y, z, qw, qx, qy, qz | see below; a first column with a decimal point is seconds |
//!
//! Further columns are ignored; the CSV formats may end after the position (then `flight.attitude = "track"`
//! is needed). A header line, also as a comment, names the columns in any order and takes precedence over the
//! table; it may name units, which are converted (`names`, `units`). Separators are commas, semicolons (then
//! decimals may have commas), tabs or blanks; fields may stand in quotes; `#` and `%` begin comments; BOM and
//! CRLF are fine. An empty field is a missing value, and so are NA, NaN, null, none and `-`. Only columns
//! that are used must be numbers.
//!
//! GPX files are read too (`gpx`), other kinds of files named with what converts them (`sniff`). What is open
//! to doubt is refused, or taken and said in the log's notes: units that are named nowhere (`resolve`),
//! clocks that begin again (`clock`), tables merged from several streams (`sparse`). docs/inputs/LOGS.md
//! lists all names and units; it is made from the tables in here.
//!
//! **TUM and EuRoC** worlds have z up: x is taken as east, y as north. Their quaternions (Hamilton, world
//! from body) belong to a body with x forward, y left, z up (FLU, as in ROS); it becomes FRD. If the poses
//! are those of a sensor with other axes, the mount makes up for it. The JPL quaternion of rotation "global
//! to body" has the same numbers as the Hamilton "body to global", so `open_vins` texts read right.

use std::path::{Path, PathBuf};

use camsim_core::{
    flight_log::{
        FlightLog, HeightConversion, LogError, LogOptions, LogRow, Note, RawAttitude, RawPosition, RawRow,
    },
    geodesy::Geodetic,
    scenario::{FlightSpec, LogFormat},
};
use glam::{DQuat, DVec3};

mod choose;
mod clock;
mod columns;
mod detect;
mod gpx;
mod header;
mod layout;
mod names;
mod quaternions;
mod reference;
mod resolve;
mod rows;
mod sniff;
mod sparse;
mod text;
mod time;
mod units;

use columns::{AttitudeColumns, Frame};
use layout::Layout;

pub use reference::reference;

/// What makes a flight log file unreadable.
#[derive(Debug, thiserror::Error)]
pub enum FlightLogError {
    /// The file cannot be read.
    #[error("{}: {source}; check flight.log", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// Not UTF-8 text.
    #[error("{}: not UTF-8 text (bad byte at offset {offset}); flight logs are text, save it as UTF-8", path.display())]
    NotText {
        /// The file.
        path: PathBuf,
        /// First bad byte.
        offset: usize,
    },
    /// No data rows.
    #[error("{}: the log has no data rows", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// A field is not a number.
    #[error("{}: line {line}, column {column}{name}: `{text}` is not a number{hint}", path.display())]
    NotANumber {
        /// The file.
        path: PathBuf,
        /// From 1.
        line: usize,
        /// From 1.
        column: usize,
        /// Its name, in brackets.
        name: String,
        /// The field.
        text: String,
        /// What it looks like and what to do.
        hint: &'static str,
    },
    /// A row is too long.
    #[error(
        "{}: line {line} has {found} columns, but only {known} are known: a separator within a field shifts the ones behind it (put the field in quotes)", path.display()
    )]
    SurplusColumns {
        /// The file.
        path: PathBuf,
        /// From 1.
        line: usize,
        /// Columns there.
        found: usize,
        /// Columns of the header, or of the other rows.
        known: usize,
    },
    /// Another kind of file.
    #[error("{}: the file is {what}, no flight log that can be read: {advice}", path.display())]
    OtherFormat {
        /// The file.
        path: PathBuf,
        /// What it is.
        what: &'static str,
        /// How to make a log of it.
        advice: &'static str,
    },
    /// The numbers as a whole say too little, or nonsense.
    #[error("{}: {problem}", path.display())]
    Values {
        /// The file.
        path: PathBuf,
        /// What is wrong and what to do.
        problem: String,
    },
    /// A row is too short.
    #[error("{}: line {line} has {found} columns, {format} needs {needed}; complete the line or set flight.format", path.display())]
    MissingColumns {
        /// The file.
        path: PathBuf,
        /// From 1.
        line: usize,
        /// Columns there.
        found: usize,
        /// Columns needed.
        needed: usize,
        /// Format as written in a scenario.
        format: &'static str,
    },
    /// A latitude, longitude or height that cannot be one.
    #[error("{}: line {line}, column {column}{name}: {value} is no {what}; {advice}", path.display())]
    OutOfRange {
        /// The file.
        path: PathBuf,
        /// From 1.
        line: usize,
        /// From 1.
        column: usize,
        /// Its name, in brackets.
        name: String,
        /// `latitude`, `longitude` or `height in metres`.
        what: &'static str,
        /// As read, in degrees or metres.
        value: f64,
        /// What it may be and what to do.
        advice: &'static str,
    },
    /// Several layouts fit.
    #[error("{}: its columns fit {candidates}; set flight.format to the right one (or name the columns in a header line)", path.display())]
    Ambiguous {
        /// The file.
        path: PathBuf,
        /// Formats that fit.
        candidates: &'static str,
    },
    /// No layout fits.
    #[error(
        "{}: {columns} columns without a header fit no known layout; set flight.format (csv-lla, csv-xya, csv-ned, tum, euroc) or name the columns in a header line", path.display()
    )]
    UnknownLayout {
        /// The file.
        path: PathBuf,
        /// Columns of the first row.
        columns: usize,
    },
    /// A header that does not say enough.
    #[error("{}: line {line}: {problem}", path.display())]
    Header {
        /// The file.
        path: PathBuf,
        /// From 1.
        line: usize,
        /// What is missing and what to do.
        problem: String,
    },
    /// KITTI poses.
    #[error(
        "{}: rows are 3x4 pose matrices without times (KITTI); convert them to TUM lines `t x y z qx qy qz qw` first (evo_traj kitti --save_as_tum)", path.display()
    )]
    PoseMatrices {
        /// The file.
        path: PathBuf,
    },
    /// The rows are readable but make no log.
    #[error("{}: {source}", path.display())]
    Log {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: LogError,
    },
}

/// The rows of a file before cleaning, and what there is to say about it.
#[derive(Clone, Debug, PartialEq)]
pub struct RawLog {
    /// In the file's order.
    pub rows: Vec<RawRow>,
    /// What was inferred, chosen, or left out.
    pub notes: Vec<Note>,
}

/// Faster than this between two rows is a jump.
const JUMP_M_S: f64 = 1000.0;

/// Reads and cleans the log at `path` (which replaces `spec.log`: the caller has resolved it) as `spec` says.
///
/// `height` is the caller's decision, because it depends on the terrain's datum too: no conversion where both
/// agree.
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
        // A header may have something like an attitude.
        let of_attitude: Vec<&str> = raw
            .notes
            .iter()
            .filter(|note| note.text.contains("attitude"))
            .map(|note| note.text.as_str())
            .collect();
        if source == LogError::NoAttitude && !of_attitude.is_empty() {
            return FlightLogError::Values {
                path: path.to_owned(),
                problem: format!("{source}: {}", of_attitude.join("; ")),
            };
        }
        FlightLogError::Log { path: path.to_owned(), source }
    })?;
    log.notes = raw.notes;
    // Local positions may have any unit of length.
    if raw.rows.iter().any(|row| matches!(row.position, RawPosition::Geodetic(_))) {
        log.notes.extend(jump_note(&log));
    }
    Ok(log)
}

/// What no cleaning has removed and no aircraft does.
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
            "the flight jumps by {:.0} m within {:.3} s at {:.3} s from its start{}: check the positions and times there",
            from.position_ned_m.distance(to.position_ned_m),
            to.t_s - from.t_s,
            from.t_s,
            if more > 0 { format!(", and in {more} more places") } else { String::new() }
        ),
    })
}

/// Reads the rows of a log as the file states them, before any cleaning, in nanoseconds, degrees and metres.
///
/// # Errors
/// As [`read_flight_log`].
pub fn read_raw_rows(path: &Path, spec: &FlightSpec) -> Result<RawLog, FlightLogError> {
    let bytes =
        std::fs::read(path).map_err(|source| FlightLogError::Read { path: path.to_owned(), source })?;
    if let Some((what, advice)) = sniff::refused(&bytes) {
        return Err(FlightLogError::OtherFormat { path: path.to_owned(), what, advice });
    }
    let content = std::str::from_utf8(&bytes)
        .map_err(|error| FlightLogError::NotText { path: path.to_owned(), offset: error.valid_up_to() })?;
    let content = content.strip_prefix('\u{feff}').unwrap_or(content);
    if content.trim_start().starts_with('<') {
        return gpx::read(path, content.trim_start(), spec);
    }
    let problem = |problem: String| FlightLogError::Values { path: path.to_owned(), problem };
    if spec.format == LogFormat::Gpx {
        return Err(problem("flight.format is \"gpx\" but the file is no XML; remove the key".to_owned()));
    }
    let table = text::Table::new(content);
    if table.rows.is_empty() {
        return Err(FlightLogError::Empty { path: path.to_owned() });
    }
    let mut notes = Vec::new();
    let layout = Layout::find(path, &table, spec, &mut notes)?;
    let mut rows = rows::read(path, &table, &layout)?;
    resolve::check_degrees(&rows, &layout).map_err(problem)?;
    let unit_ns = resolve::time_unit_ns(&rows, &layout, spec, &mut notes).map_err(problem)?;
    resolve::angles_to_degrees(&mut rows, &layout, spec, &mut notes).map_err(problem)?;
    if let AttitudeColumns::Quaternion(_) = layout.attitude {
        quaternions::normalise(&mut rows.rows, &mut notes).map_err(problem)?;
    }
    if rows.kind == time::Kind::Number {
        for row in &mut rows.rows {
            row.time = row.time.and_then(|time| time::to_ns(time, unit_ns)).map(i128::from);
        }
    }
    let has_dates = rows.kind == time::Kind::DateTime || rows.has_dates;
    if !has_dates {
        clock::unroll(&mut rows.rows, rows.kind == time::Kind::Clock, &mut notes);
    }
    clock::one_flight(&rows.rows).map_err(problem)?;
    sparse::fill(&mut rows.rows, layout.attitude != AttitudeColumns::None, &mut notes);
    if table.has_decimal_commas {
        notes.push(Note {
            is_warning: false,
            text: "commas are read as the beginning of decimals".to_owned(),
        });
    }
    Ok(RawLog { rows: rows.rows.iter().map(|row| raw_row(row, &layout)).collect(), notes })
}

/// Half a turn about x: y and z change sign.
const FLU_FROM_FRD: DQuat = DQuat::from_xyzw(1.0, 0.0, 0.0, 0.0);

/// Half a turn about the north-east diagonal: x and y change places, z changes sign.
fn ned_from_enu() -> DQuat {
    DQuat::from_xyzw(std::f64::consts::FRAC_1_SQRT_2, std::f64::consts::FRAC_1_SQRT_2, 0.0, 0.0)
}

fn raw_row(row: &rows::Row, layout: &Layout) -> RawRow {
    let [a, b, c] = row.position;
    let position = match layout.frame {
        Frame::Geodetic => RawPosition::Geodetic(Geodetic::from_deg(a, b, c)),
        Frame::NorthEastUp => RawPosition::Ned(DVec3::new(a, b, -c)),
        Frame::NorthEastDown => RawPosition::Ned(DVec3::new(a, b, c)),
        Frame::EastNorthUp => RawPosition::Ned(DVec3::new(b, a, -c)),
    };
    let attitude = match layout.attitude {
        // Where an attitude is stated in part, it is a faulty one.
        _ if !row.states_attitude() => RawAttitude::None,
        AttitudeColumns::None => RawAttitude::None,
        AttitudeColumns::Euler(_) => {
            RawAttitude::EulerDeg([row.attitude[0], row.attitude[1], row.attitude[2]])
        }
        AttitudeColumns::Quaternion(_) => {
            let world_from_body = DQuat::from_array(row.attitude);
            RawAttitude::Quaternion(match layout.frame {
                Frame::EastNorthUp => ned_from_enu() * world_from_body * FLU_FROM_FRD,
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
