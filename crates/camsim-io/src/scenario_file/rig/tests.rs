#![allow(clippy::unwrap_used, reason = "tests")]

use std::{fs, path::Path};

use camsim_core::scenario::{CameraSpec, Rig};

use super::super::{ScenarioError, parse_rig, parse_scenario, read_rig, rig_table};

const SHARED: &str = "[flight]\nlog = \"a.csv\"\n[scene.pattern]\nimage = \"g.png\"\nwidth_m = 10\n";
const PAIR: &str = "
[[cameras]]
name = \"left\"
fps = 20.0
[cameras.shutter]
readout_ms = 30.0

[[cameras]]
name = \"right\"
photometric = { vignette = \"v.png\" }
[cameras.mount]
offset_m = [0.0, 0.5, 0.0]
[[cameras.mount.vibration]]
axis = \"roll\"
hz = 3.0
";

fn parse(cameras: &str, sets: &[(&str, &str)]) -> Result<Rig, ScenarioError> {
    let sets: Vec<_> = sets.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect();
    parse_rig(&format!("{SHARED}{cameras}"), Path::new("dir/s.toml"), &sets)
}

fn camera(rig: &Rig, index: usize) -> &CameraSpec {
    &rig.scenarios()[index].camera
}

#[test]
fn each_camera_is_a_scenario_of_its_own() {
    let rig = parse(PAIR, &[]).unwrap();
    assert!(rig.is_list());
    assert_eq!(rig.names().collect::<Vec<_>>(), ["left", "right"]);
    let alone = "[camera]\nname = \"left\"\nfps = 20.0\n[camera.shutter]\nreadout_ms = 30.0\n";
    assert_eq!(*rig.first(), *parse(alone, &[]).unwrap().first());
    let right = camera(&rig, 1);
    assert_eq!(right.mount.offset_m, [0.0, 0.5, 0.0]);
    assert_eq!(right.photometric.vignette.as_deref(), Some(Path::new("dir/v.png")));
    let error = parse_scenario(&format!("{SHARED}{PAIR}"), Path::new("s.toml"), &[]).unwrap_err().to_string();
    assert!(error.contains("choose left or right"), "{error}");
}

#[test]
fn a_rig_is_written_and_read_back() {
    let rig = parse(PAIR, &[("cameras.right.clock_offset_ms", "-3.5")]).unwrap();
    let text = toml::to_string(&rig_table(&rig).unwrap()).unwrap();
    assert_eq!(parse_rig(&text, Path::new("s.toml"), &[]).unwrap(), rig);
    // As `run.json` has it, with paths relative to it.
    let folder = tempfile::tempdir().unwrap();
    let run = folder.path().join("run.json");
    let tree = crate::portable::portable_rig(&rig, folder.path()).unwrap();
    assert!(tree.get("camera").is_none() && tree["cameras"][1]["name"] == "right", "{tree}");
    let whole = serde_json::json!({ "paths": crate::scenario_file::RELATIVE_PATHS, "scenario": tree });
    fs::write(&run, whole.to_string()).unwrap();
    let read = read_rig(&run, &[("cameras.1.fps".into(), "7".into())], None).unwrap();
    assert_eq!((camera(&read, 1).fps, camera(&read, 0)), (7.0, camera(&rig, 0)));
    let vignette = camera(&read, 1).photometric.vignette.clone().unwrap();
    assert!(vignette.is_absolute() && vignette.ends_with("dir/v.png"), "{vignette:?}");
    let single = parse("", &[]).unwrap();
    assert!(!single.is_list() && rig_table(&single).unwrap().contains_key("camera"));
}

#[test]
fn keys_of_cameras_are_set_by_name_and_by_number() {
    let sets =
        [("cameras.right.shutter.readout_ms", "3"), ("cameras.0.name", "port"), ("cameras.port.fps", "9")];
    let rig = parse(PAIR, &sets).unwrap();
    assert_eq!(camera(&rig, 1).shutter.readout_ms, 3.0);
    assert_eq!((camera(&rig, 0).name.as_str(), camera(&rig, 0).fps), ("port", 9.0));
    let rig = parse(PAIR, &[("cameras.*.fps", "7")]).unwrap();
    assert_eq!([0, 1].map(|number| camera(&rig, number).fps), [7.0; 2]);
    for (cameras, key, value, wanted) in [
        (PAIR, "cameras.middle.fps", "3", "there is no camera `middle`; the cameras are left, right"),
        (PAIR, "cameras.2.fps", "3", "there is no camera `2`; the cameras are left, right"),
        (PAIR, "camera.fps", "3", "name one of them (left, right), as in cameras.left.fps"),
        (PAIR, "cameras.left.fps.x", "3", "`fps` is not a table"),
        (PAIR, "cameras.left.file", "a.toml", "write cameras.left=FILE.toml"),
        (PAIR, "cameras.left.fsp", "3", "did you mean `cameras.fps`?"),
        (PAIR, "cameras.left.fps", "fast", "--set cameras.left.fps=fast: cameras.0.fps: expected a number"),
        (
            PAIR,
            "cameras.left.fps",
            "-1",
            "--set cameras.left.fps=-1: cameras.0.fps: must be a finite number above 0",
        ),
        (PAIR, "cameras.*.fsp", "3", "did you mean `cameras.fps`?"),
        ("", "cameras.left.fps", "3", "has one camera, [camera]: write camera.fps"),
        ("", "cameras.*.fps", "3", "has one camera, [camera]: write camera.fps"),
    ] {
        let error = parse(cameras, &[(key, value)]).unwrap_err().to_string();
        assert!(error.contains(wanted), "{key}: {error}");
    }
}

#[test]
fn camera_files_lie_below_the_keys_of_their_entry() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    fs::create_dir(path("cams")).unwrap();
    let file = "name = \"from-file\"\nfps = 12.5\n[shutter]\nreadout_ms = 8.0\nexposure_ms = 1.0\n\
        [photometric]\nvignette = \"v.png\"\n";
    fs::write(path("cams/a.toml"), file).unwrap();
    let text = format!(
        "cameras = [{{ name = \"left\", file = \"cams/a.toml\", shutter = {{ readout_ms = 9.0 }} }}, \
         \"cams/a.toml\"]\n{SHARED}"
    );
    fs::write(path("s.toml"), &text).unwrap();
    let rig = read_rig(&path("s.toml"), &[], None).unwrap();
    let (left, other) = (camera(&rig, 0), camera(&rig, 1));
    assert_eq!((left.name.as_str(), left.fps), ("left", 12.5));
    assert_eq!((left.shutter.readout_ms, left.shutter.exposure_ms), (9.0, 1.0));
    assert_eq!((other.name.as_str(), other.shutter.readout_ms), ("from-file", 8.0));
    for camera in [left, other] {
        assert_eq!(camera.photometric.vignette.clone().unwrap(), path("cams/v.png"));
    }
    // Another file instead of a camera keeps the name.
    fs::write(path("b.toml"), "fps = 3.0\n").unwrap();
    let set = ("cameras.left".to_owned(), path("b.toml").display().to_string());
    let rig = read_rig(&path("s.toml"), &[set], None).unwrap();
    assert_eq!((camera(&rig, 0).name.as_str(), camera(&rig, 0).fps), ("left", 3.0));

    fs::write(path("cams/a.toml"), "fps = \"fast\"\n").unwrap();
    let error = read_rig(&path("s.toml"), &[], None).unwrap_err().to_string();
    assert!(error.contains("a.toml:1: cameras.0.fps: expected a number"), "{error}");
    fs::remove_file(path("cams/a.toml")).unwrap();
    let error = read_rig(&path("s.toml"), &[], None).unwrap_err().to_string();
    assert!(
        error.starts_with("cameras.0.file: cannot read ") && error.contains("the key `cameras.0.file` of")
    );
}

