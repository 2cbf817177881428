//! Output folders: moved, rendered in parts, interrupted.

#![allow(clippy::unwrap_used)]

mod program;

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use camsim_core::geodesy::{Geodetic, LocalFrame};
use glam::DVec3;
use program::{camsim, program, spawn, wait};

/// A camera so small that the reference renders it quickly.
const SMALL: [&str; 10] = [
    "--set",
    "camera.size_px=[32, 24]",
    "--set",
    "camera.focal_px=[21, 21]",
    "--set",
    "camera.principal_point_px=[15.5, 11.5]",
    "--set",
    "quality.max_error_dn=8",
    "--backend",
    "reference",
];

fn pattern() -> String {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../assets/pattern.toml")
        .canonicalize()
        .unwrap()
        .to_str()
        .unwrap()
        .to_owned()
}

/// Renders a small pattern into a folder.
fn render(base: &Path, out: &str, more: &[&str]) -> (i32, String) {
    let pattern = pattern();
    camsim(
        base,
        &[&["render", &pattern, "-o", out, "--outputs", "color,coords,depth,rows"][..], &SMALL, more]
            .concat(),
    )
}

fn files_below(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut all = BTreeMap::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = PathBuf::from(path.file_name().unwrap());
        if path.is_dir() {
            all.extend(files_below(&path).into_iter().map(|(below, bytes)| (name.join(below), bytes)));
        } else {
            all.insert(name, fs::read(&path).unwrap());
        }
    }
    all
}

/// Rows of `frames.csv` by the names of its columns.
fn frames(folder: &Path) -> Vec<BTreeMap<String, String>> {
    let text = fs::read_to_string(folder.join("frames.csv")).unwrap();
    let mut lines = text.lines();
    let columns: Vec<&str> = lines.next().unwrap().split(',').collect();
    lines
        .map(|line| {
            columns
                .iter()
                .zip(line.split(','))
                .map(|(column, cell)| ((*column).to_owned(), cell.to_owned()))
                .collect()
        })
        .collect()
}

fn numbers(folder: &Path) -> Vec<u64> {
    frames(folder).iter().map(|row| row["frame"].parse().unwrap()).collect()
}

/// Times of the first and the last row of a table, and the number of rows.
fn span_s(table: &Path) -> ([f64; 2], usize) {
    let text = fs::read_to_string(table).unwrap();
    let times: Vec<f64> =
        text.lines().skip(1).map(|line| line.split(',').next().unwrap().parse().unwrap()).collect();
    ([times[0], times[times.len() - 1]], times.len())
}

#[test]
fn trajectories_cover_the_frames_of_the_folder() {
    let base = tempfile::tempdir().unwrap();
    let out = base.path().join("out");
    // 23 of 24 parts of a readout of 33 ms, and an exposure of 8 ms, about the stamps; 30 frames and 400 ticks a second.
    let half_s = 0.5 * (0.033 * 23.0 / 24.0 + 0.008);
    let about = |first: f64, last: f64| [10.0 + first / 30.0 - half_s, 10.0 + last / 30.0 + half_s];
    let covers = |wanted: [f64; 2]| {
        for table in ["trajectory.csv", "camera_trajectory.csv"] {
            let (found, rows) = span_s(&out.join(table));
            assert!(found[0] <= wanted[0] && found[1] >= wanted[1], "{table}: {found:?} {wanted:?}");
            assert!(
                wanted[0] - found[0] < 0.003 && found[1] - wanted[1] < 0.003,
                "{table}: {found:?} {wanted:?}"
            );
            assert_eq!(rows, ((found[1] - found[0]) * 400.0).round() as usize + 1);
        }
    };
    for (more, wanted) in [
        (&["--frames", "2..4"][..], about(2.0, 3.0)),
        // Frames of both runs are in the folder.
        (&["--frames", "8", "--resume"], about(2.0, 8.0)),
        (&["--frames", "0", "--set", "output.trajectory=flight"], about(0.0, 59.0)),
        (&["--frames", "8", "--set", "imu=[{name = 'imu0'}]"], about(0.0, 59.0)),
    ] {
        let (code, err) = render(base.path(), "out", more);
        assert_eq!(code, 0, "{err}");
        covers(wanted);
    }
    assert_eq!(numbers(&out), [0, 2, 3, 8]);
}

