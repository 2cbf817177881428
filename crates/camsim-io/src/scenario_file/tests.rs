#![allow(clippy::unwrap_used, reason = "tests")]

use camsim_core::scenario::{
    Auto, CameraSpec, Channel, FieldOr, OutputSpec, QualitySpec, Readout, TrackerSpec,
};

use super::*;

mod sensors;

const GOOD: &str = "[flight]\nlog = \"a.csv\"\n[scene.pattern]\nimage = \"g.png\"\nwidth_m = 10\n";

fn parse(text: &str) -> Result<Scenario, ScenarioError> {
    parse_scenario(text, Path::new("dir/s.toml"), &[])
}

fn with(sets: &[(&str, &str)]) -> Result<Scenario, ScenarioError> {
    let sets: Vec<_> = sets.iter().map(|(k, v)| (k.to_string(), v.to_string())).collect();
    parse_scenario(GOOD, Path::new("dir/s.toml"), &sets)
}

#[test]
fn printed_default_has_the_default_values() {
    let scenario = parse(&print_default()).unwrap();
    assert_eq!(scenario.seed, 0);
    assert_eq!(scenario.flight.speed, 1.0);
    assert_eq!(scenario.tracker, TrackerSpec::default());
    assert_eq!(scenario.camera, CameraSpec::default());
    assert_eq!(scenario.quality, QualitySpec::default());
    assert_eq!(scenario.output, OutputSpec::default());
}

#[test]
fn twins_are_read_and_their_problems_named_by_line() {
    let with =
        |twin: &str| parse(&format!("{GOOD}[camera.shutter]\nexposure_ms = 8\n[[output.twin]]\n{twin}\n"));
    let scenario = with("name = \"burst\"\ninstants = 9\nchannels = [\"color\", \"flow_global\"]").unwrap();
    let [twin] = scenario.output.twin.as_slice() else { panic!("one twin") };
    assert_eq!((twin.name.as_str(), twin.instants), ("burst", Some(9)));
    assert_eq!(twin.channels, Some(vec![Channel::Color, Channel::FlowGlobal]));
    for (twin, wanted) in [
        ("exposure = false", "output.twin.0.name: is missing"),
        ("name = \"a\"\nexposre = false", "s.toml:10: output.twin.0.exposre: unknown key; did you mean"),
        ("name = \"a\"\nshutter = \"globl\"", "s.toml:10: output.twin.0.shutter: expected one of \"global\""),
        ("name = \"a/b\"\nlens = false", "s.toml:9: output.twin.0.name: is the name of a folder"),
        (
            "name = \"a\"\ninstant = \"last-row\"\nlens = false",
            "s.toml:10: output.twin.0.instant: is that of",
        ),
    ] {
        let error = with(twin).unwrap_err().to_string();
        assert!(error.contains(wanted), "{error}");
    }
}

#[test]
fn keys_of_boards_are_checked_by_kind() {
    let text = |keys: &str| format!("[flight]\nlog = \"a.csv\"\n[scene.board]\n{keys}\n");
    for kind in ["chessboard", "circles", "asymmetric-circles", "aprilgrid", "charuco"] {
        parse(&text(&format!("kind = \"{kind}\"\ncolumns = 5\nrows = 4\nsize_m = 0.1"))).unwrap();
    }
    for word in ["4x4", "5x5", "6x6"] {
        parse(&text(&format!(
            "kind = \"charuco\"\ncolumns = 5\nrows = 4\nsize_m = 0.1\ndictionary = \"{word}\""
        )))
        .unwrap();
    }
    for (keys, wanted) in [
        ("kind = \"chesboard\"", "did you mean \"chessboard\"?"),
        ("kind = \"charuco\"\ncolumns = 5\nrows = 4", "scene.board.size_m: is missing"),
        (
            "kind = \"circles\"\ncolumns = 5\nrows = 4\nsize_m = 0.1\nmarker_m = 0.1",
            "s.toml:8: scene.board.marker_m: does not belong",
        ),
        ("kind = \"circles\"\ncolumns = 500\nrows = 4\nsize_m = 0.1", "1 to 80"),
    ] {
        let error = parse(&text(keys)).unwrap_err().to_string();
        assert!(error.contains(wanted), "{error}");
    }
}

