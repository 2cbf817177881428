//! `[flight]`: the flight log.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::{
    HeightReference, Scenario,
    keys::{Table, Words},
};

/// The flight log and the meaning of its columns.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct FlightSpec {
    /// The flight log: time, position and attitude (paper section 3).
    #[key(required, example = "\"flight.csv\"")]
    pub log: PathBuf,
    /// Format of the log. `auto` detects it by content, and refuses a log that two formats fit.
    pub format: LogFormat,
    /// Unit of times whose column names none. `auto` refuses ambiguous values.
    pub time_unit: TimeUnit,
    /// Unit of roll, pitch and yaw whose columns name none. `auto` refuses ambiguous values.
    pub angle_unit: AngleUnit,
    /// Whether roll, pitch and yaw wrap or count turns.
    pub angles: AngleKind,
    /// Source of the attitude: the log, or the flown path.
    pub attitude: AttitudeSource,
    /// Origin of the local north-east-down frame. `"first"` is the first good row of the log; a list is
    /// latitude, longitude and height on WGS-84.
    #[key(unit = "deg, deg, m", step = 0.0001, names = "lat lon h")]
    pub origin: Origin,
    /// What the log's heights are above.
    pub height: FlightHeight,
    /// Instrument of the heights, where a log has several.
    pub height_from: HeightSource,
    /// Stream of a log that has several. It is that of the positions and, behind a comma, that of the
    /// attitudes: `"GPS, ATT"`.
    #[key(example = "\"/odom\"")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub topic: Option<String>,
    /// Part of the log that is flown: begin and end, counted from its first good row. Omitted: all of it.
    #[key(unit = "s", step = 0.05, example = "[0.0, 20.0]", names = "from to")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub window_s: Option<[f64; 2]>,
    /// Speed-up of the log. 2 flies it twice as fast.
    #[key(
        default = 1.0,
        unit = "x",
        step = 0.01,
        above = 0.0,
        hint = "1 flies the log in its own time, 2 twice as fast"
    )]
    pub speed: f64,
}

impl FlightSpec {
    /// A log in a layout of its own marks; all other keys have their defaults.
    #[must_use]
    pub fn new(log: impl Into<PathBuf>) -> Self {
        Self { log: log.into(), ..Self::default() }
    }
}

impl Scenario {
    /// Vertical datum of the log's heights; that of the terrain where they are above the ground.
    #[must_use]
    pub fn log_datum(&self) -> HeightReference {
        let of_terrain =
            || self.scene.terrain.as_ref().map_or_else(Default::default, |terrain| terrain.height);
        self.flight.height.datum().unwrap_or_else(of_terrain)
    }
}

/// Formats of flight logs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Words)]
#[serde(rename_all = "kebab-case")]
pub enum LogFormat {
    /// Detected from header and values; an error if two formats fit.
    #[default]
    Auto,
    /// `t, lat, lon, alt, roll, pitch, yaw` (degrees, metres up).
    CsvLla,
    /// `t, north, east, altitude up, roll, pitch, yaw`.
    CsvXya,
    /// `t, north, east, down, roll, pitch, yaw`.
    CsvNed,
    /// `t x y z qx qy qz qw`, world z up.
    Tum,
    /// `t_ns, x, y, z, qw, qx, qy, qz, ...`, world z up.
    Euroc,
    /// Track points of a GPX file: latitude, longitude, height, time; no attitude.
    Gpx,
    /// Tracks of a KML file (`gx:Track`) or its placemarks with times.
    Kml,
    /// Flight record of a glider logger; no attitude.
    Igc,
    /// Log of PX4.
    Ulog,
    /// Binary log of ArduPilot.
    Dataflash,
    /// ROS messages in an MCAP file.
    Mcap,
}

/// What the heights of a log are above.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Words)]
#[serde(rename_all = "lowercase")]
pub enum FlightHeight {
    /// The WGS-84 ellipsoid.
    #[default]
    Ellipsoid,
    /// Mean sea level (EGM96 geoid).
    Msl,
    /// The ground below each row, that of `scene.terrain.dem`.
    Ground,
    /// The ground below the first good row, that of `scene.terrain.dem`.
    Takeoff,
}

impl FlightHeight {
    /// The vertical datum; `None` of heights above the ground, which have that of the terrain.
    #[must_use]
    pub fn datum(self) -> Option<HeightReference> {
        match self {
            Self::Ellipsoid => Some(HeightReference::Ellipsoid),
            Self::Msl => Some(HeightReference::Msl),
            Self::Ground | Self::Takeoff => None,
        }
    }

    /// The name, for messages: "above the ellipsoid".
    #[must_use]
    pub fn surface(self) -> &'static str {
        match self {
            Self::Ellipsoid => "the ellipsoid",
            Self::Msl => "mean sea level",
            Self::Ground => "the ground",
            Self::Takeoff => "take-off",
        }
    }
}

impl From<HeightReference> for FlightHeight {
    fn from(datum: HeightReference) -> Self {
        match datum {
            HeightReference::Ellipsoid => Self::Ellipsoid,
            HeightReference::Msl => Self::Msl,
        }
    }
}

/// Instrument of the heights of a log.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Words)]
#[serde(rename_all = "lowercase")]
pub enum HeightSource {
    /// That of satellite navigation where there is one, else that of air pressure, with a warning.
    #[default]
    Auto,
    /// Satellite navigation, or a filter that uses it.
    Gnss,
    /// Air pressure in the standard atmosphere.
    Pressure,
}

/// Time units of a flight log.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Words)]
#[serde(rename_all = "lowercase")]
pub enum TimeUnit {
    /// Seconds, or a unit that the values imply beyond doubt; an error if in doubt.
    #[default]
    Auto,
    /// Seconds.
    S,
    /// Milliseconds.
    Ms,
    /// Microseconds.
    Us,
    /// Nanoseconds.
    Ns,
    /// Minutes.
    Min,
    /// Hours.
    H,
}

/// Units of roll, pitch and yaw in a flight log.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Words)]
#[serde(rename_all = "lowercase")]
pub enum AngleUnit {
    /// Degrees, or a unit that the values imply beyond doubt; an error if in doubt.
    #[default]
    Auto,
    /// Degrees.
    Deg,
    /// Radians.
    Rad,
}

/// Interpretation of Euler angles in a log.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Words)]
#[serde(rename_all = "kebab-case")]
pub enum AngleKind {
    /// `wrapped`, unless a column leaves both [-180, 180] and [0, 360).
    #[default]
    Auto,
    /// Rotation along the shorter arc between two rows.
    Wrapped,
    /// As written, turns count: from 0 to 360 is a full turn.
    Continuous,
}

/// Source of the platform's attitude.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Words)]
#[serde(rename_all = "kebab-case")]
pub enum AttitudeSource {
    /// The log's own columns.
    #[default]
    Log,
    /// Heading from the track, bank from coordinated turns, pitch from the climb angle.
    Track,
}

/// Origin of the local north-east-down frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Origin {
    /// The first good row of the log (written `"first"`).
    #[default]
    #[serde(with = "super::auto::first")]
    First,
    /// `[latitude_deg, longitude_deg, height_m]` on WGS-84.
    Geodetic([f64; 3]),
}
