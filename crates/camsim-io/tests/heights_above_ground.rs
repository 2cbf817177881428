//! `flight.height = "ground"` and `"takeoff"`: rows stand as far above the loaded terrain as the log says.

#![allow(clippy::unwrap_used)]

use std::{fs, path::Path};

use camsim_core::geodesy::Geodetic;
use camsim_io::{
    load::{LoadError, Loaded, load_flight, load_sequence},
    scenario_file::read_scenario,
};

/// Largest error of a height above the terrain, metres. Vertices are rounded to the size of a chunk * 2^-23, 8e-5 m for
/// 64 cells of 10 m: half of it, times what a slope adds. The Earth's curvature within a cell adds 3e-6 m.
const TOLERANCE_M: f64 = 1e-4;

fn asset(name: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets").join(name)
}

/// Latitude, longitude and height above mean sea level of the rows of the demo's flight.
fn flown() -> Vec<[f64; 3]> {
    let text = fs::read_to_string(asset("demo_flight.csv")).unwrap();
    let row = |line: &str| -> [f64; 3] {
        let numbers: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        [numbers[1], numbers[2], numbers[3]]
    };
    text.lines().skip(1).map(row).collect()
}

/// Loads the demo with another log: a header, and rows of a time, then the given cells, then the attitude.
fn load(header: &str, rows: &[String], height: &str, sets: &[(&str, &str)]) -> Result<Loaded, LoadError> {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("log.csv");
    let line = |(row, cells): (usize, &String)| format!("{},{cells},0,0,0\n", 0.04 * row as f64);
    let lines: String = rows.iter().enumerate().map(line).collect();
    fs::write(&file, format!("t_s,{header},roll_deg,pitch_deg,yaw_deg\n{lines}")).unwrap();
    let path = file.display().to_string();
    let mut all = vec![("flight.log", &*path), ("flight.height", height)];
    all.extend(sets);
    let sets: Vec<_> = all.iter().map(|&(key, value)| (key.to_owned(), value.to_owned())).collect();
    load_sequence(&read_scenario(&asset("demo.toml"), &sets, None).unwrap())
}

/// Heights of the rows above the ground of the loaded scene: above the point at their latitude and longitude.
fn above_ground_m(loaded: &Loaded) -> Vec<f64> {
    let (frame, terrain) = (loaded.log.frame.unwrap(), loaded.sequence.scene.terrain.as_ref().unwrap());
    let above = |ned_m| {
        let at = frame.geodetic_from_ned(ned_m);
        let mut ground_m = at.height_m;
        for _ in 0..5 {
            let below = frame.ned_from_geodetic(Geodetic { height_m: ground_m, ..at });
            let down_m = terrain.down_at(below.x, below.y).unwrap();
            ground_m = frame.geodetic_from_ned(below.with_z(down_m)).height_m;
        }
        at.height_m - ground_m
    };
    loaded.log.rows.iter().map(|row| above(row.position_ned_m)).collect()
}

#[test]
fn heights_above_the_ground_follow_the_terrain() {
    let rows: Vec<String> = flown().iter().map(|[lat, lon, _]| format!("{lat},{lon},80")).collect();
    let ellipsoid = ("scene.terrain.height", "ellipsoid");
    for (header, sets) in [
        ("lat_deg,lon_deg,alt_m", &[][..]),
        ("lat_deg,lon_deg,agl_m", &[]),
        ("lat_deg,lon_deg,alt_m", &[ellipsoid]),
        ("lat_deg,lon_deg,alt_m", &[("flight.origin", "[38.95, -107.06, 3000.0]")]),
    ] {
        let loaded = load(header, &rows, "ground", sets).unwrap();
        let all = above_ground_m(&loaded);
        let worst_m = all.iter().map(|m| (m - 80.0).abs()).fold(0.0, f64::max);
        eprintln!("{header}, {sets:?}: at most {worst_m:.1e} m");
        assert!(worst_m < TOLERANCE_M, "{header}: {worst_m} m");
        let height_m = |row: usize| loaded.log.rows[row].position_ned_m.z;
        assert!((height_m(0) - height_m(rows.len() - 1)).abs() > 50.0, "the ground is not level");
    }
}

