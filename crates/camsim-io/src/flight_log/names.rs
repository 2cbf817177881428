//! Names of columns: which names mean what. The documentation of columns is made from this table.

use super::units::{Datum, MICROSECOND, MILLISECOND, NANOSECOND, SECOND, Unit};

/// What a column holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Meaning {
    /// Times as numbers, clock times or dates with times.
    Time,
    /// Date and time as text; counts only where no column is a [`Meaning::Time`].
    DateTime,
    /// Nanoseconds that belong to a column of whole seconds.
    NanosecondsPart,
    Date,
    /// Two numbers in one field.
    LatitudeLongitude,
    Latitude,
    Longitude,
    /// Up, above what its name says or `flight.height`.
    Height(Option<Datum>),
    /// By air pressure: less trusted than `Height`.
    PressureHeight,
    /// Above take-off or ground: no place in the world.
    RelativeHeight,
    North,
    East,
    Down,
    /// Grid coordinates, whose north isn't true north.
    Grid,
    X,
    Y,
    Z,
    Roll,
    Pitch,
    Yaw,
    /// Of magnetic north.
    MagneticYaw,
    Qx,
    Qy,
    Qz,
    Qw,
    /// Where the aircraft moves, not where its nose points.
    Course,
    /// Attitude of a gimbal.
    Gimbal,
    /// The ground's height.
    Ground,
    /// North or south, east or west.
    Hemisphere,
    /// Hours or minutes beside a column of seconds.
    TimePart,
    /// Whose row it is.
    Vehicle,
}

/// A meaning with its names.
pub(super) struct Known {
    pub(super) meaning: Meaning,
    /// Lower case; blanks, hyphens, dots, slashes and colons are underscores.
    pub(super) names: &'static [&'static str],
    /// Where the name alone says it.
    pub(super) unit: Option<&'static Unit>,
    pub(super) what: &'static str,
    pub(super) use_of_it: &'static str,
}

const fn known(
    meaning: Meaning,
    names: &'static [&'static str],
    what: &'static str,
    use_of_it: &'static str,
) -> Known {
    Known { meaning, names, unit: None, what, use_of_it }
}

