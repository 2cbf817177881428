use camsim_io::scenario_file::parse_scenario;

use super::*;

fn demo() -> Document {
    Document::open(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/demo.toml"))
        .expect("the built-in scenario")
}

#[test]
fn every_key_of_the_format_can_be_set() {
    let mut document = demo();
    for (key, kind) in kinds() {
        let under_list =
            kinds().any(|(list, kind)| kind == ValueKind::Tables && key.starts_with(&format!("{list}.")));
        if kind == ValueKind::Tables || under_list {
            continue;
        }
        document.set(key, Some(Value::Integer(7)), false);
        assert_eq!(document.value(key), Some(&Value::Integer(7)), "{key}");
        assert!(document.undo());
        assert!(!document.is_changed(key), "{key}");
    }
}

#[test]
fn a_drag_is_one_undo_step() {
    let mut document = demo();
    let key = "camera.shutter.readout_ms";
    for ms in 1..20 {
        document.set(key, Some(Value::Float(f64::from(ms))), true);
    }
    document.end_gesture();
    document.set(key, Some(Value::Float(30.0)), true);
    document.end_gesture();
    assert_eq!(document.scenario.camera.shutter.readout_ms, 30.0);
    assert!(document.undo());
    assert_eq!(document.scenario.camera.shutter.readout_ms, 19.0);
    assert!(document.undo());
    assert_eq!(document.scenario.camera.shutter.readout_ms, 33.0);
    assert!(!document.undo());
    assert!(document.redo() && document.redo() && !document.redo());
    assert_eq!(document.scenario.camera.shutter.readout_ms, 30.0);
}

#[test]
fn illegal_values_are_reported_and_the_last_legal_scenario_stays() {
    let mut document = demo();
    document.set("camera.shutter.exposure_ms", Some(Value::Float(-3.0)), false);
    let problem = document.problem("camera.shutter").expect("a problem");
    assert_eq!(problem.key, "camera.shutter.exposure_ms");
    assert!(document.problem("camera.lens").is_none());
    assert_eq!(document.scenario.camera.shutter.exposure_ms, 8.0);
    assert!(document.save(Path::new("never.toml")).expect_err("not legal").contains("exposure_ms"));
    document.reset("camera.shutter.exposure_ms");
    assert!(document.problems.is_empty());
}

#[test]
fn a_saved_scenario_opens_unchanged() {
    let folder = tempfile::tempdir().expect("a folder");
    let demo_path = camsim_io::builtin::unpack(folder.path()).expect("unpacked");
    let mut document = Document::open(&demo_path).expect("the built-in scenario");
    document.set("camera.lens.coefficients", Some(Value::Array(vec![Value::Float(-0.3)])), false);
    document.set("camera.mount.vibration.1.hz", Some(Value::Float(40.0)), false);
    document.set("camera.mount.vibration.0", None, false);
    document.set("flight.window_s", None, false);
    assert!(document.is_unsaved());
    let saved = folder.path().join("changed.toml");
    document.save(&saved).expect("saved");
    assert!(!document.is_unsaved());
    let again = Document::open(&saved).expect("what was saved");
    assert_eq!(again.scenario, document.scenario);
    assert_eq!(again.scenario.camera.mount.vibration.len(), 1);
    let text = std::fs::read_to_string(&saved).expect("text");
    assert!(text.contains("log = \"demo_flight.csv\""), "paths are relative to the file:\n{text}");
}

#[test]
fn the_command_line_sets_each_changed_key() {
    let mut document = demo();
    document.set("camera.shutter.readout_ms", Some(Value::Float(0.0)), false);
    document.set(
        "camera.lens.coefficients",
        Some(Value::Array(vec![Value::Float(0.1), Value::Float(0.0)])),
        false,
    );
    let line = document.command_line();
    assert!(line.starts_with("camsim render "), "{line}");
    assert!(line.contains("--set camera.shutter.readout_ms=0.0"), "{line}");
    assert!(line.contains("--set 'camera.lens.coefficients=[0.1, 0.0]'"), "{line}");
    // The file with these values gives the same scenario.
    let sets: Vec<_> = document.changes().into_iter().map(|(key, value)| (key, value.to_string())).collect();
    let text = std::fs::read_to_string(&document.path).expect("text");
    assert_eq!(parse_scenario(&text, &document.path, &sets).expect("legal"), *document.scenario);
}

#[test]
fn a_calibration_replaces_the_camera_but_not_its_mount() {
    let mut document = demo();
    let camera = CameraSpec { focal_px: [300.0, 301.0], ..CameraSpec::default() };
    document.set_camera(&camera).expect("a camera");
    assert_eq!(document.scenario.camera.focal_px, [300.0, 301.0]);
    assert_eq!(document.scenario.camera.mount, demo().scenario.camera.mount);
    assert!(document.undo());
    assert_eq!(document.scenario, demo().scenario);
}

#[test]
fn opening_a_file_with_an_unknown_key_names_line_and_key() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("bad.toml");
    std::fs::write(&path, "[camera]\nfsp = 3\n").expect("written");
    let error = Document::open(&path).expect_err("not a scenario");
    assert!(error.contains("bad.toml:2") && error.contains("fps"), "{error}");
}

