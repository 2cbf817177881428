//! Calibrations in and out through the command line.

#![allow(clippy::unwrap_used)]

mod program;

use std::{fs, path::Path};

/// Runs camsim. Returns exit code, standard output and standard error.
fn camsim(args: &[&str]) -> (u8, String, String) {
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let args = std::iter::once("camsim").chain(args.iter().copied()).map(Into::into);
    let code = camsim_cli::run(args, &mut out, &mut err);
    (code, String::from_utf8(out).unwrap(), String::from_utf8(err).unwrap())
}

/// Kalibr's chain of two cameras; the second is 0.11 m to the right of the first.
const CHAIN: &str = "cam0:
  T_cam_imu:
    - [0.0, -1.0, 0.0, 0.0]
    - [0.0, 0.0, -1.0, 0.0]
    - [1.0, 0.0, 0.0, -0.05]
    - [0.0, 0.0, 0.0, 1.0]
  timeshift_cam_imu: -0.004
  camera_model: pinhole
  distortion_coeffs: [-0.28, 0.07, 0.0002, 0.00002]
  distortion_model: radtan
  intrinsics: [458.654, 457.296, 367.215, 248.375]
  resolution: [752, 480]
  line_delay: 0.00003
cam1:
  T_cam_imu:
    - [0.0, -1.0, 0.0, -0.11]
    - [0.0, 0.0, -1.0, 0.0]
    - [1.0, 0.0, 0.0, -0.05]
    - [0.0, 0.0, 0.0, 1.0]
  T_cn_cnm1:
    - [1.0, 0.0, 0.0, -0.11]
    - [0.0, 1.0, 0.0, 0.0]
    - [0.0, 0.0, 1.0, 0.0]
    - [0.0, 0.0, 0.0, 1.0]
  camera_model: ds
  distortion_coeffs: []
  distortion_model: none
  intrinsics: [-0.24, 0.57, 349.756, 348.724, 365.894, 249.329]
  resolution: [752, 480]
";

fn file(folder: &Path, name: &str, text: &str) -> String {
    let path = folder.join(name);
    fs::write(&path, text).unwrap();
    path.to_str().unwrap().to_owned()
}

#[test]
fn chains_become_rigs_that_scenarios_name() {
    let folder = tempfile::tempdir().unwrap();
    let base = folder.path();
    camsim_io::builtin::unpack(base).unwrap();
    let chain = file(base, "camchain.yaml", CHAIN);
    let path = |name: &str| base.join(name).to_str().unwrap().to_owned();
    let (code, _, err) = camsim(&["camera", "import", &chain, "--rig", "-o", &path("rig.toml")]);
    assert_eq!(code, 0, "{err}");
    assert!(err.contains("x forward, y left, z up") && !err.contains("not applied: cam0.T_cam_imu"), "{err}");
    let rig = fs::read_to_string(path("rig.toml")).unwrap();
    let rig: toml::Table = rig.parse().unwrap();
    let [first, second] = &rig["cameras"].as_array().unwrap()[..] else { panic!("{rig}") };
    let floats = |value: &toml::Value| -> Vec<f64> {
        value.as_array().unwrap().iter().map(|number| number.as_float().unwrap()).collect()
    };
    // Forward, level, 5 cm ahead of the IMU; the second one to the right.
    assert_eq!(floats(&first["mount"]["angles_deg"]), [0.0; 3]);
    assert_eq!(floats(&first["mount"]["offset_m"]), [0.05, 0.0, 0.0]);
    assert_eq!(floats(&second["mount"]["offset_m"]), [0.05, 0.11, 0.0]);
    assert_eq!(first["clock_offset_ms"].as_float(), Some(4.0));
    assert_eq!(first["shutter"]["readout_ms"].as_float(), Some(14.4));

    // A scenario that names the file, and its cameras as another chain.
    let text = fs::read_to_string(path("pattern.toml")).unwrap();
    let (head, tail) = (&text[..text.find("[camera]").unwrap()], &text[text.find("[scene]").unwrap()..]);
    let scenario = file(base, "flight.toml", &format!("cameras = \"rig.toml\"\n{head}{tail}"));
    let (code, _, err) =
        camsim(&["camera", "export", &scenario, "--as", "kalibr", "-o", &path("again.yaml")]);
    assert_eq!(code, 0, "{err}");
    let (code, again, err) = camsim(&["camera", "import", &path("again.yaml"), "--rig"]);
    assert_eq!(code, 0, "{err}");
    let again: toml::Table = again.parse().unwrap();
    assert_eq!(again, rig);
    let (code, out, err) = camsim(&["lens", &path("rig.toml"), "--camera", "cam1", "check"]);
    assert!(code == 0 && out.contains("one ray per pixel"), "{out} {err}");
    let wrong = file(base, "wrong.toml", &format!("cameras = \"pattern.toml\"\n{head}{tail}"));
    let (code, _, err) = camsim(&["explain", &wrong]);
    assert!(code != 0 && err.contains("a file with [[cameras]] and nothing else"), "{err}");
}

