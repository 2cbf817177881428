//! Windows that leave the log, and frame rates that no sequence can have.

#![allow(clippy::unwrap_used)]

use std::path::Path;

use camsim_io::{
    load::{LoadError, load_sequence},
    scenario_file::read_scenario,
};

/// The pattern scenario (2 s of a log of 46 s, 30 frames a second) with changes; its warnings about the log's
/// ends.
fn outside(sets: &[(&str, &str)]) -> Result<Vec<String>, LoadError> {
    let sets: Vec<_> = sets.iter().map(|&(key, value)| (key.to_owned(), value.to_owned())).collect();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/pattern.toml");
    let loaded = load_sequence(&read_scenario(&path, &sets, None).unwrap())?;
    Ok(loaded.warnings.into_iter().filter(|text| text.contains("outside of the log")).collect())
}

#[test]
fn frames_whose_image_centre_leaves_the_log_are_counted() {
    assert!(outside(&[]).unwrap().is_empty());
    assert!(outside(&[("camera.shutter.delay_ms", "9000")]).unwrap().is_empty());
    // 0.5 s before the log's first row: 15 frames at 30 a second.
    let warned = outside(&[("camera.shutter.delay_ms", "10500")]).unwrap();
    assert!(warned[0].starts_with("15 of 60 frames"), "{warned:?}");
    let warned = outside(&[("flight.window_s", "[0.0, 1.0]"), ("camera.phase", "-3.0")]).unwrap();
    assert!(warned[0].starts_with("3 of 33 frames"), "{warned:?}");
    assert!(outside(&[("flight.window_s", "[0.0, 1.0]")]).unwrap().is_empty());
}

#[test]
fn endless_sequences_are_refused() {
    let error = outside(&[("camera.fps", "1e12")]).unwrap_err().to_string();
    assert!(error.contains("camera.fps") && error.contains("flight.window_s"), "{error}");
}
