//! Tables of other programs, and clocks and receivers of several kinds: each is read with the known values, or
//! refused with a message that helps. Most describe one flight: 15 m/s, a climb of 1 m/s, yaw from 60 degrees.

#![allow(clippy::unwrap_used)]

use std::path::Path;

use camsim_core::{
    flight_log::{FlightLog, HeightConversion},
    scenario::{AttitudeSource, FlightHeight, FlightSpec, LogFormat},
};
use camsim_io::flight_log::read_flight_log;
use glam::{DQuat, DVec3, EulerRot};

fn ellipsoid() -> FlightSpec {
    FlightSpec::default()
}

fn msl() -> FlightSpec {
    FlightSpec { height: FlightHeight::Msl, ..ellipsoid() }
}

fn track(spec: FlightSpec) -> FlightSpec {
    FlightSpec { attitude: AttitudeSource::Track, ..spec }
}

/// Expected values of a log.
struct Flight {
    rows: usize,
    seconds: f64,
    /// Velocity over the first step, north, east, down.
    velocity_m_s: [f64; 3],
    /// Largest difference of any step's speed from that of the first.
    tolerance_m_s: f64,
    /// Attitude of the first row; `None` where it is not read.
    yaw_pitch_roll_deg: Option<[f64; 3]>,
    /// Words of all notes.
    notes: &'static [&'static str],
}

const USUAL: Flight = Flight {
    rows: 61,
    seconds: 6.0,
    velocity_m_s: [7.5, 13.0, -1.0],
    tolerance_m_s: 0.1,
    yaw_pitch_roll_deg: Some([60.0, 2.0, 5.0]),
    notes: &[],
};

fn without_attitude() -> Flight {
    Flight { yaw_pitch_roll_deg: None, ..USUAL }
}

fn read(content: &str, spec: &FlightSpec) -> Result<FlightLog, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    std::fs::write(&path, content).unwrap();
    read_flight_log(&path, spec, HeightConversion::None).map_err(|error| error.to_string())
}

fn data(file: &str) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/field-2");
    std::fs::read_to_string(folder.join(file)).unwrap()
}

fn check(log: &FlightLog, flight: &Flight) -> Result<(), String> {
    let near = |what: &str, value: f64, expected: f64, tolerance: f64| {
        let is_near = (value - expected).abs() <= tolerance;
        if is_near { Ok(()) } else { Err(format!("{what} {value}, not {expected}")) }
    };
    near("rows", log.rows.len() as f64, flight.rows as f64, 0.0)?;
    near("seconds", log.duration_s(), flight.seconds, 1e-6)?;
    let velocities: Vec<DVec3> = log
        .rows
        .windows(2)
        .map(|pair| (pair[1].position_ned_m - pair[0].position_ned_m) / (pair[1].t_s - pair[0].t_s))
        .collect();
    let expected = DVec3::from_array(flight.velocity_m_s);
    near("first velocity", velocities[0].distance(expected), 0.0, flight.tolerance_m_s)?;
    for velocity in &velocities {
        near("speed", velocity.length(), expected.length(), flight.tolerance_m_s)?;
    }
    if let Some(expected) = flight.yaw_pitch_roll_deg {
        let (yaw, pitch, roll) = log.rows[0].ned_from_body.to_euler(EulerRot::ZYX);
        for (what, angle, expected) in
            [("yaw", yaw, expected[0]), ("pitch", pitch, expected[1]), ("roll", roll, expected[2])]
        {
            near(what, angle.to_degrees(), expected, 0.05)?;
        }
    }
    let texts: Vec<&str> = log.notes.iter().map(|note| note.text.as_str()).collect();
    if let Some(words) = flight.notes.iter().find(|words| !texts.iter().any(|text| text.contains(*words))) {
        return Err(format!("no note has `{words}`"));
    }
    match log.notes.iter().find(|note| !flight.notes.iter().any(|words| note.text.contains(words))) {
        Some(note) => Err(format!("an unexpected note: {}", note.text)),
        None => Ok(()),
    }
}

/// What it is, the file, the settings, and the values or words of the message.
type Case<'a> = (&'a str, String, FlightSpec, Result<Flight, &'a [&'a str]>);

