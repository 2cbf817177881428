//! `camsim export` and `output.datasets` through the command line.

#![allow(clippy::unwrap_used)]

use std::{ffi::OsString, fs, path::Path};

/// Runs camsim. Returns exit code, standard output and standard error.
fn camsim(args: &[&str]) -> (u8, String, String) {
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let args = std::iter::once("camsim").chain(args.iter().copied()).map(OsString::from);
    let code = camsim_cli::run(args, &mut out, &mut err);
    (code, String::from_utf8(out).unwrap(), String::from_utf8(err).unwrap())
}

/// The pattern by a small camera with a lens and a rolling shutter; returns the scenario.
fn scenario(base: &Path) -> String {
    camsim_io::builtin::unpack(base).unwrap();
    let text = fs::read_to_string(base.join("pattern.toml")).unwrap();
    let camera = text
        .replace("size_px = [640, 480]", "size_px = [64, 48]")
        .replace("focal_px = [420.0, 421.0]", "focal_px = [42.0, 42.0]")
        .replace("principal_point_px = [318.3, 241.2]", "principal_point_px = [31.5, 23.5]");
    let path = base.join("small.toml");
    fs::write(&path, camera).unwrap();
    path.to_str().unwrap().to_owned()
}

#[test]
fn a_scenario_is_rendered_with_what_its_layout_needs() {
    let base = tempfile::tempdir().unwrap();
    let scenario = scenario(base.path());
    let out = base.path().join("tum");
    let folder = out.to_str().unwrap();
    let args =
        ["export", &scenario, "--as", "tum", "-o", folder, "--frames", "2..4", "--backend", "cpu", "-v"];
    let (code, printed, err) = camsim(&args);
    assert_eq!(code, 0, "{err}");
    assert!(err.contains("tum needs, and gets: ") && err.contains("channel depth"), "{err}");
    assert!(printed.contains("tum of 2 pictures written: "), "{printed}");
    let lines = fs::read_to_string(out.join("groundtruth.txt")).unwrap();
    assert_eq!(lines.lines().filter(|line| !line.starts_with('#')).count(), 2);
    assert!(out.join("camsim/run.json").is_file() && out.join("README.md").is_file());
    // Again: nothing is rendered, nothing is written.
    let (code, printed, err) = camsim(&args);
    assert_eq!(code, 0, "{err}");
    assert!(printed.starts_with("0 frames (2 existed)") && printed.contains("was complete"), "{printed}");
    // The frames by themselves.
    let other = base.path().join("nerfstudio");
    let run = out.join("camsim");
    let [run, other] = [&run, &other].map(|path| path.to_str().unwrap());
    let (code, _, err) = camsim(&["export", run, "--as", "nerfstudio", "-o", other]);
    assert_eq!(code, 0, "{err}");
    let (code, _, err) = camsim(&["export", run, "--as", "flo", "-o", other, "--set", "seed=1"]);
    assert!(code == 2 && err.contains("--set") && err.contains("go with a scenario"), "{err}");
    let (code, _, err) = camsim(&["export", run, "--as", "euroc", "-o", other]);
    assert!(code == 2 && err.contains("holds an export of another"), "{err}");
    let (code, _, err) = camsim(&["export", run, "--as", "gopro", "-o", folder]);
    assert!(code == 2 && err.contains("another run, layout"), "{err}");
}

#[test]
fn a_run_writes_its_datasets_at_the_end() {
    let base = tempfile::tempdir().unwrap();
    let scenario = scenario(base.path());
    let out = base.path().join("out");
    let render = |sets: &[&str], more: &[&str]| {
        let common =
            ["render", &scenario, "-o", out.to_str().unwrap(), "--frames", "2..4", "--backend", "cpu"];
        let sets: Vec<&str> = sets.iter().flat_map(|set| ["--set", *set]).collect();
        camsim(&[&common[..], &sets, more].concat())
    };
    let datasets = "output.datasets=[\"euroc\",\"gopro\"]";
    let (code, printed, err) = render(&[datasets], &[]);
    assert_eq!(code, 0, "{err}");
    assert!(printed.contains("euroc of 2 pictures written"), "{printed}");
    assert!(printed.contains("gopro of 2 pictures written"), "{printed}");
    assert!(out.join("datasets/euroc/mav0/cam0/data.csv").is_file());
    assert!(out.join("datasets/gopro/train/cam0/sharp").is_dir(), "the twin was added");
    // The run that its run.json repeats is the same.
    let (code, printed, err) = render(&[datasets], &["--resume"]);
    assert_eq!(code, 0, "{err}");
    assert!(printed.contains("euroc of 2 pictures was complete"), "{printed}");
    // Another scenario: its datasets take the place of the old ones.
    let (code, printed, err) = render(&[datasets, "seed=5"], &[]);
    assert_eq!(code, 0, "{err}");
    assert!(printed.contains("euroc of 2 pictures written"), "{printed}");
    let (code, _, err) = render(&["output.datasets=[\"zarr\"]"], &[]);
    assert!(code == 2 && err.contains("output.datasets") && err.contains("webdataset"), "{err}");
}
