//! `camsim new`: what it writes renders.

#![allow(clippy::unwrap_used)]

use std::{
    fs,
    path::{Path, PathBuf},
};

fn camsim(args: &[&str]) -> (u8, String, String) {
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let args = ["camsim"].iter().chain(args).map(Into::into);
    let code = camsim_cli::run(args, &mut out, &mut err);
    (code, String::from_utf8(out).unwrap(), String::from_utf8(err).unwrap())
}

fn assets() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets")
}

#[test]
fn every_camera_and_purpose_renders_without_a_file() {
    let folder = tempfile::tempdir().unwrap();
    for like in ["drone", "euroc", "mapping"] {
        for purpose in ["odometry", "calibration", "mapping", "learning"] {
            let scenario = folder.path().join(format!("{like}-{purpose}/flight.toml"));
            let scenario = scenario.to_str().unwrap();
            let (code, out, err) = camsim(&["new", scenario, "--like", like, "--for", purpose]);
            assert_eq!((code, err.as_str()), (0, ""), "{like} {purpose}");
            assert!(out.contains(" frames, "), "{out}");
            assert_eq!(out.contains("m above ground"), purpose != "calibration", "{out}");
            let frames = folder.path().join("frames");
            let _ = fs::remove_dir_all(&frames);
            let cameras = if like == "euroc" { "cameras.*" } else { "camera" };
            let scale = format!("{cameras}.resized.scale=0.125");
            let frames = frames.to_str().unwrap();
            let args = ["-q", "render", scenario, "-o", frames, "--frames", "2..3", "--set", &scale];
            let args = [&args[..], &["--backend", "cpu", "--format", "none"]].concat();
            let (code, _, err) = camsim(&args);
            assert_eq!((code, err.as_str()), (0, ""), "{like} {purpose}");
        }
    }
}

#[test]
fn files_are_named_from_the_scenarios_folder_on() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["demo_flight.csv", "demo_dem.tif", "demo_ortho.jpg", "demo_camera.toml", "vignette.png"] {
        fs::copy(assets().join(name), folder.path().join(name)).unwrap();
    }
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let scenario = path("deeper/own.toml");
    let files = ["demo_flight.csv", "demo_dem.tif", "demo_ortho.jpg", "demo_camera.toml"].map(path);
    let [log, dem, ortho, camera] = files.each_ref().map(String::as_str);
    let with = ["new", &scenario, "--log", log, "--terrain", dem, "--ortho", ortho, "--camera", camera];
    let (code, out, err) = camsim(&with);
    assert_eq!(code, 0, "{err}");
    assert!(out.contains("camera: 1381 frames"), "{out}");
    let text = fs::read_to_string(&scenario).unwrap();
    assert!(
        text.contains("log = \"../demo_flight.csv\"") && text.contains("camera = \"../demo_camera.toml\""),
        "{text}"
    );
    assert_eq!(fs::read_dir(folder.path().join("deeper")).unwrap().count(), 1);

    let (code, _, err) = camsim(&with);
    assert_eq!(code, 2);
    assert!(err.contains("own.toml is there already"), "{err}");
}

#[test]
fn a_log_of_heights_above_take_off_needs_its_terrain_only() {
    let folder = tempfile::tempdir().unwrap();
    let text = fs::read_to_string(assets().join("demo_flight.csv")).unwrap();
    // The ground below the first row is 3117 m above the sea, which the DEM says.
    let relative = text.lines().map(|line| match line.split(',').collect::<Vec<_>>()[..] {
        [t_s, lat, lon, height, ref attitude @ ..] if height != "height_m" => {
            let up_m = height.parse::<f64>().unwrap() - 3117.0;
            format!("{t_s},{lat},{lon},{up_m:.2},{}\n", attitude.join(","))
        }
        _ => line.replace("height_m", "height_above_takeoff(m)") + "\n",
    });
    let log = folder.path().join("dji.csv");
    fs::write(&log, relative.collect::<String>()).unwrap();
    let scenario = folder.path().join("flight.toml");
    let (log, scenario) = (log.to_str().unwrap(), scenario.to_str().unwrap());
    let (code, _, err) = camsim(&["new", scenario, "--log", log]);
    assert!(
        code == 2 && err.contains("set flight.height = \"takeoff\"") && err.contains("--height"),
        "{err}"
    );
    let takeoff = ["new", scenario, "--log", log, "--height", "takeoff"];
    let (code, _, err) = camsim(&takeoff);
    assert!(code == 2 && err.contains("needs --terrain"), "{err}");
    let dem = assets().join("demo_dem.tif");
    let (code, out, err) = camsim(&[&takeoff[..], &["--terrain", dem.to_str().unwrap()]].concat());
    assert!(code == 0 && out.contains("m above ground"), "{out}{err}");
}

#[test]
fn what_cannot_be_is_refused_before_a_file_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let scenario = folder.path().join("new/flight.toml");
    let scenario = scenario.to_str().unwrap();
    let log = assets().join("demo_flight.csv");
    let log = log.to_str().unwrap();
    for (options, wanted) in [
        (vec!["--log", log, "--for", "calibration"], "leave out --log"),
        (vec!["--terrain", "no-such.tif"], "no-such.tif"),
        (vec!["--ortho", "ortho.jpg"], "--terrain"),
        (vec!["--height", "takeoff"], "--log"),
        (vec!["--camera", log, "--like", "euroc"], "--like"),
    ] {
        let (code, _, err) = camsim(&[&["new", scenario][..], &options].concat());
        assert!(code == 2 && err.contains(wanted), "{err}");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "{options:?}");
    }
}

#[test]
fn no_file_of_the_users_is_written_over() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("board_motion.csv");
    fs::write(&log, "mine").unwrap();
    let scenario = folder.path().join("flight.toml");
    let (code, _, err) = camsim(&["new", scenario.to_str().unwrap(), "--for", "calibration"]);
    assert!(code == 2 && err.contains("board_motion.csv is there already"), "{err}");
    assert_eq!(fs::read_to_string(&log).unwrap(), "mine");
    assert!(!scenario.exists());
}
