//! The command line: arguments, output and exit codes.

#![allow(clippy::unwrap_used)]

mod apply;
mod explain;
mod lens;
mod motion;
mod refusals;

use std::{
    ffi::OsString,
    path::{Path, PathBuf},
};

/// Runs camsim. Returns exit code, standard output and standard error.
fn camsim<S: Into<OsString>>(args: impl IntoIterator<Item = S>) -> (u8, String, String) {
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let args = std::iter::once(OsString::from("camsim")).chain(args.into_iter().map(Into::into));
    let code = camsim_cli::run(args, &mut out, &mut err);
    (code, String::from_utf8(out).unwrap(), String::from_utf8(err).unwrap())
}

/// The path as text.
fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// Folder of the built-in flight.
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
    let (code, version, _) = camsim(["--version"]);
    assert!(
        code == 0
            && version.contains("gpu")
            && version.starts_with(concat!("camsim ", env!("CARGO_PKG_VERSION"), " (")),
        "{version}"
    );
}

#[test]
fn completions_exist_for_every_shell() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let (code, out, _) = camsim(["completions", shell]);
        assert!(code == 0 && out.contains("camsim") && out.contains("render"), "{shell}");
    }
}

#[test]
fn manual_pages_exist_for_every_command() {
    let folder = tempfile::tempdir().unwrap();
    let pages = folder.path().join("man1");
    let (code, _, err) = camsim(["man", text(&pages)]);
    assert_eq!(code, 0, "{err}");
    for page in ["camsim.1", "camsim-render.1", "camsim-camera-import.1"] {
        let page = std::fs::read_to_string(pages.join(page)).unwrap();
        assert!(page.contains(".SH SYNOPSIS"), "{page}");
    }
    let taken = pages.join("camsim.1");
    let (code, _, err) = camsim(["man", text(&taken)]);
    assert!(code == 1 && err.contains("camsim.1"), "{err}");
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
fn printed_default_scenario_is_valid() {
    let (code, out, _) = camsim(["render", "--print-default"]);
    assert_eq!(code, 0);
    for key in ["[flight]", "[tracker]", "[camera", "[scene", "[quality]", "[output]"] {
        assert!(out.contains(key), "{key}");
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
