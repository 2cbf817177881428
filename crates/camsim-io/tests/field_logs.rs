//! Faulty logs as users have them, and published real logs: each is read with the known values, or refused
//! with a message that helps.

#![allow(clippy::unwrap_used)]

use std::path::{Path, PathBuf};

use camsim_core::{
    flight_log::{FlightLog, HeightConversion, Note},
    scenario::{AngleUnit, AttitudeSource, FlightHeight, FlightSpec, LogFormat, TimeUnit},
};
use camsim_io::flight_log::read_flight_log;
use glam::{DVec3, EulerRot};

fn spec() -> FlightSpec {
    FlightSpec::default()
}

fn track() -> FlightSpec {
    FlightSpec { attitude: AttitudeSource::Track, ..spec() }
}

fn format(format: LogFormat) -> FlightSpec {
    FlightSpec { format, ..spec() }
}

/// Expected values of a log.
#[derive(Clone, Copy)]
struct Flight {
    rows: usize,
    seconds: f64,
    /// Motion north from the first row to the last.
    north_m: f64,
    /// Motion up from the first row to the last.
    climb_m: f64,
    yaw_deg: f64,
    /// Numbers of rows omitted: without a fix, without a height, unusable.
    left_out: [usize; 3],
    /// Origin of a geodetic log: latitude, longitude (degrees), height (metres).
    origin: Option<[f64; 3]>,
    /// Substrings of all warnings.
    warnings: &'static [&'static str],
}

/// Values of most files: 20 s, 200 m north, 20 m up, yaw 30 degrees, from 47 N, 8 E, 500 m.
const USUAL: Flight = Flight {
    rows: 21,
    seconds: 20.0,
    north_m: 200.0,
    climb_m: 20.0,
    yaw_deg: 30.0,
    left_out: [0; 3],
    origin: Some([47.0, 8.0, 500.0]),
    warnings: &[],
};

enum Expected {
    /// It is read with these values.
    Gives(Flight),
    /// It is refused with a message that contains all of these.
    Refused(&'static [&'static str]),
}

use Expected::{Gives, Refused};

fn field() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/field")
}

fn read(path: &Path, spec: &FlightSpec) -> Result<FlightLog, String> {
    read_flight_log(path, spec, HeightConversion::None).map_err(|error| error.to_string())
}

fn yaw_deg(log: &FlightLog) -> f64 {
    log.rows[log.rows.len() / 2].ned_from_body.to_euler(EulerRot::ZYX).0.to_degrees()
}

