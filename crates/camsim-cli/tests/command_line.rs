//! The command line: arguments, output and exit codes.

#![allow(clippy::unwrap_used)]

use std::{
    ffi::OsString,
    fs,
    path::{Path, PathBuf},
};

/// Exit code, standard output, standard error.
fn camsim<S: Into<OsString>>(args: impl IntoIterator<Item = S>) -> (u8, String, String) {
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let args = std::iter::once(OsString::from("camsim")).chain(args.into_iter().map(Into::into));
    let code = camsim_cli::run(args, &mut out, &mut err);
    (code, String::from_utf8(out).unwrap(), String::from_utf8(err).unwrap())
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn assets() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets")
}

#[test]
fn help_names_every_command_and_every_exit_code() {
    let (code, out, err) = camsim(["--help"]);
    assert_eq!((code, err.as_str()), (0, ""));
    for word in [
        "demo",
        "render",
        "explain",
        "verify",
        "track",
        "lens",
        "camera",
        "apply",
        "compare",
        "bench",
        "reproduce",
        "info",
        "viewer",
        "completions",
        "Exit codes",
        "CAMSIM_ADAPTER",
    ] {
        assert!(out.contains(word), "{word} is missing in\n{out}");
    }
    for command in [
        "demo",
        "render",
        "explain",
        "verify",
        "track",
        "lens",
        "camera",
        "apply",
        "compare",
        "bench",
        "reproduce",
        "info",
        "viewer",
        "completions",
    ] {
        let (code, out, _) = camsim([command, "--help"]);
        assert_eq!(code, 0, "{command}");
        assert!(out.contains("Usage: camsim"), "{out}");
    }
    assert_eq!(camsim(["--version"]).0, 0);
}

#[test]
fn completions_exist_for_every_shell() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let (code, out, _) = camsim(["completions", shell]);
        assert!(code == 0 && out.contains("camsim") && out.contains("render"), "{shell}");
    }
}

#[test]
fn distort_and_undistort_are_inverse() {
    let folder = tempfile::tempdir().unwrap();
    let (rays, pixels, back) =
        (folder.path().join("rays.csv"), folder.path().join("pixels.csv"), folder.path().join("back.csv"));
    let points = [[0.0, 0.0], [0.3, -0.2], [-0.55, 0.4], [1e-9, 0.1]];
    let rows: String = points.iter().map(|[u, v]| format!("{u},{v}\n")).collect();
    fs::write(&rays, format!("u,v\n{rows}")).unwrap();
    // The camera file alone and within a scenario.
    for camera in ["demo_camera.toml", "demo.toml"] {
        let camera = assets().join(camera);
        let (code, _, err) =
            camsim(["lens", text(&camera), "distort", "--points", text(&rays), "-o", text(&pixels)]);
        assert_eq!((code, err.as_str()), (0, ""));
        let (code, _, err) =
            camsim(["lens", text(&camera), "undistort", "--points", text(&pixels), "-o", text(&back)]);
        assert_eq!((code, err.as_str()), (0, ""));
        let answer = fs::read_to_string(&back).unwrap();
        let mut lines = answer.lines();
        assert_eq!(lines.next(), Some("u,v,valid"));
        for ([u, v], line) in points.iter().zip(lines) {
            let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
            // Newton's method stops at 1e-13 of the ideal plane or better; the text keeps every bit.
            assert!(
                (cells[0] - u).abs() < 1e-11 && (cells[1] - v).abs() < 1e-11 && cells[2] == 1.0,
                "{line}"
            );
        }
    }
}

