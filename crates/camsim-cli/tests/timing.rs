//! Runs with faults of the timing: dropped, doubled and late frames, and wrong stamps.

#![allow(clippy::unwrap_used)]

use std::{collections::BTreeMap, ffi::OsString, fs, path::Path};

/// Runs camsim. Returns exit code, standard output and standard error.
fn camsim(args: &[&str]) -> (u8, String, String) {
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let args = std::iter::once("camsim").chain(args.iter().copied()).map(OsString::from);
    let code = camsim_cli::run(args, &mut out, &mut err);
    (code, String::from_utf8(out).unwrap(), String::from_utf8(err).unwrap())
}

fn render(folder: &Path, more: &[&str]) -> (u8, String, String) {
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/pattern.toml");
    let common = [
        "render",
        scenario.to_str().unwrap(),
        "-o",
        folder.to_str().unwrap(),
        "--outputs",
        "color,rows",
        "--format",
        "png",
        "--backend",
        "cpu",
        "--set",
        "camera.size_px=[48, 36]",
        "--set",
        "camera.focal_px=[32, 32]",
        "--set",
        "camera.principal_point_px=[23.5, 17.5]",
        "--set",
        "camera.photometric.noise_sigma=0.02",
        "--set",
        "output.stamps=zero",
        "--set",
        "output.epoch_ns=1000000000",
    ];
    camsim(&[&common[..], more].concat())
}

const FAULTS: [&str; 14] = [
    "--set",
    "camera.timing.drop=[2, 5]",
    "--set",
    "camera.timing.double=[4, 6]",
    "--set",
    "camera.timing.late_ms=4",
    "--set",
    "camera.timing.jitter_ms=0.5",
    "--set",
    "camera.timing.drift_ppm=100",
    "--set",
    "camera.clock_offset_ms=7",
    "--frames",
    "0..8",
];

/// Columns of a table by the first one.
fn table(path: &Path) -> BTreeMap<String, BTreeMap<String, String>> {
    let text = fs::read_to_string(path).unwrap();
    let mut lines = text.lines().map(|line| line.split(',').map(str::to_owned));
    let header: Vec<String> = lines.next().unwrap().collect();
    lines
        .map(|line| {
            let row: BTreeMap<String, String> = header.iter().cloned().zip(line).collect();
            (row[&header[0]].clone(), row)
        })
        .collect()
}

#[test]
fn dropped_frames_leave_their_numbers_and_doubled_ones_repeat_the_picture() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path().join("whole");
    let (code, out, err) = render(&folder, &FAULTS);
    assert!(code == 0 && out.starts_with("6 frames in"), "{out}{err}");
    let file = |frame: u64, channel: &str, ending: &str| {
        fs::read(folder.join(format!("{channel}/frame_{frame:06}.{ending}")))
    };
    for frame in 0..8 {
        assert_eq!(file(frame, "color", "png").is_ok(), ![2, 5].contains(&frame), "{frame}");
    }
    // 4 repeats 3, and 6, before which 5 is missing, repeats 4: noise and true times included.
    for (again, first) in [(4, 3), (6, 3)] {
        for (channel, ending) in [("color", "png"), ("rows", "csv")] {
            assert_eq!(
                file(again, channel, ending).unwrap(),
                file(first, channel, ending).unwrap(),
                "{again} {channel}"
            );
        }
    }
    assert_ne!(file(7, "color", "png").unwrap(), file(3, "color", "png").unwrap());
    let frames = table(&folder.join("frames.csv"));
    let numbers: Vec<&str> = frames.keys().map(String::as_str).collect();
    assert_eq!(numbers, ["0", "1", "3", "4", "6", "7"]);
    let timing = table(&folder.join("timing.csv"));
    let ns = |row: &BTreeMap<String, String>, column: &str| row[column].parse::<i64>().unwrap();
    for (frame, delivery, picture) in [("1", "own", "1"), ("2", "dropped", "2"), ("6", "doubled", "3")] {
        let row = &timing[frame];
        assert_eq!((row["delivery"].as_str(), row["picture"].as_str()), (delivery, picture));
    }
    for (frame, row) in &frames {
        let (number, row_of_timing) = (frame.parse::<i64>().unwrap(), &timing[frame]);
        assert_eq!(row["stamp_ns"], row_of_timing["stamp_ns"]);
        let nominal_ns = 1_000_000_000 + (number as f64 * 1e9 / 30.0).round() as i64;
        assert!((ns(row_of_timing, "nominal_ns") - nominal_ns).abs() <= 1, "{row_of_timing:?}");
        // 7 ms ahead, 100 ppm, and five times 0.5 ms at random.
        assert!((ns(row, "stamp_ns") - nominal_ns - 7_000_000).abs() < 2_600_000, "{row:?}");
        assert_ne!(ns(row, "stamp_ns"), nominal_ns + 7_000_000);
        // The rows' times are those of the trigger, on the camera's clock but for its faults.
        let picture = &timing[&row_of_timing["picture"]];
        let late_ns = ns(picture, "trigger_ns") - ns(picture, "nominal_ns");
        assert!((0..4_000_000).contains(&late_ns) && picture["trigger_ns"] == row_of_timing["trigger_ns"]);
        let rows = table(&folder.join(&row["rows"]));
        let middle_ns = (ns(&rows["17"], "t_mid_ns") + ns(&rows["18"], "t_mid_ns")) / 2;
        let delay_ns = ns(row_of_timing, "trigger_ns") + 7_000_000 - middle_ns;
        assert!((delay_ns - delay_ns_of(&folder)).abs() <= 2, "{frame}: {delay_ns}");
    }
}

