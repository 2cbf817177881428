//! Reloading gives the same result as loading, and reads only what has changed.

#![allow(clippy::unwrap_used)]

use std::{path::Path, sync::Arc};

use camsim_core::scenario::Scenario;
use camsim_io::{
    load::{Loaded, load_sequence, reload_sequence},
    scenario_file::read_scenario,
};

fn demo(sets: &[(&str, &str)]) -> Scenario {
    let sets: Vec<_> = sets.iter().map(|&(key, value)| (key.to_owned(), value.to_owned())).collect();
    read_scenario(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/demo.toml"), &sets, None).unwrap()
}

fn assert_alike(a: &Loaded, b: &Loaded, what: &str) {
    assert_eq!(a.sequence.scenario, b.sequence.scenario, "{what}");
    assert_eq!((a.sequence.start_s, a.sequence.frames), (b.sequence.start_s, b.sequence.frames), "{what}");
    assert_eq!(a.log, b.log, "{what}");
    assert_eq!(a.sequence.vignette, b.sequence.vignette, "{what}");
    assert_eq!(a.terrain, b.terrain, "{what}");
    assert_eq!(a.warnings, b.warnings, "{what}");
    assert_eq!(a.sequence.scene.sky_linear, b.sequence.scene.sky_linear, "{what}");
    for t_s in [0.0, 20.0, 33.3] {
        assert_eq!(a.sequence.path.pose(t_s), b.sequence.path.pose(t_s), "{what} at {t_s} s");
    }
}

#[test]
fn only_changed_parts_are_read_again() {
    let before = load_sequence(&demo(&[])).unwrap();
    // Key, value, and whether flight, scene and vignette are reused.
    let cases: [(&str, &str, [bool; 3]); 9] = [
        ("camera.lens.coefficients", "[0.1, 0.0]", [true, true, true]),
        ("camera.mount.angles_deg", "[0.0, -90.0, 0.0]", [true, true, true]),
        ("flight.window_s", "[1.0, 2.0]", [true, true, true]),
        ("flight.speed", "2.0", [false, true, true]),
        ("tracker.kind", "linear", [false, true, true]),
        ("scene.sky", "[0.0, 0.0, 0.0]", [true, false, true]),
        ("camera.photometric.noise_sigma", "0.5", [true, true, true]),
        ("flight.height", "ellipsoid", [false, false, true]),
        ("flight.height", "ground", [false, false, true]),
    ];
    for (key, value, expected_reuse) in cases {
        let scenario = demo(&[(key, value)]);
        let reloaded = reload_sequence(&scenario, &before).unwrap();
        assert_alike(&reloaded, &load_sequence(&scenario).unwrap(), key);
        let vignettes = [&reloaded, &before].map(|loaded| loaded.sequence.vignette.clone().unwrap());
        let shared = [
            Arc::ptr_eq(&reloaded.log, &before.log),
            Arc::ptr_eq(&reloaded.sequence.scene, &before.sequence.scene),
            Arc::ptr_eq(&vignettes[0], &vignettes[1]),
        ];
        assert_eq!(shared, expected_reuse, "{key}: flight, scene, vignette");
    }
}

#[test]
fn changed_paths_are_read() {
    let before = load_sequence(&demo(&[])).unwrap();
    let error = reload_sequence(&demo(&[("camera.photometric.vignette", "nowhere.png")]), &before)
        .unwrap_err()
        .to_string();
    assert!(error.contains("nowhere.png"), "{error}");
}
