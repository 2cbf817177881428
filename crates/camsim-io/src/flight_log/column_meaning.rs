//! Meanings of columns.

use super::units::VerticalDatum;

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
    Height(Option<VerticalDatum>),
    /// Height by air pressure; used only where no column is a [`ColumnMeaning::Height`].
    PressureHeight,
    /// Height above take-off or ground, which is refused as the only height.
    RelativeHeight,
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
    /// Identifier of the vehicle of a row.
    Vehicle,
}
