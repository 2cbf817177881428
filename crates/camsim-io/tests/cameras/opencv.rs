//! OpenCV files: lens model, camera matrix, image size.

use camsim_core::scenario::LensModel::{BrownConrady, KannalaBrandt};

use super::Expected::{Intrinsics, Lens, Note, Size};
use super::{check, import, read, refused};

/// A file of one camera with a list of coefficients and further keys.
fn file(list: &str, more: &str) -> String {
    format!(
        "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\ncamera_matrix: [400, 0, 320, 0, 401, 240, 0, \
         0, 1]\ndist_coeffs: [{list}]\n{more}\n"
    )
}

#[test]
fn model_is_detected_by_keys_and_texts() {
    let four = "0.1, 0.2, 0.003, 0.004";
    let list: &[f64] = &[0.1, 0.2, 0.003, 0.004];
    for (more, model) in [
        ("fisheye_model: 1", KannalaBrandt),
        ("fisheye_model: 0", BrownConrady),
        ("is_fisheye: true", KannalaBrandt),
        ("camera_model: fisheye", KannalaBrandt),
        ("model_type: Kannala-Brandt", KannalaBrandt),
        ("distortion_type: equidistant", KannalaBrandt),
        ("distortion_type: radtan", BrownConrady),
        ("model: plumb_bob", BrownConrady),
    ] {
        let imported = read("out.yml", &file(four, more));
        assert_eq!(
            (imported.spec.lens.model, imported.spec.lens.coefficients.as_slice()),
            (model, list),
            "{more}"
        );
    }
}

#[test]
fn ambiguous_or_contradicting_files_are_refused() {
    let (four, five) = ("0.1, 0.2, 0.003, 0.004", "0.1, 0.2, 0.003, 0.004, 0.5");
    for (list, more, words) in [
        (four, "", ["dist_coeffs", "--format opencv-fisheye"]),
        (four, "camera_model: pinhole", ["dist_coeffs", "--format opencv-fisheye"]),
        (four, "camera_model: D435i", ["dist_coeffs", "--format opencv-fisheye"]),
        ("0.1, 0.2, 0.3", "", ["dist_coeffs", "has 3 numbers"]),
        ("0.1, 0.2", "", ["dist_coeffs", "has 2 numbers"]),
        ("0.1, 0.2, 0.003, 0.004, 0.5, 0.6", "", ["dist_coeffs", "has 6 numbers"]),
        ("0.1, 0.2, 0, 0, 0.3, 0, 0, 0, 0, 0, 0, 0, 0.01", "", ["dist_coeffs", "has 13 numbers"]),
        (five, "fisheye_model: 1", ["dist_coeffs", "a fisheye has four"]),
        (five, "is_fisheye: perhaps", ["is_fisheye", "neither yes"]),
        (five, "model_type: omnidirectional", ["model_type", "omnidirectional"]),
        (five, "camera_model: double_sphere", ["camera_model", "double sphere"]),
        (five, "xi: [1.2]", ["dist_coeffs", "has 6 parameters where `omni` has 1 or 5"]),
        (
            five,
            "fisheye_model: 0\ncamera_model: fisheye",
            ["camera_model", "contradicts the model of fisheye_model"],
        ),
        (
            five,
            "distortion_coefficients: [0.5, 0, 0, 0, 0]",
            ["dist_coeffs", "differs from distortion_coefficients"],
        ),
        (
            five,
            "K: [500, 0, 320, 0, 501, 240, 0, 0, 1]\nD: [0, 0, 0, 0, 0]",
            ["cameras", "there are 2 (`camera_matrix`, `K`)"],
        ),
        (five, "image_size: [752, 480]", ["image_size", "752"]),
        (five, "img_shape: [480, 640]", ["img_shape", "ambiguous"]),
        (five, "skew: 0.3", ["skew", "recalibrate"]),
        (five, "binning: 2", ["binning", "binned"]),
        (five, "p3: 0.1", ["p3", "coefficient"]),
        (five, "tauX: 0.1", ["tauX", "coefficient"]),
    ] {
        let text = file(list, more);
        refused(&text, "out.yml", &text, &words);
    }
}

