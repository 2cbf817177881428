//! Meanings of columns.

use camsim_core::scenario::{FlightHeight, HeightReference};

use super::units::Dimension;

/// What a column holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum ColumnMeaning {
    /// Times as numbers, clock times or dates with times.
    Time,
    /// Date and time as text; counts only where no column is a [`ColumnMeaning::Time`].
    DateTime,
    /// Nanoseconds that belong to a column of whole seconds.
    NanosecondsPart,
    /// Dates without times; applied to clock times.
    Date,
    /// Two numbers in one field.
    LatitudeLongitude,
    Latitude,
    Longitude,
    /// Height, up, above the datum that its name states, else above that of `flight.height`.
    Height(Option<HeightReference>),
    /// Height by air pressure; used only where no column is a [`ColumnMeaning::Height`].
    PressureHeight,
    /// Height above take-off or ground; used only where `flight.height` says so.
    RelativeHeight(FlightHeight),
    North,
    East,
    Down,
    /// Grid coordinates, whose north is not true north.
    Grid,
    X,
    Y,
    Z,
    Roll,
    Pitch,
    Yaw,
    /// Yaw from magnetic north.
    MagneticYaw,
    Qx,
    Qy,
    Qz,
    Qw,
    /// Direction of motion, which is not the heading.
    Course,
    /// Attitude of a gimbal.
    Gimbal,
    /// Height of the ground.
    Ground,
    /// Hemisphere as a letter: N or S, E or W.
    Hemisphere,
    /// Hours or minutes that belong to a column of seconds.
    TimePart,
    /// Earth-centred, earth-fixed coordinates.
    EarthCentred,
    /// Identifier of the vehicle of a row.
    Vehicle,
    /// Number of the receiver or estimator that a row is of.
    Receiver,
    /// Whether the receiver of a row was the one in use.
    InUse,
    /// Quality of the fix of a row.
    Fix(FixCode),
    /// What the heights are above, in words.
    HeightDatum,
}

impl ColumnMeaning {
    pub(super) fn is_time(self) -> bool {
        matches!(self, Self::Time | Self::DateTime | Self::NanosecondsPart)
    }

    /// Whether a column is a height, of any kind.
    pub(super) fn is_height(self) -> bool {
        matches!(self, Self::Height(_) | Self::PressureHeight | Self::RelativeHeight(_))
    }

    /// The physical dimension of a column; `None` where it has no unit.
    pub(super) fn dimension(self) -> Option<Dimension> {
        use ColumnMeaning::*;
        match self {
            Time | NanosecondsPart => Some(Dimension::Time),
            Latitude | Longitude | LatitudeLongitude | Roll | Pitch | Yaw | MagneticYaw | Course | Gimbal => {
                Some(Dimension::Angle)
            }
            Height(_) | PressureHeight | RelativeHeight(_) | Ground | North | East | Down | Grid
            | EarthCentred | X | Y | Z => Some(Dimension::Length),
            DateTime | Date | Hemisphere | TimePart | Vehicle | Receiver | InUse | Fix(_) | HeightDatum
            | Qx | Qy | Qz | Qw => None,
        }
    }
}

impl FixCode {
    /// Whether a column of such a name may be something else, or be left unused by the program that wrote it:
    /// it never excludes all rows, and values that are not known exclude none.
    pub(super) fn is_vague(self) -> bool {
        !matches!(self, Self::Dimensions | Self::NonZero | Self::NonNegative)
    }
}

/// Code of the quality of a fix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum FixCode {
    /// 0 and 1: none; 2: two-dimensional, its height is none; from 3 on: three-dimensional. MAVLink, PX4,
    /// u-blox, GoPro, ArduPilot.
    Dimensions,
    /// 0: none; any other: one. NMEA, flags.
    NonZero,
    /// Below 0: none. NavSatFix of ROS.
    NonNegative,
    /// 0: none; 1 to 9: one. RTKLIB's `Q`, which elsewhere is a rate.
    Rtklib,
    /// Number of satellites.
    Satellites,
    /// Flags that are set where there is no position.
    Negated,
    /// Words, and numbers below 0 for none; other numbers differ between programs.
    Words,
    /// Codes that differ between programs, or measures of accuracy.
    Unknown,
}
