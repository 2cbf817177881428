//! Rigs of several cameras through the command line: folders, bytes, resumed and repeated runs.

#![allow(clippy::unwrap_used)]

mod program;

use std::{
    collections::BTreeMap,
    fs,
    path::Path,
    time::{Duration, Instant},
};

use program::{spawn, wait};

/// Runs camsim. Returns exit code, standard output and standard error.
fn camsim(args: &[&str]) -> (u8, String, String) {
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let args = std::iter::once("camsim").chain(args.iter().copied()).map(Into::into);
    let code = camsim_cli::run(args, &mut out, &mut err);
    (code, String::from_utf8(out).unwrap(), String::from_utf8(err).unwrap())
}

/// A pair: the right camera has other optics, half the rate, and a clock of its own.
const PAIR: &str = r#"
[[cameras]]
name = "left"
size_px = [64, 48]
focal_px = [42.0, 42.0]
fps = 20.0
mount = { angles_deg = [0.0, -90.0, 0.0] }
shutter = { readout_ms = 20.0, exposure_ms = 8.0 }
photometric = { noise_sigma = 0.01 }

[[cameras]]
name = "right"
file = "right_camera.toml"
fps = 10.0
clock_offset_ms = 2.5
mount = { angles_deg = [0.0, -90.0, 0.0], offset_m = [0.0, 0.4, 0.0] }
"#;
const RIGHT_CAMERA: &str = r#"
size_px = [48, 40]
focal_px = [30.0, 30.0]
shutter = { readout_ms = 10.0 }
photometric = { noise_sigma = 0.01, vignette = "vignette.png" }
lens = { model = "brown-conrady", coefficients = [-0.1, 0.02] }
"#;

/// A scenario over the pattern with these cameras, in a folder of its own.
fn scenario(base: &Path, cameras: &str, more: &str) -> String {
    camsim_io::builtin::unpack(base).unwrap();
    fs::write(base.join("right_camera.toml"), RIGHT_CAMERA).unwrap();
    let text = fs::read_to_string(base.join("pattern.toml")).unwrap();
    let (head, tail) = (&text[..text.find("[camera]").unwrap()], &text[text.find("[scene]").unwrap()..]);
    let path = base.join("rig.toml");
    let tail = tail.replace("\"exr\", \"png\"", "\"png\"");
    fs::write(&path, format!("{head}{cameras}{tail}{more}")).unwrap();
    path.to_str().unwrap().to_owned()
}

fn render(scenario: &str, folder: &Path, more: &[&str]) -> (u8, String, String) {
    let common = ["render", scenario, "-o", folder.to_str().unwrap(), "--backend", "cpu"];
    camsim(&[&common[..], more].concat())
}

/// Files below a folder by their names.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut all = BTreeMap::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        if path.is_dir() {
            all.extend(files(&path).into_iter().map(|(below, bytes)| (format!("{name}/{below}"), bytes)));
        } else {
            all.insert(name, fs::read(&path).unwrap());
        }
    }
    all
}

/// As [`files`], without the records of runs.
fn results(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    files(folder).into_iter().filter(|(name, _)| !name.ends_with(".json")).collect()
}

#[track_caller]
fn assert_alike(a: &BTreeMap<String, Vec<u8>>, b: &BTreeMap<String, Vec<u8>>) {
    assert_eq!(a.keys().collect::<Vec<_>>(), b.keys().collect::<Vec<_>>());
    a.iter().for_each(|(name, bytes)| assert!(b[name] == *bytes, "{name}"));
}

fn run_json(folder: &Path) -> serde_json::Value {
    serde_json::from_slice(&fs::read(folder.join("run.json")).unwrap()).unwrap()
}

/// Cells of a table.
fn table(path: &Path) -> Vec<Vec<String>> {
    let text = fs::read_to_string(path).unwrap();
    text.lines().skip(1).map(|line| line.split(',').map(str::to_owned).collect()).collect()
}

