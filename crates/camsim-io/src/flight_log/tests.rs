#![allow(clippy::unwrap_used)]

use std::path::PathBuf;

use camsim_core::{
    flight_log::{RawAttitude, RawPosition, body_from_euler_deg},
    scenario::AttitudeSource,
};
use glam::{DQuat, DVec3};

use super::*;

pub(super) fn spec(format: LogFormat) -> FlightSpec {
    FlightSpec { format, ..FlightSpec::new(PathBuf::new()) }
}

fn raw(content: &str, format: LogFormat) -> Result<Vec<RawRow>, FlightLogError> {
    raw_bytes(content.as_bytes(), format)
}

fn raw_bytes(content: &[u8], format: LogFormat) -> Result<Vec<RawRow>, FlightLogError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    std::fs::write(&path, content).unwrap();
    read_raw_rows(&path, &spec(format)).map(|log| log.rows)
}

fn ned(row: &RawRow) -> DVec3 {
    match row.position {
        RawPosition::Ned(ned) => ned,
        RawPosition::Geodetic(position) => panic!("{position:?} is geodetic"),
    }
}

const LLA: &str = "0.000,47.0,8.0,500,1,2,3\n0.5,47.0001,8.0,501,1,2,3\n1.0,47.0002,8.0,502,1,2,3\n";

#[test]
fn separators_bom_crlf_and_comments_do_not_change_the_rows() {
    let plain = raw(LLA, LogFormat::Auto).unwrap();
    assert_eq!(plain.len(), 3);
    assert_eq!(plain[1].t_ns, Some(500_000_000));
    assert_eq!(plain[1].attitude, RawAttitude::EulerDeg([1.0, 2.0, 3.0]));
    for variant in [
        format!("\u{feff}{}", LLA.replace('\n', "\r\n")),
        LLA.replace(',', " ; "),
        LLA.replace(',', "\t "),
        LLA.replace('\n', ",\n"),
        LLA.trim_end().to_owned(),
    ] {
        assert_eq!(raw(&variant, LogFormat::Auto).unwrap(), plain, "{variant:?}");
    }
    let commented = raw(&format!("# a flight\n% of mine\n\n{LLA}# the end\n"), LogFormat::Auto).unwrap();
    assert_eq!(commented.iter().map(|row| row.line).collect::<Vec<_>>(), [4, 5, 6]);
}

#[test]
fn headers_allow_columns_in_any_order() {
    let rows = raw(
        "yaw_rad,Latitude,lon [deg],note,alt_m,pitch,roll,timestamp \
            [us]\n1.5707963267948966,47,8,hello,500,2,1,1500000\n",
        LogFormat::Auto,
    )
    .unwrap();
    assert_eq!(rows[0].t_ns, Some(1_500_000_000));
    let RawPosition::Geodetic(position) = rows[0].position else { panic!("{:?}", rows[0]) };
    assert!((position.lon_deg() - 8.0).abs() < 1e-12);
    assert_eq!(rows[0].attitude, RawAttitude::EulerDeg([1.0, 2.0, 90.0]));
    let down = raw("t,east,north,down,qw,qx,qy,qz\n0,1,2,3,1,0,0,0\n", LogFormat::Auto).unwrap();
    assert_eq!(ned(&down[0]), DVec3::new(2.0, 1.0, 3.0));
    assert_eq!(down[0].attitude, RawAttitude::Quaternion(DQuat::IDENTITY));
    let up = raw("# t north east alt roll pitch yaw\n0 1 2 3 0 0 0\n", LogFormat::Auto).unwrap();
    assert_eq!(ned(&up[0]), DVec3::new(1.0, 2.0, -3.0));
    let xyz = "t,x,y,z,roll,pitch,yaw\n0,1,2,3,0,0,0\n";
    assert!(raw(xyz, LogFormat::Auto).unwrap_err().to_string().contains("csv-ned"));
    assert_eq!(ned(&raw(xyz, LogFormat::CsvNed).unwrap()[0]), DVec3::new(1.0, 2.0, 3.0));
    assert_eq!(ned(&raw(xyz, LogFormat::CsvXya).unwrap()[0]), DVec3::new(1.0, 2.0, -3.0));
    assert!(raw(xyz, LogFormat::CsvLla).is_err());
    assert!(
        raw("t,lat,lon,alt\n0,1,2,3\n", LogFormat::CsvNed).unwrap_err().to_string().contains("flight.format")
    );
    assert!(raw("foo,bar\n1,2\n", LogFormat::Auto).unwrap_err().to_string().contains("line 1"));
}

