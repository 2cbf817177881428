//! Generates docs/reference/inputs/LOGS.md from the reader's tables.

use std::fmt::Write;

use super::{
    column_names::{KNOWN_NAMES, PREFIXES},
    foreign_formats::{FOREIGN_FORMATS, OTHER_BINARY, OTHER_XML, SUBTITLES},
    message_columns,
    receiver_logs::RECEIVER_LOGS,
    units::{Dimension, UNITS},
};

/// Formats of files without a header: name, columns, units and axes.
const FORMATS: &[(&str, &str, &str)] = &[
    (
        "csv-lla",
        "t, lat, lon, height, roll, pitch, yaw",
        "degrees, metres up; ZYX angles of the body (forward-right-down) in the tangent frame at the row",
    ),
    ("csv-xya", "t, north, east, altitude, roll, pitch, yaw", "metres, up; degrees"),
    ("csv-ned", "t, north, east, down, roll, pitch, yaw", "metres; degrees"),
    ("tum", "t, x, y, z, qx, qy, qz, qw", "metres, x east, y north, z up; body forward-left-up"),
    ("euroc", "t, x, y, z, qw, qx, qy, qz", "as tum; whole times are nanoseconds"),
    (
        "Motive's CSV",
        "`Format Version,...`, then the columns of rigid bodies; flight.topic chooses one of several",
        "in its Length Units, x east, z south, y up; quaternions of a body with x forward, y up",
    ),
    ("gpx", "`trkpt` with lat, lon, `ele`, `time`", "no attitude: flight.attitude = \"track\""),
    (
        "kml",
        "`gx:Track` with `when`, `gx:coord`, `gx:angles`; or placemarks with `TimeStamp` and `Point`",
        "degrees, metres above mean sea level (altitudeMode absolute, of the track or of what is around it: \
            gx:MultiTrack); angles are heading, tilt, roll",
    ),
    (
        "igc",
        "`B` records, with `LAD`, `LOD`, `TDS`; of the header date, datum, `ALG`, `ALP`",
        "WGS 84 (another datum in `HFDTM` gives a warning); heights by flight.height_from; no attitude: \
            flight.attitude = \"track\"",
    ),
    (
        "ulog",
        "vehicle_global_position, vehicle_local_position (with its origin), vehicle_odometry, \
            estimator_global_position, estimator_local_position, vehicle_gps_position, sensor_gps; \
            vehicle_attitude, estimator_attitude",
        "PX4's own; quaternions w, x, y, z of a forward-right-down body to north-east-down",
    ),
    (
        "dataflash",
        "POS, XKF1 or NKF1 (with ORGN), AHR2, GPS, SIM; ATT, XKQ",
        "ArduPilot's own, with the factors of its formats: degrees, metres above mean sea level",
    ),
    (
        "mcap",
        "PoseStamped, PoseWithCovarianceStamped, TransformStamped, Odometry, TFMessage (`/tf#child_frame`), \
            NavSatFix with Imu; ROS 2 (cdr) or ROS 1",
        "metres, x east, y north, z up; body forward-left-up (REP 103), unless the frames' names say otherwise",
    ),
];

/// Keys of `[flight]` that control the reading, with what each decides.
const KEYS: &[(&str, &str)] = &[
    ("format", "the layout, where a file has no header or its names do not say where the axes point"),
    (
        "time_unit",
        "unit of a time column that names none: s, ms, us, ns, min, h. `auto`: seconds without a question \
            where rows and speed are those of a flight; another unit, with a warning, where only that one is \
            possible; else refused",
    ),
    (
        "angle_unit",
        "unit of roll, pitch and yaw that name none: deg, rad. `auto`: degrees; radians, with a warning, \
            where yaw jumps by a turn of radians; refused where all stay within pi",
    ),
    ("angles", "whether angles wrap or count turns"),
    ("attitude", "`track`: the attitude of the log is not read at all"),
    (
        "height_from",
        "igc and tables: heights of satellite navigation (`gnss`) or of air pressure (`pressure`, standard \
            atmosphere); `auto`: gnss where there is one, else pressure with a warning",
    ),
    (
        "topic",
        "Motive: the rigid body. ulog, dataflash, mcap: the stream of the positions, and behind a comma that of the attitudes \
            (`vehicle_gps_position, vehicle_attitude`; `GPS, AHR2`; `/fix, /imu`); `#1` behind a name is an \
            instance, a core, or a child frame",
    ),
    (
        "height",
        "what heights are above; decides between several height columns, and warns where the column says \
            otherwise",
    ),
];