#[test]
fn sizes_complete_files_without_one() {
    let folder = tempfile::tempdir().unwrap();
    let text = "%YAML:1.0\nCamera.fx: 517.3\nCamera.fy: 516.5\nCamera.cx: 318.6\nCamera.cy: 255.3\nCamera.k1: 0.26\n\
                Camera.k2: -0.95\nCamera.p1: -0.005\nCamera.p2: 0.002\nCamera.k3: 1.16\nCamera.fps: 30.0\n";
    let path = file(folder.path(), "TUM1.yaml", text);
    let (code, _, err) = camsim(&["camera", "import", &path]);
    assert!(code != 0 && err.contains("--size"), "{err}");
    let (code, out, err) = camsim(&["camera", "import", &path, "--size", "640x480"]);
    assert!(
        code == 0 && out.contains("size_px = [\n    640,\n    480,\n]")
            || out.contains("size_px = [640, 480]"),
        "{out} {err}"
    );
    let stated = file(folder.path(), "own.yaml", &format!("{text}Camera.width: 320\nCamera.height: 240\n"));
    let (code, _, err) = camsim(&["camera", "import", &stated, "--size", "640x480"]);
    assert!(code != 0 && err.contains("the file states 320 x 240"), "{err}");
}

#[test]
fn stmaps_are_lens_tables() {
    let folder = tempfile::tempdir().unwrap();
    let camera = file(
        folder.path(),
        "camera.toml",
        "size_px = [80, 60]\nfocal_px = [60.0, 60.5]\nprincipal_point_px = [39.25, 30.5]\n\
         lens = { model = \"brown-conrady\", coefficients = [-0.2, 0.03, 0.001, -0.002] }\n",
    );
    let maps = folder.path().join("maps");
    let (code, _, err) =
        camsim(&["camera", "export", &camera, "--as", "stmap", "-o", maps.to_str().unwrap()]);
    assert_eq!(code, 0, "{err}");
    let table = file(
        folder.path(),
        "table.toml",
        "size_px = [80, 60]\nfocal_px = [60.0, 60.5]\nprincipal_point_px = [39.25, 30.5]\n\
         lens_table = \"maps/distort.exr\"\nlens = { model = \"table\" }\n",
    );
    let points = file(folder.path(), "points.csv", "u,v\n0,0\n0.3,0.2\n-0.45,0.31\n0.1,-0.35\n");
    let pixels = |camera: &str| -> Vec<f64> {
        let (code, out, err) = camsim(&["lens", camera, "distort", "--points", &points]);
        assert_eq!(code, 0, "{err}");
        out.lines().skip(1).flat_map(|line| line.split(',')).map(|cell| cell.parse().unwrap()).collect()
    };
    for (a, b) in pixels(&camera).iter().zip(pixels(&table)) {
        // Floats of fractions, and a spline between pixels.
        assert!((a - b).abs() < 1e-3, "{a} {b}");
    }
}

