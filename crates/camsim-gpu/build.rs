//! `CAMSIM_SKIP_GPU=1` makes the tests that need an adapter show as ignored, never as passed.
#![allow(clippy::print_stdout)] // how a build script speaks to cargo

fn main() {
    println!("cargo::rerun-if-env-changed=CAMSIM_SKIP_GPU");
    println!("cargo::rustc-check-cfg=cfg(skip_gpu)");
    if std::env::var_os("CAMSIM_SKIP_GPU").is_some_and(|value| value == "1") {
        println!("cargo::rustc-cfg=skip_gpu");
    }
}
