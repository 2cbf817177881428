//! `CAMSIM_SKIP_GPU=1` makes the tests that need an adapter show as ignored, never as passed. `CAMSIM_REVISION` is that
//! of a clone, for `camsim --version`.
#![allow(clippy::print_stdout)] // how a build script speaks to cargo

use std::{fs, path::Path};

fn main() {
    println!("cargo::rerun-if-env-changed=CAMSIM_SKIP_GPU");
    println!("cargo::rustc-check-cfg=cfg(skip_gpu)");
    if std::env::var_os("CAMSIM_SKIP_GPU").is_some_and(|value| value == "1") {
        println!("cargo::rustc-cfg=skip_gpu");
    }
    println!("cargo::rustc-env=CAMSIM_REVISION={}", revision().unwrap_or_default());
}

/// The first digits of the commit that is checked out; `None` outside of a clone.
fn revision() -> Option<String> {
    let git = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../.git");
    let watched = |file: &Path| {
        let text = fs::read_to_string(file).ok()?;
        println!("cargo::rerun-if-changed={}", file.display());
        Some(text)
    };
    let head = watched(&git.join("HEAD"))?;
    let commit = match head.trim().strip_prefix("ref: ") {
        Some(name) => watched(&git.join(name))?,
        None => head,
    };
    commit.trim().get(..8).map(str::to_owned)
}