#[test]
fn modulation_transfer_is_that_of_lens_and_pixel() {
    let folder = tempfile::tempdir().unwrap();
    let camera = file(
        folder.path(),
        "camera.toml",
        "size_px = [160, 120]\nfocal_px = [150.0, 150.0]\n[point_spread]\nf_number = 8\npixel_um = 3.45\n\
         kernel = \"kernel.csv\"\nglare = 0.05\n",
    );
    let (code, _, err) = camsim(&["lens", &camera, "check"]);
    assert!(code != 0 && err.contains("kernel.csv") && err.contains("check point_spread.kernel"), "{err}");
    file(folder.path(), "kernel.csv", "1,2,1\n2,4,2\n1,2,1\n");
    let (code, out, err) = camsim(&["lens", &camera, "check", "--mtf", "--json"]);
    assert_eq!(code, 0, "{err}");
    let report: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(report["bijective"], true);
    let channels = report["mtf"]["channels"].as_array().unwrap();
    let names: Vec<&str> = channels.iter().map(|channel| channel["channel"].as_str().unwrap()).collect();
    assert_eq!(names, ["red", "green", "blue"]);
    for channel in channels {
        assert!(channel["largest_difference"].as_f64().unwrap() < 0.02, "{channel}");
    }
    let (code, out, err) = camsim(&["lens", &camera, "check", "--mtf"]);
    assert!(code == 0 && out.contains("cycles/px |      red    model |"), "{out}{err}");
}

#[test]
fn pictures_of_an_edge_are_measured() {
    let folder = tempfile::tempdir().unwrap();
    let camera = file(folder.path(), "camera.toml", "size_px = [160, 120]\nfocal_px = [150.0, 150.0]\n");
    // The area of each pixel beside an edge, of 200 rows of it. A slope of few digits would have the pixels at
    // few distances from the edge.
    let slope = 5_f64.to_radians().tan();
    let area = |x: u32, y: u32| {
        let row = |i: u32| {
            let edge = 60.0 + slope * (f64::from(y) + (f64::from(i) + 0.5) / 200.0 - 50.0);
            (f64::from(x) + 0.5 - edge).clamp(0.0, 1.0)
        };
        (0..200).map(row).sum::<f64>() / 200.0
    };
    let level = |x: u32, y: u32| (65535.0 * (0.2 + 0.6 * area(x, y))).round() as u16;
    let picture = image::ImageBuffer::from_fn(130, 110, |x, y| image::Luma([level(x, y)]));
    let path = folder.path().join("edge.png");
    picture.save(&path).unwrap();
    let name = path.to_str().unwrap();
    let measured = |more: &[&str]| {
        let mut args = vec!["lens", &camera, "check", "--mtf", "--picture", name, "--json"];
        args.extend(more);
        camsim(&args)
    };
    let (code, out, err) = measured(&["--linear", "--region", "5,3,115,100"]);
    assert_eq!(code, 0, "{err}");
    let report: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(report["mtf"]["region_px"], serde_json::json!([115, 100]));
    let [channel] = &report["mtf"]["channels"].as_array().unwrap()[..] else { panic!("{out}") };
    // The model is the pixel alone.
    assert!(channel["largest_difference"].as_f64().unwrap() < 0.01, "{channel}");
    for (more, wanted) in [
        (&["--region", "5,3,200,100"][..], "is not within its 130 x 110 pixels"),
        (&["--region", "80,0,40,40"], "no edge"),
        (&["--region", "1,2"], "X,Y,WIDTH,HEIGHT"),
    ] {
        let (code, _, err) = measured(more);
        assert!(code != 0 && err.contains(wanted), "{err}");
    }
}