/// The summary counts every table, and large ones are told before the first frame.
#[test]
fn the_size_of_a_run_is_told_with_its_tables() {
    let base = tempfile::tempdir().unwrap();
    let (code, err) = render(
        base.path(),
        "out",
        &["--frames", "0", "--set", "output.trajectory=flight", "--set", "tracker.rate_hz=50000"],
    );
    assert_eq!(code, 0, "{err}");
    let size = |name: &str| fs::metadata(base.path().join("out").join(name)).unwrap().len() as f64;
    let told = format!("{:.1} MB", 1e-6 * (size("trajectory.csv") + size("camera_trajectory.csv")));
    assert!(err.contains(&format!("trajectories and sensors in out take {told}")), "{told}: {err}");
}

#[test]
fn frames_of_a_flight_on_earth_have_latitude_and_longitude() {
    let base = tempfile::tempdir().unwrap();
    let (code, err) = render(base.path(), "out", &["--frames", "3"]);
    assert_eq!(code, 0, "{err}");
    let row = &frames(&base.path().join("out"))[0];
    let value = |name: &str| row[name].parse::<f64>().unwrap();
    let earth = LocalFrame::new(Geodetic::from_deg(38.9492, -107.0698, 2810.0));
    let position = Geodetic::from_deg(value("lat_deg"), value("lon_deg"), value("height_m"));
    let away_m = earth.ned_from_geodetic(position) - DVec3::new(value("n"), value("e"), value("d"));
    assert!(away_m.length() < 1e-6, "{away_m}");
}

#[test]
fn copied_folder_reproduces_the_same_bytes() {
    let base = tempfile::tempdir().unwrap();
    let path = |name: &str| base.path().join(name);
    camsim_io::builtin::unpack(&path("made/demo/scene")).unwrap();
    let more =
        [&SMALL[..], &["--frames", "0..3", "--outputs", "color,coords,rows", "--format", "exr,png"]].concat();
    let (code, err) =
        camsim(&path("made"), &[&["render", "demo/scene/demo.toml", "-o", "demo"][..], &more].concat());
    assert_eq!(code, 0, "{err}");
    let made = files_below(&path("made/demo"));
    let run = String::from_utf8(made[Path::new("run.json")].clone()).unwrap();
    assert!(
        run.contains("\"log\": \"scene/demo_flight.csv\"")
            && run.contains("\"scene/demo_dem.tif\": ")
            && !run.contains("../"),
        "{run}"
    );
    assert!(!run.contains(base.path().to_str().unwrap()), "{run}");
    let camera = String::from_utf8(made[Path::new("camera.toml")].clone()).unwrap();
    assert!(camera.contains("vignette = \"scene/vignette.png\""), "{camera}");

    // At another path, without the first folder, from another working directory, by the folder's own
    // scenario.
    fs::create_dir_all(path("far/away")).unwrap();
    fs::create_dir_all(path("work")).unwrap();
    fs::rename(path("made/demo"), path("far/away/copy")).unwrap();
    fs::remove_dir_all(path("made")).unwrap();
    let frames = ["--frames", "0..3"];
    let (code, err) = camsim(
        &path("work"),
        &[&["render", "../far/away/copy/run.json", "-o", "again"][..], &frames].concat(),
    );
    assert_eq!(code, 0, "{err}");
    let again = files_below(&path("work/again"));
    for (name, bytes) in made.iter().filter(|(name, _)| !name.starts_with("scene")) {
        // These two contain relative paths, and the vignette was copied.
        if !["run.json", "camera.toml"].contains(&name.to_str().unwrap()) {
            assert_eq!(Some(bytes), again.get(name), "{}", name.display());
        }
    }
    assert_eq!(again[Path::new("inputs/vignette.png")], made[Path::new("scene/vignette.png")]);
    // Rendering into the same folder changes no byte, and existing frames are skipped.
    let (code, err) =
        camsim(&path("far"), &[&["render", "away/copy/run.json", "-o", "away/copy"][..], &frames].concat());
    assert_eq!(code, 0, "{err}");
    assert!(files_below(&path("far/away/copy")) == made);
    let (code, err) =
        camsim(&path("far/away/copy"), &["render", "run.json", "-o", ".", "--frames", "0..4", "--resume"]);
    assert_eq!(code, 0, "{err}");
    let run: serde_json::Value =
        serde_json::from_slice(&fs::read(path("far/away/copy/run.json")).unwrap()).unwrap();
    assert_eq!((run["written"].as_u64(), run["skipped"].as_u64()), (Some(1), Some(3)));

    // The camera file of either folder.
    for (folder, camera) in [("work", "again/camera.toml"), ("far", "away/copy/camera.toml")] {
        let (code, err) = camsim(&path(folder), &["lens", camera, "check"]);
        assert_eq!(code, 0, "{err}");
        fs::write(
            path(folder).join("F.toml"),
            "color = \"p.png\"\nfocal_px = [30.0, 30.0]\n[motion]\nangular_rate_rad_s = [0.0, 0.0, 0.1]\n",
        )
        .unwrap();
        fs::copy(path("far/away/copy/scene/acircles.png"), path(folder).join("p.png")).unwrap();
        let (code, err) = camsim(&path(folder), &["apply", camera, "F.toml", "-o", "applied.png"]);
        assert_eq!(code, 0, "{err}");
    }
}

