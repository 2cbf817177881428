//! Known names of columns and their meanings. docs/reference/inputs/LOGS.md is generated from this table.

use std::{collections::HashMap, sync::LazyLock};

use camsim_core::scenario::{
    FlightHeight::{self, Takeoff},
    HeightReference::{Ellipsoid, Msl},
};

use super::{
    column_meaning::{ColumnMeaning, ColumnMeaning::*, FixCode},
    units::{MICROSECOND, MILLISECOND, SECOND, Unit},
};

/// A meaning with the names that have it.
pub(super) struct KnownName {
    pub(super) meaning: ColumnMeaning,
    /// Names in normal form, with blanks between them: lower case, with underscores for blanks, hyphens, dots,
    /// slashes and colons.
    pub(super) names: &'static str,
    /// Unit that the name implies.
    pub(super) unit: Option<&'static Unit>,
    /// The quantity, for LOGS.md.
    pub(super) quantity: &'static str,
    /// What the reader does with it, for LOGS.md.
    pub(super) treatment: &'static str,
}

const fn known(
    meaning: ColumnMeaning,
    names: &'static str,
    quantity: &'static str,
    treatment: &'static str,
) -> KnownName {
    KnownName { meaning, names, unit: None, quantity, treatment }
}

const fn applied(meaning: ColumnMeaning, names: &'static str, quantity: &'static str) -> KnownName {
    known(meaning, names, quantity, "applied")
}

const fn time_in(unit: &'static Unit, names: &'static str, quantity: &'static str) -> KnownName {
    KnownName { unit: Some(unit), ..applied(Time, names, quantity) }
}

/// Prefixes that name the message or device a column comes from.
pub(super) const PREFIXES: &str = "lcl_ osd_ gps_ att_ ahr2_ pos_ uav_ drone_ aircraft_ vehicle_ ins_ imu_ \
    nav_ gnss_ flight_ field_";