#[test]
fn auto_format_refuses_tables_that_fit_two_layouts() {
    let metres = "0,-299.1,-54.3,-3346.5,9.7,1.7,94.0\n1,-323.7,-87.0,-3303.1,11.6,0.9,106.6\n";
    let slow = "0,1,2,3,0,0,0\n1,1.5,2,3,0,0,0\n";
    let one_row = "0,47,8,500,0,0,0\n";
    let still = "0,47,8,500,0,0,0\n1,47,8,500,0,0,0\n";
    let quaternion = "0,1,2,3,0,0,0,1\n1,1,2,3,0,0,0,1\n";
    for content in [metres, slow, one_row, still, quaternion] {
        let error = raw(content, LogFormat::Auto).unwrap_err();
        assert!(matches!(error.problem, LogProblem::Ambiguous(_)), "{content}: {error}");
        assert!(error.to_string().contains("flight.format"), "{error}");
    }
    assert!(matches!(
        raw("0,1,2,3,4\n", LogFormat::Auto),
        Err(FlightLogError { problem: LogProblem::UnknownLayout(5), .. })
    ));
    // A first row that is shorter than the others.
    let short = format!("1\n{}", "0.1 1 2 3 0 0 0 2\n".repeat(3));
    assert!(matches!(
        raw(&short, LogFormat::Auto),
        Err(FlightLogError { problem: LogProblem::UnknownLayout(8), .. })
    ));
    assert_eq!(raw(one_row, LogFormat::CsvLla).unwrap().len(), 1);
}

#[test]
fn tum_and_euroc_poses_are_converted_to_ned_and_frd() {
    // 1 m east, 2 m north, 3 m up; a forward-left-up body turned 90 degrees to the left of east looks north.
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let tum = raw(&format!("1520531829.301144123 1 2 3 0 0 {half} {half}\n"), LogFormat::Auto).unwrap();
    let euroc = raw(
        &format!(
            "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y \
            [],q_RS_z [],v [m s^-1]\n1520531829301144123,1,2,3,{half},0,0,{half},9\n"
        ),
        LogFormat::Euroc,
    )
    .unwrap();
    let headerless = raw(&format!("1520531829301144123,1,2,3,{half},0,0,{half}\n"), LogFormat::Auto).unwrap();
    for row in [tum[0], euroc[0], headerless[0]] {
        // Nanoseconds survive: an f64 of these seconds would be off by up to 120 ns.
        assert_eq!(row.t_ns, Some(1_520_531_829_301_144_123));
        assert_eq!(ned(&row), DVec3::new(2.0, 1.0, -3.0));
        let RawAttitude::Quaternion(ned_from_body) = row.attitude else { panic!("{row:?}") };
        assert!(ned_from_body.dot(DQuat::IDENTITY).abs() > 1.0 - 1e-15, "{ned_from_body}");
    }
    // Level and looking east: yaw 90 degrees; nose up in FLU is a negative turn about left.
    let up = DQuat::from_rotation_y(-0.1);
    let row = raw(&format!("0 0 0 0 {} {} {} {}\n", up.x, up.y, up.z, up.w), LogFormat::Tum).unwrap()[0];
    let RawAttitude::Quaternion(ned_from_body) = row.attitude else { panic!("{row:?}") };
    assert!(ned_from_body.dot(body_from_euler_deg([0.0, 0.1_f64.to_degrees(), 90.0])).abs() > 1.0 - 1e-14);
}

