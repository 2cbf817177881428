//! Twins of a frame through the command line: folders, bytes, resumed and repeated runs.

#![allow(clippy::unwrap_used)]

use std::{collections::BTreeMap, ffi::OsString, fs, path::Path};

/// Runs camsim. Returns exit code, standard output and standard error.
fn camsim(args: &[&str]) -> (u8, String, String) {
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let args = std::iter::once("camsim").chain(args.iter().copied()).map(OsString::from);
    let code = camsim_cli::run(args, &mut out, &mut err);
    (code, String::from_utf8(out).unwrap(), String::from_utf8(err).unwrap())
}

/// Twins of the pattern.
const TWINS: &str = r#"
[[output.twin]]
name = "sharp"
exposure = false

[[output.twin]]
name = "last"
shutter = "global"
instant = "last-row"
noise = false
channels = ["color", "depth"]

[[output.twin]]
name = "burst"
instants = 3
"#;

/// The pattern with twins, by a small and noisy camera, in a folder of its own; returns the scenario.
fn scenario(base: &Path, twins: &str) -> String {
    camsim_io::builtin::unpack(base).unwrap();
    let text = fs::read_to_string(base.join("pattern.toml")).unwrap();
    let camera = text
        .replace("size_px = [640, 480]", "size_px = [64, 48]")
        .replace("focal_px = [420.0, 421.0]", "focal_px = [42.0, 42.0]")
        .replace("principal_point_px = [318.3, 241.2]", "principal_point_px = [31.5, 23.5]");
    let path = base.join("twins.toml");
    fs::write(&path, camera + "\n[camera.photometric]\nnoise_sigma = 0.01\n" + twins).unwrap();
    path.to_str().unwrap().to_owned()
}

fn render(scenario: &str, folder: &Path, more: &[&str]) -> (u8, String, String) {
    let common = ["render", scenario, "-o", folder.to_str().unwrap(), "--backend", "cpu"];
    camsim(&[&common[..], &["--frames", "2..4"], more].concat())
}

/// Files below a folder by their names, without the tables of paths.
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

fn pictures(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    files(folder).into_iter().filter(|(name, _)| name.contains("frame_")).collect()
}

fn run_json(folder: &Path) -> serde_json::Value {
    serde_json::from_slice(&fs::read(folder.join("run.json")).unwrap()).unwrap()
}

#[test]
fn twins_lie_beside_the_frames_and_repeat_alone() {
    let base = tempfile::tempdir().unwrap();
    let path = |name: &str| base.path().join(name);
    let scenario = scenario(base.path(), TWINS);
    let (code, out, err) = render(&scenario, &path("out"), &["--times"]);
    assert_eq!(code, 0, "{err}");
    assert!(out.starts_with("2 frames and 10 pictures of twins in "), "{out}");
    for title in ["ms per frame ", "ms per picture of sharp ", "ms per picture of burst "] {
        assert!(out.contains(title), "{out}");
    }
    let made = files(&path("out"));
    let wanted = [
        "color/frame_000002.exr",
        "sharp/color/frame_000003.png",
        "sharp/coords/frame_000002.exr",
        "last/depth/frame_000002.exr",
        "burst/color/frame_000002_0.exr",
        "burst/rows/frame_000003_2.csv",
        "burst/run.json",
        "burst/camera.toml",
    ];
    assert!(wanted.iter().all(|name| made.contains_key(*name)), "{:?}", made.keys());
    assert!(!made.contains_key("last/coords/frame_000002.exr"), "it has channels of its own");
    let table = String::from_utf8(made["burst/frames.csv"].clone()).unwrap();
    let header: Vec<&str> = table.lines().next().unwrap().split(',').collect();
    let column = |name: &str| header.iter().position(|column| *column == name).unwrap();
    let cells: Vec<Vec<&str>> = table.lines().skip(1).map(|line| line.split(',').collect()).collect();
    assert_eq!(cells.len(), 6);
    assert_eq!(
        (cells[4][0], cells[4][column("instant")], cells[4][column("color_png")]),
        ("3", "1", "color/frame_000003_1.png")
    );
    // The exposure is 8 ms: thirds of it are 2.667 ms apart.
    let stamp = |row: usize| cells[row][1].parse::<i64>().unwrap();
    assert!((stamp(1) - stamp(0) - 2_666_667).abs() <= 1, "{table}");
    let (frames, last) = (run_json(&path("out")), run_json(&path("out/last")));
    assert_eq!(frames["scenario"]["output"]["twin"][1]["name"], "last");
    assert_eq!((frames["finished"].as_bool(), last["finished"].as_bool()), (Some(true), Some(true)));
    assert_eq!(
        (last["twin"]["name"].as_str(), last["twin"]["of"].as_str()),
        (Some("last"), Some("../run.json"))
    );
    assert_eq!(last["scenario"]["camera"]["photometric"]["noise_sigma"], 0.0);

    // The run again by its own run.json, and a twin by its own.
    let (code, _, err) = render(path("out/run.json").to_str().unwrap(), &path("again"), &[]);
    assert_eq!(code, 0, "{err}");
    assert!(pictures(&path("again")) == pictures(&path("out")));
    for name in ["sharp", "last"] {
        let run = path("out").join(name).join("run.json");
        let (code, _, err) = render(run.to_str().unwrap(), &path("alone").join(name), &[]);
        assert_eq!(code, 0, "{err}");
        assert!(pictures(&path("alone").join(name)) == pictures(&path("out").join(name)), "{name}");
    }
    // Without twins the frames are the same bytes.
    let (code, _, err) = render(&scenario_without(base.path()), &path("without"), &[]);
    assert_eq!(code, 0, "{err}");
    let without = files(&path("without"));
    for (name, bytes) in without.iter().filter(|(name, _)| *name != "run.json") {
        assert_eq!(Some(bytes), made.get(name), "{name}");
    }
}