#[test]
fn a_rig_is_rendered_as_its_cameras_alone() {
    let base = tempfile::tempdir().unwrap();
    let path = |name: &str| base.path().join(name);
    let twin = "[[output.twin]]\nname = \"sharp\"\nexposure = false\n";
    let scenario = scenario(base.path(), PAIR, twin);
    let (code, out, err) = render(&scenario, &path("out"), &["--frames", "2..24", "--times"]);
    assert_eq!(code, 0, "{err}");
    // Two seconds: 40 frames of the left camera, 20 of the right one.
    assert!(out.starts_with("40 frames of 2 cameras and 40 pictures of twins in "), "{out}");
    assert!(out.contains("ms per picture of right/sharp"), "{out}");
    assert!(err.contains("camera right has 20 frames: 18 of the 22 of --frames"), "{err}");
    let made = files(&path("out"));
    for name in [
        "run.json",
        "rig.toml",
        "trajectory.csv",
        "left/run.json",
        "left/color/frame_000023.png",
        "right/coords/frame_000019.exr",
        "right/sharp/color/frame_000002.png",
        "right/camera.toml",
        "right/inputs/vignette.png",
    ] {
        assert!(made.contains_key(name), "{name}: {:?}", made.keys());
    }
    assert_eq!(table(&path("out/left/frames.csv")).len(), 22);
    assert_eq!(table(&path("out/right/frames.csv")).len(), 18);
    let run = run_json(&path("out"));
    assert_eq!((&run["cameras"]["right"], &run["finished"]), (&"right/run.json".into(), &true.into()));

    // Each camera by its own run.json, and the whole by that of the rig.
    for (name, frames) in [("left", "2..24"), ("right", "2..20")] {
        let run = path("out").join(name).join("run.json");
        let (code, _, err) = render(run.to_str().unwrap(), &path("alone").join(name), &["--frames", frames]);
        assert_eq!(code, 0, "{err}");
        let alone = results(&path("alone").join(name));
        assert_alike(&alone, &results(&path("out").join(name)));
        // Two runs of a twin alone, too.
        let run = path("out").join(name).join("sharp/run.json");
        let (code, _, err) = render(run.to_str().unwrap(), &path("twin").join(name), &["--frames", "3"]);
        assert_eq!(code, 0, "{err}");
        let picture = "color/frame_000003.png";
        assert!(results(&path("twin").join(name))[picture] == alone[&format!("sharp/{picture}")], "{name}");
    }
    let run = path("out/run.json");
    let (code, _, err) = render(run.to_str().unwrap(), &path("again"), &["--frames", "2..24"]);
    assert_eq!(code, 0, "{err}");
    assert_alike(&results(&path("again")), &results(&path("out")));
    // Equal optics and time, another name: another noise.
    assert_ne!(made["left/color/frame_000004.png"], made["left/color/frame_000005.png"]);
}

#[test]
fn clock_offsets_move_stamps_and_nothing_else() {
    let base = tempfile::tempdir().unwrap();
    let path = |name: &str| base.path().join(name);
    let scenario = scenario(base.path(), PAIR, "");
    for (folder, offset) in [("ahead", "2.5"), ("even", "0")] {
        let set = format!("cameras.right.clock_offset_ms={offset}");
        let (code, _, err) = render(&scenario, &path(folder), &["--frames", "3..5", "--set", &set]);
        assert_eq!(code, 0, "{err}");
    }
    let (ahead, even) = (results(&path("ahead")), results(&path("even")));
    let moved: Vec<&str> =
        ahead.iter().filter(|(name, bytes)| even[*name] != **bytes).map(|(name, _)| name.as_str()).collect();
    assert_eq!(
        moved,
        [
            "rig.toml",
            "right/camera.toml",
            "right/frames.csv",
            "right/rows/frame_000003.csv",
            "right/rows/frame_000004.csv"
        ]
    );
    for (name, stamps) in [("frames.csv", &[1_usize, 2][..]), ("rows/frame_000003.csv", &[1])] {
        let [ahead, even] = ["ahead", "even"].map(|folder| table(&path(folder).join("right").join(name)));
        for (ahead, even) in ahead.iter().zip(&even) {
            for (column, (a, b)) in ahead.iter().zip(even).enumerate() {
                let is_time = a != b;
                assert!(!is_time || a.parse::<i64>().unwrap() - b.parse::<i64>().unwrap() == 2_500_000);
                assert!(is_time || column != stamps[0], "{name}: column {column} is a stamp");
            }
        }
    }
    let camera = fs::read_to_string(path("ahead/right/camera.toml")).unwrap();
    assert!(camera.contains("clock_offset_ms = 2.5") && camera.contains("name = \"right\""), "{camera}");
}

