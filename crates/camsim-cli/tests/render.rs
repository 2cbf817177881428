//! Runs of `camsim render` with shards, resume and timing, and of `camsim verify`.

#![allow(clippy::unwrap_used)]

use std::{ffi::OsString, fs, path::Path};

/// Runs camsim. Returns exit code, standard output and standard error.
fn camsim(args: &[&str]) -> (u8, String, String) {
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let args = std::iter::once("camsim").chain(args.iter().copied()).map(OsString::from);
    let code = camsim_cli::run(args, &mut out, &mut err);
    (code, String::from_utf8(out).unwrap(), String::from_utf8(err).unwrap())
}

fn bytes(folder: &Path, file: &str) -> Vec<u8> {
    fs::read(folder.join(file)).unwrap()
}

fn run_json(folder: &Path) -> serde_json::Value {
    serde_json::from_slice(&bytes(folder, "run.json")).unwrap()
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn shards_and_resume_give_the_bytes_of_one_run() {
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/pattern.toml");
    let temporary = tempfile::tempdir().unwrap();
    let (whole, parts) = (temporary.path().join("whole"), temporary.path().join("parts"));
    let render = |folder: &Path, more: &[&str]| {
        let common = [
            "render",
            scenario.to_str().unwrap(),
            "-o",
            folder.to_str().unwrap(),
            "--outputs",
            "color,rows",
            "--format",
            "exr,png",
        ];
        // A small camera is enough for the order of frames.
        let small = [
            "--set",
            "camera.size_px=[96, 72]",
            "--set",
            "camera.focal_px=[63, 63]",
            "--set",
            "camera.principal_point_px=[47.5, 35.5]",
        ];
        camsim(&[&common[..], &small, &["--set", "camera.photometric.noise_sigma=0.01"], more].concat())
    };
    let (code, out, err) = render(&whole, &["--frames", "2..6"]);
    assert!(code == 0 && out.starts_with("4 frames in"), "{out}{err}");
    for shard in ["2/2", "1/2"] {
        let (code, out, err) = render(&parts, &["--frames", "2..6", "--shard", shard]);
        assert!(code == 0 && out.starts_with("2 frames in"), "{out}{err}");
    }
    fs::remove_file(parts.join("color/frame_000004.exr")).unwrap();
    let (code, out, err) = render(&parts, &["--frames", "2..6", "--resume"]);
    assert!(code == 0 && out.starts_with("1 frames (3 existed)"), "{out}{err}");
    for frame in 2..6 {
        for file in [
            format!("color/frame_{frame:06}.exr"),
            format!("color/frame_{frame:06}.png"),
            format!("rows/frame_{frame:06}.csv"),
        ] {
            assert_eq!(bytes(&whole, &file), bytes(&parts, &file), "{file}");
        }
    }
    for table in ["camera.toml", "trajectory.csv", "frames.csv"] {
        assert_eq!(bytes(&whole, table), bytes(&parts, table), "{table}");
    }
    let (one, resumed) = (run_json(&whole), run_json(&parts));
    assert_eq!((one["written"].as_u64(), one["finished"].as_bool()), (Some(4), Some(true)));
    assert_eq!((resumed["written"].as_u64(), resumed["skipped"].as_u64()), (Some(1), Some(3)));
    assert_eq!(one["scenario"], resumed["scenario"]);

    // Frames of another scenario are never mixed in.
    let (code, _, err) = render(&parts, &["--frames", "2..6", "--resume", "--set", "seed=99"]);
    assert!(code == 2 && err.contains("seed"), "{err}");
}

/// The same scenario with a changed input file is detected.
#[test]
fn resume_detects_changed_input_files() {
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets");
    let temporary = tempfile::tempdir().unwrap();
    let text = fs::read_to_string(assets.join("pattern.toml")).unwrap();
    let log = text.lines().find_map(|line| line.strip_prefix("log = ")).unwrap().trim_matches('"').to_owned();
    for name in ["pattern.toml", &log, "acircles.png"] {
        fs::copy(assets.join(name), temporary.path().join(name)).unwrap();
    }
    let (scenario, folder) = (temporary.path().join("pattern.toml"), temporary.path().join("out"));
    let render = |more: &[&str]| {
        let common = [
            "render",
            scenario.to_str().unwrap(),
            "-o",
            folder.to_str().unwrap(),
            "--backend",
            "reference",
            "--outputs",
            "rows",
        ];
        let small = [
            "--set",
            "camera.size_px=[24, 18]",
            "--set",
            "camera.focal_px=[16, 16]",
            "--set",
            "camera.principal_point_px=[11.5, 8.5]",
        ];
        camsim(&[&common[..], &small, more].concat())
    };
    let (code, _, err) = render(&["--frames", "2"]);
    assert_eq!(code, 0, "{err}");
    let (code, out, err) = render(&["--frames", "2..4", "--resume"]);
    assert!(code == 0 && out.starts_with("1 frames (1 existed)"), "{out}{err}");

    let log = temporary.path().join(log);
    let rows = fs::read_to_string(&log).unwrap();
    fs::write(&log, rows.replace('1', "2")).unwrap();
    let (before, kept) = (bytes(&folder, "frames.csv"), bytes(&folder, "run.json"));
    let (code, _, err) = render(&["--frames", "2..5", "--resume"]);
    assert!(
        code == 2
            && err.contains("when a file had something else in it")
            && err.contains("../demo_flight.csv was "),
        "{err}"
    );
    assert_eq!(
        (bytes(&folder, "frames.csv"), bytes(&folder, "run.json")),
        (before, kept),
        "nothing is touched"
    );
    fs::write(&log, rows).unwrap();
    let (code, _, err) = render(&["--frames", "2..5", "--resume"]);
    assert!(code == 0 && !err.contains("another adapter"), "{err}");

    // Frames of another adapter are kept, with a warning.
    let manifest = fs::read_to_string(folder.join("run.json")).unwrap();
    let adapter = run_json(&folder)["adapter"].as_str().unwrap().to_owned();
    fs::write(folder.join("run.json"), manifest.replace(&adapter, "a card")).unwrap();
    let (code, _, err) = render(&["--frames", "2..6", "--resume"]);
    assert!(
        code == 0 && err.contains(&format!("run.json was rendered by another adapter than {adapter}")),
        "{err}"
    );
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn timing_runs_write_no_frame() {
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/pattern.toml");
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path().join("timing");
    let (code, out, err) = camsim(&[
        "render",
        scenario.to_str().unwrap(),
        "-o",
        folder.to_str().unwrap(),
        "--frames",
        "0,3",
        "--format",
        "none",
    ]);
    assert!(code == 0 && out.starts_with("2 frames in") && !folder.join("color").exists(), "{out}{err}");
    assert_eq!(run_json(&folder)["written"].as_u64(), Some(2));
    // Requested output is printed in a quiet run as well.
    let quiet = [
        "render",
        scenario.to_str().unwrap(),
        "-o",
        folder.to_str().unwrap(),
        "--frames",
        "0",
        "--format",
        "none",
        "--times",
        "-q",
    ];
    let (code, out, err) = camsim(&quiet);
    assert!(
        code == 0
            && out.starts_with("ms per frame")
            && out.contains("cpu: plan")
            && out.contains("plan of the first frame")
            && err.is_empty(),
        "{out}{err}"
    );
}

/// Environment variable of the child process that runs this test without an adapter.
const WITHOUT_ADAPTER: &str = "CAMSIM_TEST_WITHOUT_ADAPTER";

/// The reference needs no adapter, and shards give the bytes of one run.
#[test]
fn reference_renders_without_an_adapter() {
    if std::env::var_os(WITHOUT_ADAPTER).is_none() {
        let again = std::process::Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "reference_renders_without_an_adapter"])
            .env(WITHOUT_ADAPTER, "1")
            .env("VK_ICD_FILENAMES", "/nonexistent")
            .env("VK_DRIVER_FILES", "/nonexistent")
            .env("CAMSIM_ADAPTER", "no such adapter")
            .output()
            .unwrap();
        let output = String::from_utf8_lossy(&again.stdout);
        assert!(
            again.status.success() && output.contains("1 passed"),
            "{output}{}",
            String::from_utf8_lossy(&again.stderr)
        );
        return;
    }
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/pattern.toml");
    let temporary = tempfile::tempdir().unwrap();
    let folder = |name: &str| temporary.path().join(name);
    let (whole, parts) = (folder("whole"), folder("parts"));
    let render = |folder: &Path, more: &[&str]| {
        let common = [
            "render",
            scenario.to_str().unwrap(),
            "-o",
            folder.to_str().unwrap(),
            "--outputs",
            "color,depth,coords,rows",
        ];
        let small = [
            "--set",
            "camera.size_px=[48, 36]",
            "--set",
            "camera.focal_px=[32, 32]",
            "--set",
            "camera.principal_point_px=[23.5, 17.5]",
        ];
        camsim(&[&common[..], &small, more].concat())
    };
    let (code, _, err) = render(&folder("engine"), &["--frames", "2"]);
    assert_eq!(code, 3, "there should be no adapter here: {err}");

    let (code, out, err) = render(&whole, &["--frames", "2..5", "--backend", "reference"]);
    assert!(code == 0 && out.starts_with("3 frames in"), "{out}{err}");
    for shard in ["2/2", "1/2"] {
        let (code, out, err) =
            render(&parts, &["--frames", "2..5", "--shard", shard, "--set", "quality.solver=reference"]);
        assert!(code == 0, "{out}{err}");
    }
    fs::remove_file(parts.join("depth/frame_000003.exr")).unwrap();
    let (code, out, err) = render(&parts, &["--frames", "2..5", "--resume", "--backend", "reference"]);
    assert!(code == 0 && out.starts_with("1 frames (2 existed)"), "{out}{err}");
    for frame in 2..5 {
        for channel in ["color", "depth", "coords"] {
            let file = format!("{channel}/frame_{frame:06}.exr");
            assert_eq!(bytes(&whole, &file), bytes(&parts, &file), "{file}");
        }
    }
    let run = run_json(&whole);
    assert!(
        run["adapter"].as_str().is_some_and(|adapter| adapter.starts_with("reference (f64 rays, ")),
        "{run}"
    );
    assert_eq!(run["scenario"]["quality"]["solver"], "reference");

    // Scenarios that name methods are refused, because the reference renderer would ignore them.
    for (more, wanted) in [
        (vec!["--preset", "paper"], "quality.preset = \"paper\" cannot be combined with --backend reference"),
        (vec!["--set", "quality.solver=rk2"], "quality.solver = \"rk2\" cannot be combined"),
        (vec!["--set", "quality.solver=linear"], "quality.solver = \"linear\" cannot be combined"),
        (vec!["--set", "quality.solver=reproject"], "quality.solver = \"reproject\" cannot be combined"),
        (vec!["--set", "quality.iterations=3"], "quality.iterations: counts the depth look-ups"),
    ] {
        let refused = folder("refused");
        let (code, _, err) =
            render(&refused, &[&["--frames", "2", "--backend", "reference"], &more[..]].concat());
        assert!(code == 2 && err.contains(wanted) && !refused.exists(), "{more:?}: {code} {err}");
    }
    let (code, _, err) =
        render(&folder("refused"), &["--preset", "paper", "--set", "quality.solver=reference"]);
    assert!(code == 2 && err.contains("quality.solver: is rk2"), "{err}");
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn verify_prints_measured_and_predicted_errors() {
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/pattern.toml");
    let verify = |more: &[&str]| {
        let small = [
            "--set",
            "camera.size_px=[96, 72]",
            "--set",
            "camera.focal_px=[63, 63]",
            "--set",
            "camera.principal_point_px=[47.5, 35.5]",
        ];
        camsim(&[&["verify", scenario.to_str().unwrap(), "--frames", "3,20"][..], &small, more].concat())
    };
    let (code, out, err) = verify(&["--json"]);
    assert_eq!(code, 0, "{out}{err}");
    let report: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(report["kept"], true);
    for frame in report["frames"].as_array().unwrap() {
        let (measured, predicted) = (&frame["measured"]["smooth"], &frame["predicted"]);
        let p99_px = measured["p99_px"].as_f64().unwrap();
        assert!(measured["pixels"].as_u64().unwrap() > 1000 && p99_px > 0.0, "{frame}");
        assert!(
            p99_px <= predicted["total_px"].as_f64().unwrap() && frame["as_predicted"] == true,
            "{frame}"
        );
        assert!(frame["measured"]["falsely_valid"] == 0 && frame["measured"]["missing"] == 0, "{frame}");
    }
    // Linear steps at constant velocity in a turn exceed the tolerance, with exit code 1.
    let (code, out, err) = verify(&["--set", "quality.solver=linear", "--set", "quality.max_error_px=0.002"]);
    assert!(
        code == 1
            && out.contains("EXCEEDED")
            && err.contains("the source error exceeds the tolerance of 0.002 px"),
        "{out}{err}"
    );
    // More pixels than any adapter supports.
    let (code, _, err) = verify(&["--set", "camera.size_px=[20000, 20000]"]);
    assert!(
        code == 2 && err.contains("400000000 pixels") && err.contains("make camera.size_px smaller"),
        "{err}"
    );
}

/// `verify` of the pattern, which is a plane, at 96x72.
fn verify_small(more: &[&str]) -> (u8, String, String) {
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/pattern.toml");
    let small = ["--set", "camera.size_px=[96, 72]", "--set", "camera.focal_px=[63, 63]", "--frames", "3"];
    camsim(&[&["verify", scenario.to_str().unwrap()][..], &small, more].concat())
}

#[test]
fn verify_finds_no_fault_in_the_flow_of_any_readout() {
    let shakes = [
        "--set",
        "camera.mount.vibration=[{axis=\"pitch\", amplitude_deg=2.0, hz=60.0}, {axis=\"yaw\", amplitude_deg=2.0, hz=55.0}]",
        "--set",
        "camera.focal_px=[400, 400]",
    ];
    let cases: [(&str, &str, &[&str]); 9] = [
        ("top-to-bottom", "0", &[]),
        ("top-to-bottom", "0", &shakes),
        ("right-to-left", "0", &shakes),
        ("middle-outward", "0", &[]),
        ("middle-outward", "0", &shakes),
        ("edges-inward", "0", &[]),
        ("bottom-to-top", "20", &[]),
        ("left-to-right", "20", &[]),
        ("top-to-bottom", "20", &shakes),
    ];
    for (readout, interlace_ms, more) in cases {
        let sets = [
            "output.channels=[\"color\", \"flow\", \"flow_back\", \"flow_global\"]".to_owned(),
            "output.flow_instant=last-row".to_owned(),
            "camera.principal_point_px=[47.5, 35.5]".to_owned(),
            "camera.shutter.delay_ms=5".to_owned(),
            format!("camera.shutter.readout={readout}"),
            format!("camera.shutter.interlace_ms={interlace_ms}"),
        ];
        let sets = sets.iter().flat_map(|set| ["--set", set.as_str()]);
        let common: Vec<&str> = ["--backend", "cpu", "--json"].into_iter().chain(sets).collect();
        let (_, out, err) = verify_small(&[&common[..], more].concat());
        let report: serde_json::Value = serde_json::from_str(&out).unwrap();
        let flows = report["frames"][0]["flows"].as_array().unwrap();
        assert_eq!(flows.len(), 3, "{out}{err}");
        for flow in flows {
            assert_eq!(flow["faults"], 0, "{readout} {interlace_ms} {more:?}: {flow}");
        }
    }
}

/// A fast flight half a metre above the ground: within a readout the camera passes what its last rows see.
const LOW_FLIGHT: &str = r#"
seed = 5
[flight]
log = "log.csv"
format = "csv-ned"
[camera]
size_px = [40, 30]
focal_px = [30.0, 29.55]
fps = 20.0
[camera.mount]
angles_deg = [2.0, -2.0, 3.0]
[camera.shutter]
readout_ms = 30.0
readout = "bottom-to-top"
exposure_ms = 10.0
[scene]
pattern = { image = "acircles.png", width_m = 600.0, at = [0.0, 0.0, 0.0] }
[output]
channels = ["color", "range"]
"#;

#[test]
fn what_no_ideal_frame_holds_is_seen_by_rays() {
    let temporary = tempfile::tempdir().unwrap();
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets");
    fs::copy(assets.join("acircles.png"), temporary.path().join("acircles.png")).unwrap();
    let log = "t_s,n_m,e_m,d_m,roll_deg,pitch_deg,yaw_deg\n0,0,0,-0.5,0,0,0\n2,50,2,-0.5,0,0,20\n";
    fs::write(temporary.path().join("log.csv"), log).unwrap();
    let scenario = temporary.path().join("low.toml");
    fs::write(&scenario, LOW_FLIGHT).unwrap();
    let args =
        ["verify", scenario.to_str().unwrap(), "--backend", "cpu", "--frames", "5", "--json", "--pictures"];
    let (_, out, err) = camsim(&args);
    let report: serde_json::Value = serde_json::from_str(&out).expect(&err);
    let frame = &report["frames"][0];
    assert!(frame["measured"]["missing"] == 0 && frame["planes"][0]["faults"] == 0, "{frame}");
    assert!(frame["picture"]["psnr_db"].as_f64().unwrap() > 35.0, "{frame}");
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn picture_error_above_tolerance_fails_and_unpredicted_causes_are_named() {
    let centre = ["--set", "camera.principal_point_px=[47.5, 35.5]", "--pictures"];
    let verify = |more: &[&str]| verify_small(&[&centre[..], more].concat());
    // The quantisation to eight bits alone exceeds the tolerance.
    let strict = ["--set", "quality.max_error_dn=0.01"];
    let (code, out, err) = verify(&strict);
    assert!(code == 1 && out.contains("quality.max_error_dn = 0.01 is EXCEEDED as predicted"), "{out}{err}");
    assert!(
        err.contains("frame 3: the picture error exceeds quality.max_error_dn = 0.01")
            && !out.contains("not predicted: "),
        "{out}{err}"
    );
    let (code, out, _) = verify(&[&strict[..], &["--json"]].concat());
    let report: serde_json::Value = serde_json::from_str(&out).unwrap();
    let frame = &report["frames"][0];
    assert!(
        code == 1 && report["kept"] == false && frame["kept"] == true && frame["picture"]["kept"] == false,
        "{out}"
    );
    // The predicted picture error includes that of wrong sources.
    let (_, out, err) = verify(&["--set", "quality.solver=linear", "--set", "quality.max_error_px=100"]);
    assert!(out.contains("is EXCEEDED as predicted") && !out.contains("not predicted: "), "{out}{err}");
    let (_, out, err) = verify(&["--preset", "paper"]);
    assert!(out.contains("not predicted: vignette, fog and stored colours"), "{out}{err}");
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn interlaced_fields_do_not_hide_an_error() {
    let centre = ["--set", "camera.principal_point_px=[47.5, 35.5]"];
    let fields = ["--json", "--set", "camera.shutter.interlace_ms=700", "--set", "quality.solver=linear"];
    let (code, out, err) = verify_small(&[&centre[..], &fields].concat());
    let report: serde_json::Value = serde_json::from_str(&out).unwrap();
    let frame = &report["frames"][0];
    assert!(code == 1 && report["kept"] == false && err.contains("frame 3: "), "{out}{err}");
    assert!(
        frame["measured"]["smooth"]["pixels"].as_u64().unwrap() > 6000
            && frame["measured"]["judged_by"] == "smooth",
        "{frame}"
    );
    assert!(
        frame["measured"]["smooth"]["p99_px"].as_f64().unwrap() > 1.0 && frame["level_of_detail"].is_null(),
        "{frame}"
    );
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn empty_frames_exceed_the_tolerance_with_a_warning() {
    // The paper's frustum is symmetric about the optical axis, which is outside of these frames.
    let pinhole = ["--set", "camera.lens.model=pinhole", "--set", "camera.lens.coefficients=[]"];
    let beside =
        [&pinhole[..], &["--set", "camera.principal_point_px=[200, 150]", "--preset", "paper"]].concat();
    let (code, out, err) = verify_small(&beside);
    assert!(
        code == 1 && out.contains("6912") && out.contains("EXCEEDED as predicted: too many pixels"),
        "{out}{err}"
    );
    assert!(err.contains("the ideal frame: 100.0 % of the pixels"), "{err}");
    let folder = tempfile::tempdir().unwrap();
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/pattern.toml");
    let render = |more: &[&str]| {
        let args =
            ["render", scenario.to_str().unwrap(), "-o", folder.path().to_str().unwrap(), "--format", "none"];
        let (code, _, err) = camsim(
            &[
                &args[..],
                &[
                    "--set",
                    "camera.size_px=[96, 72]",
                    "--set",
                    "camera.focal_px=[63, 63]",
                    "--frames",
                    "3..5",
                ],
                more,
            ]
            .concat(),
        );
        assert_eq!(code, 0, "{err}");
        err
    };
    assert!(render(&beside).contains("2 of 2 frames have no valid pixel"));
    assert!(!render(&["--set", "camera.principal_point_px=[47.5, 35.5]"]).contains("no valid pixel"));
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn predicted_tolerance_violations_are_reported_once_and_stored() {
    let folder = tempfile::tempdir().unwrap();
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/pattern.toml");
    let render = |more: &[&str]| {
        let args = [
            "render",
            scenario.to_str().unwrap(),
            "-o",
            folder.path().to_str().unwrap(),
            "--format",
            "none",
            "--frames",
            "3..5",
        ];
        let small = ["--set", "camera.size_px=[96, 72]", "--set", "camera.focal_px=[63, 63]"];
        let (code, out, err) =
            camsim(&[&args[..], &small, &["--set", "camera.principal_point_px=[47.5, 35.5]"], more].concat());
        assert_eq!(code, 0, "{out}{err}");
        (err, run_json(folder.path())["warnings"].to_string())
    };
    let strict = ["--set", "quality.max_error_px=1e-7", "--set", "quality.max_error_dn=1e-3"];
    for output in <[String; 2]>::from(render(&strict)) {
        for key in ["quality.max_error_px = 0.0000001", "quality.max_error_dn = 0.001"] {
            assert_eq!(
                output.matches(&format!("2 of 2 frames exceed {key}: in the worst, frame ")).count(),
                1,
                "{output}"
            );
        }
        assert!(
            output.contains(&format!("`camsim explain {} --set ", scenario.display()))
                && output.contains(" --frame "),
            "{output}"
        );
    }
    let lax = ["--set", "quality.max_error_dn=20"];
    for more in [
        &lax[..],
        &[&strict[..], &["--preset", "paper"]].concat(),
        &[&strict[..], &["--set", "quality.solver=linear"]].concat(),
    ] {
        for output in <[String; 2]>::from(render(more)) {
            assert!(!output.contains("exceed"), "{more:?}: {output}");
        }
    }
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn verify_prints_the_terrain_level_of_detail() {
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/demo.toml");
    let verify = |more: &[&str]| {
        let small = ["--set", "camera.size_px=[80, 60]", "--set", "camera.principal_point_px=[39.5, 29.5]"];
        camsim(&[&["verify", scenario.to_str().unwrap(), "--frames", "0"][..], &small, more].concat())
    };
    // Coarse terrain does not change the source errors; its bound is listed separately.
    let off_px = |[terrain_px, dn]: [&str; 2]| {
        let asked =
            [format!("quality.max_terrain_error_px={terrain_px}"), format!("quality.max_error_dn={dn}")];
        let (_, out, err) = verify(&["--json", "--set", &asked[0], "--set", &asked[1]]);
        let report: serde_json::Value = serde_json::from_str(&out).unwrap_or_else(|_| panic!("{out}{err}"));
        let detail = &report["frames"][0]["level_of_detail"];
        assert!(detail["triangles"].as_u64().unwrap() > 0, "{detail}");
        detail["max_error_px"].as_f64().unwrap()
    };
    let [fine, coarse] = [["0.25", "1"], ["20", "200"]].map(off_px);
    assert!(fine <= 0.25 && coarse > 1.0 && coarse <= 20.0, "{fine} {coarse}");
    // The picture error stays within its tolerance.
    let [tight, loose] = [["20", "1"], ["20", "2"]].map(off_px);
    assert!(tight < 0.5 * loose && loose < 0.5 * coarse, "{tight} {loose} {coarse}");
    let (code, out, err) = verify(&[]);
    assert!(
        code == 0 && out.contains("terrain detail") && out.contains(&format!("| {fine:>14.3} | kept")),
        "{out}{err}"
    );
}

/// A triangle, with its positions in a data URI.
const MODEL: &str = r#"{ "asset": { "version": "2.0" }, "scenes": [{ "nodes": [0] }],
    "nodes": [{ "mesh": 0, "name": "blade", "scale": [40, 40, 40] }],
  "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
  "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0],
      "max": [0.5, 0.5, 0] }],
  "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
  "buffers": [{ "byteLength": 36,
      "uri": "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAAAAPwAAAAAAAAAAAAAAAAAAAD8AAAAA" }] }"#;

#[test]
fn what_moves_is_rendered_by_all_but_the_methods_of_the_paper() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    fs::write(folder.join("model.gltf"), MODEL).unwrap();
    let log = "t_s,n_m,e_m,d_m,roll_deg,pitch_deg,yaw_deg\n0,0,0,-50,0,0,0\n1,0,0,-50,0,0,0\n";
    fs::write(folder.join("log.csv"), log).unwrap();
    let scenario = folder.join("s.toml");
    let text = "[flight]\nlog = \"log.csv\"\n[camera]\nsize_px = [32, 24]\nfocal_px = [30, 30]\n\
                mount = { angles_deg = [0, -90, 0] }\n[[scene.gltf]]\nfile = \"model.gltf\"\n\
                [[scene.gltf.motion.spin]]\naxis = [1, 0, 0]\nhz = 3\nphase_deg = -45\nnode = \"blade\"\n";
    fs::write(&scenario, text).unwrap();
    let render = |out: &str, more: &[&str]| {
        let (scenario, out) = (scenario.to_str().unwrap(), folder.join(out));
        camsim(&[&["render", scenario, "-o", out.to_str().unwrap(), "--frames", "0..2"], more].concat())
    };
    let (code, out, err) = render("paper", &["--backend", "cpu", "--set", "quality.preset=paper"]);
    assert!(code != 0 && err.contains("scene.gltf.motion"), "{out}{err}");
    let frames = ["cpu", "reference"].map(|backend| {
        let (code, out, err) = render(backend, &["--backend", backend]);
        assert!(code == 0 && out.starts_with("2 frames in"), "{out}{err}");
        [0, 1].map(|i| bytes(folder, &format!("{backend}/color/frame_00000{i}.exr")))
    });
    for [first, second] in frames {
        assert_ne!(first, second, "the blade has turned");
    }
}