fn scenario_without(base: &Path) -> String {
    let folder = base.join("plain");
    fs::create_dir_all(&folder).unwrap();
    scenario(&folder, "")
}

#[test]
fn twins_are_resumed_added_and_never_mixed() {
    let base = tempfile::tempdir().unwrap();
    let path = |name: &str| base.path().join(name);
    let plain = scenario(base.path(), "");
    let (code, _, err) = render(&plain, &path("out"), &[]);
    assert_eq!(code, 0, "{err}");
    // A twin is added to frames that exist.
    let twins = scenario(base.path(), TWINS);
    let (code, out, err) = render(&twins, &path("out"), &["--resume"]);
    assert!(code == 0 && out.starts_with("0 frames (2 existed) and 10 pictures of twins"), "{out}{err}");
    let whole = files(&path("out"));
    for name in ["burst/color/frame_000003_1.png", "last/depth/frame_000002.exr"] {
        fs::remove_file(path("out").join(name)).unwrap();
    }
    fs::remove_file(path("out/burst/frames.csv")).unwrap();
    let (code, out, err) = render(&twins, &path("out"), &["--resume"]);
    assert!(code == 0 && out.starts_with("0 frames (2 existed) and 2 pictures of twins"), "{out}{err}");
    let is_picture =
        |(name, bytes): (String, Vec<u8>)| (!name.ends_with("run.json")).then_some((name, bytes));
    let again: BTreeMap<_, _> = files(&path("out")).into_iter().filter_map(is_picture).collect();
    let whole: BTreeMap<_, _> = whole.into_iter().filter_map(is_picture).collect();
    assert_eq!(again.keys().collect::<Vec<_>>(), whole.keys().collect::<Vec<_>>());
    assert!(again == whole);

    // Another twin of the same name.
    let other = scenario(base.path(), &TWINS.replace("exposure = false", "lens = false"));
    let (code, _, err) = render(&other, &path("out"), &["--resume"]);
    assert!(code == 2 && err.contains("out/sharp/run.json was made by another scenario"), "{code} {err}");
    let (code, _, err) = render(&other, &path("out"), &[]);
    assert!(code == 0 && err.contains("out/sharp belongs to another scenario"), "{code} {err}");
    // A burst with fewer pictures would leave some of the former one.
    let fewer = scenario(base.path(), &TWINS.replace("instants = 3", "instants = 2"));
    let (code, _, err) = render(&fewer, &path("out"), &[]);
    assert!(code == 2 && err.contains("twin.instants was 3, now 2"), "{code} {err}");
    // Twins of another scenario are replaced with the frames.
    let twins = scenario(base.path(), TWINS);
    let (code, _, err) = render(&twins, &path("out"), &["--set", "seed=3"]);
    assert!(code == 0 && err.contains("out belongs to another scenario"), "{code} {err}");
    let (code, _, err) = render(&twins, &path("new"), &["--set", "seed=3"]);
    assert_eq!(code, 0, "{err}");
    assert!(pictures(&path("out")) == pictures(&path("new")));
}