#[test]
fn pixels_without_a_ray_are_invalid_and_points_beyond_the_fold_are_counted() {
    let folder = tempfile::tempdir().unwrap();
    let camera = folder.path().join("folds.toml");
    // d_r = 1 - 0.4 r^2 has its maximum at r = sqrt(1 / 1.2) = 0.913, where the image radius is 0.609.
    let lens = "[lens]\nmodel = \"brown-conrady\"\ncoefficients = [-0.4]\n";
    fs::write(&camera, format!("size_px = [640, 480]\nfocal_px = [400.0, 400.0]\n{lens}")).unwrap();
    let points = folder.path().join("points.csv");
    fs::write(&points, "x_px,y_px\n0,0\n319.5,239.5\n").unwrap();
    let (code, out, _) = camsim(["lens", text(&camera), "undistort", "--points", text(&points)]);
    assert_eq!((code, out.as_str()), (0, "u,v,valid\nNaN,NaN,0\n0.0,0.0,1\n"));
    fs::write(&points, "u,v\n1.5,0\nNaN,0\n0.1,0\n").unwrap();
    let (code, out, err) = camsim(["lens", text(&camera), "distort", "--points", text(&points)]);
    assert!(code == 0 && out.starts_with("x_px,y_px\n") && out.contains("\nNaN,NaN\n"), "{out}");
    assert!(
        err.contains("1 of 3 points lie beyond") && err.contains("1 of 3 points are not finite"),
        "{err}"
    );
    assert_eq!(camsim(["-q", "lens", text(&camera), "distort", "--points", text(&points)]).2, "");

    let (code, out, _) = camsim(["lens", text(&camera), "check", "--json"]);
    let check: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(code, 0);
    assert!((check["fold_radius_min"].as_f64().unwrap() - (1.0f64 / 1.2).sqrt()).abs() < 1e-6, "{check}");
    assert!(
        check["valid_fraction"].as_f64().unwrap() < 1.0
            && check["bijective"] == true
            && check["worst_roundtrip_px"].is_f64()
    );
}

#[test]
fn calibrations_of_other_programs_are_imported() {
    let folder = tempfile::tempdir().unwrap();
    let (kalibr, camera) = (folder.path().join("camchain.yaml"), folder.path().join("CAMERA.toml"));
    let chain = "cam0:\n  camera_model: pinhole\n  distortion_coeffs: [-0.28, 0.07, 0.0002, 0.00002]\n  \
                 distortion_model: radtan\n  intrinsics: [458.6, 457.3, 367.2, 248.4]\n  resolution: [752, \
                 480]\n";
    fs::write(&kalibr, chain).unwrap();
    let (code, _, err) = camsim(["camera", "import", text(&kalibr), "-o", text(&camera)]);
    assert!(code == 0 && err.contains("kalibr"), "{err}");
    let (code, out, err) = camsim(["lens", text(&camera), "check"]);
    assert!(code == 0 && out.contains("100.000 %"), "{out}{err}");
    let (code, out, _) = camsim(["camera", "import", text(&kalibr), "-q"]);
    assert_eq!((code, out), (0, fs::read_to_string(&camera).unwrap()));
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

#[test]
fn images_are_compared() {
    let assets = assets();
    let one = assets.join("acircles.png");
    let (code, out, err) = camsim(["compare", text(&one), text(&one), "--json"]);
    let report: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!((code, err.as_str()), (0, ""));
    assert_eq!(
        (report["rmse"].as_f64(), report["max"].as_f64(), report["differing"].as_f64()),
        (Some(0.0), Some(0.0), Some(0.0))
    );
    assert!(report["psnr_db"].is_null() && report["ssim"].as_f64().unwrap() > 0.999_999, "{report}");
    let (code, out, _) = camsim(["compare", text(&one), text(&one)]);
    assert!(code == 0 && out.contains("inf"), "{out}");
}

#[test]
fn the_built_in_flight_is_tracked_and_explained() {
    let folder = tempfile::tempdir().unwrap();
    let (scenario, table) = (assets().join("pattern.toml"), folder.path().join("traj.csv"));
    let (code, out, err) =
        camsim(["track", text(&scenario), "--rate", "25", "-o", text(&table), "--report", "--json"]);
    assert_eq!(code, 0, "{err}");
    let report: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert!(
        report["rms"]["north_m"].as_f64().unwrap() < 1.0 && report["max_used"]["speed_m_s"].is_f64(),
        "{report}"
    );
    assert!(report["max_error"]["attitude_deg"].is_f64(), "{report}");
    let rows: Vec<Vec<f64>> = fs::read_to_string(&table)
        .unwrap()
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect())
        .collect();
    // The window of 10 to 12 s at 25 Hz, both ends.
    assert_eq!(rows.len(), 51);
    assert!((rows[50][0] - rows[0][0] - 2.0).abs() < 1e-8);
    assert!(rows.iter().all(|row| row.len() == 20 && row.iter().all(|value| value.is_finite())));
    assert!(rows.windows(2).all(|pair| (pair[1][0] - pair[0][0] - 0.04).abs() < 1e-8));

    let (code, out, err) = camsim(["explain", text(&scenario), "--frame", "3", "--json"]);
    assert_eq!(code, 0, "{err}");
    let explained: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!((explained["plan"]["frame"].as_u64(), explained["frames"].as_u64()), (Some(3), Some(60)));
    let (code, out, _) = camsim(["explain", text(&scenario), "--set", "camera.shutter.exposure_ms=0"]);
    assert!(code == 0 && out.contains("skipped") && !out.contains("light:"), "{out}");
    let (code, out, err) = camsim(["explain", text(&scenario), "--set", "scene.light.sun=0.7"]);
    assert!(
        code == 0 && out.contains("light: sun 0.7 from 180 deg") && !out.contains("terrain texture"),
        "{out}"
    );
    assert!(err.contains("scene.light changes nothing"), "{err}");
    let (code, out, err) =
        camsim(["explain", text(&assets().join("demo.toml")), "--set", "scene.light.sun=0.7"]);
    assert!(
        code == 0 && out.contains("in steps of 8 bits") && !err.contains("changes nothing"),
        "{out} {err}"
    );
}

