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
//! Further columns are ignored; the CSV formats may end after the position (then `flight.attitude = "track"` is needed). A header line, also
//! as a comment, names the columns in any order and takes precedence over the table. Separators are commas, semicolons or white space;
//! `#` and `%` begin comments; BOM and CRLF are fine. An empty field is a missing value.
//!
//! **TUM and EuRoC** worlds have z up: x is taken as east, y as north. Their quaternions (Hamilton, world from body) belong to a body with x
//! forward, y left, z up (FLU, as in ROS); it becomes FRD. If the poses are those of a sensor with other axes, the mount makes up for it.
//! The JPL quaternion of rotation "global to body" has the same numbers as the Hamilton "body to global", so `open_vins` texts read right.

use std::path::{Path, PathBuf};

use camsim_core::{
    flight_log::{FlightLog, HeightConversion, LogError, LogOptions, RawRow},
    scenario::{FlightSpec, LogFormat},
};

mod header;
mod layout;
mod text;

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
    #[error("{}: line {line}, column {column}: `{text}` is not a number", path.display())]
    NotANumber {
        /// The file.
        path: PathBuf,
        /// From 1.
        line: usize,
        /// From 1.
        column: usize,
        /// The field.
        text: String,
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
    /// A latitude or longitude that cannot be one.
    #[error("{}: line {line}, column {column}: {value} is no {what}; are these metres? Then set flight.format = \"csv-xya\" or \"csv-ned\"", path.display())]
    OutOfRange {
        /// The file.
        path: PathBuf,
        /// From 1.
        line: usize,
        /// From 1.
        column: usize,
        /// `latitude` or `longitude`.
        what: &'static str,
        /// As read.
        value: f64,
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

/// Reads and cleans the log at `path` (which replaces `spec.log`: the caller has resolved it) as `spec` says.
///
/// `height` is the caller's decision, because it depends on the terrain's datum too: no conversion where both agree.
///
/// # Errors
/// [`FlightLogError`] names the file, the line and the column or key, and what to do.
pub fn read_flight_log(path: &Path, spec: &FlightSpec, height: HeightConversion) -> Result<FlightLog, FlightLogError> {
    let rows = read_raw_rows(path, spec.format)?;
    let options = LogOptions::from_spec(spec, height);
    FlightLog::from_raw(&rows, &options).map_err(|source| FlightLogError::Log { path: path.to_owned(), source })
}

/// Reads the rows of a log as the file states them, before any cleaning.
///
/// # Errors
/// As [`read_flight_log`].
pub fn read_raw_rows(path: &Path, format: LogFormat) -> Result<Vec<RawRow>, FlightLogError> {
    let bytes = std::fs::read(path).map_err(|source| FlightLogError::Read { path: path.to_owned(), source })?;
    let content =
        std::str::from_utf8(&bytes).map_err(|error| FlightLogError::NotText { path: path.to_owned(), offset: error.valid_up_to() })?;
    let table = text::Table::new(content);
    if table.rows.is_empty() {
        return Err(FlightLogError::Empty { path: path.to_owned() });
    }
    let layout = layout::Layout::find(path, &table, format)?;
    table.rows.iter().map(|row| layout.read_row(path, &table, row)).collect()
}

#[cfg(test)]
mod tests;
