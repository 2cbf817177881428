//! Why a flight log cannot be read.

use std::path::PathBuf;

use camsim_core::flight_log::LogError;

/// Why a flight log cannot be read.
#[derive(Debug, thiserror::Error)]
#[error("{}: {problem}", path.display())]
pub struct FlightLogError {
    /// The file.
    pub path: PathBuf,
    /// What is wrong, and what to do.
    pub problem: LogProblem,
}

/// What is wrong with a flight log.
#[derive(Debug, thiserror::Error)]
pub enum LogProblem {
    /// The file cannot be read.
    #[error("{source}; check flight.log{suggestion}")]
    Read {
        /// Error of the system.
        source: std::io::Error,
        /// The file that was probably meant, or nothing.
        suggestion: String,
    },
    /// Not UTF-8 text; the offset of the first other byte.
    #[error("not UTF-8 text (bad byte at offset {0}); flight logs are text, save it as UTF-8")]
    NotText(usize),
    /// No data rows.
    #[error("the log has no data rows")]
    Empty,
    /// Several formats fit: these.
    #[error("its columns fit {0}; set flight.format to the right one (or name the columns in a header line)")]
    Ambiguous(&'static str),
    /// No format fits a table of so many columns.
    #[error(
        "{0} columns without a header fit no known layout; set flight.format (csv-lla, csv-xya, csv-ned, \
            tum, euroc) or name the columns in a header line"
    )]
    UnknownLayout(usize),
    /// KITTI poses.
    #[error(
        "rows are 3x4 pose matrices without times (KITTI); convert them to TUM lines `t x y z qx qy qz qw` \
            first (evo_traj kitti --save_as_tum)"
    )]
    PoseMatrices,
    /// The rows can be read but make no log.
    #[error(transparent)]
    Log(#[from] LogError),
    /// A line, a column or the values as a whole cannot be read: which, why, and what to do.
    #[error("{0}")]
    Content(String),
}

impl From<String> for LogProblem {
    fn from(problem: String) -> Self {
        Self::Content(problem)
    }
}
