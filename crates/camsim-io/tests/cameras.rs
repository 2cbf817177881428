//! Importers of calibrations: values of every format, and malformed files.

#![allow(clippy::unwrap_used, reason = "tests")]

#[path = "cameras/formats.rs"]
mod formats;
#[path = "cameras/opencv.rs"]
mod opencv;
#[path = "cameras/ros.rs"]
mod ros;
#[path = "cameras/selection.rs"]
mod selection;
#[path = "cameras/syntax.rs"]
mod syntax;
#[path = "cameras/timing.rs"]
mod timing;

use camsim_core::scenario::{CameraSpec, LensModel};
use camsim_io::formats::reading::{CameraFormat, ImportedCamera, import_camera_named};

/// Imports a text as a file of a name.
fn import(
    name: &str,
    text: &str,
    format: Option<CameraFormat>,
    camera: Option<&str>,
) -> Result<ImportedCamera, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    import_camera_named(&path, format, camera).map_err(|error| error.to_string())
}

/// Imports with the detected format.
fn read(name: &str, text: &str) -> ImportedCamera {
    import(name, text, None, None).unwrap_or_else(|error| panic!("{error}"))
}

/// An expected property of an imported camera.
enum Expected {
    /// fx fy cx cy, pixels.
    Intrinsics([f64; 4]),
    Size([u32; 2]),
    Lens(LensModel, &'static [f64]),
    /// Readout time, milliseconds.
    Readout(f64),
    Fps(f64),
    /// A note with this text.
    Note(&'static str),
    /// No note with this text.
    Without(&'static str),
}

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-9 * b.abs().max(1.0)
}

fn intrinsics(spec: &CameraSpec) -> [f64; 4] {
    let ([fx, fy], [cx, cy]) = (spec.focal_px, spec.principal_point_px.unwrap());
    [fx, fy, cx, cy]
}

/// Asserts all expectations.
fn check(name: &str, imported: &ImportedCamera, expectations: &[Expected]) {
    let spec = &imported.spec;
    for expectation in expectations {
        match expectation {
            Expected::Intrinsics(expected) => {
                let actual = intrinsics(spec);
                assert!(
                    actual.iter().zip(expected).all(|(a, b)| near(*a, *b)),
                    "{name}: {actual:?} instead of {expected:?}"
                );
            }
            Expected::Size(expected) => assert_eq!(spec.size_px, *expected, "{name}"),
            Expected::Lens(model, coefficients) => {
                assert_eq!(
                    (spec.lens.model, spec.lens.coefficients.as_slice()),
                    (*model, *coefficients),
                    "{name}"
                );
            }
            Expected::Readout(ms) => assert!(
                near(spec.shutter.readout_ms, *ms),
                "{name}: {} ms instead of {ms}",
                spec.shutter.readout_ms
            ),
            Expected::Fps(fps) => assert!(near(spec.fps, *fps), "{name}: {} fps", spec.fps),
            Expected::Note(text) => {
                assert!(
                    imported.notes.iter().any(|note| note.contains(text)),
                    "{name}: `{text}` is not in {:?}",
                    imported.notes
                )
            }
            Expected::Without(text) => {
                assert!(
                    imported.notes.iter().all(|note| !note.contains(text)),
                    "{name}: `{text}` is in {:?}",
                    imported.notes
                )
            }
        }
    }
}

/// Asserts that a text is refused with a message that contains all `words`.
fn refused(case: &str, name: &str, text: &str, words: &[&str]) {
    match import(name, text, None, None) {
        Ok(imported) => panic!("{case}: read as {imported:?}"),
        Err(error) => assert!(words.iter().all(|word| error.contains(word)), "{case}: {error}"),
    }
}