/// Further rules: subject and rule.
const RULES: &[(&str, &str)] = &[
    (
        "Units in a header",
        "in brackets `[]` or `()`, behind a comma (`\"lat, deg\"`), as the end of the name (`alt_ft`, \
            `TimeUS`, `latE7`), or as a line of units above or below the names, also as a comment. An unknown \
            unit of a column that is used is refused",
    ),
    (
        "Two lines of names",
        "the last counts, and the other one adds names, units and datums to it; a contradiction is refused",
    ),
    (
        "Prose",
        "comments above, among and below the rows, and lines before the names. In a line about columns \
            and nothing else, without unknown words or numbers, a unit that plainly belongs to a \
            quantity (`# heights in feet`, `Altitude unit,feet`, `# units: radians`) is applied where the header \
            names none, and so is the order of quaternions without names (`# scalar first`). Other statements \
            about what is read that differ from how it is read (units in doubt, datums, axes, \
            signs and order of angles, magnetic north) give one warning",
    ),
    (
        "Tags (FlySight 2)",
        "`$COL,GNSS,...` names the columns of the rows `$GNSS,...`, `$UNIT,GNSS,...` their units; of several tags \
            the one with a time and a position is read",
    ),
    (
        "Several columns for one quantity",
        "refused, with both names. Stated choices: the time that names its unit; the height of the datum of \
            flight.height; a height over one by air pressure; the quaternion over angles (with a warning); \
            latitude and longitude over local coordinates, unless flight.format says local",
    ),
    (
        "x, y, z",
        "z is up, and quaternions are of a forward-left-up body, where the names are TUM's (tx ty tz) or \
            EuRoC's (p_RS_R_x), or x y z qx qy qz qw stand in TUM's order between blanks; else flight.format \
            decides",
    ),
    (
        "Number of columns",
        "a header names as many as the rows have, and no row has more. The end of a comment counts where \
            prose stands before the names (`# format: timestamp tx ty ...`). A comment that names another number \
            gives a warning where flight.format tells the layout, or the values do and the names of time and \
            position do not contradict them",
    ),
    (
        "Times",
        "numbers; `h:m:s`, also with AM or PM, with a date column if there is one; ISO 8601 with `T` or a \
            blank, `Z` or an offset. Dates are year-month-day, 8 digits, day.month.year, or day and month in \
            either order where a number above 12 tells them apart; others give a warning, and times count from \
            midnight. Weeks of GPS beside seconds of the week are added, without leap seconds. A clock that \
            begins again (midnight, GPS week, 32 bit counters of us and ms) goes on, with a warning. Rows years \
            before the others, of a clock that is not set yet, are left out, with a warning",
    ),
    (
        "Times in two columns under one name",
        "a date and a clock, or a GPS week and its seconds, as RTKLIB writes them, are taken apart",
    ),
    ("Two clocks of ROS", "the stamp in a message's header counts before the time of arrival (`%time`)"),
    (
        "Coarse clocks",
        "rows that share the stamps of a clock (ten rows for each whole second) are spread evenly over its \
            steps, with a warning; a clock that stands still while the platform moves is refused",
    ),
    (
        "Held positions",
        "positions that change in every n-th row only, at least once a second, while the attitude goes on, are \
            interpolated between the changes, with a warning; rows beyond the first and last change are left out",
    ),
    (
        "Numbers with words",
        "of latitude, longitude and height: `47 deg 3' 36.00\" N`, `480 m Above Sea Level`, as exiftool writes",
    ),
    (
        "What heights are above",
        "by the name of their column, a column of words, or RTKLIB's comment; a warning where flight.height \
            says otherwise",
    ),
    (
        "Missing values",
        "empty, NA, N/A, NaN, null, none, nil, `-`. A row without a time or position is left out and \
            counted; an attitude is interpolated",
    ),
    (
        "Rows of zeros",
        "a latitude or longitude of exactly 0, or a height of exactly 0, that no aircraft reaches from the \
            rows beside it is left out and counted",
    ),
    (
        "Sparse tables",
        "where no row states everything, each quantity is interpolated between the rows that state it: \
            positions linearly at the rows of the attitude, attitudes as rotations at the rows of the \
            position; no row is lost",
    ),
    (
        "Numbers",
        "with a decimal point; with a decimal comma throughout where semicolons, tabs or blanks separate. \
            Only columns that are used must be numbers",
    ),
    (
        "Quaternions",
        "of length 1 within 1 %; of another length throughout: brought to 1, with a warning; of varying \
            lengths: refused",
    ),
    (
        "GPX",
        "all tracks and segments are one log; `ele` is taken as flight.height says, with a warning unless \
            that is \"msl\"; other tags are named",
    ),
    (
        "Several instances (ulog, dataflash)",
        "without `#1` in flight.topic that which the vehicle used at each time: the core of XKF4.PI or NKF4.PI, \
            the receiver of GPS.U, the estimator of estimator_selector_status; a change gives a warning. Where the \
            log does not say, the first is flown with a warning that lists them",
    ),
    (
        "Frames",
        "three letters in the name of a frame are its axes: `odom_ned`, `local_origin_ned`, `map_nwu`, \
            `base_link_frd`, `fcu_frd`; an `optical` child looks along z, and is turned to a body that does \
            (camera.mount counts from there). Transforms (`/tf#base_link`) are composed to the root, between \
            instants; the frame of another topic that has a pose in a parent gives a warning. Columns `frame_id` \
            and `child_frame_id` of tables with x, y, z count as such names",
    ),
    (
        "Interleaved receivers",
        "where a column of any name (`sensor`, `topic`, `id`) has up to eight values whose rows alternate, and each \
            value's rows make a much shorter way than all rows in turn, those of the lowest value count; the \
            others are left out and counted",
    ),
    (
        "Fixes",
        "rows without a 3D fix (fix_type, Status, NavSatFix.status, V, `fix` of GPX) or that the log marks as \
            invalid are left out and counted",
    ),
    ("Equal times", "refused where all times are equal and the positions are not"),
    (
        "Attitudes",
        "a warning where the body is upside down in all rows, or upright only in another order of the \
            quaternions; and where all rows have one attitude though the path turns. TUM rows with zeros for \
            quaternions state none",
    ),
    (
        "Jumps",
        "a flight that goes on at more than 1000 m/s between two rows after all repairs gives a warning with \
            the place",
    ),
];