#[test]
fn parts_of_a_rig_make_the_whole() {
    let base = tempfile::tempdir().unwrap();
    let path = |name: &str| base.path().join(name);
    let scenario = scenario(base.path(), PAIR, "");
    let some = ["--frames", "0..6"];
    let (code, _, err) = render(&scenario, &path("whole"), &some);
    assert_eq!(code, 0, "{err}");
    // Shards.
    for (shard, finished) in [("2/2", true), ("1/2", true)] {
        let (code, _, err) = render(&scenario, &path("shards"), &[&some[..], &["--shard", shard]].concat());
        assert_eq!(code, 0, "{err}");
        assert_eq!(run_json(&path("shards"))["finished"], finished);
    }
    assert_alike(&results(&path("shards")), &results(&path("whole")));
    assert!(path("shards/run.1-of-2.json").is_file() && path("shards/left/run.2-of-2.json").is_file());
    // Shards in folders of their own.
    for (folder, shard) in [("a", "1/2"), ("b", "2/2")] {
        let (code, _, err) = render(&scenario, &path(folder), &[&some[..], &["--shard", shard]].concat());
        assert_eq!(code, 0, "{err}");
    }
    let [a, b, merged] = ["a", "b", "merged"].map(|name| path(name).display().to_string());
    let (code, out, err) = camsim(&["merge", &b, &a, "-o", &merged]);
    assert!(code == 0 && out.starts_with("12 frames of 2 shards in "), "{out} {err}");
    assert_alike(&results(&path("merged")), &results(&path("whole")));
    assert_eq!(run_json(&path("merged")), run_json(&path("whole")));
    // One camera after the other.
    let (code, out, err) = render(&scenario, &path("turns"), &[&some[..], &["--camera", "right"]].concat());
    assert!(code == 0 && out.starts_with("6 frames of 1 camera in "), "{out} {err}");
    assert!(!path("turns/left").exists() && run_json(&path("turns"))["finished"] == false);
    let (code, _, err) = render(&scenario, &path("turns"), &[&some[..], &["--camera", "left"]].concat());
    assert_eq!(code, 0, "{err}");
    assert_eq!(run_json(&path("turns"))["finished"], true);
    assert_alike(&results(&path("turns")), &results(&path("whole")));
    // What is missing.
    fs::remove_file(path("turns/right/color/frame_000002.png")).unwrap();
    fs::remove_dir_all(path("turns/left")).unwrap();
    let (code, out, err) = render(&scenario, &path("turns"), &[&some[..], &["--resume"]].concat());
    assert!(code == 0 && out.starts_with("7 frames of 2 cameras (5 existed) in "), "{out} {err}");
    assert_alike(&results(&path("turns")), &results(&path("whole")));
    // Another rig replaces the frames, and is not resumed.
    let set = ["--set", "cameras.right.shutter.readout_ms=3"];
    let (code, _, err) = render(&scenario, &path("turns"), &[&some[..], &set, &["--resume"]].concat());
    assert!(code == 2 && err.contains("turns/right/run.json was made by another scenario"), "{err}");
    let (code, _, err) = render(&scenario, &path("turns"), &[&some[..], &set].concat());
    assert!(code == 0 && err.contains("turns/right belongs to another scenario"), "{err}");
    assert!(!err.contains("turns/left belongs"), "{err}");
}

#[test]
fn a_killed_run_is_resumed() {
    let base = tempfile::tempdir().unwrap();
    let path = |name: &str| base.path().join(name);
    let scenario = scenario(base.path(), PAIR, "");
    let args = ["render", &scenario, "-o", "out", "--backend", "cpu"];
    let mut child = spawn(base.path(), &args);
    let begin = Instant::now();
    while !path("out/right/color/frame_000001.png").is_file() {
        assert!(begin.elapsed() < Duration::from_secs(120), "no frame came");
        #[allow(clippy::disallowed_methods, reason = "files of another process tell nobody when they come")]
        std::thread::sleep(Duration::from_millis(2));
    }
    child.kill().unwrap();
    let (code, err) = wait(child);
    assert_eq!(code, -1, "{err}");
    assert_eq!(run_json(&path("out"))["finished"], false);
    let (code, _, err) = render(&scenario, &path("out"), &["--resume"]);
    assert_eq!(code, 0, "{err}");
    assert_eq!(run_json(&path("out"))["finished"], true);
    let (code, _, err) = render(&scenario, &path("whole"), &[]);
    assert_eq!(code, 0, "{err}");
    assert_alike(&results(&path("out")), &results(&path("whole")));
}

