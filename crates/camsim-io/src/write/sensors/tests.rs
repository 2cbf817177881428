#![allow(clippy::unwrap_used, reason = "tests")]

use std::sync::Arc;

use camsim_core::{
    geodesy::{Geodetic, LocalFrame},
    pose::BodyState,
    scenario::{PerAxis, Scenario},
    trajectory::Trajectory,
};
use glam::{DQuat, DVec3};

use super::*;
use crate::scenario_file::parse_scenario;

const TEXT: &str = "seed = 7\n[flight]\nlog = \"a.csv\"\n[scene.pattern]\nimage = \"g.png\"\nwidth_m = 10\n\
    [[imu]]\nname = \"imu0\"\naxes = \"flu\"\nmount = { angles_deg = [0, 0, 90], offset_m = [0.1, 0.2, 0.3] }\n\
    gyro = { noise_density = 1e-3, random_walk = [1e-5, 2e-5, 3e-5], scale = 0.01 }\n\
    accel = { noise_density = 2e-3, drift_sigma = 0.02, drift_tau_s = 50, range = 9 }\n\
    [[gnss]]\nname = \"gnss0\"\nsigma_m = [1, 2]\ndropouts_s = [[1, 2]]\n\
    [[barometer]]\nname = \"baro0\"\nsigma_pa = 3\n\
    [[magnetometer]]\nname = \"mag0\"\ndate = \"2026-11-27\"\n";

fn scenario(text: &str) -> Scenario {
    parse_scenario(text, Path::new("s.toml"), &[]).unwrap()
}

/// Sensors on a platform that climbs northwards for four seconds, turning.
fn sensors(scenario: &Scenario) -> Sensors {
    let state = BodyState {
        position_ned_m: DVec3::new(0.0, 0.0, -100.0),
        velocity_ned_m_s: DVec3::new(20.0, 0.0, -2.0),
        acceleration_ned_m_s2: DVec3::new(0.5, 0.0, 0.0),
        ned_from_body: DQuat::IDENTITY,
        rate_body_rad_s: DVec3::new(0.0, 0.0, 0.3),
        angular_acceleration_body_rad_s2: DVec3::ZERO,
    };
    let trajectory = Arc::new(Trajectory::listed(vec![0.0], 4.0, vec![state]).unwrap());
    let frame = LocalFrame::new(Geodetic::from_deg(46.7, 9.85, 2100.0));
    let input = SensorInput::new(scenario, trajectory, Some(frame), 1_700_000_000_000_000_000, 4.0);
    Sensors::new(scenario, &input).unwrap()
}

fn table(path: &Path) -> (Vec<String>, Vec<Vec<String>>) {
    let mut reader = csv::Reader::from_path(path).unwrap();
    let texts = |record: &csv::StringRecord| record.iter().map(str::to_owned).collect::<Vec<_>>();
    let header = texts(reader.headers().unwrap());
    (header, reader.records().map(|record| texts(&record.unwrap())).collect())
}