#[test]
fn the_camera_is_tracked_with_its_mount_and_vibration() {
    let folder = tempfile::tempdir().unwrap();
    let (scenario, table) = (assets().join("pattern.toml"), folder.path().join("poses.csv"));
    let track = |more: &[&str]| {
        let (code, _, err) = camsim([&["track", text(&scenario), "-o", text(&table)][..], more].concat());
        assert_eq!(code, 0, "{err}");
        let all = fs::read_to_string(&table).unwrap();
        let header = all.lines().next().unwrap().to_owned();
        let rows = all
            .lines()
            .skip(1)
            .map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect())
            .collect::<Vec<Vec<f64>>>();
        (header, rows, err)
    };
    let still =
        ["--set", "camera.mount.vibration=[]", "--set", "camera.mount.offset_m=[2, 0, 0]", "--rate", "100"];
    let (_, body, _) = track(&still);
    let (header, rigid, err) = track(&[&still[..], &["--of", "camera"]].concat());
    assert_eq!(header, "t_s,n_m,e_m,d_m,vn,ve,vd,qw,qx,qy,qz,wx,wy,wz");
    assert!(body.len() == 201 && rigid.len() == 201 && !err.contains("too few"), "{err}");
    let shaken = [
        "--set",
        "camera.mount.vibration=[{ axis = \"roll\", amplitude_deg = 0.5, hz = 17, phase_deg = 30 }]",
    ];
    let (_, shaken, err) = track(&[&still[2..], &shaken[..], &["--of", "camera"]].concat());
    assert!(!err.contains("too few"), "{err}");
    for (i, (body, (rigid, shaken))) in body.iter().zip(rigid.iter().zip(&shaken)).enumerate() {
        assert_eq!((body[0], body[0]), (rigid[0], shaken[0]));
        let quaternion = |row: &[f64]| glam::DQuat::from_xyzw(row[1], row[2], row[3], row[0]);
        let (of_body, of_rigid, of_shaken) =
            (quaternion(&body[10..14]), quaternion(&rigid[7..11]), quaternion(&shaken[7..11]));
        // The camera looks straight down with its top towards the nose, 2 m ahead.
        let ahead = of_body * glam::DVec3::new(2.0, 0.0, 0.0);
        let apart = glam::DVec3::new(rigid[1] - body[1], rigid[2] - body[2], rigid[3] - body[3]);
        assert!((apart - ahead).length() < 1e-9, "{apart} {ahead}");
        assert!((of_rigid * glam::DVec3::Z - of_body * glam::DVec3::Z).length() < 1e-9);
        assert!((of_rigid * -glam::DVec3::Y - of_body * glam::DVec3::X).length() < 1e-9);
        // The window begins 10 s after the first good row, where the phase is zero; the rotation is about the
        // body's forward axis, before the mount.
        let angle_rad = 0.5_f64.to_radians()
            * (std::f64::consts::TAU * 17.0 * (10.0 + 0.01 * i as f64) + 30_f64.to_radians()).sin();
        let expected = of_body * glam::DQuat::from_rotation_x(angle_rad) * of_body.inverse() * of_rigid;
        assert!(of_shaken.angle_between(expected) < 1e-7, "{i}: {}", of_shaken.angle_between(expected));
    }
    let (_, _, err) = track(&["--of", "camera", "--rate", "30", "--set", "output.stamps=zero"]);
    assert!(
        err.contains("30 rows per second are too few for the mount's vibration of 17 Hz: use --rate 136"),
        "{err}"
    );
    assert!(fs::read_to_string(&table).unwrap().lines().nth(1).unwrap().starts_with("0.000000000,"));
}