#[test]
fn removing_the_last_key_of_a_table_removes_the_table() {
    let mut document = demo();
    assert_eq!(document.scenario.scene.light, None);
    document.set("scene.light.sun", Some(Value::Float(0.5)), false);
    assert_eq!(document.scenario.scene.light.map(|light| light.sun), Some(0.5));
    document.set("scene.light.sun", None, false);
    // An empty table would be the default light.
    assert_eq!((document.scenario.scene.light, document.value("scene.light")), (None, None));
}

/// A rig of two cameras in `folder`.
fn pair(folder: &Path) -> PathBuf {
    let path = folder.join("pair.toml");
    let text = "[flight]\nlog = \"a.csv\"\n[scene.pattern]\nimage = \"g.png\"\nwidth_m = 10.0\n\
        [[cameras]]\nname = \"left\"\nfps = 20.0\n[[cameras]]\nname = \"right\"\n\
        photometric = { vignette = \"v.png\" }\n";
    std::fs::write(&path, text).expect("written");
    path
}

#[test]
fn keys_of_the_camera_are_those_of_the_shown_one() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut document = Document::open(&pair(folder.path())).expect("legal");
    assert_eq!((document.scenario.camera.name.as_str(), document.camera()), ("left", 0));
    document.show_camera(1);
    document.show_camera(7);
    assert_eq!((document.scenario.camera.name.as_str(), document.camera()), ("right", 1));
    document.set("camera.fps", Some(Value::Float(5.0)), false);
    document.set("camera.lens.model", Some(Value::String("kannala-brandt".into())), false);
    let fps =
        |document: &Document| document.rig().scenarios().iter().map(|s| s.camera.fps).collect::<Vec<_>>();
    assert_eq!(fps(&document), [20.0, 5.0]);
    assert_eq!(document.value("camera.fps"), Some(&Value::Float(5.0)));
    assert!(document.is_changed("camera.fps") && document.removed_keys().is_empty());
    let command = document.render_command(Path::new("out"), Some([0, 3]));
    assert!(
        command.contains("--set cameras.1.fps=5.0 ")
            && command.contains("--set 'cameras.1.lens.model=\"kannala-brandt\"'")
            && command.contains("--camera right"),
        "{command}"
    );
    document.show_camera(0);
    assert!(!document.is_changed("camera.fps"));
    document.set("camera.fps", Some(Value::Float(-5.0)), false);
    let problem = document.problem("camera.fps").expect("a problem").to_string();
    assert!(problem.starts_with("cameras.0.fps: must be"), "{problem}");
    assert!(document.undo());
    assert!(document.problem("camera.fps").is_none());

    let camera = CameraSpec { name: "other".into(), fps: 1.0, size_px: [9, 9], ..CameraSpec::default() };
    document.set_camera(&camera).expect("set");
    let left = &document.scenario.camera;
    assert_eq!((left.name.as_str(), left.fps, left.size_px), ("left", 20.0, [9, 9]));
    let saved = folder.path().join("saved.toml");
    document.save(&saved).expect("saved");
    let text = std::fs::read_to_string(&saved).expect("text");
    assert!(text.contains("vignette = \"v.png\"") && !text.contains("[camera]"), "{text}");
    assert_eq!(Document::open(&saved).expect("what was saved").rig(), document.rig());
}

#[test]
fn a_file_with_random_values_is_not_overwritten() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("random.toml");
    let text = "[flight]\nlog = \"a.csv\"\n[scene.pattern]\nimage = \"g.png\"\nwidth_m = 10\n[randomize]\n\
                \"camera.fps\" = { uniform = [10, 20] }\n";
    std::fs::write(&path, text).expect("written");
    let mut document = Document::open(&path).expect("legal");
    assert!(document.save(&path).expect_err("refused").contains("[randomize]"));
    assert_eq!(std::fs::read_to_string(&path).expect("read"), text);
    let copy = folder.path().join("copy.toml");
    document.save(&copy).expect("saved");
    document.save(&copy).expect("saved again");
}
