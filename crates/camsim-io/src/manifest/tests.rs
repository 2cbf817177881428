//! Manifests are scenarios that repeat their run.

#![allow(clippy::unwrap_used, reason = "tests")]
use super::*;
use crate::scenario_file::{RELATIVE_PATHS, parse_scenario, read_scenario};

fn scenario(sets: &[(&str, &str)]) -> Scenario {
    let sets: Vec<_> = sets.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
    let text = "[flight]\nlog = \"a.csv\"\n[scene.pattern]\nimage = \"g.png\"\nwidth_m = 10\n";
    parse_scenario(text, Path::new("s.toml"), &sets).unwrap()
}

fn manifest(scenario: Scenario) -> RunManifest {
    RunManifest {
        version: "0.1.0".into(),
        adapter: "llvmpipe".into(),
        seed: scenario.seed,
        paths: RELATIVE_PATHS.to_owned(),
        variation: None,
        twin: None,
        scenario,
        inputs: [("a.csv".to_owned(), "3 bytes".to_owned())].into(),
        frames: [0, 10],
        shard: Some([2, 4]),
        written: 3,
        skipped: 0,
        finished: true,
        tracked_points: None,
        warnings: vec![],
    }
}

#[test]
fn manifests_read_back_and_resume_only_their_own_scenario() {
    let dir = tempfile::tempdir().unwrap();
    assert!(!check_resume(dir.path(), &scenario(&[]), &Inputs::new()).unwrap());
    let ours =
        manifest(scenario(&[("camera.fps", "29.97"), ("camera.mount.angles_deg", "[0.1, -0.3, 1e-7]")]));
    ours.write(dir.path()).unwrap();
    let text = std::fs::read_to_string(dir.path().join("run.2-of-4.json")).unwrap();
    let read: RunManifest = serde_json::from_str(&text).unwrap();
    let portable = portable_scenario(&ours.scenario, dir.path()).unwrap();
    assert_eq!(
        read,
        RunManifest { scenario: portable, inputs: portable_inputs(&ours.inputs, dir.path()), ..ours.clone() }
    );
    assert!(check_resume(dir.path(), &ours.scenario, &ours.inputs).unwrap());
    let changed = [("a.csv".to_owned(), "4 bytes".to_owned())].into();
    let error = check_resume(dir.path(), &ours.scenario, &changed).unwrap_err().to_string();
    assert!(error.contains("a.csv was \"3 bytes\", now \"4 bytes\""), "{error}");

    let mut other = ours.scenario.clone();
    other.camera.fps = 25.0;
    other.scene.fog_visibility_m = Some(900.0);
    let error = check_resume(dir.path(), &other, &ours.inputs).unwrap_err().to_string();
    assert!(
        error.contains("camera.fps was 29.97, now 25")
            && error.contains("scene.fog_visibility_m was nothing, now 900"),
        "{error}"
    );

    std::fs::write(dir.path().join("run.json"), "{").unwrap();
    assert!(matches!(check_resume(dir.path(), &other, &ours.inputs), Err(ResumeError::Parse { .. })));
}

#[test]
fn twins_have_manifests_of_their_own() {
    let dir = tempfile::tempdir().unwrap();
    let mut ours = manifest(scenario(&[("camera.shutter.exposure_ms", "8")]));
    ours.write(dir.path()).unwrap();
    let mut with_twin = ours.scenario.clone();
    let burst = TwinSpec { name: "burst".into(), instants: Some(9), ..TwinSpec::default() };
    with_twin.output.twin.push(burst.clone());
    assert!(check_resume(dir.path(), &with_twin, &ours.inputs).unwrap(), "a twin changes no frame");
    let record = TwinRecord::new(&burst);
    let error = check_burst(dir.path(), Some(&record)).unwrap_err().to_string();
    assert!(error.contains("twin.instants was nothing, now 9"), "{error}");
    assert!(check_burst(dir.path(), None).unwrap());
    ours.twin = Some(record.clone());
    ours.write(dir.path()).unwrap();
    assert!(check_burst(dir.path(), Some(&record)).unwrap());
    let error = check_burst(dir.path(), None).unwrap_err().to_string();
    assert!(error.contains("twin.over was \"exposure\", now nothing"), "{error}");
    let more = TwinRecord { instants: Some(11), ..record };
    assert!(check_burst(dir.path(), Some(&more)).is_err());
    assert!(!check_burst(&dir.path().join("none"), None).unwrap());
}