#[test]
fn folders_of_rigs_and_of_single_cameras_do_not_mix() {
    let base = tempfile::tempdir().unwrap();
    let path = |name: &str| base.path().join(name);
    let rig = scenario(base.path(), PAIR, "");
    let single = path("pattern.toml");
    let small = ["--frames", "0", "--set", "camera.size_px=[32, 24]"];
    let (code, _, err) = render(single.to_str().unwrap(), &path("single"), &small);
    assert_eq!(code, 0, "{err}");
    let (code, _, err) = render(&rig, &path("single"), &["--frames", "0"]);
    assert!(code == 2 && err.contains("has frames of a scenario with one camera"), "{err}");
    let (code, _, err) = render(&rig, &path("rig"), &["--frames", "0"]);
    assert_eq!(code, 0, "{err}");
    let (code, _, err) = render(single.to_str().unwrap(), &path("rig"), &small);
    assert!(code == 2 && err.contains("has the cameras of a rig (rig.toml)"), "{err}");
    let renamed = ["--frames", "0", "--set", "cameras.right.name=\"port\""];
    let (code, _, err) = render(&rig, &path("rig"), &renamed);
    assert!(code == 2 && err.contains("has frames of a camera right, which the scenario lacks"), "{err}");
}

#[test]
fn commands_take_one_camera() {
    let base = tempfile::tempdir().unwrap();
    let rig = scenario(base.path(), PAIR, "");
    let single = base.path().join("pattern.toml");
    let (code, out, err) = camsim(&["explain", &rig, "--json"]);
    assert!(
        code == 0 && err.contains("camera left, the first of left, right: --camera NAME chooses another")
    );
    let report: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(report["frames"], 40);
    let (code, out, err) = camsim(&["explain", &rig, "--camera", "right", "--json"]);
    assert!(code == 0 && !err.contains("the first of"), "{err}");
    let report: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(report["frames"], 20);
    let (code, out, _) = camsim(&["lens", &rig, "--camera", "right", "check", "--json"]);
    assert!(code == 0 && out.contains("fold_radius"), "{out}");
    let tracked = |name: &str| camsim(&["track", &rig, "--of", "camera", "--camera", name, "--rate", "2"]).1;
    assert_ne!(tracked("left"), tracked("right"));
    for (args, wanted) in [
        (vec!["explain", &rig, "--camera", "up"], "there is no such camera; the cameras are left, right"),
        (vec!["render", &rig, "--camera", "left,up"], "--camera up: there is no such camera"),
        (vec!["verify", single.to_str().unwrap(), "--camera", "left"], "has one [camera], without a name"),
        (vec!["render", &rig, "--frames", "50"], "--frames: frame 50 does not exist, the last one is 39"),
        (vec!["render", &rig, "--set", "camera.fps=3"], "as in cameras.left.fps"),
    ] {
        let (code, _, err) = camsim(&args);
        assert!(code == 2 && err.contains(wanted), "{args:?}: {err}");
    }
}

/// A pair on one wire: pictures of one instant, late by up to 20 ms.
const WIRED: &str = r#"
[[cameras]]
name = "left"
size_px = [32, 24]
focal_px = [21.0, 21.0]
fps = 20.0
mount = { angles_deg = [0.0, -90.0, 0.0] }
timing = { trigger = "wire", late_ms = 20.0, miss = [3], jitter_ms = 0.5, drop = [5] }

[[cameras]]
name = "right"
size_px = [32, 24]
focal_px = [21.0, 21.0]
fps = 20.0
mount = { angles_deg = [0.0, -90.0, 0.0], offset_m = [0.0, 0.4, 0.0] }
timing = { trigger = "wire", late_ms = 20.0, miss = [3], jitter_ms = 0.5, drop_probability = 0.1 }
"#;

