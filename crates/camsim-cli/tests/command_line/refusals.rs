//! Input that is refused, with location and remedy.

use std::fs;

use super::{assets, camsim, text};

#[test]
fn other_files_are_refused_as_scenario() {
    let assets = assets();
    for (file, wanted) in [
        (
            "demo_flight.csv",
            "log = \"demo_flight.csv\"\n    [scene]\n    terrain = \
             { dem = \"dem.tif\", ortho = \"ortho.tif\" }",
        ),
        ("demo_camera.toml", "demo_camera.toml is a camera file, not a scenario: name it in one:"),
        ("acircles.png", "acircles.png is a picture (PNG), not a scenario"),
        ("demo_dem.tif", "demo_dem.tif is a TIFF, not a scenario"),
    ] {
        let file = assets.join(file);
        for command in ["render", "explain", "track", "verify"] {
            let (code, _, err) = camsim([command, text(&file)]);
            assert!(code == 2 && err.contains(wanted), "{command}: {err}");
        }
    }
}

#[test]
fn invalid_input_is_refused_with_position_and_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, content: &str| {
        let path = folder.path().join(name);
        fs::write(&path, content).unwrap();
        text(&path).to_owned()
    };
    let scenario = text(&assets().join("pattern.toml")).to_owned();
    let camera = text(&assets().join("demo_camera.toml")).to_owned();
    let picture = text(&assets().join("acircles.png")).to_owned();
    let other = text(&assets().join("vignette.png")).to_owned();
    let no_toml = file("no.toml", "[flight\nlog = 3");
    let unknown = file("unknown.toml", "[flight]\nlogg = \"a.csv\"\n[scene]\n");
    let no_log = file(
        "no_log.toml",
        "[flight]\nlog = \"nowhere.csv\"\n[scene.pattern]\nimage = \"a.png\"\nwidth_m = 9.0\n",
    );
    let binary = file("binary.toml", "\u{1}\u{2}\0");
    let demo = text(&assets().join("demo.toml")).to_owned();
    let no_heights = format!("scene.terrain.dem={picture}");
    let latin = folder.path().join("latin.toml");
    fs::write(&latin, b"# K\xf6ln\n").unwrap();
    let latin = text(&latin).to_owned();
    let words = file("words.csv", "u,v\n1,two\n");
    let no_focal = file("no_focal.toml", "size_px = [640, 480]\nfocal_px = [0.0, 100.0]\n");
    let cases: Vec<(Vec<&str>, &str)> = vec![
        (vec!["rendr"], "render"),
        (vec!["render"], "SCENARIO"),
        (vec!["render", "nowhere.toml"], "nowhere.toml"),
        (vec!["render", &no_toml], "no.toml"),
        (vec!["render", &binary], "binary.toml"),
        (vec!["render", &unknown], "log"),
        (vec!["render", &no_log], "nowhere.csv"),
        (vec!["render", &latin], "latin.toml: not UTF-8 text (bad byte at offset 3)"),
        (vec!["render", &demo, "--set", "scene.terrain.dem=none.tif"], "; check scene.terrain.dem"),
        (vec!["render", &demo, "--set", &no_heights], "check scene.terrain.dem"),
        (vec!["render", &demo, "--set", "scene.terrain.ortho=none.jpg"], "; check scene.terrain.ortho"),
        (
            vec!["explain", &scenario, "--frame", "-1"],
            "'--frame <N>': it is a number that counts from 0, such as 7",
        ),
        (vec!["explain", &scenario, "--variation", "-1"], "it is a number that counts from 0"),
        (vec!["render", &scenario, "--frames", "-1"], "`-1` is not a range of frames, which count from 0"),
        (vec!["verify", &scenario, "--frames", "-3..2"], "`-3..2` is not a range of frames"),
        (
            vec!["export", &scenario, "--as", "tum", "-o", "x", "--frames", "1.5"],
            "`1.5` is not a range of frames",
        ),
        (
            vec!["render", &scenario, "--set", "camera.resized.binning=1.5"],
            "another factor is camera.resized.scale",
        ),
        (vec!["explain", &scenario, "--set", "scene.pattern.image=none.png"], "; check scene.pattern.image"),
        (
            vec!["explain", &scenario, "--set", "camera.photometric.vignette=none.png"],
            "; check camera.photometric.vignette",
        ),
        (vec!["render", &scenario, "--frames", "5..2"], "`5..2` is empty"),
        (vec!["render", &scenario, "--frames", "58..99"], "the last one is 59"),
        (vec!["render", &scenario, "--shard", "5/4"], "I from 1 to N"),
        (vec!["render", &scenario, "--outputs", "colour"], "coords"),
        (vec!["render", &scenario, "--format", "none,png"], "cannot be combined with other formats"),
        (vec!["render", &scenario, "--preset", "paper", "--set", "quality.solver=linear"], "quality.solver"),
        (
            vec!["render", &scenario, "--backend", "gpu", "--set", "quality.solver=reference"],
            "leave --backend out",
        ),
        (vec!["verify", &scenario, "--set", "quality.solver=reference"], "which this command compares with"),
        (vec!["render", &scenario, "--set", "camera.fps"], "KEY=VALUE"),
        (vec!["render", &scenario, "--set", "camera.fpss=3"], "fps"),
        (vec!["render", &scenario, "--set", "camera.fps=-3"], "camera.fps"),
        (vec!["explain", &scenario, "--frame", "60"], "--frame: frame 60 does not exist, the last one is 59"),
        (
            vec!["explain", &scenario, "--set", "flight.window_s=[1.0, 1.001]", "--set", "camera.phase=0.9"],
            "window_s",
        ),
        (vec!["verify", &scenario, "--frames", "58..99"], "the last one is 59"),
        (vec!["verify", "nowhere.toml"], "nowhere.toml"),
        (vec!["track", &scenario, "--rate", "0"], "--rate"),
        (vec!["track", &scenario, "--rate", "NaN"], "--rate"),
        (vec!["track", &scenario, "--json"], "--report"),
        (vec!["lens", "nowhere.toml", "check"], "nowhere.toml"),
        (vec!["lens", &no_focal, "check"], "focal_px"),
        (vec!["lens", &camera, "distort", "--points", &words], "line 2: v is `two`"),
        (vec!["lens", &camera, "undistort", "--points", &words], "x_px,y_px"),
        (vec!["lens", &camera, "distort", "--points", "nowhere.csv"], "nowhere.csv"),
        (vec!["camera", "import", &words], "supported are"),
        (vec!["camera", "import", &words, "--format", "blender"], "kalibr"),
        (vec!["compare", &picture, &other], "acircles.png"),
        (vec!["compare", &picture, "nowhere.png"], "nowhere.png"),
        (vec!["completions", "tcsh"], "zsh"),
        (vec!["bench", "--plot", "curve.png"], "must end in .svg"),
        (vec!["render", &scenario, "--set", "quality.blur_samples=4294967296"], "up to 4096"),
        (
            vec!["render", &scenario, "--set", "quality.iterations=4294967295"],
            "quality.iterations: must be 1 to 64",
        ),
    ];
    let mut faults = Vec::new();
    for (args, wanted) in cases {
        let (code, out, err) = camsim(args.clone());
        if code != 2 || !err.contains(wanted) || !err.starts_with("error: ") {
            faults.push(format!("{args:?} should say `{wanted}` and exit with 2, not {code}:\n{out}{err}"));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    assert_eq!(camsim::<&str>([]).0, 2);
}

#[test]
fn unwritable_output_is_a_failure_of_the_run() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    fs::write(&file, "").unwrap();
    let below = file.join("traj.csv");
    let (code, _, err) =
        camsim(["track", text(&assets().join("pattern.toml")), "--rate", "1", "-o", text(&below)]);
    assert!(code == 1 && err.contains("traj.csv"), "{err}");
    // Long runs are refused before they begin.
    for (args, name) in [
        (vec!["bench", "--csv", text(&below)], "traj.csv"),
        (vec!["bench", "--plot", text(&below.with_extension("svg"))], "traj.svg"),
        (vec!["bench", "-o", text(&below)], "traj.csv"),
        (vec!["reproduce", "speed", "-o", text(&below)], "traj.csv"),
    ] {
        let (code, out, err) = camsim(args.clone());
        assert!(
            code == 1 && out.is_empty() && err.contains(name) && err.starts_with("error: "),
            "{args:?}: {code} {err}"
        );
        assert!(!err.contains("--resume"), "{err}");
    }
}

#[test]
fn reproduce_refuses_invalid_input() {
    let folder = tempfile::tempdir().unwrap();
    let (code, _, err) = camsim(["reproduce", "time", "--width", "12"]);
    assert!(code == 2 && err.contains("--width 12: must be 96 to 4096"), "{err}");
    let (code, _, err) = camsim(["reproduce", "tracking", "--data", text(folder.path())]);
    assert!(code == 2 && err.contains("path_lawnmower.csv") && err.contains(text(folder.path())), "{err}");
    let (code, _, err) = camsim(["reproduce", "figure14"]);
    assert!(code == 2 && err.contains("figure14") && err.contains("tracking"), "{err}");
}