#[test]
fn malformed_files_are_refused_with_line_and_column() {
    let text = |result: Result<Vec<RawRow>, FlightLogError>| result.unwrap_err().to_string();
    assert!(matches!(raw("", LogFormat::Auto), Err(FlightLogError { problem: LogProblem::Empty, .. })));
    assert!(matches!(
        raw("# only words\n", LogFormat::Auto),
        Err(FlightLogError { problem: LogProblem::Empty, .. })
    ));
    assert!(matches!(
        raw("t,lat,lon,alt\n", LogFormat::Auto),
        Err(FlightLogError { problem: LogProblem::Empty, .. })
    ));
    assert!(matches!(
        raw_bytes(b"0,1\xff,2", LogFormat::Auto),
        Err(FlightLogError { problem: LogProblem::NotText(3), .. })
    ));
    let error = text(raw(&LLA.replace("501", "5o1"), LogFormat::Auto));
    assert!(error.contains("line 2, column 4 (height): `5o1` is not a number"), "{error}");
    let error = text(raw(&format!("{LLA}1.5,47.0,8.0\n"), LogFormat::Auto));
    assert!(error.contains("line 4 has 3 columns, csv-lla needs 7"), "{error}");
    let error = text(raw("0,91,8,500,0,0,0\n", LogFormat::CsvLla));
    assert!(error.contains("line 1, column 2 (latitude): 91 is no latitude"), "{error}");
    assert!(text(raw("1 0 0 5 0 1 0 6 0 0 1 7\n", LogFormat::Tum)).contains("KITTI"));
    let missing = read_raw_rows(Path::new("/nowhere/at/all.csv"), &spec(LogFormat::Auto)).map(|log| log.rows);
    assert!(text(missing).contains("/nowhere/at/all.csv"));
}

#[test]
fn missing_values_are_kept_as_nan_or_none() {
    let rows =
        raw("0,47,8,500,1,2,3\n,47,8,500,1,2,3\n1,nan,8,500,1,,3\n1e30,47,8,inf,1,2,3\n", LogFormat::CsvLla)
            .unwrap();
    assert_eq!(rows[1].t_ns, None);
    assert_eq!(rows[3].t_ns, None);
    assert!(matches!(rows[2].attitude, RawAttitude::EulerDeg([_, pitch, _]) if pitch.is_nan()));
}

#[test]
fn times_are_parsed_exactly() {
    let time_ns = |field: &str, unit: &units::Unit| {
        time_fields::fixed_point(field, false)
            .map(|value| value.and_then(|value| time_fields::to_ns(value, unit.factor)))
    };
    let [s, ms, ns, min] = [&units::SECOND, &units::MILLISECOND, &units::NANOSECOND, &units::MINUTE];
    assert_eq!(time_ns("-1.5", s), Some(Some(-1_500_000_000)));
    assert_eq!(time_ns("+.25", ms), Some(Some(250_000)));
    assert_eq!(time_ns("1.0000000006", s), Some(Some(1_000_000_001)));
    assert_eq!(time_ns("-1.0000000006", s), Some(Some(-1_000_000_001)));
    assert_eq!(time_ns("1.037359e-01", s), Some(Some(103_735_900)));
    assert_eq!(time_ns("9223372036854775807", ns), Some(Some(i64::MAX)));
    assert_eq!(time_ns("9223372036854775808", ns), Some(None));
    assert_eq!(time_ns("99999999999999999999999999999999999999", s), Some(None));
    assert_eq!(time_ns("0.05", min), Some(Some(3_000_000_000)));
    assert_eq!(time_ns("nan", s), Some(None));
    assert_eq!(time_ns("1:30", s), None);
    assert_eq!(time_fields::clock_ns("15:41:00.980"), Some(56_460_980_000_000));
    assert_eq!(time_fields::clock_ns("3:41:00.98 PM"), Some(56_460_980_000_000));
    assert_eq!(time_fields::clock_ns("12:00:01 am"), Some(1_000_000_000));
    for bad in ["12:34", "24:00:00", "1:60:00", "1:2:3:4", "a:b:c", ""] {
        assert_eq!(time_fields::clock_ns(bad), None, "{bad}");
    }
    // `date -u -d 2024-02-29T23:59:59Z +%s`
    for same in [
        "2024-02-29T23:59:59Z",
        "2024-02-29 23:59:59",
        "2024/02/29 23:59:59.000",
        "2024-03-01T01:29:59+01:30",
        "2024-02-29T18:59:59-0500",
    ] {
        assert_eq!(time_fields::date_time_ns(same), Some(1_709_251_199_000_000_000), "{same}");
    }
    assert_eq!(time_fields::date_ns("1970-01-01"), Some(0));
    assert_eq!(time_fields::date_ns("01/02/2024"), None);
}