#[test]
fn faulty_logs_are_read_or_refused_as_expected() {
    let level = || Flight { climb_m: 0.0, ..USUAL };
    let usual = || USUAL;
    let local = || Flight { origin: None, ..USUAL };
    let msl = || FlightSpec { height: FlightHeight::Msl, ..spec() };
    let time = |time_unit| FlightSpec { time_unit, ..spec() };
    let angle = |angle_unit| FlightSpec { angle_unit, ..spec() };
    let airsim = || Flight { yaw_deg: 30.0, north_m: 200.0, climb_m: 20.0, ..local() };
    let cases: Vec<(&str, FlightSpec, Expected)> = vec![
        // Units in the header.
        ("header-units/airdata.csv", msl(), Gives(usual())),
        (
            "header-units/airdata.csv",
            spec(),
            Gives(Flight {
                warnings: &["altitude_above_seaLevel(feet)` says above mean sea level"],
                ..usual()
            }),
        ),
        ("header-units/alt_ft.csv", spec(), Gives(usual())),
        ("header-units/flytrex.csv", track(), Gives(Flight { yaw_deg: 0.0, ..usual() })),
        ("header-units/flytrex.csv", spec(), Refused(&["flight.attitude = \"track\""])),
        ("header-units/lat_rad.csv", spec(), Gives(level())),
        ("header-units/sbet.csv", spec(), Gives(level())),
        ("header-units/tu_min.csv", track(), Gives(Flight { yaw_deg: 0.0, ..usual() })),
        ("header-units/tu_msec.csv", track(), Gives(Flight { yaw_deg: 0.0, ..usual() })),
        // Units that no header names.
        (
            "time-unit-guess/epoch_ms.csv",
            spec(),
            Gives(Flight { warnings: &["read as ms", "2023"], ..usual() }),
        ),
        (
            "time-unit-guess/epoch_us.csv",
            spec(),
            Gives(Flight { warnings: &["read as us", "2023"], ..usual() }),
        ),
        (
            "time-unit-guess/px4_global.csv",
            track(),
            Gives(Flight {
                yaw_deg: 0.0,
                origin: Some([47.0, 8.0, 547.0]),
                warnings: &[
                    "`alt_ellipsoid` counts, because flight.height is \"ellipsoid\"",
                    "read as us: their column names no unit, and only so",
                ],
                ..usual()
            }),
        ),
        (
            "time-unit-guess/px4_global.csv",
            FlightSpec { height: FlightHeight::Msl, time_unit: TimeUnit::Us, ..track() },
            Gives(Flight {
                yaw_deg: 0.0,
                warnings: &["`alt` counts, because flight.height is \"msl\""],
                ..usual()
            }),
        ),
        (
            "time-unit-guess/time_ms_nounit.csv",
            spec(),
            Refused(&["flight.time_unit", "rows 1000 s apart at 0.01 m/s"]),
        ),
        ("time-unit-guess/time_ms_nounit.csv", time(TimeUnit::Ms), Gives(level())),
        // Receivers without a fix.
        (
            "gps-null/zero.csv",
            spec(),
            Gives(Flight {
                rows: 18,
                seconds: 18.0,
                north_m: 180.0,
                climb_m: 18.0,
                left_out: [3, 0, 0],
                origin: Some([47.000_179_89, 8.0, 502.0]),
                ..usual()
            }),
        ),
        (
            "gps-null/altzero.csv",
            spec(),
            Gives(Flight {
                rows: 18,
                seconds: 17.0,
                north_m: 170.0,
                climb_m: 17.0,
                left_out: [0, 3, 0],
                origin: Some([47.000_269_84, 8.0, 503.0]),
                ..usual()
            }),
        ),
        // Axes that no name states.
        ("ned-quaternion/airsim_named.txt", spec(), Refused(&["csv-ned", "POS_X", "flight.format"])),
        ("ned-quaternion/airsim_named.txt", format(LogFormat::CsvNed), Gives(airsim())),
        ("ned-quaternion/airsim_rec.txt", spec(), Refused(&["csv-ned", "POS_X", "flight.format"])),
        (
            "ned-quaternion/airsim_rec.txt",
            format(LogFormat::CsvNed),
            Gives(Flight { warnings: &["read as ms", "2021"], ..airsim() }),
        ),
        // Two columns for one quantity; angles without a unit.
        ("two-columns/heading_and_yaw.csv", spec(), Refused(&["`heading`", "`yaw`", "line 1"])),
        ("two-columns/heading_and_yaw.csv", track(), Gives(Flight { yaw_deg: 0.0, ..level() })),
        (
            "two-columns/rad_nounit.csv",
            spec(),
            Gives(Flight { north_m: -200.0, yaw_deg: f64::NAN, warnings: &["read as radians"], ..level() }),
        ),
        (
            "two-columns/rad_nounit.csv",
            angle(AngleUnit::Rad),
            Gives(Flight { north_m: -200.0, yaw_deg: f64::NAN, ..level() }),
        ),
        // Times, quotes, separators, missing values.
        (
            "bad-message/a.gpx",
            FlightSpec { height: FlightHeight::Msl, ..track() },
            Gives(Flight { rows: 1, seconds: 0.0, north_m: 0.0, climb_m: 0.0, yaw_deg: 0.0, ..usual() }),
        ),
        (
            "bad-message/a.gpx",
            FlightSpec { format: LogFormat::Gpx, ..track() },
            Gives(Flight {
                rows: 1,
                seconds: 0.0,
                north_m: 0.0,
                climb_m: 0.0,
                yaw_deg: 0.0,
                warnings: &["flight.height = \"msl\""],
                ..usual()
            }),
        ),
        ("bad-message/a.gpx", spec(), Refused(&["flight.attitude = \"track\""])),
        (
            "bad-message/a.gpx",
            FlightSpec { format: LogFormat::Tum, ..track() },
            Refused(&["flight.format is \"tum\" but the file is GPX"]),
        ),
        ("bad-message/dji.SRT", track(), Refused(&["subtitles", "exiftool", "lat_deg"])),
        ("bad-message/dupalt.csv", track(), Refused(&["line 1", "4 (`alt`) and 5 (`alt`)", "one quantity"])),
        ("bad-message/iso.csv", spec(), Gives(usual())),
        (
            "bad-message/midnight.csv",
            spec(),
            Gives(Flight { warnings: &["begins again at line 12", "midnight"], ..level() }),
        ),
        ("bad-message/na.csv", spec(), Gives(Flight { rows: 20, left_out: [0, 0, 1], ..level() })),
        ("bad-message/opentx.csv", spec(), Gives(Flight { yaw_deg: 0.524_f64.to_degrees(), ..usual() })),
        ("bad-message/quoted.csv", spec(), Gives(level())),
        ("bad-message/semi.csv", spec(), Gives(usual())),
        (
            "bad-message/sparse.csv",
            spec(),
            Gives(Flight {
                rows: 58,
                seconds: 19.0,
                north_m: 190.0,
                left_out: [0, 0, 2],
                warnings: &["positions are interpolated", "20 with a position, 40 with an attitude"],
                ..level()
            }),
        ),
        (
            "bad-message/tum_2q.txt",
            spec(),
            Gives(Flight {
                north_m: 0.0,
                climb_m: 0.0,
                yaw_deg: f64::NAN,
                warnings: &["length 2.000, not 1"],
                ..local()
            }),
        ),
        // Prose before the names.
        (
            "tum-header/format_header.txt",
            spec(),
            Gives(Flight {
                rows: 100,
                seconds: 4.95,
                north_m: 19.898_487,
                climb_m: 0.0,
                yaw_deg: f64::NAN,
                ..local()
            }),
        ),
    ];
    let mut faults = Vec::new();
    for (file, spec, expected) in &cases {
        let result = read(&field().join(format!("log-{file}")), spec);
        if let Err(fault) = check(&result, expected) {
            faults.push(format!(
                "{file}: {fault}\n    {}",
                result.map_or_else(|error| error, |log| format!("{} {:?}", log.report, log.notes))
            ));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));

    // All files of the folder are tested.
    for folder in std::fs::read_dir(field()).unwrap().map(|entry| entry.unwrap().path()) {
        let name = folder.file_name().unwrap().to_str().unwrap().to_owned();
        let Some(name) = name.strip_prefix("log-") else { continue };
        for file in std::fs::read_dir(&folder).unwrap() {
            let file = format!("{name}/{}", file.unwrap().file_name().to_str().unwrap());
            assert!(cases.iter().any(|(case, ..)| *case == file), "{file}");
        }
    }
}

