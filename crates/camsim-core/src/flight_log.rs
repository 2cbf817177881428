//! The flight log: rows of time, position and attitude, cleaned and converted to one local north-east-down
//! frame.
//!
//! [`RawRow`]s come from a reader (camsim-io) as the file states them. [`FlightLog::from_raw`] cleans them
//! and counts every repair in a [`CleaningReport`]; nothing is repaired silently. The steps, in order:
//!
//! 1. Rows without a usable time or position are dropped; unusable attitudes are marked as missing.
//! 2. Rows are sorted by time (stable sort); zeros that stand for a missing fix or height are dropped
//!    (`null_rows`).
//! 3. Heights change datum or are added to those of the ground, positions become local NED, angles become
//!    rotations, or stay angles if they count turns.
//! 4. Position spikes are dropped, attitude glitches are marked as missing (`outliers`).
//! 5. Rows less than 1 ms apart are averaged into one.
//! 6. Missing attitudes are interpolated between their neighbours, or all are computed from the track
//!    (`track_attitude`).
//! 7. Time is scaled, gaps are counted, and rows are inserted where the angles between two rows change by
//!    more than 90 degrees.
//!    between.

use std::fmt;

use glam::{DQuat, DVec3};

use crate::{
    geodesy::{Geodetic, LocalFrame},
    scenario::{AngleKind, AttitudeSource, FlightSpec, Origin},
};

mod attitude;
mod clean;
mod null_rows;
mod outliers;
mod query;
mod report;
mod track_attitude;

pub use attitude::body_from_euler_deg;
pub use report::{CleaningReport, Finding, Note};

/// Position of a row as the file states it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RawPosition {
    /// On WGS-84; the attitude of such a row is relative to the tangent frame at that point.
    Geodetic(Geodetic),
    /// Local north, east, down in metres; the attitude of such a row is relative to the same axes.
    Ned(DVec3),
}

/// Attitude of a row as its file states it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RawAttitude {
    /// Roll, pitch, yaw of the body (FRD), ZYX, degrees.
    EulerDeg([f64; 3]),
    /// Takes body (FRD) to north-east-down; any norm within 10 % of 1.
    Quaternion(DQuat),
    /// The row states no attitude. Where other rows do, it is interpolated between them; that counts as no
    /// repair.
    None,
}

/// One row of a log before cleaning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RawRow {
    /// Line of the file, from 1; only for reports.
    pub line: usize,
    /// Log clock in nanoseconds; `None` where the file's time is not a finite number.
    pub t_ns: Option<i64>,
    /// Position.
    pub position: RawPosition,
    /// Attitude.
    pub attitude: RawAttitude,
}

/// A row of a cleaned log.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LogRow {
    /// Seconds since the first good row, divided by the `speed` factor; strictly increasing.
    pub t_s: f64,
    /// Position in local NED, metres.
    pub position_ned_m: DVec3,
    /// Takes body (FRD) coordinates to local NED; unit length.
    pub ned_from_body: DQuat,
}

/// Height of the ground at a position, whose own height does not count, metres; `None` where it is not known.
pub type GroundHeight<'a> = &'a dyn Fn(Geodetic) -> Option<f64>;

/// Conversion of heights while a log is read. None is needed if log and terrain share a datum; the caller
/// decides.
#[derive(Clone, Copy, Default)]
pub enum HeightConversion<'a> {
    /// Heights stay as they are.
    #[default]
    None,
    /// Heights above mean sea level (EGM96) become heights above the ellipsoid.
    MslToEllipsoid,
    /// Heights above the ellipsoid become heights above mean sea level (EGM96).
    EllipsoidToMsl,
    /// Heights above the ground below each row. Where that is not known, the ground of the row before counts.
    AboveGround(GroundHeight<'a>),
    /// Heights above the ground below the first good row.
    AboveTakeoff(GroundHeight<'a>),
}

impl fmt::Debug for HeightConversion<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::None => "None",
            Self::MslToEllipsoid => "MslToEllipsoid",
            Self::EllipsoidToMsl => "EllipsoidToMsl",
            Self::AboveGround(_) => "AboveGround",
            Self::AboveTakeoff(_) => "AboveTakeoff",
        })
    }
}

