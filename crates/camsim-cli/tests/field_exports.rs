//! Problematic exports of users (`data/field-2`): names that do not sort, stamps before 0, baselines, rigs with cameras
//! without frames.

#![allow(clippy::unwrap_used)]

use std::{
    ffi::OsString,
    fs,
    path::{Path, PathBuf},
};

/// Runs camsim. Returns exit code, standard output and standard error.
fn camsim(args: &[&str]) -> (u8, String, String) {
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let args = std::iter::once("camsim").chain(args.iter().copied()).map(OsString::from);
    let code = camsim_cli::run(args, &mut out, &mut err);
    (code, String::from_utf8(out).unwrap(), String::from_utf8(err).unwrap())
}

fn case(folder: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/field-2").join(folder).join("s.toml")
}

/// Exports the frames of a case; returns the folder of the export, and standard error.
fn exported(base: &Path, folder: &str, layout: &str, more: &[&str]) -> (PathBuf, String) {
    let out = base.join(layout);
    let (scenario, target) = (case(folder), out.to_str().unwrap().to_owned());
    let args = ["export", scenario.to_str().unwrap(), "--as", layout, "-o", &target, "--backend", "cpu"];
    let (code, _, err) = camsim(&[&args, more].concat());
    assert_eq!(code, 0, "{folder} as {layout}: {err}");
    (out, err)
}

fn read(path: PathBuf) -> String {
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn files(folder: PathBuf) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<String> =
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn names_of_pictures_sort_as_their_times() {
    let base = tempfile::tempdir().unwrap();
    let (out, _) = exported(base.path(), "42-euroc-names-unpadded", "euroc", &["--frames", "0..12"]);
    let names = files(out.join("mav0/cam0/data"));
    let times: Vec<i64> =
        names.iter().map(|name| name.strip_suffix(".png").unwrap().parse().unwrap()).collect();
    assert!(names.len() == 12 && times.is_sorted(), "{names:?}");
    let listed: Vec<String> = read(out.join("mav0/cam0/data.csv"))
        .lines()
        .skip(1)
        .map(|line| line.split_once(',').unwrap().1.to_owned())
        .collect();
    assert_eq!(listed, names);
}

#[test]
fn samples_before_zero_are_not_lost() {
    let base = tempfile::tempdir().unwrap();
    let frames = ["--frames", "0..2"];
    let (out, err) = exported(base.path(), "43-mcap-drops-negative-stamps", "mcap", &frames);
    assert!(err.contains("output.epoch_ns = 2000000000"), "{err}");
    let bytes = fs::read(out.join("camsim.mcap")).unwrap();
    let inertial = mcap::MessageStream::new(&bytes)
        .unwrap()
        .filter(|message| message.as_ref().unwrap().channel.topic == "/imu0")
        .count();
    let rows = read(out.join("camsim/sensors/imu0.csv")).lines().count() - 1;
    assert_eq!(inertial, rows);
    let (out, err) = exported(base.path(), "43-mcap-drops-negative-stamps", "kalibr", &frames);
    assert!(err.contains("output.epoch_ns = 2000000000"), "{err}");
    let table = read(out.join("imu0.csv"));
    assert_eq!(table.lines().count() - 1, rows);
    assert!(table.lines().all(|line| !line.starts_with('-')), "{table}");
}

#[test]
fn a_stereo_pair_has_its_baseline() {
    let base = tempfile::tempdir().unwrap();
    let (out, _) = exported(base.path(), "44-stereo-baseline-exports", "kitti", &["--frames", "0..2"]);
    let text = read(out.join("sequences/00/calib.txt"));
    let row = |name: &str| -> Vec<f64> {
        let line = text.lines().find_map(|line| line.strip_prefix(name)).unwrap();
        line.split_whitespace().map(|cell| cell.parse().unwrap()).collect()
    };
    // 120 px times 0.12 m.
    assert!((row("P1:")[3] + 14.4).abs() < 1e-9 && (row("P3:")[3] + 14.4).abs() < 1e-9, "{text}");
    assert!(row("P0:")[3] == 0.0 && row("P2:")[3] == 0.0, "{text}");
    assert_eq!(files(out.join("sequences")), ["00"]);
    for folder in ["image_0", "image_1", "image_2", "image_3"] {
        assert_eq!(files(out.join("sequences/00").join(folder)), ["000000.png", "000001.png"]);
    }
}

#[test]
fn cameras_are_chosen_by_name_and_left_out_without_frames() {
    let base = tempfile::tempdir().unwrap();
    let (out, err) = exported(
        base.path(),
        "44-stereo-baseline-exports",
        "tum",
        &["--frames", "0..2", "--camera", "right"],
    );
    assert_eq!(files(out.join("rgb")).len(), 2, "one camera has no prefix: {err}");
    assert!(read(out.join("README.md")).contains("camera `right`"));
    let run = out.join("camsim");
    let other = base.path().join("other");
    let [run, other] = [&run, &other].map(|path| path.to_str().unwrap());
    let (code, _, err) = camsim(&["export", run, "--as", "euroc", "-o", other, "--camera", "left"]);
    assert!(code == 2 && err.contains("--camera left") && err.contains("right"), "{err}");
    // The slower camera has no frame 9.
    let slow = base.path().join("slow");
    fs::create_dir_all(slow.join("case")).unwrap();
    let folder = case("44-stereo-baseline-exports");
    let text = read(folder.clone());
    let offset = text.rfind("fps = 10.0").unwrap();
    fs::write(slow.join("case/s.toml"), format!("{}fps = 0.5{}", &text[..offset], &text[offset + 10..]))
        .unwrap();
    fs::copy(folder.with_file_name("f.csv"), slow.join("case/f.csv")).unwrap();
    fs::copy(folder.parent().unwrap().with_file_name("acircles.png"), slow.join("acircles.png")).unwrap();
    let (scenario, target) = (slow.join("case/s.toml"), slow.join("out"));
    let [scenario, target] = [&scenario, &target].map(|path| path.to_str().unwrap());
    let args = ["export", scenario, "--as", "euroc", "-o", target, "--frames", "25..27", "--backend", "cpu"];
    let (code, printed, err) = camsim(&args);
    assert_eq!(code, 0, "{err}");
    assert!(err.contains("warning: no frames of right"), "{err}");
    assert!(printed.contains("euroc of 2 pictures written"), "{printed}");
}