#[test]
fn errors_name_file_line_and_key() {
    let cases: &[(&str, &str)] = &[
        ("[camera]\nfsp = 30", "dir/s.toml:7: camera.fsp: unknown key; did you mean `camera.fps`?"),
        (
            "[camera.shuter]\nreadout_ms = 3",
            "dir/s.toml:6: camera.shuter: unknown key; did you mean `camera.shutter`?",
        ),
        ("[camera]\nreadout_ms = 3", "did you mean `camera.shutter.readout_ms`?"),
        ("[camera]\nexposure_ms = 8", "did you mean `camera.shutter.exposure_ms`?"),
        ("[camera]\ncoefficients = [0.1]", "did you mean `camera.lens.coefficients`?"),
        ("[camera.lens]\nfocal_px = [1, 1]", "did you mean `camera.focal_px`?"),
        ("[camera]\nf_number = 4", "did you mean `camera.sensor.f_number`?"),
        ("[[imu]]\nname = \"a\"\nangles_deg = [1, 2, 3]", "did you mean `imu.mount.angles_deg`?"),
        ("focal_px = [1, 1]", "did you mean `camera.focal_px`?"),
        (
            "[camera.lens]\nmodel = \"eucm\"\ncoefficients = [0.6, -1.0]",
            "dir/s.toml:8: camera.lens.coefficients: has beta = -1; beta must be above 0",
        ),
        ("[quality]\nxyz = 3", "quality.xyz: unknown key; `camsim render --print-default`"),
        (
            "[camera]\nresolution = [640, 480]",
            "camera.resolution: unknown key; did you mean `camera.size_px`?",
        ),
        ("qqqq = 1", "unknown key; `camsim render --print-default`"),
        ("[camera]\nfps = \"thirty\"", "dir/s.toml:7: camera.fps: expected a number, found \"thirty\""),
        (
            "[camera]\nsize_px = [640, -1]",
            "camera.size_px: expected a list of 2 whole numbers up to 32768, found [640, -1]",
        ),
        (
            "[camera]\nsize_px = [640, 99999999999]",
            "dir/s.toml:7: camera.size_px: expected a list of 2 whole numbers up to 32768, found",
        ),
        (
            "[quality]\nblur_samples = 4294967296",
            "dir/s.toml:7: quality.blur_samples: expected a whole number up to 4096 or \"auto\", found \
                4294967296",
        ),
        (
            "[quality]\niterations = 4294967296",
            "dir/s.toml:7: quality.iterations: expected a whole number up to 64 or \"auto\"",
        ),
        (
            "[quality]\nkey_frames = 4294967296",
            "dir/s.toml:7: quality.key_frames: expected a whole number up to 4 or \"auto\"",
        ),
        ("[quality]\nfootprint_taps = 4294967295", "dir/s.toml:7: quality.footprint_taps: must be 1 to 64"),
        (
            "[quality]\nframes_per_ideal = 65",
            "quality.frames_per_ideal: expected a whole number, 1 to 64, found 65",
        ),
        (
            "[quality]\nframes_per_ideal = 0",
            "quality.frames_per_ideal: expected a whole number, 1 to 64, found 0",
        ),
        (
            "[scene.terrain]\ndem = \"d.tif\"\nepsg = 65536",
            "dir/s.toml:8: scene.terrain.epsg: expected a whole number, 0 to 65535",
        ),
        ("[camera.shutter]\nreadout = \"top-to-botom\"", "did you mean \"top-to-bottom\"?"),
        (
            "[camera.shutter]\ninterlace_ms = \"feild\"",
            "expected a number or \"field\", found \"feild\"; did you mean \"field\"?",
        ),
        ("[camera]\nlens = 3", "camera.lens: expected a table, found 3"),
        ("[camera.timing]\ndrop = [1.5]", "camera.timing.drop: expected a list of whole numbers, 0 or more"),
        (
            "[camera.sensor]\ngain = 1",
            "dir/s.toml:7: camera.sensor.gain: unknown key; did you mean `camera.sensor.gain_e_per_dn`?",
        ),
        ("[quality]\nsolver = \"rk3\"", "did you mean \"rk2\"?"),
        ("[quality]\nsolver = \"rk2\"\niterations = 3", "quality.iterations: counts the depth look-ups"),
        (
            "[quality]\npreset = \"paper\"\nsolver = \"linear\"",
            "dir/s.toml:8: quality.solver: is rk2 with quality.preset",
        ),
        ("[output]\nchannels = [\"color\", \"flaw\"]", "did you mean \"flow\"?"),
        ("[camera]\nfps = nan", "dir/s.toml:7: camera.fps: must be a finite number above 0"),
        (
            "[camera]\nmount = { vibration = [{ axis = \"roll\" }] }",
            "camera.mount.vibration.0.hz: is missing",
        ),
        ("[[camera.zoom]]\nat = 1\nfocal_px = [1, 0]", "dir/s.toml:8: camera.zoom.0.focal_px: must be"),
        ("[camera", "dir/s.toml:6: not valid TOML"),
        (
            "[output]\nx = 18446744073709551615",
            "s.toml:7: not valid TOML: whole numbers end at 9223372036854775807",
        ),
        ("[output]\nx = -99999999999999999999", "s.toml:7: not valid TOML: whole numbers end at"),
        ("[camera.shutter]\nexposure_ms = 8,0", "; decimals have a point"),
        ("[camera]\ncamera = \"c.toml\"", "`camera` stands outside of all tables: move the line above"),
        ("[camera.lens]\nmodel = \"equidistant\"", "did you mean \"kannala-brandt\"?"),
        ("[camera.lens]\nmodel = \"radtan\"", "did you mean \"brown-conrady\"?"),
        ("[camera.sensor]\nmosaic = \"RGGB\"", "did you mean \"rggb\"?"),
        ("camera = \"no.toml\"", "unknown key"),
    ];
    for (extra, expected) in cases {
        let error = parse(&format!("{GOOD}{extra}\n")).unwrap_err().to_string();
        assert!(error.contains(expected), "{extra}\n  gives {error}\n  not   {expected}");
    }
    let empty = parse("").unwrap_err().to_string();
    assert!(empty.contains("flight.log: is missing") && empty.contains("scene: is missing"), "{empty}");
    assert!(parse("[flight]\nlog = \"a\"\n[scene]\n").unwrap_err().to_string().contains("scene: is empty"));
    assert!(matches!(read_scenario(Path::new("/no/such.toml"), &[], None), Err(ScenarioError::Read { .. })));
}

