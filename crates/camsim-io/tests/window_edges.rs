//! Windows that exceed the log, and excessive frame rates.

#![allow(clippy::unwrap_used)]

use std::path::Path;

use camsim_io::{
    load::{LoadError, load_sequence},
    scenario_file::read_scenario,
};

/// Warnings about frames outside of the log, for the pattern scenario (2 s of a log of 46 s, 30 frames per
/// second) with changed keys.
fn outside(sets: &[(&str, &str)]) -> Result<Vec<String>, LoadError> {
    let sets: Vec<_> = sets.iter().map(|&(key, value)| (key.to_owned(), value.to_owned())).collect();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/pattern.toml");
    let loaded = load_sequence(&read_scenario(&path, &sets, None).unwrap())?;
    Ok(loaded.warnings.into_iter().filter(|text| text.contains("outside of the log")).collect())
}

#[test]
fn frames_exposed_outside_of_the_log_are_counted() {
    assert!(outside(&[]).unwrap().is_empty());
    assert!(outside(&[("camera.shutter.delay_ms", "9000")]).unwrap().is_empty());
    // 0.5 s before the log's first row: 15 frames at 30 per second.
    let warnings = outside(&[("camera.shutter.delay_ms", "10500")]).unwrap();
    assert!(warnings[0].starts_with("15 of 60 frames"), "{warnings:?}");
    let warnings = outside(&[("flight.window_s", "[0.0, 1.0]"), ("camera.phase", "-3.0")]).unwrap();
    assert!(warnings[0].starts_with("3 of 33 frames"), "{warnings:?}");
    assert!(outside(&[("flight.window_s", "[0.0, 1.0]")]).unwrap().is_empty());
}

#[test]
fn excessive_frame_counts_are_refused() {
    let error =
        outside(&[("camera.fps", "1e12"), ("camera.shutter.readout_ms", "0")]).unwrap_err().to_string();
    assert!(error.contains("camera.fps") && error.contains("flight.window_s"), "{error}");
}