#[test]
fn invalid_matrices_are_refused() {
    let five = "0.1, 0.2, 0.003, 0.004, 0.5";
    for (matrix, words) in [
        ("400, 0, 0, 0, 401, 0, 320, 240, 1", ["camera_matrix", "transposed"]),
        ("400, 0.7, 320, 0, 401, 240, 0, 0, 1", ["camera_matrix", "skew of 0.7"]),
        ("400, 0, 320, 0, 401, 240, 0, 0, 2", ["camera_matrix", "last row"]),
        ("400, 0, 320, 0, -401, 240, 0, 0, 1", ["focal_px", "-401"]),
        ("0.625, 0, 0.5, 0, 0.626, 0.5, 0, 0, 1", ["focal length", "fraction"]),
        ("8.8, 0, 320, 0, 8.8, 240, 0, 0, 1", ["focal length", "millimetres"]),
        ("400, 0, 320, 0, .inf, 240, 0, 0, 1", ["out.yml:5", "non-finite"]),
    ] {
        refused(
            matrix,
            "out.yml",
            &file(five, "").replace("400, 0, 320, 0, 401, 240, 0, 0, 1", matrix),
            &words,
        );
    }
}

#[test]
fn implausible_and_unknown_values_are_reported() {
    let five = "0.1, 0.2, 0.003, 0.004, 0.5";
    for (from, to, note) in [
        (
            "image_width: 640\nimage_height: 480",
            "image_width: 300\nimage_height: 480",
            "outside of the picture",
        ),
        ("image_width: 640\nimage_height: 480", "image_width: 1280\nimage_height: 960", "about 641 x 481"),
        (
            "image_width: 640\nimage_height: 480",
            "image_width: 480\nimage_height: 640",
            "whether it is rotated",
        ),
        ("401, 240", "900, 240", "differs by 125 %"),
        ("[400, 0, 320, 0, 401", "[50, 0, 320, 0, 50", "162 degrees"),
        ("image_width", "Readout_time_ms: 12\nimage_width", "the file has no frame rate"),
        (
            "image_width",
            "new_camera_matrix: [380, 0, 320, 0, 381, 240, 0, 0, 1]\nimage_width",
            "new_camera_matrix",
        ),
        ("image_width", "R1: [0.9, 0.1, 0, 0, 1, 0, 0, 0, 1]\nimage_width", "stereo or rectification"),
        ("image_width", "image_scale: 0.5\nimage_width", "image_scale = 0.5"),
        ("image_width", "flip_vertical: true\nimage_width", "flip_vertical = true"),
        ("image_width", "mask_file: mask.png\nimage_width", "mask_file = `mask.png`"),
        ("image_width", "unit_of_length: mm\nimage_width", "unit_of_length = `mm`"),
        ("image_width", "crop_left: 12\nimage_width", "crop_left = 12"),
        ("image_width", "extra: {a: [1, 2, 3]}\nimage_width", "extra.a"),
    ] {
        let imported = import("out.yml", &file(five, "").replacen(from, to, 1), None, None).unwrap();
        assert!(imported.notes.iter().any(|line| line.contains(note)), "{to}: {:?}", imported.notes);
    }
}

#[test]
fn key_names_of_other_programs_are_accepted() {
    let matrix = "[[400, 0, 320], [0, 401, 240], [0, 0, 1]]";
    let list = "[[0.1, 0.2, 0.003, 0.004, 0.5]]";
    for text in [
        format!("{{\"mtx\": {matrix}, \"dist\": {list}, \"width\": 640, \"height\": 480}}"),
        format!("{{\"K\": {matrix}, \"D\": {list}, \"image_size\": [640, 480]}}"),
        format!("{{\"cameraMatrix\": {matrix}, \"distCoeffs\": {list}, \"imageSize\": [640, 480]}}"),
        format!("{{\"camera_matrix\": {matrix}, \"dist_coeff\": {list}, \"img_size\": [640, 480]}}"),
        format!(
            "CameraMat: {{rows: 3, cols: 3, dt: d, data: {matrix}}}\nDistCoeff: {list}\nImageSize: [640, \
             480]\n"
        ),
    ] {
        let expectations = [
            Size([640, 480]),
            Intrinsics([400.0, 401.0, 320.0, 240.0]),
            Lens(BrownConrady, &[0.1, 0.2, 0.003, 0.004, 0.5]),
            Note("no shutter times"),
        ];
        check(&text, &read("camera.json", &text), &expectations);
    }
    refused(
        "no coefficients",
        "camera.json",
        &format!("{{\"K\": {matrix}, \"width\": 640, \"height\": 480}}"),
        &["distortion_coefficients", "is missing for K"],
    );
    refused("no size", "camera.json", &format!("{{\"K\": {matrix}, \"D\": {list}}}"), &["image_width"]);
    refused(
        "a key twice",
        "camera.json",
        &format!("{{\"K\": {matrix}, \"D\": {list}, \"D\": [0,0,0,0,0], \"width\": 640, \"height\": 480}}"),
        &["duplicate key `D`"],
    );
}
