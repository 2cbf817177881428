//! Why a flight log cannot be read.

use std::path::PathBuf;

use camsim_core::flight_log::LogError;

use crate::similar_file::suggestion;

/// Why a flight log cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum FlightLogError {
    /// The file cannot be read.
    #[error("{}: {source}; check flight.log{}", path.display(), suggestion(path))]
    Read {
        /// The file.
        path: PathBuf,
        /// Error of the system.
        source: std::io::Error,
    },
    /// Not UTF-8 text.
    #[error("{}: not UTF-8 text (bad byte at offset {offset}); flight logs are text, save it as \
        UTF-8", path.display())]
    NotText {
        /// The file.
        path: PathBuf,
        /// Offset of the first byte that is not UTF-8.
        offset: usize,
    },
    /// No data rows.
    #[error("{}: the log has no data rows", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// All lines are comments.
    #[error(
        "{}: all {lines} lines begin with # or %, so all are comments: remove these marks from the lines of \
            data", path.display()
    )]
    OnlyComments {
        /// The file.
        path: PathBuf,
        /// Number of lines.
        lines: usize,
    },
    /// A field is not a number.
    #[error("{}: line {line}, column {column}{name}: `{text}` is not a number{hint}", path.display())]
    NotANumber {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// Name of the column in brackets, or nothing.
        name: String,
        /// Text of the field.
        text: String,
        /// Advice by the look of the text, or nothing.
        hint: &'static str,
    },
    /// A row is too long.
    #[error(
        "{}: line {line} has {found} columns, but only {known} are known: a separator within a field shifts \
            the ones behind it (put the field in quotes)", path.display()
    )]
    SurplusColumns {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Number of columns of the row.
        found: usize,
        /// Number of columns of the header, or of the other rows.
        known: usize,
    },
    /// A known format that is no flight log.
    #[error("{}: the file is {what}, no flight log that can be read: {advice}", path.display())]
    OtherFormat {
        /// The file.
        path: PathBuf,
        /// Name of the format.
        what: &'static str,
        /// How to convert it.
        advice: &'static str,
    },
    /// The values of the file as a whole are ambiguous or implausible.
    #[error("{}: {problem}", path.display())]
    Values {
        /// The file.
        path: PathBuf,
        /// What is wrong and what to do.
        problem: String,
    },
    /// A row is too short.
    #[error("{}: line {line} has {found} columns, {format} needs {needed}; complete the line or set \
        flight.format", path.display())]
    MissingColumns {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Number of columns of the row.
        found: usize,
        /// Number of columns that the format needs.
        needed: usize,
        /// Format, as `flight.format` names it.
        format: &'static str,
    },
    /// A latitude, longitude or height out of range.
    #[error("{}: line {line}, column {column}{name}: {value} is no {what}; {advice}", path.display())]
    OutOfRange {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// Name of the column in brackets, or nothing.
        name: String,
        /// `latitude`, `longitude` or `height in metres`.
        what: &'static str,
        /// The value, in degrees or metres.
        value: f64,
        /// What the value may be, and what to do.
        advice: &'static str,
    },
    /// Several formats fit.
    #[error("{}: its columns fit {candidates}; set flight.format to the right one (or name the columns in a \
        header line)", path.display())]
    Ambiguous {
        /// The file.
        path: PathBuf,
        /// Formats that fit.
        candidates: &'static str,
    },
    /// No format fits.
    #[error(
        "{}: {columns} columns without a header fit no known layout; set flight.format (csv-lla, csv-xya, \
            csv-ned, tum, euroc) or name the columns in a header line", path.display()
    )]
    UnknownLayout {
        /// The file.
        path: PathBuf,
        /// Number of columns of the table.
        columns: usize,
    },
    /// A header that lacks columns, or is ambiguous.
    #[error("{}: line {line}: {problem}", path.display())]
    Header {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// What is missing and what to do.
        problem: String,
    },
    /// KITTI poses.
    #[error(
        "{}: rows are 3x4 pose matrices without times (KITTI); convert them to TUM lines `t x y z qx qy qz \
            qw` first (evo_traj kitti --save_as_tum)", path.display()
    )]
    PoseMatrices {
        /// The file.
        path: PathBuf,
    },
    /// The rows can be read but make no log.
    #[error("{}: {source}", path.display())]
    Log {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: LogError,
    },
}
