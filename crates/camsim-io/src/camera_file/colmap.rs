//! COLMAP's `cameras.txt`: `CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]`. In COLMAP the centre of the first pixel
//! is (0.5, 0.5).

use camsim_core::{lens::ModelFacts, scenario::LensModel};
use serde_json::{Value, json};

use super::document::{Document, KeyProblem, SyntaxProblem, number, numbers, size, word};
use super::key_table::{KeyRow, Treatment};
use super::selection::CameraEntry;
use super::{CameraFormat, ImportedCamera, camera};

pub(super) const KEYS: &[KeyRow] = &[
    KeyRow::new("cameras.id", Treatment::Ignored, "CAMERA_ID, for `--camera`"),
    KeyRow::new(
        "cameras.model",
        Treatment::Applied,
        "MODEL: SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL, OPENCV, FULL_OPENCV, OPENCV_FISHEYE, \
         SIMPLE_RADIAL_FISHEYE, RADIAL_FISHEYE, FOV, SIMPLE_DIVISION, DIVISION, EUCM, \
         RAD_TAN_THIN_PRISM_FISHEYE; others are refused",
    ),
    KeyRow::new("cameras.width", Treatment::Applied, "WIDTH"),
    KeyRow::new("cameras.height", Treatment::Applied, "HEIGHT"),
    KeyRow::new("cameras.params", Treatment::Applied, "PARAMS; half a pixel is subtracted from cx and cy"),
];

/// Lines with content, with their numbers.
fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    text.lines()
        .enumerate()
        .map(|(index, line)| (index + 1, line.trim()))
        .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'))
}

fn is_camera(line: &str) -> bool {
    let words: Vec<&str> = line.split_whitespace().collect();
    let is_integer = |word: &str| word.bytes().all(|byte| byte.is_ascii_digit());
    words.len() > 4
        && is_integer(words[0])
        && words[1].starts_with(|c: char| c.is_ascii_uppercase())
        && words[1].bytes().all(|byte| byte.is_ascii_uppercase() || byte.is_ascii_digit() || byte == b'_')
        && words[2..].iter().all(|word| word.parse::<f64>().is_ok())
}

pub(super) fn matches_text(text: &str) -> bool {
    lines(text).next().is_some_and(|(_, line)| is_camera(line))
}

pub(super) fn parse(text: &str) -> Result<Document, SyntaxProblem> {
    let mut cameras = Vec::new();
    for (line_number, line) in lines(text) {
        if !is_camera(line) {
            let message = format!(
                "`{line}` is not a camera: CAMERA_ID MODEL WIDTH HEIGHT and the parameters, separated by \
                 blanks"
            );
            return Err(SyntaxProblem { line: Some(line_number), message });
        }
        let words: Vec<&str> = line.split_whitespace().collect();
        let numbers: Vec<f64> = words[2..].iter().filter_map(|word| word.parse().ok()).collect();
        cameras.push(json!({"id": words[0], "model": words[1], "width": numbers[0], "height": numbers[1],
            "params": &numbers[2..]}));
    }
    Ok(Document { root: "colmap".to_owned(), value: json!({ "cameras": cameras }) })
}

pub(super) fn matches(document: &Document) -> bool {
    document.root == "colmap"
}

pub(super) fn entries(document: &Document) -> Vec<CameraEntry<'_>> {
    let list = document.value.get("cameras").and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
    let entry = |(index, value): (usize, _)| {
        CameraEntry::new(word(value, "id").unwrap_or_default().to_owned(), value, format!("cameras[{index}]"))
    };
    list.iter().enumerate().map(entry).collect()
}

/// Lens model and names of the parameters, from COLMAP's source; `None` for unsupported models.
fn parameter_names(model: &str) -> Option<(LensModel, &'static [&'static str])> {
    use LensModel::{BrownConrady, Division, Eucm, Fisheye624, Fov, KannalaBrandt};
    Some(match model {
        "SIMPLE_PINHOLE" => (BrownConrady, &["f", "cx", "cy"]),
        "PINHOLE" => (BrownConrady, &["fx", "fy", "cx", "cy"]),
        "SIMPLE_RADIAL" => (BrownConrady, &["f", "cx", "cy", "k1"]),
        "RADIAL" => (BrownConrady, &["f", "cx", "cy", "k1", "k2"]),
        "OPENCV" => (BrownConrady, &["fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2"]),
        "FULL_OPENCV" => {
            (BrownConrady, &["fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"])
        }
        "OPENCV_FISHEYE" => (KannalaBrandt, &["fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"]),
        "SIMPLE_RADIAL_FISHEYE" => (KannalaBrandt, &["f", "cx", "cy", "k1"]),
        "RADIAL_FISHEYE" => (KannalaBrandt, &["f", "cx", "cy", "k1", "k2"]),
        "FOV" => (Fov, &["fx", "fy", "cx", "cy", "omega"]),
        "SIMPLE_DIVISION" => (Division, &["f", "cx", "cy", "k"]),
        "DIVISION" => (Division, &["fx", "fy", "cx", "cy", "k"]),
        "EUCM" => (Eucm, &["fx", "fy", "cx", "cy", "alpha", "beta"]),
        "RAD_TAN_THIN_PRISM_FISHEYE" => (
            Fisheye624,
            &["fx", "fy", "cx", "cy", "k0", "k1", "k2", "k3", "k4", "k5", "p0", "p1", "s0", "s1", "s2", "s3"],
        ),
        _ => return None,
    })
}

pub(super) fn import(value: &Value) -> Result<ImportedCamera, KeyProblem> {
    let model = word(value, "model").unwrap_or_default();
    let (lens, names) = parameter_names(model).ok_or_else(|| {
        KeyProblem::new(
            "MODEL",
            format!(
                "is {model}, which is not supported: reconstruct with OPENCV, FULL_OPENCV or OPENCV_FISHEYE \
                 (or a model with fewer parameters)"
            ),
        )
    })?;
    let params = numbers(value, "params")?;
    if params.len() != names.len() {
        let text = format!(
            "has {} parameters where {model} has {} ({})",
            params.len(),
            names.len(),
            names.join(", ")
        );
        return Err(KeyProblem::new("PARAMS", text));
    }
    let get = |name: &str| {
        names.iter().position(|known| *known == name).and_then(|index| params.get(index).copied())
    };
    let or_zero = |name: &str| get(name).unwrap_or(0.0);
    let f = or_zero("f");
    let coefficients = match lens {
        LensModel::KannalaBrandt => ["k1", "k2", "k3", "k4"].map(or_zero).to_vec(),
        LensModel::BrownConrady => ["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"].map(or_zero).to_vec(),
        _ => ModelFacts::of(lens).coefficients.iter().map(|name| or_zero(name)).collect(),
    };
    let size_px = size("WIDTH", [number(value, "width")?, number(value, "height")?])?;
    let focal_px = [get("fx").unwrap_or(f), get("fy").unwrap_or(f)];
    let mut imported = camera(
        CameraFormat::Colmap,
        size_px,
        focal_px,
        [or_zero("cx") - 0.5, or_zero("cy") - 0.5],
        lens,
        coefficients,
    );
    imported.notes.push(
        "the principal point was shifted by half a pixel: COLMAP has image corners at integers".to_owned(),
    );
    Ok(imported)
}