/// Names, units, formats and rules of flight logs, as Markdown.
#[must_use]
pub fn reference() -> String {
    let mut text = String::from(
        "# Flight logs: what is read\n\nMade from the reader's own tables \
            (`crates/camsim-io/src/flight_log`).\n\n## Columns\n\nNames count without regard to case; \
            blanks, dots, hyphens and underscores are alike. These may stand before a name: ",
    );
    let prefixes: Vec<String> = PREFIXES.iter().map(|prefix| format!("`{prefix}`")).collect();
    text += &prefixes.join(", ");
    text += ". Other columns are not read.\n\n| quantity | names | what is done |\n|---|---|---|\n";
    for known in KNOWN_NAMES {
        let names: Vec<String> = known.names.iter().map(|name| format!("`{name}`")).collect();
        // Writing to a String cannot fail.
        let _ = writeln!(text, "| {} | {} | {} |", known.quantity, names.join(", "), known.treatment);
    }
    text += "\n## Columns of messages\n\nColumns `MESSAGE.field`, as `mavlogdump.py --format csv` writes them for \
        several messages. Of several messages with a position, or with an attitude, the first here counts.\n\n\
        | message | fields |\n|---|---|\n";
    for (message, fields) in message_columns::documentation() {
        let _ = writeln!(text, "| {message} | {fields} |");
    }
    text += "\n## Units\n\nAll are applied. Spellings count without blanks, underscores, dots, hyphens and \
        signs of multiplication.\n\n| of | unit | is | spellings |\n|---|---|---|---|\n";
    for unit in UNITS {
        let (base, scale) = match unit.dimension {
            Dimension::Time => ("s", 1e9),
            Dimension::Length => ("m", 1.0),
            Dimension::Angle => ("deg", 1.0),
        };
        let factor = unit.factor / scale;
        let factor = if (1e-3..1e6).contains(&factor) { format!("{factor}") } else { format!("{factor:e}") };
        let spellings: Vec<String> = unit.spellings.iter().map(|name| format!("`{name}`")).collect();
        let _ = writeln!(
            text,
            "| {} | {} | {factor} {base} | {} |",
            unit.dimension.name(),
            unit.name,
            spellings.join(", ")
        );
    }
    text += "\nBeside a height, msl, amsl, asl, orthometric, geoid, egm96 say that it is above mean sea \
        level; ellipsoid, ellipsoidal, hae, wgs84 that it is above the ellipsoid.\n";
    text += "\n## Formats\n\nBy flight.format, or detected where only one fits.\n\n| format | columns | \
        numbers |\n|---|---|---|\n";
    for (format, columns, numbers) in FORMATS {
        let _ = writeln!(text, "| {format} | {columns} | {numbers} |");
    }
    text += "\n## Keys of `[flight]`\n\n| key | decides |\n|---|---|\n";
    for (key, decides) in KEYS {
        let _ = writeln!(text, "| {key} | {decides} |");
    }
    text += "\n## Rules\n\n| of | rule |\n|---|---|\n";
    for (subject, rule) in RULES {
        let _ = writeln!(text, "| {subject} | {rule} |");
    }
    text += "\n## Refused with advice\n\n| file | what to do |\n|---|---|\n";
    let by_signature = FOREIGN_FORMATS.iter().map(|format| (format.name, format.advice));
    for (name, advice) in by_signature.chain(OTHER_BINARY).chain(RECEIVER_LOGS).chain([SUBTITLES, OTHER_XML])
    {
        let _ = writeln!(text, "| {name} | {advice} |");
    }
    text
}