#[test]
fn partial_runs_share_one_table_and_scenarios_are_not_mixed() {
    let base = tempfile::tempdir().unwrap();
    let path = |name: &str| base.path().join(name);
    let done = |out: &str, more: &[&str]| {
        let (code, err) = render(base.path(), out, more);
        assert_eq!(code, 0, "{err}");
        err
    };
    done("whole", &["--frames", "2..8"]);
    done("parts", &["--frames", "2..5"]);
    assert_eq!(numbers(&path("parts")), [2, 3, 4]);
    done("parts", &["--frames", "4..8"]);
    assert_eq!(fs::read(path("parts/frames.csv")).unwrap(), fs::read(path("whole/frames.csv")).unwrap());
    // Two concurrent runs.
    let pattern = pattern();
    let shard = |shard: &str| {
        let args = [
            "render",
            &pattern,
            "-o",
            "shards",
            "--outputs",
            "color,coords,depth,rows",
            "--frames",
            "2..8",
            "--shard",
            shard,
        ];
        spawn(base.path(), &[&args[..], &SMALL].concat())
    };
    for child in ["1/3", "2/3", "3/3"].map(shard) {
        let (code, err) = wait(child);
        assert_eq!(code, 0, "{err}");
    }
    assert_eq!(fs::read(path("shards/frames.csv")).unwrap(), fs::read(path("whole/frames.csv")).unwrap());
    // Deleted frames are not listed, and a deleted table is restored from the existing frames.
    fs::remove_file(path("parts/color/frame_000003.exr")).unwrap();
    done("parts", &["--frames", "7", "--resume"]);
    let rows = frames(&path("parts"));
    assert!(
        rows[1]["frame"] == "3"
            && rows[1]["color_exr"].is_empty()
            && rows[1]["depth"] == "depth/frame_000003.exr",
        "{rows:?}"
    );
    fs::remove_file(path("parts/frames.csv")).unwrap();
    done("parts", &["--frames", "2..8", "--resume"]);
    assert_eq!(fs::read(path("parts/frames.csv")).unwrap(), fs::read(path("whole/frames.csv")).unwrap());
    // Another channel of the same frames is added.
    let channel = camsim(
        base.path(),
        &[&["render", &pattern, "-o", "parts", "--outputs", "valid", "--frames", "2..4"][..], &SMALL]
            .concat(),
    );
    assert_eq!(channel.0, 0, "{}", channel.1);
    let rows = frames(&path("parts"));
    assert!(
        rows.len() == 6
            && rows[0]["valid"] == "valid/frame_000002.png"
            && rows[0]["coords"] == "coords/frame_000002.exr",
        "{rows:?}"
    );
    assert!(rows[5]["valid"].is_empty(), "{rows:?}");

    // Another scenario among these frames is refused before anything is changed ...
    let before = files_below(&path("whole"));
    let (code, err) = render(base.path(), "whole", &["--frames", "2..4", "--set", "seed=99"]);
    assert!(
        code == 2
            && err.contains("seed was 12, now 99")
            && err.contains("20 files of other frames would remain (color/frame_000004.exr is the first)"),
        "{err}"
    );
    assert!(files_below(&path("whole")) == before);
    // ... and if it replaces all of them, no old frame remains.
    let err = done("whole", &["--frames", "2..8", "--set", "seed=99"]);
    assert!(err.contains("its frames are replaced"), "{err}");
    assert_eq!(numbers(&path("whole")), [2, 3, 4, 5, 6, 7]);
    assert!(
        fs::read(path("whole/color/frame_000002.exr")).unwrap()
            == before[Path::new("color/frame_000002.exr")],
        "the pattern has no noise"
    );
    // Frames of unknown origin.
    fs::remove_file(path("whole/run.json")).unwrap();
    let (code, err) = render(base.path(), "whole", &["--frames", "2..8", "--resume"]);
    assert!(code == 2 && err.contains("no run.json that describes their origin"), "{err}");
    let (code, err) = render(base.path(), "whole", &["--frames", "2..4"]);
    assert!(code == 2 && err.contains("no run.json that describes their origin"), "{err}");
}