#[test]
fn manifests_are_scenarios_that_repeat_the_run() {
    let dir = tempfile::tempdir().unwrap();
    let text = r#"
            seed = 9
            [flight]
            log = "logs/a.csv"
            window_s = [1.0, 2.5]
            origin = [46.5, 7.25, 900.0]
            [camera.shutter]
            interlace_ms = "field"
            [[camera.mount.vibration]]
            axis = "roll"
            amplitude_deg = 0.1
            hz = 30.0
            phase_deg = 0.0
            [scene]
            terrain = { dem = "/maps/dem.tif", ortho = "ortho.tif" }
            sky = [0.1, 0.2, 0.3]
            [scene.light]
            sun_azimuth_deg = 150.0
            sun_elevation_deg = 35.0
            [[scene.gltf]]
            file = "house.glb"
            placements = "houses.csv"
            on_ground = true
            [[scene.gltf]]
            file = "../tower.glb"
            geodetic = [46.5, 7.25, 0.0]
            time_s = 1.5
            [quality]
            solver = "rk2"
            [output]
            channels = ["color", "coords"]
        "#;
    // Paths are relative to the folder of the manifest.
    let scenario = parse_scenario(text, &dir.path().join("there/s.toml"), &[]).unwrap();
    let ours = manifest(scenario.clone());
    ours.write(&dir.path().join("out")).unwrap();
    let written: Value =
        serde_json::from_slice(&std::fs::read(dir.path().join("out/run.json")).unwrap()).unwrap();
    assert_eq!(written["scenario"]["flight"]["log"], "../there/logs/a.csv");
    assert_eq!(written["scenario"]["scene"]["terrain"]["dem"], "/maps/dem.tif");
    assert_eq!(written["scenario"]["scene"]["gltf"][1]["file"], "../tower.glb");
    let run = dir.path().join("out/run.json");
    let read = read_scenario(&run, &[], None).unwrap();
    assert_eq!(read.flight.log, dir.path().join("out/../there/logs/a.csv"));
    assert_eq!(
        portable_scenario(&read, dir.path()).unwrap(),
        portable_scenario(&scenario, dir.path()).unwrap()
    );
    let sets = [("camera.fps".to_owned(), "12.5".to_owned())];
    assert_eq!(read_scenario(&run, &sets, None).unwrap().camera.fps, 12.5);
    // A key that is set beside a path does not move the path.
    let sets = [("scene.terrain.ortho_white".to_owned(), "2047".to_owned())];
    let terrain = read_scenario(&run, &sets, None).unwrap().scene.terrain.unwrap();
    assert_eq!(terrain.ortho, Some(dir.path().join("out/../there/ortho.tif").into()));
    for (text, wanted) in [
        ("{ \"apply\": {} }", "run.json: JSON without `scenario`"),
        ("{ \"scenario\": ", "run.json: neither TOML nor JSON"),
        ("{ \"scenario\": { \"fligth\": {} } }", "run.json: fligth: unknown key"),
    ] {
        std::fs::write(&run, text).unwrap();
        let error = read_scenario(&run, &[], None).unwrap_err().to_string();
        assert!(error.contains(wanted), "{error}");
    }
}

#[test]
fn moved_folders_and_inputs_can_be_resumed() {
    let base = tempfile::tempdir().unwrap();
    let path = |name: &str| base.path().join(name);
    std::fs::create_dir_all(path("data/maps")).unwrap();
    for name in ["data/a.csv", "data/g.png", "data/maps/g.pgw"] {
        std::fs::write(path(name), name).unwrap();
    }
    let read = |folder: &str| {
        let text = "[flight]\nlog = \"a.csv\"\n[scene.pattern]\nimage = \"g.png\"\nwidth_m = 10\n";
        let scenario = parse_scenario(text, &path(folder).join("s.toml"), &[]).unwrap();
        let mut inputs = crate::inputs::scenario_fingerprints(&scenario);
        // A file beside an input, such as a world file or a buffer of a model.
        let world_file = path(folder).join("g.pgw");
        inputs.insert(world_file.display().to_string(), "a world file".into());
        (scenario, inputs)
    };
    let (scenario, inputs) = read("data");
    let ours = RunManifest { inputs: inputs.clone(), ..manifest(scenario.clone()) };
    ours.write(&path("runs/out")).unwrap();
    assert!(check_resume(&path("runs/out"), &scenario, &inputs).unwrap());
    std::fs::rename(path("runs/out"), path("out")).unwrap();
    assert!(check_resume(&path("out"), &scenario, &inputs).unwrap(), "the folder is elsewhere");
    std::fs::rename(path("data"), path("other")).unwrap();
    let (scenario, inputs) = read("other");
    assert!(check_resume(&path("out"), &scenario, &inputs).unwrap(), "the inputs are elsewhere");
    std::fs::write(path("other/a.csv"), "another log").unwrap();
    let (scenario, inputs) = read("other");
    let error = check_resume(&path("out"), &scenario, &inputs).unwrap_err().to_string();
    assert!(error.contains("flight.log was \"../../data/a.csv\", now \"../other/a.csv\""), "{error}");
}

#[test]
fn all_paths_of_a_scenario_are_made_relative() {
    use crate::scenario_file::{ValueKind, kinds};
    let text = r#"
            flight = { log = "x/1" }
            [camera]
            zoom_track = "x/2"
            photometric = { vignette = "x/3" }
            point_spread = { kernel = "x/14" }
            [[camera.zoom]]
            at = 1.0
            focal_px = [1.0, 1.0]
            [scene]
            terrain = { dem = "x/4", ortho = "x/5" }
            pattern = { image = "x/6", width_m = 1.0 }
            board = { target = "x/7" }
            gltf = [{ file = "x/8", placements = "x/9" }, { file = "x/10", motion = { poses = "x/11" } }]
            [output.tracks]
            points = ["terrain", "x/12.csv"]
        "#;
    let mut scenario = parse_scenario(text, Path::new("s.toml"), &[]).unwrap();
    // No lens has a table and a zoom.
    scenario.camera.lens_table = Some(PathBuf::from("x/13.csv").into());
    let mut tree = serde_json::to_value(&scenario).unwrap();
    let mut visited = Vec::new();
    for_each_path(&mut tree, &mut |key, _| visited.push(key.replace(".0.", ".").replace(".1.", ".")));
    for (key, _) in kinds().filter(|(_, kind)| matches!(kind, ValueKind::Path | ValueKind::Paths)) {
        assert!(visited.iter().any(|visited| visited == key), "{key}");
    }
    assert!(visited.contains(&"output.tracks.points.1".to_owned()), "{visited:?}");
    assert_eq!(visited.len(), 14);
}

#[test]
fn shards_partition_the_frames() {
    for index in 0..20 {
        assert_eq!((1..=4).filter(|&i| in_shard(index, [i, 4])).count(), 1);
    }
    assert!(!in_shard(0, [1, 0]));
}
