//! What columns a flight can have: axes, units, sources of numbers.

use camsim_core::scenario::LogFormat;

/// Axes of the positions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Frame {
    /// Latitude, longitude, height up.
    Geodetic,
    /// North, east, up.
    NorthEastUp,
    /// North, east, down.
    NorthEastDown,
    /// East, north, up; the attitude is that of a forward-left-up body.
    EastNorthUp,
}

/// Where a number comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Source {
    pub(super) column: usize,
    /// Which of two numbers in one field.
    pub(super) part: Option<usize>,
    /// To degrees or metres; `None` where the header names no unit.
    pub(super) factor: Option<f64>,
}

impl Source {
    pub(super) fn whole(column: usize, factor: Option<f64>) -> Self {
        Self { column, part: None, factor }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum AttitudeColumns {
    None,
    /// Roll, pitch, yaw.
    Euler([Source; 3]),
    /// x, y, z, w.
    Quaternion([usize; 4]),
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TimeColumns {
    pub(super) column: usize,
    /// Nanoseconds of the unit, where the header names one.
    pub(super) unit_ns: Option<f64>,
    /// Where the format says it: whole numbers are nanoseconds.
    pub(super) whole_are_ns: bool,
    pub(super) date: Option<usize>,
    /// Nanoseconds beside whole seconds.
    pub(super) nanoseconds: Option<usize>,
}
/// As written in a scenario.
pub(super) fn format_name(format: LogFormat) -> &'static str {
    match format {
        LogFormat::Auto => "auto",
        LogFormat::CsvLla => "csv-lla",
        LogFormat::CsvXya => "csv-xya",
        LogFormat::CsvNed => "csv-ned",
        LogFormat::Tum => "tum",
        LogFormat::Euroc => "euroc",
        LogFormat::Gpx => "gpx",
    }
}