fn check(result: &Result<FlightLog, String>, expected: &Expected) -> Result<(), String> {
    let (log, flight) = match (result, expected) {
        (Err(error), Refused(words)) => {
            return match words.iter().find(|word| !error.contains(*word)) {
                Some(word) => Err(format!("the message lacks `{word}`")),
                None => Ok(()),
            };
        }
        (Ok(_), Refused(_)) => return Err("read, but should be refused".into()),
        (Err(_), Gives(_)) => return Err("refused".into()),
        (Ok(log), Gives(flight)) => (log, flight),
    };
    let (first, last) = (log.rows.first().unwrap(), log.rows.last().unwrap());
    let moved = last.position_ned_m - first.position_ned_m;
    let check_near = |quantity: &str, value: f64, expected: f64, tolerance: f64| {
        if expected.is_nan() || (value - expected).abs() <= tolerance {
            Ok(())
        } else {
            Err(format!("{quantity} {value}, not {expected}"))
        }
    };
    check_near("rows", log.rows.len() as f64, flight.rows as f64, 0.0)?;
    check_near("seconds", log.duration_s(), flight.seconds, 2e-6)?;
    // Feet with two decimals and degrees with eight are exact to millimetres. The curvature of the Earth is 3
    // mm over 200 m.
    check_near("north", moved.x, flight.north_m, 0.05)?;
    check_near("climb", -moved.z, flight.climb_m, 0.01)?;
    check_near("yaw", yaw_deg(log), flight.yaw_deg, 0.05)?;
    let report = &log.report;
    let left_out = [report.null_fixes.count, report.null_heights.count, report.unusable.count];
    if left_out != flight.left_out {
        return Err(format!("left out {left_out:?}"));
    }
    match (flight.origin, log.frame) {
        (None, None) => {}
        (Some([lat, lon, height]), Some(frame)) => {
            let origin = frame.origin();
            check_near("latitude", origin.lat_deg(), lat, 1e-8)?;
            check_near("longitude", origin.lon_deg(), lon, 1e-8)?;
            check_near("height", origin.height_m, height, 0.01)?;
        }
        _ => return Err("one of origin and frame".into()),
    }
    let warnings: Vec<&str> =
        log.notes.iter().filter(|note| note.is_warning).map(|note| note.text.as_str()).collect();
    if let Some(word) =
        flight.warnings.iter().find(|word| !warnings.iter().any(|warning| warning.contains(*word)))
    {
        return Err(format!("no warning has `{word}`"));
    }
    match warnings.iter().find(|warning| !flight.warnings.iter().any(|word| warning.contains(word))) {
        Some(warning) => Err(format!("an unexpected warning: {warning}")),
        None => Ok(()),
    }
}

