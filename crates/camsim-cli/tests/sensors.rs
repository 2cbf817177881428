//! Sensors beside the camera through the command line: tables of `render`, of its shards, and of `track`.

#![allow(clippy::unwrap_used)]

use std::{collections::BTreeMap, ffi::OsString, fs, path::Path};

/// Runs camsim. Returns exit code and standard error.
fn camsim(args: &[&str]) -> (u8, String) {
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let args = std::iter::once("camsim").chain(args.iter().copied()).map(OsString::from);
    let code = camsim_cli::run(args, &mut out, &mut err);
    (code, String::from_utf8(err).unwrap())
}

const FLIGHT: &str = "[flight]\nlog = \"log.csv\"\nwindow_s = [3.0, 4.0]\n";
const IMU: &str = "[[imu]]\nname = \"imu0\"\ngyro = { noise_density = 1e-3, random_walk = 1e-4 }\n";

/// A board above which a platform turns for eight seconds.
fn write_scenario(folder: &Path, flight: &str, sensors: &str) {
    let row = |i: i32| {
        let t = f64::from(i) * 0.1;
        format!("{t},{},{},-3,{},2,{}\n", 0.2 * t, 0.1 * t, 2.0 * t, 9.0 * t)
    };
    let rows: String = (0..=80).map(row).collect();
    fs::write(folder.join("log.csv"), format!("t_s,n_m,e_m,d_m,roll_deg,pitch_deg,yaw_deg\n{rows}")).unwrap();
    let scenario = format!(
        "seed = 3\n{flight}[camera]\nsize_px = [32, 24]\nfocal_px = [30.0, 30.0]\nfps = 5.0\n\
         mount = {{ angles_deg = [0, -90, 0] }}\n[scene.board]\nkind = \"chessboard\"\ncolumns = 8\nrows = 5\n\
         size_m = 0.26\nangles_deg = [0.0, 0.0, 0.0]\n{sensors}"
    );
    fs::write(folder.join("s.toml"), scenario).unwrap();
}

fn on(folder: &Path, command: &str, to: &[&str], more: &[&str]) -> (u8, String) {
    let scenario = folder.join("s.toml").to_str().unwrap().to_owned();
    let out = folder.join(to[1]).to_str().unwrap().to_owned();
    camsim(&[&[command, &scenario, to[0], &out][..], more].concat())
}

/// Everything below `sensors`, by name.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(folder.join("sensors")).unwrap().map(|entry| entry.unwrap().path());
    entries
        .map(|path| (path.file_name().unwrap().to_str().unwrap().to_owned(), fs::read(path).unwrap()))
        .collect()
}

/// Stamps of a table.
fn stamps(path: &Path) -> Vec<i64> {
    let mut reader = csv::Reader::from_path(path).unwrap();
    let column = |record: csv::StringRecord, i: usize| record[i].parse().unwrap();
    let header = reader.headers().unwrap().clone();
    let at = header.iter().position(|name| name == "t_ns" || name == "stamp_ns").unwrap();
    reader.records().map(|record| column(record.unwrap(), at)).collect()
}

#[test]
fn render_its_shards_and_track_write_the_same_tables() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    let origin = "origin = [46.7, 9.85, 2100.0]\n";
    let others = "[[gnss]]\nname = \"gnss0\"\n[[barometer]]\nname = \"baro0\"\n\
        [[magnetometer]]\nname = \"mag0\"\ndate = \"2026-11-27\"\n";
    write_scenario(folder, &format!("{FLIGHT}{origin}"), &format!("{IMU}{others}"));
    let backend = ["--backend", "cpu", "-q"];
    let (code, err) = on(folder, "render", &["-o", "all"], &backend);
    assert_eq!(code, 0, "{err}");
    let all = files(&folder.join("all"));
    let names: Vec<&str> = all.keys().map(String::as_str).collect();
    assert_eq!(
        names,
        [
            "baro0.csv",
            "baro0.toml",
            "gnss0.csv",
            "gnss0.toml",
            "imu0.csv",
            "imu0.toml",
            "imu0_kalibr.yaml",
            "mag0.csv",
            "mag0.toml"
        ]
    );
    for shard in ["1/2", "2/2"] {
        let (code, err) =
            on(folder, "render", &["-o", "parts"], &[&backend[..], &["--shard", shard]].concat());
        assert_eq!(code, 0, "{err}");
        assert_eq!(files(&folder.join("parts")), all, "shard {shard}");
    }
    let (code, err) = on(folder, "track", &["--sensors", "tracked"], &[]);
    assert_eq!(code, 0, "{err}");
    assert_eq!(files(&folder.join("tracked")), all);
    // Inertial samples begin before the first frame and end after the last.
    let [imu, frames] = ["sensors/imu0.csv", "frames.csv"].map(|name| stamps(&folder.join("all").join(name)));
    assert_eq!(imu.len(), 601);
    assert!(imu[0] + 999_000_000 < frames[0] && frames[frames.len() - 1] + 999_000_000 < imu[600]);

    // Another sensor leaves the frames as they are, unless they are to be resumed.
    write_scenario(folder, &format!("{FLIGHT}{origin}"), &IMU.replace("imu0", "imu1"));
    let (code, err) = on(folder, "render", &["-o", "all"], &["--backend", "cpu"]);
    assert!(code == 0 && !err.contains("another scenario"), "{err}");
    let names: Vec<String> = files(&folder.join("all")).into_keys().collect();
    assert_eq!(names, ["imu1.csv", "imu1.toml", "imu1_kalibr.yaml"]);
}

#[test]
fn what_sensors_lack_is_said() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    let track = |flight: &str, sensors: &str| {
        write_scenario(folder, flight, sensors);
        on(folder, "track", &["--sensors", "out"], &[])
    };
    let (code, err) = track(FLIGHT, "");
    assert!(code == 2 && err.contains("--sensors: the scenario has none; add [[imu]]"), "{code} {err}");
    let (code, err) = track(FLIGHT, "[[gnss]]\nname = \"gnss0\"\n");
    assert!(code == 2 && err.contains("gnss \"gnss0\": latitude") && err.contains("flight.origin"), "{err}");
    let (code, err) = track(&format!("{FLIGHT}[tracker]\nkind = \"linear\"\n"), IMU);
    assert!(code == 0 && err.contains("velocities jump") && err.contains("9.80665 m/s^2"), "{err}");
    assert!(folder.join("out/sensors/imu0.csv").exists());
}