#[test]
fn twins_of_the_reference_renderer_and_of_shards() {
    let base = tempfile::tempdir().unwrap();
    let path = |name: &str| base.path().join(name);
    let twins = scenario(base.path(), TWINS);
    let (code, _, err) = render(&twins, &path("whole"), &[]);
    assert_eq!(code, 0, "{err}");
    for shard in ["2/2", "1/2"] {
        let (code, out, err) = render(&twins, &path("parts"), &["--shard", shard]);
        assert!(code == 0 && out.starts_with("1 frames and 5 pictures of twins"), "{out}{err}");
    }
    assert!(pictures(&path("parts")) == pictures(&path("whole")));
    for name in ["frames.csv", "burst/frames.csv", "last/frames.csv"] {
        let read = |folder: &str| fs::read_to_string(path(folder).join(name)).unwrap();
        assert_eq!(read("parts"), read("whole"), "{name}");
    }
    let args = ["render", &twins, "-o", path("exact").to_str().unwrap(), "--backend", "reference"]
        .map(str::to_owned);
    let more = ["--frames", "2", "--set", "camera.size_px=[16, 12]", "--set", "camera.focal_px=[10, 10]"];
    let centre = ["--set", "camera.principal_point_px=[7.5, 5.5]", "--set", "quality.max_error_dn=8"];
    let all: Vec<&str> = args.iter().map(String::as_str).chain(more).chain(centre).collect();
    let (code, out, err) = camsim(&all);
    assert!(code == 0 && out.starts_with("1 frames and 5 pictures of twins"), "{out}{err}");
    assert!(path("exact/burst/color/frame_000002_2.exr").is_file());
}

#[test]
fn explain_names_the_twins_with_their_plans() {
    let base = tempfile::tempdir().unwrap();
    let twins = scenario(base.path(), TWINS);
    let (code, out, err) = camsim(&["explain", &twins, "--frame", "2", "--backend", "cpu"]);
    assert_eq!(code, 0, "{err}");
    let (_, listed) = out.split_once("twins, each in a folder with its name\n").unwrap();
    assert!(listed.contains("  sharp: no exposure\n    ideal: "), "{listed}");
    assert!(listed.contains("  last: global shutter, no noise\n"), "{listed}");
    assert!(listed.contains("  burst: 3 instants over the exposure, no exposure\n"), "{listed}");
    let (code, out, err) = camsim(&["explain", &twins, "--frame", "2", "--backend", "cpu", "--json"]);
    assert_eq!(code, 0, "{err}");
    let report: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(report["twins"][2]["pictures"], 3);
    assert!(report["twins"][0]["plan"]["blur"].is_null() && !report["plan"]["blur"].is_null());
}

