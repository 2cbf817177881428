//! The columns that a flight is read from: axes, units, and the fields of each number.

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

/// The field that a number is read from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FieldSource {
    /// Index of the column, from 0.
    pub(super) column: usize,
    /// Index of the number where one field holds two, as `47.0 8.0`.
    pub(super) part: Option<usize>,
    /// Factor that converts to degrees or metres; `None` where the header names no unit.
    pub(super) factor: Option<f64>,
}

impl FieldSource {
    pub(super) fn whole(column: usize, factor: Option<f64>) -> Self {
        Self { column, part: None, factor }
    }
}

/// The columns of the attitude.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum AttitudeColumns {
    /// The log has no attitude, or it is not read.
    None,
    /// Roll, pitch, yaw.
    Euler([FieldSource; 3]),
    /// Quaternion x, y, z, w.
    Quaternion([usize; 4]),
}

impl AttitudeColumns {
    /// Indices of the columns: roll, pitch, yaw, or x, y, z, w.
    pub(super) fn columns(self) -> Vec<usize> {
        match self {
            Self::None => Vec::new(),
            Self::Euler(sources) => sources.iter().map(|source| source.column).collect(),
            Self::Quaternion(columns) => columns.to_vec(),
        }
    }

    /// What the columns hold.
    pub(super) fn kind(self) -> AttitudeKind {
        match self {
            Self::None => AttitudeKind::None,
            Self::Euler(_) => AttitudeKind::Euler,
            Self::Quaternion(_) => AttitudeKind::Quaternion,
        }
    }
}

/// What the attitudes of a log are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum AttitudeKind {
    /// There are none.
    None,
    /// Roll, pitch, yaw in degrees.
    Euler,
    /// Quaternions x, y, z, w.
    Quaternion,
}

/// The columns of the time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct TimeColumns {
    /// Index of the column, from 0.
    pub(super) column: usize,
    /// Nanoseconds per unit, where the header names the unit.
    pub(super) unit_ns: Option<f64>,
    /// Whether whole numbers are nanoseconds, as in EuRoC files.
    pub(super) integers_are_ns: bool,
    /// Column of dates that belong to clock times.
    pub(super) date: Option<usize>,
    /// Column of the GPS weeks whose seconds the times are.
    pub(super) week: Option<usize>,
    /// Column of nanoseconds that are added to whole seconds.
    pub(super) nanoseconds: Option<usize>,
}