fn delay_ns_of(folder: &Path) -> i64 {
    let run: serde_json::Value = serde_json::from_slice(&fs::read(folder.join("run.json")).unwrap()).unwrap();
    (run["scenario"]["camera"]["shutter"]["delay_ms"].as_f64().unwrap() * 1e6).round() as i64
}

#[test]
fn parts_of_a_run_with_faults_are_those_of_the_whole() {
    let temporary = tempfile::tempdir().unwrap();
    let (whole, parts, two) =
        (temporary.path().join("whole"), temporary.path().join("parts"), temporary.path().join("two"));
    assert_eq!(render(&whole, &FAULTS).0, 0);
    // In two halves, the second of which begins with a doubled frame.
    for frames in ["0..6", "6..8"] {
        let faults = [&FAULTS[..12], &["--frames", frames, "--resume"]].concat();
        let (code, out, err) = render(&parts, &faults);
        assert!(code == 0, "{out}{err}");
    }
    for shard in ["1/2", "2/2"] {
        let folder = two.join(shard.replace('/', "-of-"));
        let (code, out, err) = render(&folder, &[&FAULTS[..], &["--shard", shard]].concat());
        assert!(code == 0, "{out}{err}");
    }
    let merged = two.join("merged");
    let shards = ["1-of-2", "2-of-2"].map(|name| two.join(name));
    let (code, out, err) = camsim(&[
        "merge",
        shards[0].to_str().unwrap(),
        shards[1].to_str().unwrap(),
        "-o",
        merged.to_str().unwrap(),
    ]);
    assert!(code == 0, "{out}{err}");
    for folder in [&parts, &merged] {
        for file in ["frames.csv", "timing.csv", "color/frame_000006.png", "rows/frame_000006.csv"] {
            assert_eq!(fs::read(folder.join(file)).unwrap(), fs::read(whole.join(file)).unwrap(), "{file}");
        }
    }
    // Nothing is left to do, and a scenario without faults leaves no table of them behind.
    let (code, out, err) = render(&whole, &[&FAULTS[..], &["--resume"]].concat());
    assert!(code == 0 && out.contains("0 frames (6 existed)"), "{out}{err}");
    let (code, out, err) = render(&whole, &["--frames", "0..8"]);
    assert!(code == 0 && !whole.join("timing.csv").exists(), "{out}{err}");
}

#[test]
fn videos_with_dropped_frames_are_refused() {
    let temporary = tempfile::tempdir().unwrap();
    let (code, _, err) = render(temporary.path(), &["--format", "y4m", "--set", "camera.timing.drop=[2]"]);
    assert!(code == 2 && err.contains("a video needs frames at equal distances"), "{err}");
}

#[test]
fn exported_stamps_are_faulty_and_exported_poses_true() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path().join("run");
    let more = [&FAULTS[..], &["--outputs", "color,rows,depth"]].concat();
    let more: Vec<&str> = more.into_iter().collect();
    let (code, out, err) = render(&folder, &more);
    assert!(code == 0, "{out}{err}");
    let export = temporary.path().join("tum");
    let (code, out, err) =
        camsim(&["export", folder.to_str().unwrap(), "--as", "tum", "-o", export.to_str().unwrap()]);
    assert!(code == 0, "{out}{err}");
    let times = |file: &str| -> Vec<f64> {
        let text = fs::read_to_string(export.join(file)).unwrap();
        let lines = text.lines().filter(|line| !line.starts_with('#'));
        lines.map(|line| line.split(' ').next().unwrap().parse().unwrap()).collect()
    };
    let (pictures, poses) = (times("rgb.txt"), times("groundtruth.txt"));
    let timing = table(&folder.join("timing.csv"));
    let delay_s = 1e-9 * delay_ns_of(&folder) as f64;
    for (i, frame) in ["0", "1", "3", "4", "6", "7"].into_iter().enumerate() {
        let s = |column: &str| 1e-9 * timing[frame][column].parse::<i64>().unwrap() as f64;
        assert!((poses[i] - (s("trigger_ns") - delay_s)).abs() < 5e-9, "{frame}: {}", poses[i]);
        assert!((pictures[i] - (s("stamp_ns") - 7e-3 - delay_s)).abs() < 5e-9, "{frame}: {}", pictures[i]);
    }
}
