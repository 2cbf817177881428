//! The viewer as part of the program.

#![allow(clippy::unwrap_used)]

use std::{ffi::OsString, path::Path};

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn viewer_shows_the_bytes_that_render_writes() {
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/pattern.toml");
    let folder = tempfile::tempdir().unwrap();
    let words = [
        "camsim",
        "render",
        scenario.to_str().unwrap(),
        "--frames",
        "7..8",
        "--outputs",
        "color",
        "--format",
        "png",
        "-o",
    ];
    let args = words.iter().map(OsString::from).chain([folder.path().as_os_str().to_owned()]);
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let code = camsim_cli::run(args, &mut out, &mut err);
    assert_eq!(code, 0, "{}", String::from_utf8_lossy(&err));
    let written = image::open(folder.path().join("color/frame_000007.png")).unwrap().to_rgba8();

    let shown = camsim_viewer::render_headless(&scenario, 7).unwrap();
    assert_eq!(shown.size_px, [written.width() as usize, written.height() as usize]);
    let differing =
        shown.rgba.iter().zip(written.as_raw()).filter(|(shown, written)| shown != written).count();
    assert_eq!((differing, shown.rgba.len()), (0, written.as_raw().len()), "codes that differ, of all");
    assert!(shown.rgba.chunks(4).any(|pixel| pixel != &shown.rgba[..4]), "a picture of something");
}

#[test]
fn invalid_scenario_gives_the_error_of_the_viewer() {
    let error =
        camsim_viewer::render_headless(Path::new("no/such/scenario.toml"), 0).unwrap_err().to_string();
    assert!(error.contains("no/such/scenario.toml"), "{error}");
}