#[test]
fn set_changes_keys_before_they_are_checked() {
    let scenario = with(&[
        ("camera.shutter.readout_ms", "10"),
        ("camera.shutter.readout", "left-to-right"),
        ("camera.shutter.interlace_ms", "field"),
        ("quality.blur_samples", "8"),
        ("flight.log", "my log.csv"),
        ("output.channels", "[\"depth\"]"),
        ("camera.mount.vibration", "[{ axis = \"roll\", hz = 5 }]"),
        ("camera.mount.vibration.0.hz", "7.5"),
    ])
    .unwrap();
    assert_eq!(scenario.camera.shutter.readout_ms, 10.0);
    assert_eq!(scenario.camera.shutter.readout, Readout::LeftToRight);
    assert_eq!(scenario.camera.shutter.interlace_ms, FieldOr::Field);
    assert_eq!(scenario.quality.blur_samples, Auto::Value(8));
    assert_eq!(scenario.flight.log, Path::new("my log.csv"));
    assert_eq!(scenario.camera.mount.vibration[0].hz, 7.5);
    assert_eq!(scenario.scene.pattern.unwrap().image, Path::new("dir/g.png"));
    let unset =
        with(&[("camera.shutter.readout_ms", "10"), ("camera.shutter", UNSET), ("camera.fps", UNSET)]);
    assert_eq!(unset.unwrap(), with(&[]).unwrap());
    let of_list =
        with(&[("camera.focal_px", "[400, 400]"), ("camera.focal_px.0", UNSET)]).unwrap_err().to_string();
    assert_eq!(of_list, "--set camera.focal_px.0=(omitted): is an element of a list; give the whole list");
    for (key, value, expected) in [
        ("camera.fsp", "3", "--set camera.fsp=3: camera.fsp: unknown key; did you mean `camera.fps`?"),
        ("camera.fps", "-3", "--set camera.fps=-3: camera.fps: must be a finite number above 0"),
        ("camera..fps", "3", "the key is empty"),
        ("seed.x", "3", "--set seed.x=3: seed: expected a whole number, 0 or more, found a table"),
        ("flight.log.x", "3", "is not a table"),
        ("camera.fps", "1\nseed = 2", "expected a number"),
        (
            "seed",
            "18446744073709551616",
            "whole number, 0 or more, found \"18446744073709551616\"; whole numbers end at 9223372036854775807",
        ),
        (
            "camera.timing.drop",
            "[1, 99999999999999999999]",
            "list of whole numbers, 0 or more, found \"[1, 99999999999999999999]\"; whole numbers end at",
        ),
        (
            "imu.rate_hz",
            "100",
            "--set imu.rate_hz=100: there is no [[imu]]: add one to the file, or write the whole list, imu=[{ name = \
             \"imu0\", rate_hz = 100 }]",
        ),
        ("imu.left.mount.angles_deg", "[1, 2, 3]", "imu=[{ name = \"left\", mount.angles_deg = [1, 2, 3] }]"),
        (
            "camera.zoom.0.at",
            "2.0",
            "no [[camera.zoom]]: add one to the file, or write the whole list, camera.zoom=[{ at",
        ),
    ] {
        let error = with(&[(key, value)]).unwrap_err().to_string();
        assert!(error.contains(expected), "{key}={value} gives {error}");
    }
}