const fn time_in(unit: &'static Unit, names: &'static [&'static str], what: &'static str) -> Known {
    Known { meaning: Meaning::Time, names, unit: Some(unit), what, use_of_it: "applied" }
}

/// Prefixes that say which message or device a column is from.
pub(super) const PREFIXES: &[&str] = &[
    "osd_",
    "gps_",
    "att_",
    "ahr2_",
    "pos_",
    "uav_",
    "drone_",
    "aircraft_",
    "vehicle_",
    "ins_",
    "imu_",
    "nav_",
    "gnss_",
];

/// Every name known.
pub(super) static KNOWN: &[Known] = &[
    known(
        Meaning::Time,
        &[
            "t",
            "time",
            "timestamp",
            "stamp",
            "time_stamp",
            "elapsed",
            "elapsed_time",
            "fly_time",
            "flight_time",
            "time_boot",
            "time_since_boot",
            "tow",
            "sow",
            "time_of_week",
            "utc_time",
            "time_of_day",
        ],
        "time: number, clock time `h:m:s`, or ISO 8601",
        "applied",
    ),
    time_in(&SECOND, &["sec", "secs", "seconds", "secs_of_week", "seconds_of_week"], "time in seconds"),
    time_in(&MILLISECOND, &["ms", "msec", "millis", "milliseconds", "itow"], "time in milliseconds"),
    time_in(&MICROSECOND, &["us", "usec", "micros", "microseconds"], "time in microseconds"),
    known(
        Meaning::NanosecondsPart,
        &["nsec", "nsecs", "nanosec", "nanosecs", "nanoseconds", "ns"],
        "nanoseconds: added to a column of whole seconds, else the time itself",
        "applied",
    ),
    known(
        Meaning::DateTime,
        &["datetime", "date_time", "utc", "utc_datetime", "iso_time", "timestamp_iso", "time_iso"],
        "date and time as text",
        "applied where no other column is a time",
    ),
    known(
        Meaning::Date,
        &["date", "day", "utc_date", "date_utc"],
        "date, `year-month-day`",
        "applied to clock times",
    ),
    known(
        Meaning::LatitudeLongitude,
        &["gps", "coordinates", "gps_coordinates", "latlon", "lat_lon", "latlng", "gps_position"],
        "latitude and longitude in one field, with a blank between them",
        "applied",
    ),
    known(Meaning::Latitude, &["lat", "latitude"], "latitude", "applied"),
    known(Meaning::Longitude, &["lon", "lng", "long", "longitude"], "longitude", "applied"),
    known(
        Meaning::Height(None),
        &["alt", "altitude", "height", "h", "up", "elevation", "elev", "ele", "abs_alt", "absolute_altitude"],
        "height, up; above what flight.height says",
        "applied",
    ),
    known(
        Meaning::Height(Some(Datum::MeanSeaLevel)),
        &[
            "msl",
            "amsl",
            "asl",
            "altitude_above_sea_level",
            "altitude_above_sealevel",
            "height_above_sea_level",
            "orthometric_height",
        ],
        "height above mean sea level",
        "applied; a warning where flight.height says otherwise",
    ),
    known(
        Meaning::Height(Some(Datum::Ellipsoid)),
        &["hae", "ellipsoid_height", "ellipsoidal_height", "height_above_ellipsoid", "h_ell", "alt_ell"],
        "height above the ellipsoid",
        "applied; a warning where flight.height says otherwise",
    ),
    known(
        Meaning::PressureHeight,
        &[
            "pressure_alt",
            "pressure_altitude",
            "baro_alt",
            "baro_altitude",
            "alt_baro",
            "altitude_baro",
            "barometric_altitude",
            "barometer_altitude",
        ],
        "height by air pressure",
        "applied where there is no other height",
    ),
    known(
        Meaning::RelativeHeight,
        &[
            "height_above_takeoff",
            "height_above_take_off",
            "osd_height",
            "rel_alt",
            "relative_alt",
            "relative_altitude",
            "alt_rel",
            "altitude_relative",
            "height_relative",
            "altitude_above_takeoff",
            "agl",
            "alt_agl",
            "altitude_agl",
            "height_agl",
            "height_above_ground",
            "height_above_ground_at_drone_location",
            "height_sonar",
            "vps_height",
            "radar_altitude",
            "radar_alt",
            "rangefinder_alt",
            "dist_bottom",
        ],
        "height above take-off or ground",
        "refused as the only height",
    ),
    known(
        Meaning::Ground,
        &["ground_elevation", "ground_elevation_at_drone_location", "terrain_alt", "terrain_elevation"],
        "height of the ground",
        "not used",
    ),
    known(
        Meaning::North,
        &["n", "north", "pn", "pos_n", "pos_north", "position_north"],
        "local north",
        "applied",
    ),
    known(Meaning::East, &["e", "east", "pe", "pos_e", "pos_east", "position_east"], "local east", "applied"),
    known(Meaning::Down, &["d", "down", "pd", "pos_d", "pos_down", "position_down"], "local down", "applied"),
    known(
        Meaning::Grid,
        &[
            "easting",
            "northing",
            "utm_e",
            "utm_n",
            "utm_x",
            "utm_y",
            "utm_east",
            "utm_north",
            "utm_easting",
            "utm_northing",
        ],
        "grid coordinates, whose north is not true north",
        "refused as the only position",
    ),
    known(
        Meaning::X,
        &[
            "x",
            "tx",
            "px",
            "p_x",
            "pos_x",
            "position_x",
            "p_rs_r_x",
            "pose_position_x",
            "field_pose_position_x",
            "pose_pose_position_x",
            "field_pose_pose_position_x",
        ],
        "local x",
        "applied; axes by flight.format, TUM's order or EuRoC's names",
    ),
    known(
        Meaning::Y,
        &[
            "y",
            "ty",
            "py",
            "p_y",
            "pos_y",
            "position_y",
            "p_rs_r_y",
            "pose_position_y",
            "field_pose_position_y",
            "pose_pose_position_y",
            "field_pose_pose_position_y",
        ],
        "local y",
        "as x",
    ),
    known(
        Meaning::Z,
        &[
            "z",
            "tz",
            "pz",
            "p_z",
            "pos_z",
            "position_z",
            "p_rs_r_z",
            "pose_position_z",
            "field_pose_position_z",
            "pose_pose_position_z",
            "field_pose_pose_position_z",
        ],
        "local z",
        "as x",
    ),
    known(Meaning::Roll, &["roll", "phi", "roll_angle", "bank"], "roll of the body", "applied"),
    known(Meaning::Pitch, &["pitch", "theta", "pitch_angle", "ptch"], "pitch of the body", "applied"),
    known(
        Meaning::Yaw,
        &["yaw", "heading", "hdg", "psi", "yaw_angle", "compass_heading", "true_heading", "heading_true"],
        "yaw of the body, from true north",
        "applied",
    ),
    known(
        Meaning::MagneticYaw,
        &["magnetic_heading", "mag_heading", "heading_magnetic", "heading_mag"],
        "yaw of the body, from magnetic north",
        "applied as true, with a warning",
    ),
    known(
        Meaning::Qx,
        &[
            "qx",
            "q_x",
            "q_rs_x",
            "quat_x",
            "orientation_x",
            "pose_orientation_x",
            "field_pose_orientation_x",
            "pose_pose_orientation_x",
            "field_pose_pose_orientation_x",
        ],
        "quaternion, x",
        "applied",
    ),
    known(
        Meaning::Qy,
        &[
            "qy",
            "q_y",
            "q_rs_y",
            "quat_y",
            "orientation_y",
            "pose_orientation_y",
            "field_pose_orientation_y",
            "pose_pose_orientation_y",
            "field_pose_pose_orientation_y",
        ],
        "quaternion, y",
        "applied",
    ),
    known(
        Meaning::Qz,
        &[
            "qz",
            "q_z",
            "q_rs_z",
            "quat_z",
            "orientation_z",
            "pose_orientation_z",
            "field_pose_orientation_z",
            "pose_pose_orientation_z",
            "field_pose_pose_orientation_z",
        ],
        "quaternion, z",
        "applied",
    ),
    known(
        Meaning::Qw,
        &[
            "qw",
            "q_w",
            "q_rs_w",
            "quat_w",
            "orientation_w",
            "pose_orientation_w",
            "field_pose_orientation_w",
            "pose_pose_orientation_w",
            "field_pose_pose_orientation_w",
        ],
        "quaternion, scalar",
        "applied",
    ),
    known(
        Meaning::Course,
        &[
            "course",
            "track",
            "cog",
            "course_over_ground",
            "ground_course",
            "gcrs",
            "gps_heading",
            "gps_hdg",
            "gps_yaw",
        ],
        "direction of motion",
        "not used: it is no heading",
    ),
    known(
        Meaning::Hemisphere,
        &[
            "n_s",
            "e_w",
            "ns_indicator",
            "ew_indicator",
            "lat_ref",
            "lon_ref",
            "latitude_ref",
            "longitude_ref",
            "lat_dir",
            "lon_dir",
            "lat_hem",
            "lon_hem",
            "lat_ns",
            "lon_ew",
        ],
        "hemisphere as a letter",
        "refused beside latitude and longitude: write signed degrees",
    ),
    known(
        Meaning::TimePart,
        &["hour", "hours", "hr", "minute", "minutes", "min", "mins"],
        "hours or minutes of a time in several columns",
        "refused beside a column of seconds: write one column",
    ),
    known(
        Meaning::Vehicle,
        &[
            "vehicle",
            "vehicle_name",
            "vehicle_id",
            "drone",
            "drone_name",
            "drone_id",
            "uav",
            "uav_id",
            "aircraft_id",
            "aircraft_name",
            "robot",
            "robot_id",
            "sysid",
            "system_id",
            "icao24",
            "callsign",
            "tail_number",
        ],
        "whose row it is",
        "refused where there are several: keep the rows of one",
    ),
    known(
        Meaning::Gimbal,
        &[
            "gimbal_heading",
            "gimbal_yaw",
            "gimbal_pitch",
            "gimbal_roll",
            "camera_yaw",
            "camera_pitch",
            "camera_roll",
        ],
        "attitude of a gimbal",
        "not used, with a warning: camera.mount says where the camera looks",
    ),
];

/// The meaning of a whole name, with the unit that it implies.
pub(super) fn find(name: &str) -> Option<&'static Known> {
    let exact = |name: &str| KNOWN.iter().find(|known| known.names.contains(&name));
    // An `imu_x` is no position, and a `gps_h` may be an accuracy: behind a prefix only words count, and only
    // these.
    let behind_prefix = |name: &str| {
        use Meaning::{Height, Latitude, LatitudeLongitude, Longitude, Pitch, Roll, Time, Yaw};
        let may = |known: &&Known| {
            matches!(
                known.meaning,
                Time | Latitude | Longitude | LatitudeLongitude | Height(_) | Roll | Pitch | Yaw
            )
        };
        (name.len() > 2).then(|| exact(name).filter(may)).flatten()
    };
    exact(name)
        .or_else(|| PREFIXES.iter().find_map(|prefix| name.strip_prefix(prefix).and_then(behind_prefix)))
}

/// The unit that goes with [`Meaning::NanosecondsPart`] alone.
pub(super) static NANOSECONDS: &Unit = &NANOSECOND;