#[test]
fn tables_hold_the_samples_to_the_bit() {
    let folder = tempfile::tempdir().unwrap();
    let sensors = sensors(&scenario(TEXT));
    let summary = write_sensors(folder.path(), &sensors).unwrap();
    // From -1 s to 5 s.
    assert_eq!(summary, SensorSummary { sensors: 4, rows: 1201 + 61 + 301 + 301 });
    let sensors_folder = folder.path().join(SENSORS_FOLDER);
    let (header, rows) = table(&sensors_folder.join("imu0.csv"));
    assert_eq!((header.join(","), rows.len()), (Columns::<ImuSample>::all().header(), 1201));
    let column = |name: &str| header.iter().position(|cell| cell == name).unwrap();
    for (row, sample) in rows.iter().zip(sensors.imus[0].samples()) {
        let number = |name: &str| row[column(name)].parse::<f64>().unwrap();
        assert_eq!(row[0].parse::<i64>().unwrap(), sample.time.stamp_ns);
        assert_eq!(number("gyro_z_rad_s"), sample.gyro_rad_s.z);
        assert_eq!(number("accel_x_m_s2"), sample.accel_m_s2.x);
        assert_eq!(number("true_accel_y_m_s2"), sample.true_accel_m_s2.y);
        assert_eq!(number("gyro_bias_y_rad_s"), sample.gyro_bias_rad_s.y);
        assert_eq!(number("accel_bias_z_m_s2"), sample.accel_bias_m_s2.z);
        assert_eq!(number("true_d_m"), sample.position_ned_m.z);
        assert_eq!(number("true_vn_m_s"), sample.velocity_ned_m_s.x);
        assert_eq!(number("true_qw"), sample.ned_from_sensor.w);
        assert_eq!(number("true_qz"), sample.ned_from_sensor.z);
        assert_eq!(row[column("is_saturated")], "1", "up reads 9.8 m/s^2, beyond the range");
    }
    assert_eq!(rows[200][0], "1700000000000000000");
    let (header, rows) = table(&sensors_folder.join("gnss0.csv"));
    assert_eq!((header.join(","), rows.len()), (Columns::<GnssSample>::all().header(), 61));
    for (row, sample) in rows.iter().zip(sensors.gnss[0].samples()) {
        assert_eq!(row[1] == "0", (10..20).contains(&sample.time.sample));
        assert!(row[2..12].iter().all(|cell| cell.is_empty() == (row[1] == "0")));
        let lat_deg =
            row[header.iter().position(|cell| cell == "true_lat_deg").unwrap()].parse::<f64>().unwrap();
        assert_eq!(lat_deg, sample.truth.at.lat_deg());
    }
    let columns = [Columns::<BarometerSample>::all().header(), Columns::<MagnetometerSample>::all().header()];
    for (name, columns) in ["baro0.csv", "mag0.csv"].into_iter().zip(columns) {
        let (header, rows) = table(&sensors_folder.join(name));
        assert_eq!((header.join(","), rows.len()), (columns, 301), "{name}");
        assert!(rows.iter().flatten().all(|cell| cell.parse::<f64>().unwrap().is_finite()), "{name}");
    }
}

#[test]
fn descriptions_say_what_a_sensor_is() {
    let folder = tempfile::tempdir().unwrap();
    let scenario = scenario(TEXT);
    write_sensors(folder.path(), &sensors(&scenario)).unwrap();
    let read = |name: &str| -> toml::Table {
        fs::read_to_string(folder.path().join(SENSORS_FOLDER).join(name)).unwrap().parse().unwrap()
    };
    let imu = read("imu0.toml");
    let keys = [("kind", "imu"), ("name", "imu0"), ("table", "imu0.csv")];
    keys.iter().for_each(|(key, value)| assert_eq!(imu[*key].as_str(), Some(*value)));
    assert_eq!((imu["rows"].as_integer(), imu["rows_outside_log"].as_integer()), (Some(1201), Some(400)));
    // Up reads 9.8 m/s^2 all the time, beyond the range.
    assert_eq!(imu["saturated_rows"].as_integer(), Some(1201));
    assert_eq!(imu["first_t_ns"].as_integer(), Some(1_699_999_999_000_000_000));
    let matrix: Vec<Vec<f64>> = imu["T_body_sensor"].clone().try_into().unwrap();
    // Forward of the sensor is right of the body, left is forward, up is up.
    let expected = [[0.0, 1.0, 0.0, 0.1], [1.0, 0.0, 0.0, 0.2], [0.0, 0.0, -1.0, 0.3], [0.0, 0.0, 0.0, 1.0]];
    for (value, expected) in matrix.iter().flatten().zip(expected.as_flattened()) {
        assert!((value - expected).abs() < 1e-15, "{matrix:?}");
    }
    let scale: Vec<Vec<f64>> = imu["gyro_matrix"].clone().try_into().unwrap();
    assert_eq!(scale, [[1.01, 0.0, 0.0], [0.0, 1.01, 0.0], [0.0, 0.0, 1.01]]);
    let gravity = imu["gravity_at_origin_m_s2"].as_float().unwrap();
    assert!((gravity - 9.8013).abs() < 1e-3, "{gravity}");
    let spec: camsim_core::scenario::ImuSpec = imu["scenario"].clone().try_into().unwrap();
    assert_eq!(spec, scenario.imu[0]);
    assert_eq!(read("gnss0.toml")["rows_without_fix"].as_integer(), Some(10));
    let origin: Vec<f64> = read("mag0.toml")["local_origin"].clone().try_into().unwrap();
    assert!((origin[0] - 46.7).abs() < 1e-9 && (origin[2] - 2100.0).abs() < 1e-6, "{origin:?}");
    assert!(read("baro0.toml").contains_key("T_body_sensor"));
}