#[test]
fn camera_files_have_their_own_paths_and_lines() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::create_dir(dir.path().join("cams")).unwrap();
    let camera = dir.path().join("cams/c.toml");
    std::fs::write(&camera, "fps = 25\n[photometric]\nvignette = \"v.png\"\n").unwrap();
    let file = dir.path().join("s.toml");
    std::fs::write(&file, format!("\u{feff}camera = \"cams/c.toml\"\r\n{GOOD}")).unwrap();
    let set = [("camera.shutter.exposure_ms".to_owned(), "4".to_owned())];
    let scenario = read_scenario(&file, &set, None).unwrap();
    assert_eq!((scenario.camera.fps, scenario.camera.shutter.exposure_ms), (25.0, 4.0));
    assert_eq!(scenario.camera.photometric.vignette.unwrap(), dir.path().join("cams/v.png"));
    assert_eq!(read_camera(&camera).unwrap().fps, 25.0);
    assert_eq!(read_scenario(&file, &[], Some(Preset::Paper)).unwrap().quality.preset, Preset::Paper);

    std::fs::write(&camera, "fps = 25\nfocal = 3\n").unwrap();
    let error = read_scenario(&file, &[], None).unwrap_err().to_string();
    assert!(
        error.contains("c.toml:2: camera.focal: unknown key; did you mean `camera.focal_px`?"),
        "{error}"
    );
    // Errors of a camera file alone name keys without `camera.`.
    let error = read_camera(&camera).unwrap_err().to_string();
    assert!(error.ends_with("c.toml:2: focal: unknown key; did you mean `focal_px`?"), "{error}");
    for (text, expected) in [
        (
            "[camera]\nfps = 25\n",
            "c.toml:1: camera: a CAMERA.toml has the keys of [camera] at its root: write fps = 30",
        ),
        (
            "fps = 1\nseed = 1\n[flight]\nlog = \"a.csv\"\n",
            "c.toml:2: seed: a CAMERA.toml has the keys of [camera] at its root: the rest",
        ),
    ] {
        std::fs::write(&camera, text).unwrap();
        for error in [read_camera(&camera).unwrap_err(), read_scenario(&file, &[], None).unwrap_err()] {
            assert!(error.to_string().contains(expected), "{error}");
        }
    }
}