#[test]
fn explain_prints_the_frame_of_source_coordinates() {
    let scenario = assets().join("pattern.toml");
    let (code, out, err) = camsim(["explain", text(&scenario), "--frame", "3", "--json"]);
    assert_eq!(code, 0, "{err}");
    let explained: serde_json::Value = serde_json::from_str(&out).unwrap();
    let (plan, source) = (&explained["plan"], &explained["source_frame"]);
    assert_eq!(source["ideal_width_px"], plan["ideal_size_px"][0]);
    assert_eq!(
        (&source["ideal_fx_px"], &source["ideal_cy_px"]),
        (&plan["ideal_focal_px"][0], &plan["ideal_principal_px"][1])
    );
    let q: Vec<f64> =
        source["ideal_q_wxyz"].as_array().unwrap().iter().map(|q| q.as_f64().unwrap()).collect();
    assert!((q.iter().map(|q| q * q).sum::<f64>() - 1.0).abs() < 1e-9 && source["ideal_t_ns"].is_i64());
    let (_, out, _) = camsim(["explain", text(&scenario), "--frame", "3"]);
    let width = &source["ideal_width_px"];
    assert!(
        out.contains(&format!("source coordinates (x, y of coords) are in a frame of {width}x"))
            && out.contains("ned_from_camera w "),
        "{out}"
    );
}