#[test]
fn prose_in_a_header_does_not_shift_columns() {
    let log = read(&field().join("log-tum-header/format_header.txt"), &spec()).unwrap();
    for row in &log.rows {
        let radius_m = DVec3::new(row.position_ned_m.x, row.position_ned_m.y, 0.0).length();
        assert!((radius_m - 20.0).abs() < 1e-5 && (row.position_ned_m.z + 5.0).abs() < 1e-12, "{row:?}");
        // A circular flight: the yaw of the quaternion (FLU) is the angle of the arc, 0 is east.
        let turned = (row.t_s * 0.3).to_degrees();
        let yaw = row.ned_from_body.to_euler(EulerRot::ZYX).0.to_degrees();
        assert!((yaw - (90.0 - turned)).abs() < 1e-3, "{} s: {yaw}", row.t_s);
    }
}

#[test]
fn unitless_radians_are_inferred_unless_the_key_says_degrees() {
    let log = read(&field().join("log-two-columns/rad_nounit.csv"), &spec()).unwrap();
    let (yaw, pitch, roll) = log.rows[0].ned_from_body.to_euler(EulerRot::ZYX);
    assert!(
        (yaw - 2.8).abs() < 1e-9 && (pitch + 0.05).abs() < 1e-9 && (roll - 0.1).abs() < 1e-9,
        "{yaw} {pitch} {roll}"
    );
    let degrees = FlightSpec { angle_unit: AngleUnit::Deg, ..spec() };
    let log = read(&field().join("log-two-columns/rad_nounit.csv"), &degrees).unwrap();
    assert!((log.rows[0].ned_from_body.to_euler(EulerRot::ZYX).0.to_degrees() - 2.8).abs() < 1e-9);
}