#[test]
fn tracks_are_those_of_the_frames_and_objects_are_listed_beside_their_numbers() {
    const MORE: &str = r#"
[output.tracks]
points = "points.csv"

[[output.twin]]
name = "global"
shutter = "global"
channels = ["object"]

[[output.twin]]
name = "burst"
instants = 2
channels = ["color"]
"#;
    let base = tempfile::tempdir().unwrap();
    let path = |name: &str| base.path().join(name);
    let twins = scenario(base.path(), MORE);
    fs::write(path("points.csv"), "n_m,e_m,d_m\n0,0,0\n5,5,0\n").unwrap();
    let colours = ["--set", "output.palette=true"];
    let (code, out, err) = render(&twins, &path("out"), &colours);
    assert!(code == 0 && out.starts_with("2 frames and 6 pictures of twins"), "{out}{err}");
    let whole = files(&path("out"));
    let names = |table: &str| {
        let is_it = |name: &&String| name.ends_with(table);
        whole.keys().filter(is_it).map(String::as_str).collect::<Vec<_>>()
    };
    assert_eq!(names("tracks.csv"), ["tracks.csv"]);
    assert_eq!(names("points.csv"), ["points.csv"]);
    assert_eq!(names("objects.csv"), ["global/objects.csv"]);
    assert!(whole.contains_key("global/object_palette/frame_000002.png"), "{:?}", whole.keys());
    let [frames, global, burst] = ["out", "out/global", "out/burst"].map(|name| run_json(&path(name)));
    assert_eq!(frames["tracked_points"], 2);
    for twin in [&global, &burst] {
        assert!(twin["tracked_points"].is_null() && twin["scenario"]["output"]["tracks"].is_null(), "{twin}");
    }
    assert_eq!(global["scenario"]["output"]["palette"], true);
    assert!(burst["scenario"]["output"]["palette"].is_null(), "it has no numbers");
    for run in ["out/global/run.json", "out/burst/run.json"] {
        let (code, _, err) = render(path(run).to_str().unwrap(), &path("alone"), &[]);
        assert_eq!(code, 0, "{run}: {err}");
        fs::remove_dir_all(path("alone")).unwrap();
    }

    // Shards, and a resumed run that has to make the table again.
    for shard in ["2/2", "1/2"] {
        let (code, _, err) = render(&twins, &path("parts"), &[&colours[..], &["--shard", shard]].concat());
        assert_eq!(code, 0, "{err}");
    }
    let table = |folder: &str| fs::read(path(folder).join("tracks.csv")).unwrap();
    assert!(table("parts") == whole["tracks.csv"]);
    fs::remove_file(path("out/tracks.csv")).unwrap();
    let (code, _, err) = render(&twins, &path("out"), &[&colours[..], &["--resume"]].concat());
    assert!(code == 0 && table("out") == whole["tracks.csv"], "{err}");

    // What belongs to a replaced twin goes with it, and its frames are left alone.
    let other = scenario(
        base.path(),
        &MORE.replace("\"object\"", "\"color\"").replace("shutter = \"global\"", "lens = false"),
    );
    for channel in ["object", "object_palette"] {
        fs::remove_dir_all(path("out/global").join(channel)).unwrap();
    }
    let (code, _, err) = render(&other, &path("out"), &[]);
    assert!(code == 0 && !path("out/global/objects.csv").exists(), "{err}");
    assert!(table("out") == whole["tracks.csv"]);
}

#[test]
fn a_lens_that_a_dataset_lacks_is_refused_before_rendering_and_its_twin_is_exported() {
    let base = tempfile::tempdir().unwrap();
    let path = scenario(base.path(), "[[output.twin]]\nname = \"plain\"\nlens = false\n");
    let folder = base.path().join("out");
    let panorama = [
        "--set",
        "camera.lens.model=\"equirectangular\"",
        "--set",
        "camera.lens.coefficients=[]",
        "--set",
        "output.format=[\"png\"]",
    ];
    for dataset in ["nerfstudio", "euroc", "tum", "colmap", "kalibr", "mcap"] {
        let datasets = format!("output.datasets=[\"{dataset}\"]");
        let (code, _, err) = render(&path, &folder, &[&panorama[..], &["--set", &datasets]].concat());
        assert!(code != 0 && err.contains("has no lens of the model equirectangular"), "{dataset}: {err}");
        assert!(err.contains("`camsim export OUT/plain --as ...`"), "{err}");
        assert!(!folder.exists(), "{dataset}");
    }
    // As the error says.
    let (code, _, err) = render(&path, &folder, &panorama);
    assert_eq!(code, 0, "{err}");
    let [plain, camera, dataset, json] =
        ["out/plain", "out/plain/camera.toml", "nerfstudio", "plain.json"].map(|name| base.path().join(name));
    for args in [
        ["export", plain.to_str().unwrap(), "-o", dataset.to_str().unwrap()].as_slice(),
        &["camera", "export", camera.to_str().unwrap(), "-o", json.to_str().unwrap()],
    ] {
        let (code, _, err) = camsim(&[args, &["--as", "nerfstudio"]].concat());
        assert_eq!(code, 0, "{err}");
    }
    assert!(dataset.join("transforms.json").is_file() && json.is_file());
}