#[test]
fn what_is_no_rig_is_refused_with_its_position() {
    let both = format!("[camera]\nfps = 3\n{PAIR}");
    for (cameras, wanted) in [
        (both.as_str(), "dir/s.toml:9: cameras: cannot stand beside [camera]"),
        ("[[cameras]]\nfps = 3\n", "dir/s.toml:6: cameras.0.name: is missing"),
        (
            "[[cameras]]\nname = \"a\"\n[[cameras]]\nname = \"A\"\n",
            "dir/s.toml:9: cameras.1.name: \"A\" names two",
        ),
        ("[[cameras]]\nname = \"a/b\"\n", "dir/s.toml:7: cameras.0.name: is the name of a folder"),
        ("[[cameras]]\nname = 3\n", "cameras.0.name: expected a text in quotes"),
        ("[[cameras]]\nname = \"a\"\nlens = 3\n", "cameras.0.lens: expected a table"),
        ("[cameras]\nleft = { fps = 3 }\n", "cameras: expected a list of tables; write [[cameras]]"),
        ("[[cameras]]\nname = \"a\"\nfile = 3\n", "cameras.0.file: expected a path in quotes"),
        ("[[cameras]]\nname = \"a\"\n[[cameras.zoom]]\nat = 3\n", "cameras.0.zoom.0.focal_px: is missing"),
        ("[[cameras]]\nname = \"a\"\nsensor = 3\n", "cameras.0.sensor: expected a table"),
    ] {
        let error = parse(cameras, &[]).unwrap_err().to_string();
        assert!(error.contains(wanted), "{wanted}: {error}");
    }
    let listed = |list: &str| {
        parse_rig(&format!("cameras = {list}\n{SHARED}"), Path::new("s.toml"), &[]).unwrap_err().to_string()
    };
    assert!(listed("[]").contains("s.toml:1: cameras: is empty"), "{}", listed("[]"));
    assert!(listed("3").contains("cameras: expected a list of tables"), "{}", listed("3"));
    assert!(listed("[3]").contains("cameras: expected a list of tables"), "{}", listed("[3]"));
    let gone = listed("[\"gone.toml\"]");
    assert!(gone.contains("cameras.0: cannot read gone.toml"), "{gone}");
}