#[test]
fn heights_above_take_off_are_above_the_ground_of_the_first_row() {
    let all = flown();
    let up_m = |row: usize| row as f64;
    let rows: Vec<String> =
        (0..all.len()).map(|row| format!("{},{},{},9000", all[row][0], all[row][1], up_m(row))).collect();
    // The column that says what its heights are above counts, before one that does not.
    let loaded = load("lat_deg,lon_deg,height_above_takeoff_m,alt_m", &rows, "takeoff", &[]).unwrap();
    assert!(above_ground_m(&loaded)[0].abs() < TOLERANCE_M);
    let frame = loaded.log.frame.unwrap();
    let heights_m: Vec<f64> =
        loaded.log.rows.iter().map(|row| frame.geodetic_from_ned(row.position_ned_m).height_m).collect();
    for (row, height_m) in heights_m.iter().enumerate() {
        assert!((height_m - heights_m[0] - up_m(row)).abs() < 1e-6, "row {row}");
    }
    assert!(
        loaded.warnings.iter().all(|warning| !warning.contains("flight.height")),
        "{:?}",
        loaded.warnings
    );
}

#[test]
fn local_logs_stand_on_the_ground_at_their_origin() {
    let rows: Vec<String> = (0..50).map(|row| format!("{},{},30", 10 * row, -4 * row)).collect();
    let origin = ("flight.origin", "[38.95, -107.06, 0.0]");
    let format = ("flight.format", "csv-xya");
    let window = ("flight.window_s", "[0.0, 1.0]");
    let loaded = load("n_m,e_m,alt_m", &rows, "ground", &[origin, format, window]).unwrap();
    assert!(above_ground_m(&loaded).iter().all(|m| (m - 30.0).abs() < TOLERANCE_M));
    let error = load("n_m,e_m,alt_m", &rows, "ground", &[format, window]).unwrap_err().to_string();
    assert!(error.contains("flight.origin"), "{error}");
}

#[test]
fn rows_beyond_the_terrain_are_counted_and_a_first_one_for_take_off_is_refused() {
    let inside = flown()[0];
    let mut rows = vec![format!("{},{},20", inside[0], inside[1]); 60];
    for (row, cells) in rows.iter_mut().enumerate() {
        *cells = format!("{},{},20", inside[0] + 1e-6 * row as f64, inside[1]);
    }
    let header = "lat_deg,lon_deg,alt_m";
    let beyond = |row: usize| format!("{},{},20", 39.5 + 1e-6 * row as f64, inside[1]);
    let window = [("flight.window_s", "[0.0, 0.5]"), ("tracker.kind", "linear")];
    let mut last = rows.clone();
    for (row, cells) in last.iter_mut().enumerate().skip(50) {
        *cells = beyond(row);
    }
    let loaded = load(header, &last, "ground", &window).unwrap();
    assert_eq!(loaded.log.report.without_ground.count, 10);
    assert!(
        loaded.warnings.iter().any(|warning| warning.contains("10 rows beyond the heights of the terrain"))
    );
    for (row, cells) in last.iter_mut().enumerate().skip(20) {
        *cells = beyond(row);
    }
    let error = load(header, &last, "ground", &window).unwrap_err().to_string();
    assert!(error.contains("line 22") && error.contains("terrain has no height there"), "{error}");
    let mut first = rows;
    first[0] = beyond(0);
    let error = load(header, &first, "takeoff", &window).unwrap_err().to_string();
    assert!(error.contains("line 2") && error.contains("terrain has no height there"), "{error}");
}

#[test]
fn the_flight_alone_is_that_of_the_sequence() {
    let rows: Vec<String> = flown().iter().map(|[lat, lon, _]| format!("{lat},{lon},80")).collect();
    let loaded = load("lat_deg,lon_deg,alt_m", &rows, "ground", &[]).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("log.csv");
    let lines: String = rows
        .iter()
        .enumerate()
        .map(|(row, cells)| format!("{},{cells},0,0,0\n", 0.04 * row as f64))
        .collect();
    fs::write(&file, format!("t_s,lat_deg,lon_deg,alt_m,roll_deg,pitch_deg,yaw_deg\n{lines}")).unwrap();
    let mut scenario = loaded.sequence.scenario.clone();
    scenario.flight.log = file;
    assert_eq!(load_flight(&scenario).unwrap().0, *loaded.log);
}