/// All known names.
pub(super) static KNOWN_NAMES: &[KnownName] = &[
    applied(
        Time,
        "t time timestamp stamp time_stamp elapsed elapsed_time fly_time flight_time time_boot \
            time_since_boot tow sow time_of_week utc_time time_of_day header_stamp field_header_stamp",
        "time: number, clock time `h:m:s`, or ISO 8601",
    ),
    time_in(
        &SECOND,
        "sec secs seconds secs_of_week seconds_of_week stamp_sec stamp_secs header_stamp_sec \
            header_stamp_secs",
        "time in seconds",
    ),
    time_in(&MILLISECOND, "ms msec millis milliseconds itow cts", "time in milliseconds"),
    time_in(&MICROSECOND, "us usec micros microseconds", "time in microseconds"),
    applied(
        NanosecondsPart,
        "nsec nsecs nanosec nanosecs nanoseconds ns stamp_nsec stamp_nsecs stamp_nanosec header_stamp_nsec \
            header_stamp_nsecs header_stamp_nanosec",
        "nanoseconds: added to the seconds (`NAME_secs`, `NAME_nsecs`), else the time itself; refused where \
            they begin again each second",
    ),
    known(
        DateTime,
        "datetime date_time utc gpst jst utc_datetime iso_time timestamp_iso time_iso date_time_original \
            sub_sec_date_time_original create_date gps_date_time",
        "date and time as text",
        "applied where no other column is a time",
    ),
    known(
        Date,
        "date day local_date utc_date date_utc gps_date_stamp",
        "date, `year-month-day` or as below; or date and time as text",
        "applied to clock times; a date with a time where no other column is a time",
    ),
    applied(
        LatitudeLongitude,
        "gps coordinates gps_coordinates latlon lat_lon latlng gps_position",
        "latitude and longitude in one field, with a blank between them",
    ),
    applied(Latitude, "lat latitude", "latitude"),
    applied(Longitude, "lon lng long longitude", "longitude"),
    applied(
        Height(None),
        "alt altitude height h up elevation elev ele abs_alt absolute_altitude u_baseline",
        "height, up; above what flight.height says",
    ),
    known(
        Height(Some(Msl)),
        "msl amsl asl altitude_above_sea_level altitude_above_sealevel height_above_sea_level \
            orthometric_height",
        "height above mean sea level",
        "applied; a warning where flight.height says otherwise",
    ),
    known(
        Height(Some(Ellipsoid)),
        "hae ellipsoid_height ellipsoidal_height height_above_ellipsoid h_ell alt_ell field_altitude",
        "height above the ellipsoid",
        "applied; a warning where flight.height says otherwise",
    ),
    known(
        PressureHeight,
        "pressure_alt pressure_altitude baro_alt baro_altitude alt_baro altitude_baro barometric_altitude \
            barometer_altitude",
        "height by air pressure",
        "applied where there is no other height",
    ),
    known(
        RelativeHeight(Takeoff),
        "height_above_takeoff height_above_take_off osd_height rel_alt relative_alt relative_altitude \
            alt_rel altitude_relative height_relative altitude_above_takeoff",
        "height above take-off",
        "applied where flight.height is \"takeoff\"; else refused as the only height",
    ),
    known(
        RelativeHeight(FlightHeight::Ground),
        "agl alt_agl altitude_agl height_agl height_above_ground height_above_ground_at_drone_location \
            height_sonar vps_height radar_altitude radar_alt rangefinder_alt dist_bottom",
        "height above ground",
        "applied where flight.height is \"ground\"; else refused as the only height",
    ),
    known(
        Ground,
        "ground_elevation ground_elevation_at_drone_location terrain_alt terrain_elevation",
        "height of the ground",
        "not used",
    ),
    applied(North, "n north pn pos_n pos_north position_north n_baseline", "local north"),
    applied(East, "e east pe pos_e pos_east position_east e_baseline", "local east"),
    applied(Down, "d down pd pos_d pos_down position_down", "local down"),
    known(
        Grid,
        "easting northing utm_e utm_n utm_x utm_y utm_east utm_north utm_easting utm_northing",
        "grid coordinates, whose north is not true north",
        "refused as the only position",
    ),
    known(
        EarthCentred,
        "x_ecef y_ecef z_ecef ecef_x ecef_y ecef_z",
        "coordinates from the centre of the Earth (ECEF)",
        "refused as the only position",
    ),
    known(
        X,
        "x tx px p_x pos_x position_x p_rs_r_x pose_position_x field_pose_position_x pose_pose_position_x \
            field_pose_pose_position_x",
        "local x",
        "applied; axes by flight.format, TUM's order or EuRoC's names",
    ),
    known(
        Y,
        "y ty py p_y pos_y position_y p_rs_r_y pose_position_y field_pose_position_y pose_pose_position_y \
            field_pose_pose_position_y",
        "local y",
        "as x",
    ),
    known(
        Z,
        "z tz pz p_z pos_z position_z p_rs_r_z pose_position_z field_pose_position_z pose_pose_position_z \
            field_pose_pose_position_z",
        "local z",
        "as x",
    ),
    applied(Roll, "roll phi roll_angle bank", "roll of the body"),
    applied(Pitch, "pitch theta pitch_angle ptch", "pitch of the body"),
    applied(
        Yaw,
        "yaw heading hdg psi yaw_angle compass_heading true_heading heading_true",
        "yaw of the body, from true north",
    ),
    known(
        MagneticYaw,
        "magnetic_heading mag_heading heading_magnetic heading_mag",
        "yaw of the body, from magnetic north",
        "applied as true, with a warning",
    ),
    applied(
        Qx,
        "qx q_x q[1] q_rs_x quat_x orientation_x pose_orientation_x field_pose_orientation_x \
            pose_pose_orientation_x field_pose_pose_orientation_x",
        "quaternion, x",
    ),
    applied(
        Qy,
        "qy q_y q[2] q_rs_y quat_y orientation_y pose_orientation_y field_pose_orientation_y \
            pose_pose_orientation_y field_pose_pose_orientation_y",
        "quaternion, y",
    ),
    applied(
        Qz,
        "qz q_z q[3] q_rs_z quat_z orientation_z pose_orientation_z field_pose_orientation_z \
            pose_pose_orientation_z field_pose_pose_orientation_z",
        "quaternion, z",
    ),
    applied(
        Qw,
        "qw q_w q[0] q_rs_w quat_w orientation_w pose_orientation_w field_pose_orientation_w \
            pose_pose_orientation_w field_pose_pose_orientation_w",
        "quaternion, scalar",
    ),
    known(
        Course,
        "course track cog course_over_ground ground_course gcrs gps_heading gps_hdg gps_yaw",
        "direction of motion",
        "not used: it is no heading",
    ),
    known(
        Hemisphere,
        "n_s e_w ns_indicator ew_indicator lat_ref lon_ref gps_latitude_ref gps_longitude_ref latitude_ref \
            longitude_ref lat_dir lon_dir lat_hem lon_hem lat_ns lon_ew",
        "hemisphere as a letter",
        "refused where latitude and longitude have no sign: write signed degrees",
    ),
    known(
        TimePart,
        "hour hours hr minute minutes min mins",
        "hours or minutes of a time in several columns",
        "refused beside a column of seconds: write one column",
    ),
    known(
        Vehicle,
        "vehicle vehicle_name vehicle_id drone drone_name drone_id uav uav_id aircraft_id aircraft_name \
            robot robot_id sysid system_id icao24 callsign tail_number",
        "whose row it is",
        "refused where there are several: keep the rows of one",
    ),
    known(
        Receiver,
        "instance gps_instance gps_i gps_id gps_index gps_number gnss_id gnss_index receiver receiver_id \
            receiver_index multi_id core ekf_core antenna antenna_id antenna_index",
        "number of the receiver or estimator; `I` or `C` of one ArduPilot message (with `TimeUS`)",
        "of several the one that ArduPilot's `U` says is in use, else the lowest; the rows of the others are \
            skipped and counted",
    ),
    known(
        Fix(FixCode::Dimensions),
        "fix_type fixtype gps_fix_type gps_fix gpsfix gnss_fix gnss_fix_type gps_lock fix fix_dimension \
            fix_mode",
        "fix: 0 and 1 none, 2 two-dimensional, from 3 on three-dimensional; or in words",
        "rows without a three-dimensional fix are skipped and counted",
    ),
    known(
        Fix(FixCode::NonZero),
        "fix_quality gps_quality gnss_quality quality_indicator fix_valid gps_valid gnss_valid \
            position_valid pos_valid is_valid valid has_fix fix_ok gps_fix_ok gnss_fix_ok solution_valid \
            xy_valid healthy gps_healthy gnss_healthy gps_ok",
        "quality of the fix, or whether there is one; 0, false, V and words such as `none`: no fix",
        "rows without a fix are skipped and counted",
    ),
    known(
        Fix(FixCode::NonNegative),
        "status_status field_status_status navsat_status gps_status_status",
        "status of a fix, as ROS has it; below 0: no fix",
        "rows without a fix are skipped and counted",
    ),
    known(
        InUse,
        "used in_use is_used gps_used is_gps_used gnss_used primary is_primary",
        "whether the receiver of a row was in use",
        "rows that were not are skipped and counted, unless all are such",
    ),
    known(
        Fix(FixCode::Rtklib),
        "q",
        "RTKLIB's quality of a solution; 0: none",
        "rows without a solution are skipped and counted, unless all are such or there are columns `p` or `r`",
    ),
    known(
        Fix(FixCode::Satellites),
        "satellites num_satellites satellites_used sats sats_used num_sats num_sat nsats nsat n_sats num_sv \
            numsats numsat numsv satellite_count sat_count gps_sats gps_num_sats gps_num_sat gps_satellites \
            gnss_satellites gps_num",
        "number of satellites; 0: no fix",
        "rows without satellites are skipped and counted, unless all are such",
    ),
    known(
        Fix(FixCode::Negated),
        "lost is_lost tracking_lost gps_lost outlier is_outlier rejected invalid",
        "flag of a position that is none",
        "rows with the flag set are skipped and counted, unless all are such",
    ),
    known(
        Fix(FixCode::Words),
        "status fix_status gps_status gps_fix_status gnss_status gnss_fix_status nav_status navstatus \
            quality position_quality pos_quality solution_quality pos_type position_type position_status \
            pos_status solution solution_type solution_status sol_type sol_status tracking tracking_state \
            tracking_status tracker_state mode gps_mode pos_mode position_mode validity",
        "state of a fix or of a tracker in words (`NoFix`, `3D`, `NONE`, `LOST`, `OK`, `V`, `A`); a number below \
            0: no position",
        "rows of words for no position are skipped and counted where other rows have words for one; of other \
            numbers and words a warning, where positions jump as they change",
    ),
    known(
        Fix(FixCode::Unknown),
        "hdop pdop flags gps_flags carrier_solution carr_soln rtk_status ekf_status confidence \
            tracking_confidence tracker_confidence",
        "accuracy, or a state whose codes differ between programs",
        "not used; a warning where positions jump as it changes",
    ),
    known(
        HeightDatum,
        "altitude_system altitude_reference altitude_ref alt_ref height_reference height_system \
            gps_altitude_ref vertical_datum height_datum altitude_datum alt_datum",
        "what the heights are above, in words (MSL, MSLV, Above Sea Level, ellipsoid, WGS84)",
        "a warning where flight.height says otherwise",
    ),
    known(
        Gimbal,
        "gimbal_heading gimbal_yaw gimbal_pitch gimbal_roll camera_yaw camera_pitch camera_roll",
        "attitude of a gimbal",
        "not used, with a warning: camera.mount says where the camera looks",
    ),
];

/// Each name with its line of the table.
static BY_NAME: LazyLock<HashMap<&str, &KnownName>> = LazyLock::new(|| {
    KNOWN_NAMES.iter().flat_map(|known| known.names.split(' ').map(move |name| (name, known))).collect()
});

/// Looks up a whole name in normal form.
pub(super) fn find(name: &str) -> Option<&'static KnownName> {
    // `imu_x` is no position, and `gps_h` may be an accuracy: after a prefix only names of more than two
    // letters count, and only those of these meanings.
    let after_prefix = |name: &str| {
        BY_NAME.get(name).copied().filter(|known| {
            name.len() > 2
                && matches!(
                    known.meaning,
                    Time | Date | Latitude | Longitude | LatitudeLongitude | Height(_) | Roll | Pitch | Yaw
                )
        })
    };
    let prefixes = || PREFIXES.split(' ').find_map(|prefix| name.strip_prefix(prefix).and_then(after_prefix));
    BY_NAME.get(name).copied().or_else(prefixes)
}