/// Checks each case; prints all faults at once.
fn check_all(cases: Vec<Case<'_>>) {
    let mut faults = Vec::new();
    for (what, content, spec, expected) in cases {
        let result = read(&content, &spec);
        let fault = match (&result, expected) {
            (Ok(log), Ok(flight)) => check(log, &flight).err(),
            (Err(error), Err(words)) => words
                .iter()
                .find(|word| !error.contains(*word))
                .map(|word| format!("the message lacks `{word}`")),
            (Ok(_), Err(_)) => Some("read, but should be refused".to_owned()),
            (Err(_), Ok(_)) => Some("refused".to_owned()),
        };
        if let Some(fault) = fault {
            let said = result.map_or_else(|error| error, |log| format!("{} {:?}", log.report, log.notes));
            faults.push(format!("{what}: {fault}\n    {said}"));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// The file with each line changed.
fn lines(content: &str, change: impl Fn(usize, &str) -> String) -> String {
    content.lines().enumerate().map(|(index, line)| change(index, line) + "\n").collect()
}

#[test]
fn solutions_of_rtklib_are_read() {
    let blanks = data("23-rtklib-pos/RT1.pos");
    let commas = data("22-rtklib-comma-ns/RT7_comma.pos");
    // 10:00 on that Thursday is second 381600 of the week.
    let in_weeks = blanks.replace("2023/05/04 10:00:0", "2260 38160");
    let in_meters = |line: &str| {
        let mut fields: Vec<String> = line.split_whitespace().map(str::to_owned).collect();
        let seconds: f64 = fields[1].rsplit(':').next().unwrap().parse().unwrap();
        (fields[2], fields[3], fields[4]) =
            (format!("{}", 13.0 * seconds), format!("{}", 7.5 * seconds), format!("{seconds}"));
        fields.join(" ")
    };
    let baseline = lines(&blanks, |_, line| match line.starts_with('%') {
        true => line
            .replace("latitude(deg) longitude(deg)  height(m)", "e-baseline(m) n-baseline(m) u-baseline(m)")
            .replace("lat/lon/height=WGS84/ellipsoidal", "e/n/u-baseline=WGS84"),
        false => in_meters(line),
    });
    let from_position = format!("% ref pos   :  47.05  8.31  500.0\n{baseline}");
    let advised: &[&str] = &["line 1 says", "set flight.origin = [47.05, 8.31, 500.0]"];
    let earth = blanks.replace("latitude(deg) longitude(deg)  height(m)", "x-ecef(m) y-ecef(m) z-ecef(m)");
    let in_parts = lines(&blanks, |_, line| match line.starts_with('%') {
        true => line.replace("(deg)", "(d'\")"),
        false => line.replace("47.05", "47 03 00.05").replace("8.31", "8 18 36.31"),
    });
    let stated: &[&str] = &["line 4 says, are above the ellipsoid"];
    check_all(vec![
        ("blanks", blanks.clone(), track(ellipsoid()), Ok(without_attitude())),
        ("blanks, msl", blanks.clone(), track(msl()), Ok(Flight { notes: stated, ..without_attitude() })),
        ("geodetic", blanks.replace("/ellipsoidal", "/geodetic"), track(msl()), Ok(without_attitude())),
        ("UTC", blanks.replace("%  GPST", "%  UTC "), track(ellipsoid()), Ok(without_attitude())),
        (
            "weeks",
            in_weeks,
            track(ellipsoid()),
            Ok(Flight { notes: &["from GPS week 2260 on"], ..without_attitude() }),
        ),
        ("commas", commas.clone(), track(ellipsoid()), Ok(without_attitude())),
        ("commas, UTC", commas.replace("GPST,", "UTC,"), track(ellipsoid()), Ok(without_attitude())),
        ("baseline", baseline, track(ellipsoid()), Ok(without_attitude())),
        (
            "baseline from a position",
            from_position,
            track(ellipsoid()),
            Ok(Flight { notes: advised, ..without_attitude() }),
        ),
        (
            "from the centre of the Earth",
            earth,
            track(ellipsoid()),
            Err(&["x-ecef", "ECEF", "Lat/Lon/Height"]),
        ),
        (
            "degrees, minutes, seconds",
            in_parts,
            track(ellipsoid()),
            Err(&["columns of their own", "decimals"]),
        ),
        ("only satellites", commas.replace("GPST,", "epoch,"), track(ellipsoid()), Err(&["name no time"])),
    ]);
}

#[test]
fn tables_of_photos_are_read() {
    let photos = data("26-exiftool-csv/exifn.csv");
    let flight = |notes| Flight { rows: 10, seconds: 18.0, velocity_m_s: [7.5, 13.0, -1.0], notes, ..USUAL };
    let gimbal: &[&str] = &["camera.mount says where the camera looks"];
    let in_words = |letters: [&str; 2]| {
        lines(&photos, |index, line| {
            let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
            if index > 0 {
                for (column, letter) in [(2, letters[0]), (3, letters[1])] {
                    let value: f64 = cells[column].parse().unwrap();
                    let (degrees, minutes) = (value.floor(), value.fract() * 60.0);
                    let seconds = minutes.fract() * 60.0;
                    cells[column] =
                        format!("\"{degrees} deg {}' {seconds:.4}\"\" {letter}\"", minutes.floor());
                }
                cells[4] += " m Above Sea Level";
            }
            cells.join(",")
        })
    };
    let with_column = |name: &str, value: &str| {
        lines(&photos, |index, line| format!("{line},{}", if index == 0 { name } else { value }))
    };
    let says_msl: &[&str] = &["camera.mount", "are above mean sea level, flight.height says otherwise"];
    let of_times: &[&str] = &["camera.mount", "`SubSecDateTimeOriginal` counts"];
    let sub_seconds = lines(&photos, |index, line| {
        let time = line.split(',').nth(1).unwrap();
        format!(
            "{line},{}",
            if index == 0 { "SubSecDateTimeOriginal".to_owned() } else { format!("{time}.50+02:00") }
        )
    });
    let south = Flight { velocity_m_s: [-7.5, 13.0, -1.0], ..flight(gimbal) };
    check_all(vec![
        ("numbers", photos.clone(), msl(), Ok(flight(gimbal))),
        ("words", in_words(["N", "E"]), msl(), Ok(flight(gimbal))),
        ("words, south", in_words(["S", "E"]), msl(), Ok(south)),
        ("words, ellipsoid", in_words(["N", "E"]), ellipsoid(), Ok(flight(says_msl))),
        ("letters", with_column("GPSLatitudeRef", "North"), msl(), Ok(flight(gimbal))),
        (
            "other letter",
            with_column("GPSLatitudeRef", "S"),
            msl(),
            Err(&["GPSLatitudeRef", "signed degrees"]),
        ),
        ("reference", with_column("GPSAltitudeRef", "Above Sea Level"), ellipsoid(), Ok(flight(says_msl))),
        ("reference, number", with_column("GPSAltitudeRef", "0"), msl(), Ok(flight(gimbal))),
        (
            "below",
            with_column("GPSAltitudeRef", "1"),
            msl(),
            Ok(flight(&["camera.mount", "below sea level"])),
        ),
        ("one field", with_column("GPSPosition", "47.05 8.31"), msl(), Ok(flight(gimbal))),
        ("decimals of seconds", sub_seconds, msl(), Ok(flight(of_times))),
    ]);
}

#[test]
fn tables_of_messages_are_read() {
    let messages = data("34-mavlogdump-csv/L04c_mavlogdump_real.csv");
    let merged: &[&str] = &["no row states everything"];
    let ardupilot = "timestamp,GPS.TimeUS,GPS.I,GPS.Status,GPS.Lat,GPS.Lng,GPS.Alt,GPS.U,ATT.TimeUS,ATT.Roll,ATT.Pitch,ATT.Yaw\n";
    let plain = lines(&messages, |index, line| {
        if index == 0 {
            return ardupilot.trim_end().to_owned();
        }
        let cells: Vec<&str> = line.split(',').collect();
        match (cells[2].parse::<f64>(), cells[3].parse::<f64>(), cells[4].parse::<f64>()) {
            (Ok(lat), Ok(lon), Ok(alt)) => {
                format!("{},0,0,3,{:.7},{:.7},{},1,,,,", cells[0], lat * 1e-7, lon * 1e-7, alt * 1e-3)
            }
            _ => {
                let degrees = |column: usize| cells[column].parse::<f64>().unwrap().to_degrees();
                format!("{},,,,,,,,0,{},{},{}", cells[0], degrees(11), degrees(12), degrees(13))
            }
        }
    });
    let gps_raw = messages.replace("GLOBAL_POSITION_INT", "GPS_RAW_INT");
    let extended = lines(&messages, |index, line| {
        let more = if index == 0 { "VFR_HUD.heading,VFR_HUD.alt,AHRS2.roll,AHRS2.yaw" } else { ",,," };
        format!("{line},{more}")
    });
    let near = || Flight { tolerance_m_s: 0.2, notes: merged, ..USUAL };
    let mut of_two = "timestamp,GPS.Lat,GPS.Lng,GPS.Alt,GPS.U,GPS2.Lat,GPS2.Lng,GPS2.Alt,GPS2.U\n".to_owned();
    for row in 0..61 {
        let t_s = 0.1 * f64::from(row);
        let position = |t_s: f64| {
            let (lat, lon) = (47.05 + 7.5 * t_s / 111_180.0, 8.31 + 13.0 * t_s / 76_055.0);
            format!("{lat:.8},{lon:.8},{:.2}", 480.0 + t_s)
        };
        of_two += &format!("{:.2},{},0,,,,\n", 1_683_194_400.0 + t_s, position(t_s));
        of_two += &format!("{:.2},,,,,{},1\n", 1_683_194_400.01 + t_s, position(t_s));
    }
    let other: &[&str] =
        &["(`GPS2.U`) says that its receiver was: remove the columns of `GPS`", "61 rows state neither"];
    check_all(vec![
        ("MAVLink", messages.clone(), msl(), Ok(near())),
        ("MAVLink, semicolons", messages.replace(',', ";"), msl(), Ok(near())),
        ("raw", gps_raw, msl(), Ok(near())),
        ("further messages", extended, msl(), Ok(near())),
        ("ArduPilot", plain, msl(), Ok(near())),
        (
            "ArduPilot, the other in use",
            of_two,
            track(msl()),
            Ok(Flight { notes: other, ..without_attitude() }),
        ),
    ]);
}

#[test]
fn one_receiver_and_its_fixes_are_kept() {
    let receivers = data("07-csv-gps-instances/DF_GPS2.csv");
    let fixes = data("09-csv-fix-type/L53b_fixtype_slow.csv");
    let used: &[&str] = &[
        "rows of `0` (61 rows) and `1` (61 rows): those that column 16 (`U`) says are in use count",
        "names its unit",
        "`GCrs`",
    ];
    let first: &[&str] = &["those of `0` count, and 61 rows are skipped", "names its unit", "`GCrs`"];
    let swapped = lines(&receivers, |index, line| match (index, line.rsplit_once(',')) {
        (0, _) => line.to_owned(),
        (_, Some((rest, flag))) => format!("{rest},{}", if flag == "0" { "1" } else { "0" }),
        _ => line.to_owned(),
    });
    let second = Flight { seconds: 6.0, ..without_attitude() };
    let fixed = |notes| Flight {
        rows: 51,
        seconds: 5.0,
        velocity_m_s: [7.04, 13.26, -1.0],
        yaw_pitch_roll_deg: Some([62.0, 2.0, 5.0]),
        notes,
        ..USUAL
    };
    let left_out: &[&str] = &["10 rows have no three-dimensional fix by column 5 (`fix_type`)"];
    let words = fixes.replace(",1,5.0", ",NO_FIX,5.0").replace(",3,5.0", ",3D_FIX,5.0");
    let valid =
        fixes.replace("fix_type", "gps_valid").replace(",1,5.0", ",False,5.0").replace(",3,5.0", ",True,5.0");
    let flags = fixes.replace("fix_type", "fix").replace(",1,5.0", ",0,5.0").replace(",3,5.0", ",1,5.0");
    let status =
        fixes.replace("fix_type", "status.status").replace(",1,5.0", ",-1,5.0").replace(",3,5.0", ",0,5.0");
    check_all(vec![
        ("two receivers", receivers.clone(), track(msl()), Ok(Flight { notes: used, ..without_attitude() })),
        ("the other is in use", swapped, track(msl()), Ok(Flight { notes: used, ..second })),
        (
            "no flag of use",
            receivers.replace(",U\n", ",V\n"),
            track(msl()),
            Ok(Flight { notes: first, ..without_attitude() }),
        ),
        ("fix_type", fixes.clone(), msl(), Ok(fixed(left_out))),
        ("words", words, msl(), Ok(fixed(left_out))),
        ("validity", valid, msl(), Ok(fixed(&["10 rows have no fix by column 5 (`gps_valid`)"]))),
        ("flags", flags, msl(), Ok(fixed(&["10 rows have no fix by", "1 is taken as a fix"]))),
        ("ROS", status, msl(), Ok(fixed(&["10 rows have no fix by column 5 (`status.status`)"]))),
        ("never a fix", fixes.replace(",3,5.0", ",2,5.0"), msl(), Err(&["fix_type", "remove the column"])),
    ]);
}

#[test]
fn rows_of_bad_states_are_left_out() {
    let fixes = data("09-csv-fix-type/L53b_fixtype_slow.csv");
    let named = |name: &str, bad: &str, good: &str| {
        let values = [(",1,5.0", format!(",{bad},5.0")), (",3,5.0", format!(",{good},5.0"))];
        values.iter().fold(fixes.replace("fix_type", name), |text, (from, to)| text.replace(from, to))
    };
    let flight = |notes| Flight {
        rows: 51,
        seconds: 5.0,
        velocity_m_s: [7.04, 13.26, -1.0],
        yaw_pitch_roll_deg: Some([62.0, 2.0, 5.0]),
        notes,
        ..USUAL
    };
    let invalid: &[&str] = &["10 rows have no valid position by column 5"];
    let unused: &[&str] = &["10 rows are not in use by column 5"];
    let cases = [
        ("GPS Fix Status", "NoFix", "3DDiff", invalid),
        ("status", "-1", "2", invalid),
        ("navStatus", "V", "A", invalid),
        ("quality", "NO_FIX", "RTK_INT", invalid),
        ("pos_type", "NONE", "NARROW_INT", invalid),
        ("tracking_state", "LOST", "OK", invalid),
        ("lost", "true", "false", invalid),
        ("Q", "0", "5", invalid),
        ("used", "0", "1", unused),
        ("in_use", "false", "true", unused),
        ("gps_used", "no", "yes", unused),
        ("primary", "0", "1", unused),
        ("healthy", "0", "1", &["10 rows have no fix by column 5"]),
        ("num_sats", "0", "14", &["10 rows have no satellites by column 5"]),
        ("fix_type", "0x00", "0x03", &["10 rows have no three-dimensional fix by column 5"]),
    ];
    for (name, bad, good, notes) in cases {
        check_all(vec![(name, named(name, bad, good), msl(), Ok(flight(notes)))]);
    }
    // States that say nothing certain, or that all rows share, change nothing.
    let all = |name: &str, value: &str| read(&named(name, value, value), &msl()).unwrap();
    let without = read(&named("remark", "1", "3"), &msl()).unwrap();
    for (name, value, words) in [
        ("used", "0", "61 of 61 rows are not in use: it is not applied"),
        ("num_sats", "0", "61 of 61 rows have no satellites: it is not applied"),
        ("num_sats", "3", "61 rows have fewer than four satellites by column 5"),
        ("mode", "AUTO", ""),
        ("status", "3", ""),
        ("Q", "0.013", ""),
    ] {
        let log = all(name, value);
        assert_eq!(log.rows, without.rows, "{name}");
        let texts: Vec<&str> = log.notes.iter().map(|note| &*note.text).collect();
        assert!(texts.iter().any(|text| text.contains(words)) || words.is_empty(), "{name}: {texts:?}");
        assert_eq!(texts.len(), without.notes.len() + usize::from(!words.is_empty()), "{name}: {texts:?}");
    }
}

/// Rows of two receivers, 30 m apart, with a column about them; `offset_s` is the time between them.
fn two_receivers(name: &str, values: [&str; 2], offset_s: f64) -> String {
    let mut text = format!("t,{name},lat,lon,alt\n");
    for row in 0..122 {
        let (which, t_s) = (row % 2, 0.1 * f64::from(row / 2));
        let north_m = 7.5 * t_s + 30.0 * f64::from(which);
        text += &format!(
            "{:.3},{},{:.8},{:.8},{:.2}\n",
            t_s + offset_s * f64::from(which),
            values[usize::from(which == 1)],
            47.05 + north_m / 111_180.0,
            8.31 + 13.0 * t_s / 76_055.0,
            480.0 + t_s
        );
    }
    text
}

#[test]
fn a_column_that_tells_interleaved_tracks_apart_numbers_receivers() {
    let flight = |notes| Flight { notes, ..without_attitude() };
    let first: &[&str] = &["(61 rows): those of `0` count, and 61 rows are skipped"];
    let named: &[&str] = &["`/gps0/fix` (61 rows) and `/gps1/fix` (61 rows): those of `/gps0/fix` count"];
    let used = lines(&two_receivers("gps", ["0", "1"], 0.0), |index, line| match index {
        0 => format!("{line},used"),
        _ => format!("{line},{}", u8::from(line.split(',').nth(1) == Some("1"))),
    });
    // One flight, whose cameras fire in turn.
    let in_turn = lines(&two_receivers("camera", ["left", "right"], 0.05), |index, line| {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        if index > 0 {
            let t_s: f64 = cells[0].parse().unwrap();
            cells[2] = format!("{:.8}", 47.05 + 7.5 * t_s / 111_180.0);
            cells[3] = format!("{:.8}", 8.31 + 13.0 * t_s / 76_055.0);
            cells[4] = format!("{:.2}", 480.0 + t_s);
        }
        cells.join(",")
    });
    let all = Flight { rows: 122, seconds: 6.05, tolerance_m_s: 0.3, ..without_attitude() };
    check_all(vec![
        ("antenna", two_receivers("antenna", ["0", "1"], 0.0), track(msl()), Ok(flight(first))),
        ("gps", two_receivers("gps", ["0", "1"], 0.0), track(msl()), Ok(flight(first))),
        ("id", two_receivers("id", ["0", "1"], 0.0), track(msl()), Ok(flight(first))),
        ("sensor", two_receivers("sensor", ["0", "1"], 0.05), track(msl()), Ok(flight(first))),
        ("topic", two_receivers("topic", ["/gps0/fix", "/gps1/fix"], 0.05), track(msl()), Ok(flight(named))),
        ("used", used, track(msl()), Ok(flight(&["61 rows are not in use by column 6"]))),
        ("in turn", in_turn, track(msl()), Ok(all)),
    ]);
}

#[test]
fn columns_of_frames_state_axes() {
    // A flight as `frames` have it: `turn` takes vectors of north-east-down and of bodies to their axes.
    let poses = |frames: [&str; 2], header: [&str; 2], world: DQuat, body: DQuat| {
        let mut text = format!("Time,{},{},", header[0], header[1]);
        text += "pose.pose.position.x,pose.pose.position.y,pose.pose.position.z,";
        text += "pose.pose.orientation.x,pose.pose.orientation.y,pose.pose.orientation.z,pose.pose.orientation.w\n";
        let attitude =
            DQuat::from_euler(EulerRot::ZYX, 60_f64.to_radians(), 2_f64.to_radians(), 5_f64.to_radians());
        let [x, y, z, w] = (world * attitude * body.inverse()).to_array();
        for row in 0..61 {
            let t_s = 0.1 * f64::from(row);
            let p = world * (DVec3::new(7.5, 13.0, -1.0) * t_s);
            text += &format!(
                "{:.1},{},{},{:.4},{:.4},{:.4},{x},{y},{z},{w}\n",
                1_683_194_400.0 + t_s,
                frames[0],
                frames[1],
                p.x,
                p.y,
                p.z
            );
        }
        text
    };
    let ros = ["header.frame_id", "child_frame_id"];
    let tum = || FlightSpec { format: LogFormat::Tum, ..ellipsoid() };
    let csv_ned = FlightSpec { format: LogFormat::CsvNed, ..ellipsoid() };
    let contradiction: &[&str] =
        &["(`header.frame_id`) says `map_enu`", "but positions are read as north-east-down"];
    let (enu, flu) = (
        DQuat::from_xyzw(std::f64::consts::FRAC_1_SQRT_2, std::f64::consts::FRAC_1_SQRT_2, 0.0, 0.0),
        DQuat::from_xyzw(1.0, 0.0, 0.0, 0.0),
    );
    let stated: &[&str] = &["read as north-east-down and forward-right-down, as the names say"];
    let of_body: &[&str] = &["its body is read as forward-right-down"];
    let usual = Flight { velocity_m_s: [7.5, 13.0, -1.0], ..USUAL };
    let case = |frames, header, world, body, notes| {
        (poses(frames, header, world, body), tum(), Ok(Flight { notes, ..usual }))
    };
    let ned = DQuat::IDENTITY;
    let cases = [
        case(["odom_ned", "base_link_frd"], ros, ned, ned, stated),
        case(
            ["/odom_ned", "base_link_frd"],
            ["odom/header/frame_id", "odom/child_frame_id"],
            ned,
            ned,
            stated,
        ),
        case(["odom_ned", "base_link"], ros, ned, ned, of_body),
        case(["odom", "base_link"], ros, enu, flu, &[]),
        (
            poses(["map_enu", "base_link"], ros, ned, ned),
            csv_ned,
            Ok(Flight { notes: contradiction, ..usual }),
        ),
        (poses(["earth", "base_link"], ros, enu, flu), tum(), Err(&["`earth`", "geocentric"][..])),
    ];
    check_all(cases.into_iter().map(|(text, spec, expected)| ("frames", text, spec, expected)).collect());
}

#[test]
fn clocks_of_several_kinds_are_read() {
    let two = data("13-rostopic-two-times/L22_rostopic.csv");
    let tum = FlightSpec { format: LogFormat::Tum, ..ellipsoid() };
    let stamps = Flight {
        velocity_m_s: [-0.52, 14.99, -1.0],
        yaw_pitch_roll_deg: None,
        notes: &["of the measurement counts: `field.header.stamp`", "read as ns"],
        ..USUAL
    };
    let seconds = data("14-second-resolution-clock/L44_seconds_repeat.csv");
    let coarse: &[&str] = &["counts in steps of 1 s, with 10 rows in most"];
    let without = |count: usize| {
        let kept = seconds.lines().enumerate().filter(|(index, _)| !(1..=count).contains(index));
        kept.map(|(_, line)| format!("{line}\n")).collect::<String>()
    };
    let later = |rows: usize, seconds: f64, yaw: f64| Flight {
        rows,
        seconds,
        velocity_m_s: [7.2, 13.2, -1.0],
        tolerance_m_s: 0.3,
        yaw_pitch_roll_deg: Some([yaw, 2.0, 5.0]),
        notes: coarse,
    };
    let stopped = lines(&seconds, |_, line| match line.split_once(',') {
        Some((clock, rest)) if clock != "time" => format!("10:20:00,{rest}"),
        _ => line.to_owned(),
    });
    let go_pro = data("48-gpmf-csv/L03_gopro.csv");
    let dates_only = lines(&go_pro, |_, line| line.split_once(',').unwrap().1.to_owned());
    let unset = lines(&dates_only, |index, line| match index {
        1..=10 => line.replace("2023-05-04", "1980-01-06"),
        _ => line.to_owned(),
    });
    let set = Flight {
        rows: 51,
        seconds: 5.0,
        velocity_m_s: [7.04, 13.26, -1.0],
        tolerance_m_s: 0.2,
        notes: &["10 rows have times 43 years before the others"],
        ..without_attitude()
    };
    let with_year_2000 = |rows: usize| {
        lines(&dates_only, |index, line| match index {
            index if (1..=rows).contains(&index) => line.replace("2023-05-04", "2000-01-01"),
            _ => line.to_owned(),
        })
    };
    let since_2000 = Flight { notes: &["10 rows have times 23 years before the others"], ..set };
    let other_datum: &[&str] = &["(`altitude system`) says, are above mean sea level"];
    check_all(vec![
        ("stamp and arrival", two, tum, Ok(stamps)),
        ("whole seconds", seconds.clone(), msl(), Ok(Flight { notes: coarse, tolerance_m_s: 0.1, ..USUAL })),
        ("whole seconds, from within one", without(3), msl(), Ok(later(58, 5.7, 60.6))),
        ("one time", stopped, msl(), Err(&["all times are equal (61 rows"])),
        ("clock not set yet", unset, track(msl()), Ok(set)),
        ("clock not set yet, of 2000", with_year_2000(10), track(msl()), Ok(since_2000)),
        (
            "clock set late",
            with_year_2000(40),
            track(msl()),
            Err(&["the times jump by 23 years at line 42", "keep the rows before it"]),
        ),
        ("GoPro", go_pro.clone(), track(msl()), Ok(without_attitude())),
        (
            "GoPro, ellipsoid",
            go_pro.clone(),
            track(ellipsoid()),
            Ok(Flight { notes: other_datum, ..without_attitude() }),
        ),
        ("dates only", dates_only, track(msl()), Ok(without_attitude())),
    ]);
}

/// A straight flight of 6 s with times in the columns of these names.
fn rows_with_times(names: &str, times: impl Fn(usize) -> String) -> String {
    let mut text = format!("{names},lat,lon,alt,roll,pitch,yaw\n");
    for row in 0..=60 {
        let t = row as f64 * 0.1;
        let (lat, lon) = (47.05 + t * 7.5 * 8.994_6e-6, 8.31 + t * 13.0 * 1.316_0e-5);
        text += &format!("{},{lat:.9},{lon:.9},{:.3},5,2,60\n", times(row), 480.0 + t);
    }
    text
}

#[test]
fn times_in_several_columns_are_read_or_named() {
    let nanoseconds = |row: usize| (row % 10) * 100_000_000;
    let pair = |row: usize| format!("{},{}", 1_683_194_400 + row / 10, nanoseconds(row));
    let late = |row: usize| format!("{},{}", 1_683_194_400_005_000_000 + row * 100_000_000, pair(row));
    let clock = |row: usize| format!("10:00:{:04.1}", row as f64 * 0.1);
    let dated = |date: &'static str| move |row: usize| format!("{date},{}", clock(row));
    let noted = |notes| Flight { notes, ..USUAL };
    let not_read: &[&str] = &["holds dates that are not read"];
    let over_midnight = |names: &str, dates: [&str; 2]| {
        rows_with_times(names, |row| match row {
            0..30 => format!("{},23:59:{:04.1}", dates[0], 57.0 + row as f64 * 0.1),
            _ => format!("{},00:00:{:04.1}", dates[1], (row - 30) as f64 * 0.1),
        })
    };
    let weeks: &[&str] = &["from GPS week 2260 on"];
    let mut cases: Vec<Case<'_>> = Vec::new();
    for names in [
        "field.header.stamp.secs,field.header.stamp.nsecs",
        "field.header.stamp.sec,field.header.stamp.nanosec",
        "header.stamp.secs,header.stamp.nsecs",
        "rosbagTimestamp_secs,nsecs",
        "sec,nanosec",
        "timestamp_sec,timestamp_nanosec",
        "msg/Time/Secs,msg/Time/NSecs",
    ] {
        cases.push((names, rows_with_times(names, pair), msl(), Ok(noted(&[]))));
    }
    let with_arrival = "time,field.header.stamp.secs,field.header.stamp.nsecs";
    let of_week = |row: usize| format!("2260,{:.1}", 381_600.0 + row as f64 * 0.1);
    let since_start = |row: usize| format!("2260,{:.1}", row as f64 * 0.1);
    let over_week = |row: usize| match row {
        0..30 => format!("2260,{:.1}", 604_797.0 + row as f64 * 0.1),
        _ => format!("2261,{:.1}", (row - 30) as f64 * 0.1),
    };
    let over_weeks: &[&str] = &["from GPS week 2260 on", "after a week of GPS time"];
    let of_message = |row: usize| format!("{},{}", 5_000_000 + row * 102_000, 5_000_000 + row * 100_000);
    cases.extend([
        (
            "beside the arrival",
            rows_with_times(with_arrival, late),
            msl(),
            Ok(noted(&["of the measurement counts: `field.header.stamp.secs`"])),
        ),
        (
            "nanoseconds alone",
            rows_with_times("header.stamp.nsecs", |row| nanoseconds(row).to_string()),
            msl(),
            Err(&["nanoseconds within a second", "line 12", "stamp.secs"] as &[&str]),
        ),
        (
            "nanoseconds of another name alone",
            rows_with_times("field.stamp_ns,time_of_x", |row| format!("{},x", nanoseconds(row))),
            msl(),
            Err(&["nanoseconds within a second"]),
        ),
        ("8 digits", over_midnight("date,time", ["20230504", "20230505"]), msl(), Ok(noted(&[]))),
        ("dots", over_midnight("date,time", ["04.05.2023", "05.05.2023"]), msl(), Ok(noted(&[]))),
        ("day first", over_midnight("date,time", ["30/05/2023", "31/05/2023"]), msl(), Ok(noted(&[]))),
        ("month first", over_midnight("date,time", ["05/30/2023", "05/31/2023"]), msl(), Ok(noted(&[]))),
        ("G1000", over_midnight("Lcl Date, Lcl Time", ["2023-05-04", "2023-05-05"]), msl(), Ok(noted(&[]))),
        (
            "two dates",
            rows_with_times("date,lcl_date,lcl_time", |row| format!("x,2023-05-04,{}", clock(row))),
            msl(),
            Ok(noted(&["`lcl_date` counts"])),
        ),
        ("ambiguous", rows_with_times("date,time", dated("05/04/2023")), msl(), Ok(noted(not_read))),
        ("two digits", rows_with_times("date,time", dated("04.05.23")), msl(), Ok(noted(not_read))),
        (
            "ambiguous over midnight",
            over_midnight("date,time", ["05/04/2023", "05/05/2023"]),
            msl(),
            Err(&["05/04/2023", "year-month-day"]),
        ),
        ("week", rows_with_times("gps_week,tow", of_week), msl(), Ok(noted(weeks))),
        ("week with units", rows_with_times("Week (weeks),GPSTime (sec)", of_week), msl(), Ok(noted(weeks))),
        ("week beside time", rows_with_times("week,t", since_start), msl(), Ok(noted(&[]))),
        ("end of the week", rows_with_times("week,tow", over_week), msl(), Ok(noted(over_weeks))),
        (
            "sample",
            rows_with_times("timestamp,timestamp_sample", of_message),
            msl(),
            Ok(noted(&["measurement counts: `timestamp_sample`", "read as us"])),
        ),
    ]);
    check_all(cases);

    // Each of these begins at 2023-05-04 10:00.
    for content in [
        rows_with_times("field.header.stamp.secs,field.header.stamp.nsecs", pair),
        rows_with_times("date,time", dated("20230504")),
        rows_with_times("date,time", dated("04.05.2023")),
        rows_with_times("Lcl Date,Lcl Time", dated("2023-05-04")),
        rows_with_times("gps_week,tow", of_week),
        rows_with_times("Week (weeks),GPSTime (sec)", of_week),
    ] {
        let log = read(&content, &msl()).unwrap();
        assert_eq!(log.epoch_ns, 1_683_194_400_000_000_000, "{}", content.lines().next().unwrap());
    }
}

#[test]
fn held_positions_are_interpolated() {
    let held = data("16-held-gps-positions/FZ1.csv");
    let notes: &[&str] = &["change once in 10 rows only, each 0.2 s"];
    let flight = Flight { rows: 301, seconds: 6.0, notes, ..USUAL };
    let from_within = |first: usize| {
        let kept = held.lines().enumerate().filter(|(index, _)| !(1..first).contains(index));
        kept.map(|(_, line)| format!("{line}\n")).collect::<String>()
    };
    let resting = lines(&held, |index, line| {
        let cells: Vec<&str> = line.split(',').collect();
        if index == 0 {
            line.to_owned()
        } else {
            format!("{},47.05,8.31,480,{}", cells[0], cells[4..].join(","))
        }
    });
    let rest = Flight { rows: 301, velocity_m_s: [0.0; 3], notes: &[], ..USUAL };
    check_all(vec![
        ("held", held.clone(), msl(), Ok(flight)),
        (
            "held, without attitude",
            held.clone(),
            track(msl()),
            Ok(Flight { rows: 301, notes, ..without_attitude() }),
        ),
        (
            "from within a hold",
            from_within(4),
            msl(),
            Ok(Flight {
                rows: 291,
                seconds: 5.8,
                velocity_m_s: [7.44, 13.03, -1.0],
                yaw_pitch_roll_deg: Some([60.4, 2.0, 5.0]),
                notes,
                ..USUAL
            }),
        ),
        ("at rest", resting, msl(), Ok(rest)),
    ]);
}

#[test]
fn tables_of_motive_are_read() {
    let motive = data("49-motive-csv/VI2_motive.csv");
    let stated: &[&str] =
        &["a table of Motive in mm: x is taken as east", "start of the capture, 2023-05-04"];
    let flight = |notes| Flight { notes, ..USUAL };
    let two = lines(&motive, |index, line| match (index, line) {
        (0 | 1, _) => line.to_owned(),
        (_, line) => {
            let more: Vec<String> =
                line.split(',').skip(2).map(|cell| cell.replace("drone", "target")).collect();
            format!("{line},{}", more.join(","))
        }
    });
    let topic = |name: &str| FlightSpec { topic: Some(name.to_owned()), ..ellipsoid() };
    let euler = motive.replace("Rotation Type,Quaternion", "Rotation Type,XYZ");
    check_all(vec![
        ("one body", motive.clone(), ellipsoid(), Ok(flight(stated))),
        (
            "metres",
            motive.replace("Millimeters", "Meters"),
            ellipsoid(),
            Ok(Flight {
                velocity_m_s: [7500.0, 13_000.0, -1000.0],
                tolerance_m_s: 100.0,
                notes: &["in m:", "capture"],
                ..USUAL
            }),
        ),
        ("two bodies", two.clone(), ellipsoid(), Err(&["`drone`, `target`", "flight.topic"])),
        ("one of two bodies", two.clone(), topic("target"), Ok(flight(stated))),
        ("no such body", two, topic("car"), Err(&["`car`", "`drone`"])),
        ("angles", euler.clone(), ellipsoid(), Err(&["XYZ", "quaternions"])),
        (
            "angles not read",
            euler,
            track(ellipsoid()),
            Ok(Flight { yaw_pitch_roll_deg: None, ..flight(stated) }),
        ),
        ("local", motive.replace("Global", "Local"), ellipsoid(), Err(&["Coordinate Space", "global"])),
        (
            "other key",
            motive,
            FlightSpec { format: LogFormat::Tum, ..ellipsoid() },
            Err(&["flight.format", "Motive"]),
        ),
    ]);
}
