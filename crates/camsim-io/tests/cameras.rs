//! Importers of calibrations: the right value of every format, and hostile files of every kind.

#![allow(clippy::unwrap_used)]

#[path = "cameras/conventions.rs"]
mod conventions;
#[path = "cameras/formats.rs"]
mod formats;
#[path = "cameras/models.rs"]
mod models;
#[path = "cameras/regions.rs"]
mod regions;
#[path = "cameras/several.rs"]
mod several;
#[path = "cameras/times.rs"]
mod times;

use camsim_core::scenario::{CameraSpec, LensModel};
use camsim_io::camera_file::{CameraFormat, ImportedCamera, import_camera_named};

/// Imports a text as a file of that name.
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

fn read(name: &str, text: &str) -> ImportedCamera {
    import(name, text, None, None).unwrap_or_else(|error| panic!("{error}"))
}

/// What is wanted of an import.
enum Want {
    /// fx fy cx cy.
    Intrinsics([f64; 4]),
    Size([u32; 2]),
    Lens(LensModel, &'static [f64]),
    /// ms.
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

fn check(what: &str, imported: &ImportedCamera, wants: &[Want]) {
    let spec = &imported.spec;
    for want in wants {
        match want {
            Want::Intrinsics(wanted) => {
                let found = intrinsics(spec);
                assert!(
                    found.iter().zip(wanted).all(|(a, b)| near(*a, *b)),
                    "{what}: {found:?} instead of {wanted:?}"
                );
            }
            Want::Size(wanted) => assert_eq!(spec.size_px, *wanted, "{what}"),
            Want::Lens(model, coefficients) => {
                assert_eq!(
                    (spec.lens.model, spec.lens.coefficients.as_slice()),
                    (*model, *coefficients),
                    "{what}"
                );
            }
            Want::Readout(ms) => assert!(
                near(spec.shutter.readout_ms, *ms),
                "{what}: {} ms instead of {ms}",
                spec.shutter.readout_ms
            ),
            Want::Fps(fps) => assert!(near(spec.fps, *fps), "{what}: {} fps", spec.fps),
            Want::Note(text) => {
                assert!(
                    imported.notes.iter().any(|note| note.contains(text)),
                    "{what}: `{text}` is not in {:?}",
                    imported.notes
                )
            }
            Want::Without(text) => {
                assert!(
                    imported.notes.iter().all(|note| !note.contains(text)),
                    "{what}: `{text}` is in {:?}",
                    imported.notes
                )
            }
        }
    }
}

/// A text that must be refused with these words.
fn refused(what: &str, name: &str, text: &str, words: &[&str]) {
    match import(name, text, None, None) {
        Ok(imported) => panic!("{what}: read as {imported:?}"),
        Err(error) => assert!(words.iter().all(|word| error.contains(word)), "{what}: {error}"),
    }
}