/// Options for turning raw rows into a log.
#[derive(Clone, Copy, Debug)]
pub struct LogOptions<'a> {
    /// Whether angles wrap or count turns.
    pub angles: AngleKind,
    /// Source of the attitude.
    pub attitude: AttitudeSource,
    /// Origin of the local frame. `None` is the first good row of a geodetic log, after `height`. A given
    /// origin is in the datum *after* `height`. For a log in local coordinates, it is the geodetic position
    /// of (0, 0, 0).
    pub origin: Option<Geodetic>,
    /// Conversion of the heights of geodetic rows. Those above the ground also convert local rows, if there is an
    /// `origin`.
    pub height: HeightConversion<'a>,
    /// Time scale: 2 flies the log twice as fast. Positive.
    pub speed: f64,
}

impl Default for LogOptions<'_> {
    fn default() -> Self {
        Self {
            angles: AngleKind::Auto,
            attitude: AttitudeSource::Log,
            origin: None,
            height: HeightConversion::None,
            speed: 1.0,
        }
    }
}

impl<'a> LogOptions<'a> {
    /// The options of a scenario's `[flight]`.
    pub fn from_spec(spec: &FlightSpec, height: HeightConversion<'a>) -> Self {
        let origin = match spec.origin {
            Origin::First => None,
            Origin::Geodetic([lat_deg, lon_deg, height_m]) => {
                Some(Geodetic::from_deg(lat_deg, lon_deg, height_m))
            }
        };
        Self { angles: spec.angles, attitude: spec.attitude, origin, height, speed: spec.speed }
    }
}

/// Why a log cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LogError {
    /// There are no rows.
    #[error("the log has no rows")]
    Empty,
    /// No row is usable.
    #[error("none of the log's {rows} rows has a finite time and position (first: line {line})")]
    NoGoodRow {
        /// Rows read.
        rows: usize,
        /// Line of the first row.
        line: usize,
    },
    /// Positions that differ, all at one time.
    #[error(
        "all times are equal ({rows} rows from line {line}, up to {distance_m:.1} m apart), so there is no \
            flight: export the log with the time of each position"
    )]
    AllTimesEqual {
        /// Rows with a time and a position.
        rows: usize,
        /// Line of the first.
        line: usize,
        /// Largest distance from the first, metres.
        distance_m: f64,
    },
    /// There are neither attitude columns nor usable attitudes.
    #[error("the log has no usable attitude; set flight.attitude = \"track\" to derive it from the track")]
    NoAttitude,
    /// Geodetic and local positions in one log.
    #[error("line {line}: the log mixes geodetic and local positions; keep one kind per file")]
    MixedPositions {
        /// First line of the other kind.
        line: usize,
    },
    /// Some rows with angles, others with quaternions.
    #[error("line {line}: the log mixes Euler angles and quaternions; keep one kind per file")]
    MixedAttitudes {
        /// First line of the other kind.
        line: usize,
    },
    /// Heights are above the ground, which is not known below the first row, or below more than half of the rows.
    #[error(
        "line {line}: heights are above the ground, but the terrain has no height there: use a terrain below the flight"
    )]
    NoGround {
        /// Line of the first row without.
        line: usize,
    },
    /// `flight.speed` is not usable.
    #[error("flight.speed = {0} must be a positive finite number")]
    BadSpeed(f64),
    /// `flight.origin` is not usable.
    #[error("flight.origin must be [lat_deg within +-90, lon_deg within +-360, height_m], all finite")]
    BadOrigin,
    /// A continuous angle jumps by thousands of turns.
    #[error(
        "line {line}: angles jump by {degrees:.0} degrees from the row before; if they wrap, set flight.angles = \"wrapped\", else repair the row"
    )]
    TurnTooLarge {
        /// Line of the later row.
        line: usize,
        /// Sum of the changes of the three angles.
        degrees: f64,
    },
}

/// A cleaned log, ready for the tracker, with at least one row.
#[derive(Clone, Debug, PartialEq)]
pub struct FlightLog {
    /// Rows by strictly increasing time.
    pub rows: Vec<LogRow>,
    /// Log clock at `t_s = 0`, nanoseconds.
    pub epoch_ns: i64,
    /// Geodetic position of the local frame; `None` for a log in local coordinates without a geodetic origin.
    pub frame: Option<LocalFrame>,
    /// The repairs.
    pub report: CleaningReport,
    /// Notes of the reader about the file.
    pub notes: Vec<Note>,
}

impl FlightLog {
    /// Cleans raw rows; see the module's list of steps.
    ///
    /// # Errors
    /// [`LogError`]: nothing usable in the rows, or unusable options.
    pub fn from_raw(raw: &[RawRow], options: &LogOptions<'_>) -> Result<Self, LogError> {
        clean::clean(raw, options)
    }
}

#[cfg(test)]
mod tests;