#[test]
fn files_that_are_no_scenario_are_recognised() {
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
fn predicted_error_is_listed_by_cause() {
    let scenario = assets().join("pattern.toml");
    let explain = |more: &[&str]| {
        let (code, out, err) = camsim([&["explain", text(&scenario)][..], more].concat());
        assert_eq!(code, 0, "{err}");
        out
    };
    let out = explain(&[]);
    assert!(
        out.contains("predicted source error")
            && out.contains("within the tolerance")
            && out.contains("single precision"),
        "{out}"
    );
    let of = |more: &[&str]| {
        serde_json::from_str::<serde_json::Value>(&explain(&[&["--json"][..], more].concat())).unwrap()["plan"].clone()
    };
    let plan = of(&[]);
    let predicted = &plan["predicted"];
    let total_px = predicted["total_px"].as_f64().unwrap();
    assert!(
        total_px > 0.0
            && total_px <= 0.05
            && predicted["source_error_kept"] == true
            && predicted["source_error_obstacle"].is_null(),
        "{predicted}"
    );
    // The paper's motion model is less accurate, and single precision has a floor: both are listed.
    let [linear, exact] =
        ["linear", "reproject"].map(|solver| of(&["--set", &format!("quality.solver={solver}")]));
    let temporal_px = |plan: &serde_json::Value| plan["predicted"]["temporal_px"].as_f64().unwrap();
    assert!(temporal_px(&linear) > temporal_px(&exact), "{linear} {exact}");
    // The picture error has its own tolerance.
    assert!(
        predicted["picture_error_kept"] == true && predicted["picture_error_obstacle"].is_null(),
        "{predicted}"
    );
    let coarse = of(&["--set", "quality.max_error_dn=1e-3"]);
    assert!(
        coarse["predicted"]["picture_error_kept"] == false
            && coarse["predicted"]["picture_error_obstacle"].as_str().unwrap().contains("/255"),
        "{coarse}"
    );
    let floor = of(&["--set", "quality.max_error_px=1e-7"]);
    assert!(
        floor["predicted"]["source_error_kept"] == false
            && floor["predicted"]["source_error_obstacle"].as_str().unwrap().contains("the lens inverse"),
        "{floor}"
    );
}

#[test]
fn printed_default_scenario_is_valid() {
    let (code, out, _) = camsim(["render", "--print-default"]);
    assert_eq!(code, 0);
    for key in ["[flight]", "[tracker]", "[camera", "[scene", "[quality]", "[output]"] {
        assert!(out.contains(key), "{key}");
    }
}

#[test]
fn invalid_input_is_refused_with_place_and_remedy() {
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
            vec!["render", &scenario, "--backend", "gpu", "--set", "quality.solver=oracle"],
            "leave --backend out",
        ),
        (vec!["verify", &scenario, "--set", "quality.solver=oracle"], "the reference of this command"),
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
        (vec!["camera", "import", &words], "known are"),
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
fn unwritable_folders_are_failures_of_the_run() {
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
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn failed_experiment_does_not_stop_the_others() {
    let folder = tempfile::tempdir().unwrap();
    let (code, out, err) =
        camsim(["reproduce", "lens", "interlace", "--width", "96", "-o", text(folder.path())]);
    assert_eq!(code, 1, "{err}");
    assert!(
        err.contains("lens: error: no circle of the target was found") && err.contains("96 px wide"),
        "{err}"
    );
    assert!(err.contains("1 of 2 experiments failed: lens"), "{err}");
    assert!(out.contains("8.7, fig. 20") && folder.path().join("interlace/report.md").is_file(), "{out}");
}

#[test]
fn apply_renders_an_image_of_another_program() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    fs::copy(assets().join("acircles.png"), file("ideal.png")).unwrap();
    let (camera, frame, out) = (file("CAMERA.toml"), file("FRAME.toml"), file("out.png"));
    fs::write(&camera, "size_px = [64, 48]\nfocal_px = [60.0, 60.0]\n[shutter]\nreadout_ms = 33.0\n")
        .unwrap();
    let turning =
        "color = \"ideal.png\"\nfocal_px = [300.0, 300.0]\n[motion]\nangular_rate_rad_s = [0.0, 0.0, 1.0]\n";
    fs::write(&frame, turning).unwrap();
    for solver in ["linear", "rk2", "reproject"] {
        let (code, answer, err) =
            camsim(["apply", text(&camera), text(&frame), "--solver", solver, "-o", text(&out)]);
        assert_eq!((code, answer.as_str()), (0, ""), "{err}");
        assert!(err.contains("64x48"), "{err}");
    }
    // The paper's two models differ slightly for a rotation of half a degree.
    let other = file("linear.png");
    assert_eq!(
        camsim(["-q", "apply", text(&camera), text(&frame), "--solver", "linear", "-o", text(&other)]).0,
        0
    );
    let (_, report, _) = camsim(["compare", text(&out), text(&other), "--json"]);
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    assert!(report["rmse"].as_f64().unwrap() < 0.02, "{report}");
    assert_eq!(
        camsim([
            "-q",
            "apply",
            text(&camera),
            text(&frame),
            "--preset",
            "paper",
            "-o",
            text(&file("out.exr"))
        ])
        .0,
        0
    );
    assert!(file("out.exr").is_file());

    for (solver, expected) in [("reproject", 2), ("linear", 2), ("rk2", 0)] {
        let (code, _, err) = camsim([
            "apply",
            text(&camera),
            text(&frame),
            "--preset",
            "paper",
            "--solver",
            solver,
            "-o",
            text(&out),
        ]);
        assert!(
            code == expected && err.contains("--solver is rk2 with --preset paper") == (code == 2),
            "{solver}: {err}"
        );
    }

    // An image of sky only is valid, with a warning that velocity has no effect.
    let png = fs::read(file("ideal.png")).unwrap();
    // Width and height are in the first chunk of a PNG.
    let [width, height] = [16, 20].map(|at| u32::from_be_bytes(png[at..at + 4].try_into().unwrap()));
    let sky: Vec<u8> = format!("P5\n{width} {height}\n65535\n")
        .bytes()
        .chain(vec![0; 2 * (width * height) as usize])
        .collect();
    fs::write(file("sky.pgm"), sky).unwrap();
    let depth = "depth = \"sky.pgm\"\ndepth_per_metre = 1000\n[motion]";
    fs::write(&frame, turning.replace("[motion]", depth).replace("angular_rate_rad_s", "velocity_m_s"))
        .unwrap();
    let (code, _, err) = camsim(["apply", text(&camera), text(&frame), "-o", text(&out)]);
    assert!(code == 0 && err.contains("FRAME.toml: no pixel has a depth"), "{err}");
    fs::write(file("poses.csv"), "t_s,x,y,z,qw,qx,qy,qz\n0,0,0,0,1,0,0,0\n1,1,0,0,1,0,0,0\n").unwrap();

    for (change, wanted) in [
        (turning.replace("color =", "colour ="), "did you mean `color`?"),
        (turning.replace("angular_rate_rad_s", "velocity_m_s"), "depth: is missing"),
        (turning.replace("ideal.png", "none.png"), "none.png: cannot be read"),
        (
            format!("{turning}[fog]\nend_m = 10.0\ncolor = [0.0, 0.0, 0.0]\n"),
            "FRAME.toml: linear fog after the blur belongs",
        ),
        (
            turning
                .replace("angular_rate_rad_s = [0.0, 0.0, 1.0]", "trajectory = \"poses.csv\"\nstamp_s = 9.0")
                .replace("[motion]", depth),
            "FRAME.toml: the trajectory covers",
        ),
    ] {
        fs::write(&frame, change).unwrap();
        let (code, _, err) = camsim(["apply", text(&camera), text(&frame), "-o", text(&out)]);
        assert!(code == 2 && err.contains(wanted), "{err}");
    }
    let (code, _, err) = camsim(["apply", text(&camera), text(&frame), "-o", "picture.jpg"]);
    assert!(code == 2 && err.contains(".exr or .png"), "{err}");
    fs::write(&camera, "[camera]\nsize_px = [64, 48]\n").unwrap();
    let (code, _, err) = camsim(["apply", text(&camera), text(&frame), "-o", text(&out)]);
    assert!(
        code == 2
            && err.contains("CAMERA.toml:1: camera: a CAMERA.toml has the keys of [camera] at its root"),
        "{err}"
    );
    fs::write(&camera, "size_px = [64, 48]\nfocal_px = [60.0, 60.0]\n[shutter]\nreadout_ms = -33.0\n")
        .unwrap();
    let (code, _, err) = camsim(["apply", text(&camera), text(&frame), "-o", text(&out)]);
    assert!(code == 2 && err.contains("shutter.readout_ms: must be"), "{err}");
}

#[test]
fn apply_renders_a_folder_of_images() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    fs::create_dir(file("rgb")).unwrap();
    for i in 0..4 {
        fs::copy(assets().join("acircles.png"), file(&format!("rgb/{i}.5.png"))).unwrap();
    }
    let (camera, frames, out) = (file("CAMERA.toml"), file("FRAMES.toml"), file("out"));
    fs::write(
        &camera,
        "size_px = [64, 48]\nfocal_px = [60.0, 60.0]\n[shutter]\nreadout_ms = \
                        33.0\n[photometric]\nnoise_sigma = 0.01\n",
    )
    .unwrap();
    let twist = "color = \"rgb/*.png\"\nname_unit = \"s\"\nfocal_px = [300.0, \
                 300.0]\n[motion]\nangular_rate_rad_s = [0.0, 0.0, 1.0]\n";
    fs::write(&frames, twist).unwrap();
    let apply = |more: &[&str]| {
        camsim(["apply", text(&camera), text(&frames), "-o", text(&out)].iter().chain(more).copied())
    };
    let (code, _, err) = apply(&["--frames", "1..3", "--format", "png,exr"]);
    assert!(code == 0 && err.contains("2 frames in"), "{err}");
    let table = fs::read_to_string(out.join("frames.csv")).unwrap();
    let rows: Vec<&str> = table.lines().collect();
    assert_eq!(rows[0], "frame,stamp_ns,from_color,from_depth,color_png,color_exr,valid");
    assert!(
        rows.len() == 3
            && rows[1].starts_with("1,1500000000,")
            && rows[1].ends_with("color/frame_000001.exr,valid/frame_000001.png"),
        "{table}"
    );
    for name in ["color/frame_000002.png", "valid/frame_000002.png", "run.json", "camera.toml"] {
        assert!(out.join(name).is_file(), "{name}");
    }
    assert!(!out.join("color/frame_000000.png").exists() && !out.join("depth").exists());

    // Existing frames are kept, missing ones equal those of a single run, and the table lists both.
    let kept = fs::read(out.join("color/frame_000001.exr")).unwrap();
    fs::remove_file(out.join("color/frame_000002.exr")).unwrap();
    let (code, _, err) = apply(&["--resume", "--format", "png,exr"]);
    assert!(code == 0 && err.contains("3 frames (1 existed)"), "{err}");
    assert_eq!(fs::read(out.join("color/frame_000001.exr")).unwrap(), kept);
    assert_eq!(fs::read_to_string(out.join("frames.csv")).unwrap().lines().count(), 5);
    let alone = file("alone");
    assert_eq!(
        camsim(["-q", "apply", text(&camera), text(&frames), "-o", text(&alone), "--frames", "1"]).0,
        0
    );
    assert_eq!(
        fs::read(alone.join("color/frame_000001.exr")).unwrap(),
        kept,
        "a frame does not depend on those beside it"
    );
    let noise = |frame: u32| fs::read(out.join(format!("color/frame_00000{frame}.exr"))).unwrap();
    assert_ne!(noise(1), noise(2), "noise is of the frame");

    // The table that it writes is accepted as a table of frames.
    let again = file("AGAIN.toml");
    fs::write(&again, "frames = \"out/frames.csv\"\nfocal_px = [60.0, 60.0]\n").unwrap();
    let (code, _, err) =
        camsim(["apply", text(&camera), text(&again), "-o", text(&file("twice")), "--frames", "0"]);
    assert!(code == 0, "{err}");

    let (code, _, err) = apply(&["--resume", "--seed", "3"]);
    assert!(code == 2 && err.contains("seed was 0, now 3"), "{err}");
    // A changed input image is detected as well.
    let picture = file("rgb/1.5.png");
    let was = fs::read(&picture).unwrap();
    fs::write(&picture, [&was[..], b"more"].concat()).unwrap();
    let (code, _, err) = apply(&["--resume"]);
    assert!(
        code == 2 && err.contains("from other inputs: pictures.") && err.contains("rgb/1.5.png"),
        "{err}"
    );
    fs::write(&picture, was).unwrap();
    let (code, _, err) = apply(&["--frames", "3..9"]);
    assert!(code == 2 && err.contains("names frames 0 to 3"), "{err}");
    let (code, _, err) = camsim(["apply", text(&camera), text(&frames), "-o", text(&file("p.png"))]);
    assert!(code == 2 && err.contains("names 4 frames, so it must be a folder"), "{err}");

    // A trajectory that does not cover all frames is an error before anything is written.
    fs::write(file("poses.csv"), "t_s,x,y,z,qw,qx,qy,qz\n1,0,0,0,1,0,0,0\n3,0,0,0,1,0,0,0\n").unwrap();
    fs::write(&frames, twist.replace("angular_rate_rad_s = [0.0, 0.0, 1.0]", "trajectory = \"poses.csv\""))
        .unwrap();
    let new = file("new");
    let (code, _, err) = camsim(["apply", text(&camera), text(&frames), "-o", text(&new)]);
    assert!(
        code == 2 && err.contains("2 of 4 frames, first frame 0") && err.contains("it covers --frames 1..=2"),
        "{err}"
    );
    assert!(!new.exists());
    // A trajectory with gaps gives a warning.
    let (_, _, err) = camsim(["apply", text(&camera), text(&frames), "-o", text(&new), "--frames", "1..3"]);
    assert!(
        err.contains(
            "FRAMES.toml: 2 of 2 frames, first frame 1, are in gaps of the trajectory of up to 2.0 s"
        ),
        "{err}"
    );

    // A single frame has no folder.
    fs::write(&frames, "color = \"rgb/0.5.png\"\nfocal_px = [300.0, 300.0]\n").unwrap();
    let (code, _, err) = camsim(["apply", text(&camera), text(&frames), "-o", text(&new)]);
    assert!(code == 2 && err.contains("a single frame is an image"), "{err}");
    let (code, _, err) =
        camsim(["apply", text(&camera), text(&frames), "-o", text(&file("p.png")), "--resume"]);
    assert!(code == 2 && err.contains("--resume is for several frames"), "{err}");
}