/// Where each picture of a camera was taken from, by frame.
fn poses(folder: &Path) -> BTreeMap<String, (glam::DVec3, glam::DQuat)> {
    let rows = table(&folder.join("frames.csv"));
    let pose = |row: &Vec<String>| {
        let [n, e, d, w, x, y, z] = std::array::from_fn(|i| row[2 + i].parse::<f64>().unwrap());
        (row[0].clone(), (glam::DVec3::new(n, e, d), glam::DQuat::from_xyzw(x, y, z, w)))
    };
    rows.iter().map(pose).collect()
}

/// Largest error of the lever arm from the left camera to the right one, over pictures of the same number.
fn stereo_error_m(rig: &Path) -> f64 {
    let [left, right] = ["left", "right"].map(|name| poses(&rig.join(name)));
    let both = left.iter().filter_map(|(frame, left)| Some((left, right.get(frame)?)));
    let error_m = |((from, q), (to, _)): (&(glam::DVec3, glam::DQuat), &(glam::DVec3, _))| {
        (q.conjugate() * (*to - *from) - glam::DVec3::new(0.4, 0.0, 0.0)).length()
    };
    let errors: Vec<f64> = both.map(error_m).collect();
    assert!(errors.len() > 20, "{}", errors.len());
    errors.into_iter().fold(0.0, f64::max)
}

#[test]
fn cameras_of_one_trigger_are_late_together() {
    let base = tempfile::tempdir().unwrap();
    let path = |name: &str| base.path().join(name);
    let scenario = scenario(base.path(), WIRED, "");
    let (code, _, err) = render(&scenario, &path("wired"), &["--outputs", "color"]);
    assert_eq!(code, 0, "{err}");
    let [left, right] = ["left", "right"].map(|name| table(&path("wired").join(name).join("timing.csv")));
    assert_eq!((left.len(), left[3][1].as_str(), left[5][1].as_str()), (40, "missed", "dropped"));
    let own = |of: &[Vec<String>], frame: usize| of[frame][1] == "own";
    for (frame, (a, b)) in left.iter().zip(&right).enumerate() {
        // Nominal time and trigger are the wire's; stamps and dropped pictures the camera's.
        assert_eq!((&a[3], &a[4], a[1] == "missed"), (&b[3], &b[4], b[1] == "missed"), "{frame}");
        assert_ne!(a[5], b[5], "{frame}");
        for (camera, of) in [("left", &left), ("right", &right)] {
            let picture = path("wired").join(camera).join(format!("color/frame_{frame:06}.png"));
            assert_eq!(picture.is_file(), own(of, frame), "{camera} {frame}");
        }
    }
    assert!((0..40).any(|frame| own(&left, frame) && !own(&right, frame)));
    // The mount is the pose of the right camera in the left one, to the digits of the table.
    assert!(stereo_error_m(&path("wired")) < 1e-6, "{}", stereo_error_m(&path("wired")));
    // A camera alone has the triggers of its rig.
    let run = path("wired/right/run.json");
    let (code, _, err) = render(run.to_str().unwrap(), &path("alone"), &["--outputs", "color"]);
    assert_eq!(code, 0, "{err}");
    assert_eq!(table(&path("alone/timing.csv")), right);
    // Triggers of their own part them.
    let apart = WIRED.replace("trigger = \"wire\", ", "");
    let scenario = self::scenario(base.path(), &apart, "");
    let (code, _, err) = render(&scenario, &path("apart"), &["--outputs", "color"]);
    assert_eq!(code, 0, "{err}");
    assert!(stereo_error_m(&path("apart")) > 0.1, "{}", stereo_error_m(&path("apart")));
    // What the cameras of a wire say of it is the same.
    let scenario = self::scenario(base.path(), &WIRED.replacen("late_ms = 20.0", "late_ms = 3.0", 1), "");
    let (code, _, err) = render(&scenario, &path("never"), &[]);
    let wanted =
        "cameras.1.timing.late_ms: differs from that of camera left, which has the same trigger \"wire\"";
    assert!(code == 2 && err.contains(wanted), "{err}");
}