/// Reads the real flights in CAMSIM_DATA and compares the number of rows and of repairs with the known ones.
#[test]
fn published_flights_have_the_known_rows_and_repairs() {
    let Some(data) = std::env::var_os("CAMSIM_DATA").map(PathBuf::from) else {
        eprintln!("CAMSIM_DATA is not set: skipped");
        return;
    };
    let read = |file: &str, format, attitude| {
        let start = std::time::Instant::now();
        let result = read_flight_log(
            &data.join(file),
            &FlightSpec { attitude, ..spec(format) },
            HeightConversion::None,
        );
        match &result {
            Ok(log) => eprintln!(
                "{file}: {} rows, {:.1} s, {:.2} m/s, {:.1} deg/s, {:.0} ms; {}",
                log.rows.len(),
                log.duration_s(),
                log.speed_percentile_m_s(0.999),
                log.angular_rate_percentile_rad_s(0.999).to_degrees(),
                start.elapsed().as_secs_f64() * 1e3,
                log.report
            ),
            Err(error) => eprintln!("{error}"),
        }
        result
    };
    let log = |file: &str| read(file, LogFormat::Auto, AttitudeSource::Log).unwrap();

    let lawnmower = log("camsim/path_lawnmower.csv");
    // The last row, 44848, has -170.4 between 179.8 and -180.0.
    assert_eq!(lawnmower.report.attitude_glitches.lines, [7190, 22762, 23060, 37732, 44551, 44848]);
    assert_eq!(lawnmower.report.position_spikes.count, 0);
    assert_eq!(lawnmower.report.rows_read, 51_753);
    let speed = lawnmower.speed_percentile_m_s(0.999);
    assert!((10.0..25.0).contains(&speed), "{speed}");

    for (file, rows) in [
        ("flights/demo_brighton_lawnmower_x0.05.csv", 5886),
        ("flights/demo_sertig_lawnmower_x5.5.csv", 10_618),
        ("flights/glider_9crx3101_camsim_derived.csv", 2133),
        ("flights/euroc_V1_03_difficult.txt", 20_932),
        ("flights/tumvi_corridor1_okvis.txt", 5986),
        ("flights/tumrgbd_fr2_desk_groundtruth.txt", 20_957),
        ("flights/rpng_neighborhood_01_gps.txt", 1931),
    ] {
        let report = log(file).report;
        assert_eq!(report.rows_read, rows, "{file}");
        assert_eq!(
            (report.attitude_glitches.count, report.position_spikes.count),
            (0, 0),
            "{file}: {report}"
        );
    }
    let desk = log("flights/tumrgbd_fr2_desk_groundtruth.txt").report;
    assert_eq!((desk.gaps.count, desk.duplicates.count), (5, 1));
    assert!((desk.longest_step_s - 12.0).abs() < 0.1, "{}", desk.longest_step_s);
    assert!(
        read("flights/glider_9crx3101.csv", LogFormat::Auto, AttitudeSource::Log)
            .unwrap_err()
            .to_string()
            .contains("track")
    );
    read("flights/glider_9crx3101.csv", LogFormat::Auto, AttitudeSource::Track).unwrap();
    read("flights/rpng_neighborhood_01_gps.txt", LogFormat::Auto, AttitudeSource::Track).unwrap();
    assert!(matches!(
        read("flights/kitti_00_gt.txt", LogFormat::Auto, AttitudeSource::Log),
        Err(FlightLogError { problem: LogProblem::PoseMatrices, .. })
    ));
    assert!(read("flights/kitti_00_gt_times.txt", LogFormat::Auto, AttitudeSource::Log).is_err());

    for (file, rows) in [
        ("camsim/path-pure-pattern-rotation.csv", 5),
        ("camsim/path-pure-pattern-translation.csv", 2),
        ("camsim/path-chessboard-S3fisheye-lowoffset-opencv+posetracker.csv", 60),
        ("camsim/path-chessboard-S3fisheye-lowoffset-agisoftlens+posetracker.csv", 60),
    ] {
        assert!(
            matches!(
                read(file, LogFormat::Auto, AttitudeSource::Log),
                Err(FlightLogError { problem: LogProblem::Ambiguous(_), .. })
            ),
            "{file}"
        );
        let log = read(file, LogFormat::CsvNed, AttitudeSource::Log).unwrap();
        assert_eq!(log.rows.len(), rows, "{file}");
        assert!(log.report.is_clean(), "{file}: {}", log.report);
    }
}
