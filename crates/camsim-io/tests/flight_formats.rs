//! Flight logs in the formats of other programs: one climbing circle, written by `scripts/goldens/flight_logs.py`
//! through pyulog, pymavlink, aerofiles, simplekml, mcap and rosbags, against its closed form.

#![allow(clippy::unwrap_used)]

use std::path::{Path, PathBuf};

use camsim_core::{
    flight_log::{FlightLog, HeightConversion, body_from_euler_deg},
    scenario::{AttitudeSource, FlightHeight, FlightSpec, Origin},
};
use camsim_io::flight_log::read_flight_log;
use glam::DVec3;

const ORIGIN: [f64; 3] = [47.0, 8.0, 500.0];

fn spec() -> FlightSpec {
    FlightSpec { origin: Origin::Geodetic(ORIGIN), height: FlightHeight::Msl, ..FlightSpec::default() }
}

fn topic(topic: &str) -> FlightSpec {
    FlightSpec { topic: Some(topic.to_owned()), ..spec() }
}

fn track() -> FlightSpec {
    FlightSpec { attitude: AttitudeSource::Track, ..spec() }
}

fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/flights").join(name)
}

fn read(name: &str, spec: &FlightSpec) -> Result<FlightLog, String> {
    read_flight_log(&file(name), spec, HeightConversion::None).map_err(|error| error.to_string())
}

/// Position, and attitude as angles in degrees, of the circle at a time from its start.
fn truth(t_s: f64) -> (DVec3, [f64; 3]) {
    let (sin, cos) = (0.2 * t_s).sin_cos();
    let bank = (100.0_f64 * 0.04 / 9.806_65).atan().to_degrees();
    let pitch = (1.0_f64 / 20.0).atan().to_degrees();
    (DVec3::new(100.0 * sin, 100.0 * (1.0 - cos), -t_s), [bank, pitch, (0.2 * t_s).to_degrees()])
}

/// Largest errors of the rows: horizontal and vertical, metres; attitude, degrees. `start_s` is the time of
/// the first row on the circle.
fn errors(log: &FlightLog, start_s: f64) -> [f64; 3] {
    let mut worst = [0.0_f64; 3];
    for row in &log.rows {
        let (position, angles) = truth(row.t_s + start_s);
        let error = row.position_ned_m - position;
        let attitude = row.ned_from_body.angle_between(body_from_euler_deg(angles)).to_degrees();
        let now = [error.truncate().length(), error.z.abs(), attitude];
        worst = [0, 1, 2].map(|i| worst[i].max(now[i]));
    }
    worst
}

/// A log as it must be read.
struct Case {
    file: &'static str,
    spec: FlightSpec,
    rows: usize,
    seconds: f64,
    /// Limits of [`errors`].
    limits: [f64; 3],
    /// Substrings of all warnings.
    warnings: &'static [&'static str],
}

/// Cubics between positions 0.1 s and 0.2 s apart leave the circle by 3 and 12 mm at its ends.
#[test]
fn every_format_gives_the_circle() {
    let case = |file, spec, rows, limits| Case { file, spec, rows, seconds: 20.0, limits, warnings: &[] };
    let cases = [
        // f32 metres, and PX4's sphere against the ellipsoid: below 1 mm.
        case("px4_local.ulg", spec(), 401, [0.006, 0.002, 0.02]),
        case("px4_global.ulg", spec(), 401, [0.021, 0.002, 0.02]),
        // Whole 1e-7 degrees and millimetres.
        case("px4_global.ulg", topic("vehicle_gps_position, vehicle_attitude"), 401, [0.032, 0.002, 0.02]),
        // Hundredths of a degree; heights in f32.
        case("ardupilot.bin", spec(), 401, [0.017, 0.002, 0.02]),
        Case {
            warnings: &["`XKF1` has the instances 0, 1"],
            ..case("ardupilot.bin", topic("XKF1"), 201, [0.002, 0.002, 0.02])
        },
        // The third fix of GPS is the first with three dimensions, 0.6 s after the first attitude.
        Case {
            seconds: 19.4,
            warnings: &["3 positions of `GPS` have no 3D fix"],
            ..case("ardupilot.bin", topic("GPS, AHR2"), 195, [0.017, 0.006, 0.02])
        },
        Case {
            warnings: &["GIMBAL.pitch"],
            ..case("dji_flight_record.csv", spec(), 201, [0.002, 0.002, 0.01])
        },
        case("track.kml", spec(), 201, [0.002, 0.002, 0.01]),
        // Metres of height, hundredths of 1.85 m of position.
        Case {
            seconds: 20.0,
            warnings: &["1 of 22 fixes have no GNSS height"],
            ..case(
                "glider.igc",
                FlightSpec { height: FlightHeight::Ellipsoid, ..track() },
                21,
                [0.05, 0.51, 2.0],
            )
        },
        case("pose_zstd.mcap", spec(), 201, [0.001, 0.001, 0.01]),
        case("pose_lz4.mcap", spec(), 201, [0.001, 0.001, 0.01]),
        case("pose_plain.mcap", spec(), 201, [0.001, 0.001, 0.01]),
        case("odometry.mcap", topic("/odom"), 21, [0.001, 0.001, 0.01]),
        case("odometry.mcap", topic("/pose_cov"), 21, [0.001, 0.001, 0.01]),
        case("odometry.mcap", topic("/tf#base_link"), 21, [0.001, 0.001, 0.01]),
        Case {
            warnings: &["1 messages of `/fix` have no fix"],
            ..case(
                "fix_imu.mcap",
                FlightSpec { height: FlightHeight::Ellipsoid, ..spec() },
                81,
                [0.51, 0.001, 0.02],
            )
        },
    ];
    let mut faults = Vec::new();
    for Case { file, spec, rows, seconds, limits, warnings } in cases {
        let name = format!("{file} {}", spec.topic.as_deref().unwrap_or(""));
        let log = match read(file, &spec) {
            Ok(log) => log,
            Err(error) => {
                faults.push(format!("{name}: {error}"));
                continue;
            }
        };
        let found = errors(&log, 20.0 - seconds);
        eprintln!("{name}: {} rows, {:.1} s, {found:.4?}", log.rows.len(), log.duration_s());
        if log.rows.len() != rows || (log.duration_s() - seconds).abs() > 1e-6 {
            faults.push(format!("{name}: {} rows, {} s", log.rows.len(), log.duration_s()));
        }
        if !(0..3).all(|i| found[i] <= limits[i]) {
            faults.push(format!("{name}: errors {found:?}"));
        }
        let told: Vec<&str> = log.notes.iter().filter(|n| n.is_warning).map(|n| n.text.as_str()).collect();
        if told.len() != warnings.len() || !warnings.iter().zip(&told).all(|(a, b)| b.contains(a)) {
            faults.push(format!("{name}: warnings {told:?}"));
        }
        if !log.report.is_clean() {
            faults.push(format!("{name}: {}", log.report));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
