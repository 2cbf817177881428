//! Known names of columns and their meanings. docs/inputs/LOGS.md is generated from this table.

use super::{
    column_meaning::ColumnMeaning,
    units::{MICROSECOND, MILLISECOND, NANOSECOND, SECOND, Unit, VerticalDatum},
};

/// A meaning with the names that have it.
pub(super) struct KnownName {
    pub(super) meaning: ColumnMeaning,
    /// Names in normal form: lower case, with underscores for blanks, hyphens, dots, slashes and colons.
    pub(super) names: &'static [&'static str],
    /// Unit that the name implies.
    pub(super) unit: Option<&'static Unit>,
    /// The quantity, for LOGS.md.
    pub(super) quantity: &'static str,
    /// What the reader does with it, for LOGS.md.
    pub(super) treatment: &'static str,
}

const fn known_name(
    meaning: ColumnMeaning,
    names: &'static [&'static str],
    quantity: &'static str,
    treatment: &'static str,
) -> KnownName {
    KnownName { meaning, names, unit: None, quantity, treatment }
}

const fn time_name(unit: &'static Unit, names: &'static [&'static str], quantity: &'static str) -> KnownName {
    KnownName { meaning: ColumnMeaning::Time, names, unit: Some(unit), quantity, treatment: "applied" }
}

/// Prefixes that name the message or device a column comes from.
pub(super) const PREFIXES: &[&str] = &[
    "lcl_",
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

/// All known names.
pub(super) static KNOWN_NAMES: &[KnownName] = &[
    known_name(
        ColumnMeaning::Time,
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
    time_name(
        &SECOND,
        &[
            "sec",
            "secs",
            "seconds",
            "secs_of_week",
            "seconds_of_week",
            "stamp_sec",
            "stamp_secs",
            "header_stamp_sec",
            "header_stamp_secs",
        ],
        "time in seconds",
    ),
    time_name(&MILLISECOND, &["ms", "msec", "millis", "milliseconds", "itow"], "time in milliseconds"),
    time_name(&MICROSECOND, &["us", "usec", "micros", "microseconds"], "time in microseconds"),
    known_name(
        ColumnMeaning::NanosecondsPart,
        &[
            "nsec",
            "nsecs",
            "nanosec",
            "nanosecs",
            "nanoseconds",
            "ns",
            "stamp_nsec",
            "stamp_nsecs",
            "stamp_nanosec",
            "header_stamp_nsec",
            "header_stamp_nsecs",
            "header_stamp_nanosec",
        ],
        "nanoseconds: added to a column of whole seconds, else the time itself",
        "applied",
    ),
    known_name(
        ColumnMeaning::DateTime,
        &["datetime", "date_time", "utc", "utc_datetime", "iso_time", "timestamp_iso", "time_iso"],
        "date and time as text",
        "applied where no other column is a time",
    ),
    known_name(
        ColumnMeaning::Date,
        &["date", "day", "utc_date", "date_utc"],
        "date, `year-month-day`",
        "applied to clock times",
    ),
    known_name(
        ColumnMeaning::LatitudeLongitude,
        &["gps", "coordinates", "gps_coordinates", "latlon", "lat_lon", "latlng", "gps_position"],
        "latitude and longitude in one field, with a blank between them",
        "applied",
    ),
    known_name(ColumnMeaning::Latitude, &["lat", "latitude"], "latitude", "applied"),
    known_name(ColumnMeaning::Longitude, &["lon", "lng", "long", "longitude"], "longitude", "applied"),
    known_name(
        ColumnMeaning::Height(None),
        &["alt", "altitude", "height", "h", "up", "elevation", "elev", "ele", "abs_alt", "absolute_altitude"],
        "height, up; above what flight.height says",
        "applied",
    ),
    known_name(
        ColumnMeaning::Height(Some(VerticalDatum::MeanSeaLevel)),
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
    known_name(
        ColumnMeaning::Height(Some(VerticalDatum::Ellipsoid)),
        &["hae", "ellipsoid_height", "ellipsoidal_height", "height_above_ellipsoid", "h_ell", "alt_ell"],
        "height above the ellipsoid",
        "applied; a warning where flight.height says otherwise",
    ),
    known_name(
        ColumnMeaning::PressureHeight,
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
    known_name(
        ColumnMeaning::RelativeHeight,
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
    known_name(
        ColumnMeaning::Ground,
        &["ground_elevation", "ground_elevation_at_drone_location", "terrain_alt", "terrain_elevation"],
        "height of the ground",
        "not used",
    ),
    known_name(
        ColumnMeaning::North,
        &["n", "north", "pn", "pos_n", "pos_north", "position_north"],
        "local north",
        "applied",
    ),
    known_name(
        ColumnMeaning::East,
        &["e", "east", "pe", "pos_e", "pos_east", "position_east"],
        "local east",
        "applied",
    ),
    known_name(
        ColumnMeaning::Down,
        &["d", "down", "pd", "pos_d", "pos_down", "position_down"],
        "local down",
        "applied",
    ),
    known_name(
        ColumnMeaning::Grid,
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
    known_name(
        ColumnMeaning::X,
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
    known_name(
        ColumnMeaning::Y,
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
    known_name(
        ColumnMeaning::Z,
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
    known_name(ColumnMeaning::Roll, &["roll", "phi", "roll_angle", "bank"], "roll of the body", "applied"),
    known_name(
        ColumnMeaning::Pitch,
        &["pitch", "theta", "pitch_angle", "ptch"],
        "pitch of the body",
        "applied",
    ),
    known_name(
        ColumnMeaning::Yaw,
        &["yaw", "heading", "hdg", "psi", "yaw_angle", "compass_heading", "true_heading", "heading_true"],
        "yaw of the body, from true north",
        "applied",
    ),
    known_name(
        ColumnMeaning::MagneticYaw,
        &["magnetic_heading", "mag_heading", "heading_magnetic", "heading_mag"],
        "yaw of the body, from magnetic north",
        "applied as true, with a warning",
    ),
    known_name(
        ColumnMeaning::Qx,
        &[
            "qx",
            "q_x",
            "q[1]",
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
    known_name(
        ColumnMeaning::Qy,
        &[
            "qy",
            "q_y",
            "q[2]",
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
    known_name(
        ColumnMeaning::Qz,
        &[
            "qz",
            "q_z",
            "q[3]",
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
    known_name(
        ColumnMeaning::Qw,
        &[
            "qw",
            "q_w",
            "q[0]",
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
    known_name(
        ColumnMeaning::Course,
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
    known_name(
        ColumnMeaning::Hemisphere,
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
    known_name(
        ColumnMeaning::TimePart,
        &["hour", "hours", "hr", "minute", "minutes", "min", "mins"],
        "hours or minutes of a time in several columns",
        "refused beside a column of seconds: write one column",
    ),
    known_name(
        ColumnMeaning::Vehicle,
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
    known_name(
        ColumnMeaning::Gimbal,
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

/// Looks up a whole name in normal form.
pub(super) fn find(name: &str) -> Option<&'static KnownName> {
    let exact = |name: &str| KNOWN_NAMES.iter().find(|known| known.names.contains(&name));
    // `imu_x` is no position, and `gps_h` may be an accuracy: after a prefix only names of more than two
    // letters count, and only those of these meanings.
    let after_prefix = |name: &str| {
        use ColumnMeaning::{Height, Latitude, LatitudeLongitude, Longitude, Pitch, Roll, Time, Yaw};
        let is_allowed = |known: &&KnownName| {
            matches!(
                known.meaning,
                Time | Latitude | Longitude | LatitudeLongitude | Height(_) | Roll | Pitch | Yaw
            )
        };
        (name.len() > 2).then(|| exact(name).filter(is_allowed)).flatten()
    };
    exact(name)
        .or_else(|| PREFIXES.iter().find_map(|prefix| name.strip_prefix(prefix).and_then(after_prefix)))
}

/// The unit of [`ColumnMeaning::NanosecondsPart`].
pub(super) static NANOSECONDS: &Unit = &NANOSECOND;