#[test]
fn kalibr_gets_numbers_above_zero_that_yaml_takes_for_numbers() {
    let mut spec = scenario(TEXT).imu[0].clone();
    spec.rate_hz = 200.0;
    let read = |text: &str| -> std::collections::BTreeMap<String, String> {
        let lines = text.lines().filter(|line| !line.starts_with('#'));
        lines
            .map(|line| line.split('#').next().unwrap().trim().split_once(": ").unwrap())
            .map(|(key, value)| (key.to_owned(), value.to_owned()))
            .collect()
    };
    let text = kalibr_yaml(&spec);
    let keys = read(&text);
    let number = |key: &str| keys[key].parse::<f64>().unwrap();
    assert_eq!((number("gyroscope_noise_density"), number("gyroscope_random_walk")), (1e-3, 3e-5));
    assert_eq!(number("accelerometer_noise_density"), 2e-3);
    assert!((number("accelerometer_random_walk") - 0.02 * (2.0_f64 / 50.0).sqrt()).abs() < 1e-15);
    assert_eq!((keys["rostopic"].as_str(), keys["update_rate"].as_str()), ("/imu0", "200.0"));
    spec.gyro.random_walk = PerAxis::default();
    let text = kalibr_yaml(&spec);
    assert!(
        text.contains("gyroscope_random_walk: 0.000000000001   # rad/s^2/sqrt(Hz); 0 in truth"),
        "{text}"
    );
    for (key, value) in read(&text).iter().filter(|(key, _)| key.as_str() != "rostopic") {
        assert!(value.contains('.') && !value.contains('e'), "{key}: {value}");
    }
}

#[test]
fn files_of_former_sensors_go_and_those_of_others_stay() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(SENSORS_FOLDER).join(name);
    write_sensors(folder.path(), &sensors(&scenario(TEXT))).unwrap();
    let first = fs::read(path("imu0.csv")).unwrap();
    fs::write(path("notes.toml"), "mine = true\n").unwrap();
    let renamed = scenario(&TEXT.replace("imu0", "imu1"));
    write_sensors(folder.path(), &sensors(&renamed)).unwrap();
    let gone = ["imu0.csv", "imu0.toml", "imu0_kalibr.yaml"];
    assert!(gone.iter().all(|name| !path(name).exists()));
    assert!(path("imu1.csv").exists() && path("notes.toml").exists() && path("gnss0.csv").exists());
    assert_ne!(fs::read(path("imu1.csv")).unwrap(), first, "another name has other noise");
    write_sensors(folder.path(), &sensors(&scenario(TEXT))).unwrap();
    assert_eq!(fs::read(path("imu0.csv")).unwrap(), first, "another run writes the same bytes");

    let without_range = scenario(&TEXT.replace(", range = 9", ""));
    write_sensors(folder.path(), &sensors(&without_range)).unwrap();
    let (header, rows) = table(&path("imu0.csv"));
    let saturated = header.iter().position(|name| name == "is_saturated").unwrap();
    assert!(rows.iter().all(|row| row[saturated] == "0"));
    // Of a version before `is_saturated`.
    let header = Columns::<ImuSample>::all().header().replace(",is_saturated", "");
    fs::write(path("imu0.csv"), header + "\n").unwrap();
    write_sensors(folder.path(), &sensors(&without_range)).unwrap();
    assert_eq!(table(&path("imu0.csv")).1, rows);

    fs::write(path("imu0.csv"), "t,x\n1,2\n").unwrap();
    let error = write_sensors(folder.path(), &sensors(&scenario(TEXT))).unwrap_err().to_string();
    assert!(error.contains("imu0.csv") && error.contains("no file of a sensor"), "{error}");
    assert_eq!(fs::read_to_string(path("imu0.csv")).unwrap(), "t,x\n1,2\n");
    let other = tempfile::tempdir().unwrap();
    fs::create_dir(other.path().join(SENSORS_FOLDER)).unwrap();
    fs::write(other.path().join(SENSORS_FOLDER).join("baro0.toml"), "a = 1\n").unwrap();
    let error = write_sensors(other.path(), &sensors(&scenario(TEXT))).unwrap_err().to_string();
    assert!(error.contains("baro0.toml"), "{error}");
    // Without sensors there is no folder.
    let bare = tempfile::tempdir().unwrap();
    write_sensors(bare.path(), &Sensors::default()).unwrap();
    assert!(!bare.path().join(SENSORS_FOLDER).exists());
}

#[test]
fn an_unwritable_folder_is_named() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join(SENSORS_FOLDER), "a file").unwrap();
    let error = write_sensors(folder.path(), &sensors(&scenario(TEXT))).unwrap_err().to_string();
    assert!(error.contains("imu0.csv") && error.contains("choose another folder"), "{error}");
}
