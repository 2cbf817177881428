//! What a reader of calibrations consists of.

use camsim_core::scenario::{CameraSpec, LensModel};
use serde_json::Value;

use super::key_table::{KeyRow, TableLeaves, leaves};
use super::other_text;
use super::poses::Extrinsics;
use super::selection::{CameraEntry, single};
use super::syntax::LENS_DATABASE;
use crate::text::document::{Document, KeyProblem, find};

/// A format of calibrations that can be read.
pub(crate) struct Reader {
    /// Name, as in `--format`.
    pub(crate) name: &'static str,
    /// Title in lists of formats.
    pub(crate) title: &'static str,
    /// Root elements of its documents.
    pub(crate) roots: &'static [&'static str],
    /// Whether a document with one of these roots has this format.
    pub(crate) matches: fn(&Document) -> bool,
    /// Tables of keys, each with its scope.
    pub(crate) tables: &'static [(&'static str, &'static [KeyRow])],
    /// Reads the selected camera.
    pub(crate) import: fn(&Selected<'_>) -> Result<ReadCamera, KeyProblem>,
    /// The document as its own program reads it.
    pub(crate) prepare: fn(Document) -> Document,
    /// Adds a size of pictures to a document that has none.
    pub(crate) complete: fn(&mut Document, [u32; 2]),
    /// The cameras of a file.
    pub(crate) entries: for<'a> fn(&'a Document) -> Result<Vec<CameraEntry<'a>>, KeyProblem>,
    /// Leaves of the selected camera and common leaves, with their tables.
    pub(crate) leaves: for<'a> fn(&Selected<'a>) -> Vec<TableLeaves<'a>>,
    /// Reads pose and clock of the selected camera.
    pub(crate) poses: fn(&mut Extrinsics, &Selected<'_>) -> Result<(), KeyProblem>,
    /// Whether its shutter is read by the names of all formats.
    pub(crate) has_common_timing: bool,
}

impl Reader {
    /// A reader of files with one camera, a table of keys and no pose.
    pub(crate) const fn new(
        name: &'static str,
        title: &'static str,
        matches: fn(&Document) -> bool,
        tables: &'static [(&'static str, &'static [KeyRow])],
        import: fn(&Selected<'_>) -> Result<ReadCamera, KeyProblem>,
    ) -> Self {
        Self {
            name,
            title,
            roots: &[""],
            matches,
            tables,
            import,
            prepare: |document| document,
            complete: |_, _| (),
            entries: single,
            leaves: own_and_common_leaves,
            poses: |_, _| Ok(()),
            has_common_timing: true,
        }
    }

    /// Whether a document has this format.
    pub(crate) fn has_marks_in(&self, document: &Document) -> bool {
        self.roots.contains(&document.root.as_str()) && (self.matches)(document)
    }
}

/// The selected one of a file's cameras.
#[derive(Clone, Copy)]
pub(crate) struct Selected<'a> {
    pub(crate) reader: &'static Reader,
    pub(crate) document: &'a Document,
    pub(crate) entries: &'a [CameraEntry<'a>],
    pub(crate) index: usize,
    /// Whether the user named the format.
    pub(crate) is_explicit: bool,
}

impl<'a> Selected<'a> {
    pub(crate) fn entry(&self) -> &'a CameraEntry<'a> {
        &self.entries[self.index]
    }

    /// What stands before its keys.
    pub(crate) fn prefix(&self) -> String {
        format!("{}.", self.entry().roots[0])
    }

    /// Its part of the document.
    pub(crate) fn value(&self) -> &'a Value {
        self.entry().value
    }
}

/// Leaves of the document but those of other cameras.
fn own_and_common_leaves<'a>(selected: &Selected<'a>) -> Vec<TableLeaves<'a>> {
    let mut leaves = leaves(&selected.document.value);
    leaves.retain(|leaf| {
        selected.entry().contains(&leaf.path)
            || !selected.entries.iter().any(|other| other.contains(&leaf.path))
    });
    vec![TableLeaves { keys: selected.reader.tables[0].1, leaves }]
}

/// A camera as a file has it, and notes for the user.
#[derive(Debug)]
pub(crate) struct ReadCamera {
    pub(crate) spec: CameraSpec,
    pub(crate) notes: Vec<String>,
}

/// A camera of intrinsics and lens; the other values are defaults.
pub(crate) fn camera(
    size_px: [u32; 2],
    focal_px: [f64; 2],
    principal_point_px: [f64; 2],
    model: LensModel,
    mut coefficients: Vec<f64>,
) -> ReadCamera {
    let used = coefficients.iter().rposition(|k| *k != 0.0).map_or(0, |last| last + 1);
    match model {
        // Three coefficients k1, k2, p1 could be mistaken for k1, k2, k3.
        LensModel::BrownConrady if used == 3 => coefficients.truncate(4),
        LensModel::BrownConrady | LensModel::KannalaBrandt => coefficients.truncate(used),
        _ => {}
    }
    let mut spec = CameraSpec {
        size_px,
        focal_px,
        principal_point_px: Some(principal_point_px),
        ..CameraSpec::default()
    };
    // A Kannala-Brandt lens without coefficients is an equidistant fisheye, not a pinhole.
    spec.lens.model = if used == 0 && model == LensModel::BrownConrady { LensModel::Pinhole } else { model };
    spec.lens.coefficients = coefficients;
    ReadCamera { spec, notes: Vec::new() }
}

/// A message for known files that are not supported.
pub(crate) fn unsupported_hint(document: &Document) -> Option<String> {
    let value = &document.value;
    let calibrations: Vec<&str> = (0..8)
        .filter_map(|index| find(value, &format!("cam{index}_calib")).and_then(Value::as_str))
        .collect();
    if !calibrations.is_empty() {
        return Some(format!(
            "this refers to a file for each camera: import one of those ({})",
            calibrations.join(", ")
        ));
    }
    if document.root == "lensdatabase" {
        return Some(LENS_DATABASE.to_owned());
    }
    if find(value, "ppx").is_some() {
        let text = "these are RealSense intrinsics: write camera_matrix ([fx, 0, ppx, 0, fy, ppy, 0, 0, 1]), \
                    distortion_coefficients, image_width and image_height to a YAML file";
        return Some(text.to_owned());
    }
    if find(value, "IntrinsicMatrix").is_some() {
        let text = "this is MATLAB's transposed matrix, whose pixels count from 1: write camera_matrix ([fx, 0, \
                    cx - 1, 0, fy, cy - 1, 0, 0, 1]), distortion_coefficients ([k1, k2, p1, p2, k3]), image_width and \
                    image_height to a YAML file";
        return Some(text.to_owned());
    }
    if let Some(hint) = other_text::hint(document) {
        return Some(hint);
    }
    if find(value, "distortion_model").is_some() || find(value, "distortion_coefficients").is_some() {
        return Some(
            "there are distortion coefficients, but no 3 x 3 camera matrix under a known name \
             (camera_matrix, K, k)"
                .to_owned(),
        );
    }
    None
}