/// Reads every real flight, and compares the results with the table in docs/reference/inputs.
#[test]
fn published_flights_are_read_or_refused_as_expected() {
    let Some(data) = std::env::var_os("CAMSIM_DATA").map(PathBuf::from) else {
        eprintln!("CAMSIM_DATA is not set: skipped");
        return;
    };
    // File, settings, and number of rows or a substring of the message.
    let ned = || format(LogFormat::CsvNed);
    let msl = || FlightSpec { height: FlightHeight::Msl, ..spec() };
    let cases: [(&str, FlightSpec, Result<usize, &str>); 21] = [
        ("flights/demo_brighton_lawnmower_x0.05.csv", spec(), Ok(5886)),
        ("flights/demo_sertig_lawnmower_x5.5.csv", spec(), Ok(10_618)),
        ("flights/euroc_V1_03_difficult.txt", spec(), Ok(20_932)),
        ("flights/glider_9crx3101.csv", spec(), Err("flight.attitude = \"track\"")),
        ("flights/glider_9crx3101.csv", track(), Ok(7630)),
        ("flights/glider_9crx3101_camsim_derived.csv", spec(), Ok(2133)),
        ("flights/kitti_00_gt.txt", spec(), Err("KITTI")),
        ("flights/kitti_00_gt_times.txt", spec(), Err("1 columns without a header fit no known layout")),
        ("flights/rpng_neighborhood_01_gps.txt", spec(), Ok(1931)),
        ("flights/rpng_neighborhood_01_gps.txt", track(), Ok(1931)),
        ("flights/tumrgbd_fr2_desk_groundtruth.txt", spec(), Ok(20_947)),
        ("flights/tumvi_corridor1_okvis.txt", spec(), Ok(5986)),
        (
            "flights/px4/sample_appended_multiple.ulg",
            msl(),
            Err("no position is valid in vehicle_local_position"),
        ),
        ("flights/px4/sample_log_small.ulg", msl(), Ok(1279)),
        ("camsim/path_lawnmower.csv", spec(), Ok(51_596)),
        ("camsim/path-pure-pattern-rotation.csv", spec(), Err("csv-ned")),
        ("camsim/path-pure-pattern-rotation.csv", ned(), Ok(5)),
        ("camsim/path-pure-pattern-translation.csv", ned(), Ok(2)),
        ("camsim/path-chessboard-S3fisheye-lowoffset-opencv+posetracker.csv", spec(), Err("csv-ned")),
        ("camsim/path-chessboard-S3fisheye-lowoffset-opencv+posetracker.csv", ned(), Ok(60)),
        ("camsim/path-chessboard-S3fisheye-lowoffset-agisoftlens+posetracker.csv", ned(), Ok(60)),
    ];
    let mut table = String::from(
        "# Real flights, as they are read\n\nMade by a test from the files in CAMSIM_DATA. Speed: the 99.9th \
            percentile. Warnings are the reader's; repairs are in the report.\n\n| file | read with | rows | \
            seconds | m/s | what is said |\n|---|---|---|---|---|---|\n",
    );
    let mut faults = Vec::new();
    for (file, spec, expected) in &cases {
        let result = read(&data.join(file), spec);
        let name = |text: String| text.replace(&format!("{}/", data.display()), "").replace('|', "\\|");
        let key = match (spec.format, spec.attitude) {
            (LogFormat::CsvNed, _) => "`format = \"csv-ned\"`",
            _ if spec.height == FlightHeight::Msl => "`height = \"msl\"`",
            (_, AttitudeSource::Track) => "`attitude = \"track\"`",
            _ => "",
        };
        table += &match &result {
            Ok(log) => {
                let report = log.report.to_string();
                let repairs =
                    report.split_once("; ").map_or(String::new(), |(_, repairs)| repairs.to_owned());
                let notes = log.notes.iter().map(|note| note.text.clone());
                let texts: Vec<String> = notes.chain([repairs]).filter(|text| !text.is_empty()).collect();
                let speed = log.speed_percentile_m_s(0.999);
                format!(
                    "| {file} | {key} | {} | {:.2} | {speed:.2} | {} |\n",
                    log.rows.len(),
                    log.duration_s(),
                    name(texts.join("; "))
                )
            }
            Err(error) => format!(
                "| {file} | {key} | | | | refused: {} |\n",
                name(error.clone()).trim_start_matches(&format!("{file}: "))
            ),
        };
        match (&result, expected) {
            (Ok(log), Ok(rows)) if log.rows.len() == *rows => {
                // On the bench, the estimator of a log had no position but that of its receiver; positions of
                // a receiver alone state the identity for an attitude; one log has the poses of a camera.
                let known = |note: &&Note| {
                    note.text == "`vehicle_local_position` has no valid position"
                        || (file.ends_with("01_gps.txt") && note.text.starts_with("the attitude is the same"))
                        || (file.contains("fr2_desk") && note.text.contains("camera (optical) axes"))
                };
                if let Some(warning) = log.notes.iter().find(|note| note.is_warning && !known(note)) {
                    faults.push(format!("{file}: an unexpected warning: {}", warning.text));
                }
            }
            (Err(error), Err(word)) if error.contains(word) => {}
            (Ok(log), _) => faults.push(format!("{file}: {} rows", log.rows.len())),
            (Err(error), _) => faults.push(error.clone()),
        }
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/reference/inputs/FLIGHTS-MEASURED.md");
    if std::env::var_os("CAMSIM_BLESS").is_some() {
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, &table).unwrap();
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    assert_eq!(std::fs::read_to_string(&path).unwrap(), table, "set CAMSIM_BLESS=1 to write it");
}