/// Waits until a running child has written more than `least` frames.
#[cfg(unix)]
fn wait_for_frames(out: &Path, least: usize) -> usize {
    let begin = Instant::now();
    loop {
        let files = fs::read_dir(out.join("rows")).map_or(0, |files| {
            files.flatten().filter(|file| !file.file_name().to_string_lossy().starts_with('.')).count()
        });
        if files > least {
            return files;
        }
        assert!(begin.elapsed() < Duration::from_secs(120), "no frame came");
        #[allow(clippy::disallowed_methods, reason = "files of another process tell nobody when they come")]
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[cfg(unix)]
fn send(child: &std::process::Child, signal: rustix::process::Signal) {
    let process = rustix::process::Pid::from_raw(child.id() as i32).unwrap();
    rustix::process::kill_process(process, signal).unwrap();
}

/// What a script has started in the background goes on after Ctrl-C, and SIGTERM stops it after a frame.
#[cfg(target_os = "linux")]
#[test]
fn a_run_in_the_background_is_stopped_by_sigterm() {
    let base = tempfile::tempdir().unwrap();
    let out = base.path().join("out");
    let pattern = pattern();
    let args = [
        &["render", &pattern, "-o", "out", "--outputs", "color,rows"][..],
        &SMALL,
        &["--set", "camera.size_px=[64, 48]"],
    ]
    .concat();
    let child = program::in_background(base.path(), &args).spawn().unwrap();
    let before = wait_for_frames(&out, 0);
    send(&child, rustix::process::Signal::INT);
    // The frames under way, and more.
    wait_for_frames(&out, before + 8);
    send(&child, rustix::process::Signal::TERM);
    let (code, err) = wait(child);
    assert_eq!(code, 130, "{err}");
    assert_eq!(err.matches("stopping after the frames that are under way").count(), 1, "{err}");
    assert!(err.contains("to resume: camsim render "), "{err}");
    let run: serde_json::Value = serde_json::from_slice(&fs::read(out.join("run.json")).unwrap()).unwrap();
    assert_eq!(run["finished"].as_bool(), Some(false));
}

#[cfg(unix)]
#[test]
fn interrupted_run_reports_progress_and_resume_command() {
    let base = tempfile::tempdir().unwrap();
    let out = base.path().join("my out");
    let pattern = pattern();
    // A run long enough to be interrupted.
    let args = [
        &["render", &pattern, "-o", "my out", "--outputs", "color,rows"][..],
        &SMALL,
        &["--set", "camera.size_px=[64, 48]"],
    ]
    .concat();
    let child = spawn(base.path(), &args);
    wait_for_frames(&out, 1);
    send(&child, rustix::process::Signal::INT);
    let (code, err) = wait(child);
    assert_eq!(code, 130, "{err}");
    assert!(err.contains("stopping after the frames that are under way"), "{err}");
    let message = err.lines().find(|line| line.starts_with("stopped: ")).unwrap_or_else(|| panic!("{err}"));
    let done = wait_for_frames(&out, 1);
    assert!(
        done < 60
            && message.starts_with(&format!(
                "stopped: {done} of 60 frames are in my out; to resume: camsim render "
            )),
        "{message}"
    );
    assert!(
        message.contains(" -o 'my out' ")
            && message.contains("--set 'camera.size_px=[64, 48]'")
            && message.ends_with(" --resume"),
        "{message}"
    );
    // Exactly the written frames are listed.
    assert_eq!(numbers(&out), (0..done as u64).collect::<Vec<_>>());
    assert!(
        frames(&out)
            .iter()
            .all(|row| out.join(&row["color_exr"]).is_file() && out.join(&row["rows"]).is_file())
    );
    let run: serde_json::Value = serde_json::from_slice(&fs::read(out.join("run.json")).unwrap()).unwrap();
    assert_eq!((run["finished"].as_bool(), run["written"].as_u64()), (Some(false), Some(done as u64)));
    assert!(files_below(&out).keys().all(|name| !name.to_string_lossy().contains(".tmp")));
    let (code, err) = camsim(base.path(), &[&args[..], &["--frames", "..20", "--resume"]].concat());
    assert_eq!(code, 0, "{err}");
    assert_eq!(numbers(&out), (0..(done as u64).max(20)).collect::<Vec<_>>());
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn unknown_adapter_lists_available_ones() {
    let base = tempfile::tempdir().unwrap();
    let adapters = camsim_engine::adapters(camsim_engine::AdapterChoice::Best);
    let (code, err) =
        wait(program(base.path(), &["info"]).env("CAMSIM_ADAPTER", "no such thing").spawn().unwrap());
    assert!(
        code == 3 && err.contains("no adapter has `no such thing` in its name (CAMSIM_ADAPTER): there is "),
        "{err}"
    );
    // The list of this process, which may be shorter.
    assert!(
        adapters.iter().all(|adapter| err.contains(&adapter.to_string())) && !adapters.is_empty(),
        "{err}"
    );
}

#[test]
fn a_video_that_cannot_be_made_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/pattern.toml");
    let args = [
        "render",
        scenario.to_str().unwrap(),
        "-o",
        "out",
        "--frames",
        "0..2",
        "--backend",
        "cpu",
        "--format",
        "mp4",
    ];
    // No program is found.
    let (code, err) = wait(program(folder.path(), &args).env("PATH", folder.path()).spawn().unwrap());
    assert!(code == 2 && err.contains("ffmpeg, which is not on the PATH"), "{code} {err}");
    assert!(!folder.path().join("out").exists());
    let spaced = [&args[..3], &["out", "--frames", "0,1,3", "--backend", "cpu", "--format", "y4m"]].concat();
    let (code, err) = camsim(folder.path(), &spaced);
    assert!(code == 2 && err.contains("at equal distances"), "{code} {err}");
    assert!(!folder.path().join("out").exists());
}

#[test]
fn exposures_follow_the_flight_whatever_is_rendered() {
    let base = tempfile::tempdir().unwrap();
    let path = |name: &str| base.path().join(name);
    let sets = ["shutter.exposure_ms=5", "auto_exposure.start=nominal", "auto_exposure.target=0.1"];
    let sets = sets.map(|set| format!("camera.{set}"));
    let auto: Vec<&str> = sets.iter().flat_map(|set| ["--set", set]).collect();
    let done = |out: &str, more: &[&str]| {
        let (code, err) = render(base.path(), out, &[&auto[..], more].concat());
        assert_eq!(code, 0, "{err}");
    };
    done("whole", &["--frames", "0..7"]);
    done("parts", &["--frames", "5..7"]);
    let files =
        |out: &str, frame: u64| fs::read(path(out).join(format!("color/frame_{frame:06}.exr"))).unwrap();
    assert!(files("parts", 5) == files("whole", 5) && files("parts", 6) == files("whole", 6));
    done("parts", &["--frames", "0..7", "--resume"]);
    assert_eq!(fs::read(path("parts/frames.csv")).unwrap(), fs::read(path("whole/frames.csv")).unwrap());
    // Frame by frame shorter, by a fifth of the logarithm of what is missing.
    let times: Vec<f64> =
        frames(&path("whole")).iter().map(|row| row["exposure_ms"].parse().unwrap()).collect();
    assert_eq!(times[0], 5.0);
    assert!(times.windows(2).all(|pair| pair[1] < pair[0]), "{times:?}");
    assert!(frames(&path("whole")).iter().all(|row| row["gain"] == "1"));
    // Another exposure is another scenario.
    let (code, _) = render(base.path(), "parts", &["--frames", "0..7", "--resume"]);
    assert_ne!(code, 0);
}
