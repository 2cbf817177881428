//! COLMAP's `cameras.txt`: `CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]`. In COLMAP the centre of the first pixel
//! is (0.5, 0.5).

use serde_json::{Value, json};

use super::MODELS;
use crate::formats::reading::format::{ReadCamera, Reader, camera};
use crate::formats::reading::key_table::{KeyRow, applied, ignored};
use crate::formats::reading::selection::CameraEntry;
use crate::text::document::{Document, KeyProblem, SyntaxProblem, list, number, numbers, size, word};

pub(crate) const READER: Reader = Reader {
    roots: &["colmap"],
    entries,
    ..Reader::new("colmap", "COLMAP cameras.txt", |_| true, &[("", KEYS)], |camera| import(camera.value()))
};

const KEYS: &[KeyRow] = &[
    ignored("cameras.id", "CAMERA_ID, for `--camera`"),
    applied(
        "cameras.model",
        "MODEL: SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL, OPENCV, FULL_OPENCV, OPENCV_FISHEYE, \
         SIMPLE_RADIAL_FISHEYE, RADIAL_FISHEYE, FOV, SIMPLE_DIVISION, DIVISION, EUCM, \
         RAD_TAN_THIN_PRISM_FISHEYE; others are refused",
    ),
    applied("cameras.width", "WIDTH"),
    applied("cameras.height", "HEIGHT"),
    applied("cameras.params", "PARAMS; half a pixel is subtracted from cx and cy"),
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

pub(crate) fn matches_text(text: &str) -> bool {
    lines(text).next().is_some_and(|(_, line)| is_camera(line))
}

pub(crate) fn parse(text: &str) -> Result<Document, SyntaxProblem> {
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

fn entries(document: &Document) -> Result<Vec<CameraEntry<'_>>, KeyProblem> {
    let entry = |(index, value): (usize, _)| {
        CameraEntry::new(word(value, "id").unwrap_or_default().to_owned(), value, format!("cameras[{index}]"))
    };
    Ok(list(&document.value, "cameras").iter().enumerate().map(entry).collect())
}

fn import(value: &Value) -> Result<ReadCamera, KeyProblem> {
    let model = word(value, "model").unwrap_or_default();
    let known = MODELS.iter().find(|known| known.name == model).ok_or_else(|| {
        KeyProblem::new(
            "MODEL",
            format!(
                "is {model}, which is not supported: reconstruct with OPENCV, FULL_OPENCV or OPENCV_FISHEYE \
                 (or a model with fewer parameters)"
            ),
        )
    })?;
    let (params, names) = (numbers(value, "params")?, known.parameters());
    if params.len() != names.len() {
        let text = format!(
            "has {} parameters where {model} has {} ({})",
            params.len(),
            names.len(),
            names.join(", ")
        );
        return Err(KeyProblem::new("PARAMS", text));
    }
    let (focal, rest) = params.split_at(known.focal_lengths.len());
    let (centre, coefficients) = rest.split_at(2);
    let size_px = size("WIDTH", [number(value, "width")?, number(value, "height")?])?;
    let mut read = camera(
        size_px,
        [focal[0], focal[focal.len() - 1]],
        [centre[0] - 0.5, centre[1] - 0.5],
        known.lens,
        coefficients.to_vec(),
    );
    read.notes.push(
        "the principal point was shifted by half a pixel: COLMAP has image corners at integers".to_owned(),
    );
    Ok(read)
}
