//! OpenCV FileStorage (YAML, XML, JSON): a camera matrix, distortion coefficients and an image size under one of their usual names.

use camsim_core::scenario::LensModel;

use super::document::{Document, Problem, at_most, camera_matrix, find, number, numbers, numbers_n, size};
use super::{CameraFormat, ImportedCamera, camera};

/// Camera matrix and coefficients, as OpenCV's samples and the projects after them call these. The numbered ones are stereo pairs.
const PAIRS: [(&str, &str); 11] = [
    ("camera_matrix", "distortion_coefficients"),
    ("Camera_Matrix", "Distortion_Coefficients"),
    ("cameraMatrix", "distCoeffs"),
    ("camera_matrix", "dist_coeffs"),
    ("camera_matrix", "distortion"),
    ("K", "D"),
    ("M1", "D1"),
    ("K1", "D1"),
    ("cameraMatrix1", "distCoeffs1"),
    ("cameraMatrixL", "distCoeffsL"),
    ("intrinsic_matrix", "distortion_coefficients"),
];

fn pair(document: &Document) -> Option<(&'static str, &'static str)> {
    let both = |(matrix, coefficients): &&(&str, &str)| {
        find(&document.value, matrix).is_some_and(|matrix| matrix.get("data").is_some()) && find(&document.value, coefficients).is_some()
    };
    PAIRS.iter().find(both).copied()
}

pub(super) fn fits(document: &Document) -> bool {
    let container = document.root.is_empty() || document.root == "opencv_storage";
    // ROS uses the same two keys, but names the model.
    container && pair(document).is_some() && find(&document.value, "distortion_model").is_none()
}

pub(super) fn import(document: &Document) -> Result<ImportedCamera, Problem> {
    let value = &document.value;
    let (matrix, coefficients) =
        pair(document).ok_or_else(|| Problem::new("camera_matrix", "is missing, or its distortion coefficients are"))?;
    let (focal_px, principal_point_px) = camera_matrix(value, matrix)?;
    let size_px = image_size(document)?;
    let list = numbers(value, coefficients)?;
    // OpenCV's calibration sample writes the flag; without it coefficients are those of the default model.
    let fisheye = match find(value, "fisheye_model") {
        Some(_) => number(value, "fisheye_model")? != 0.0,
        None => false,
    };
    let mut imported = if fisheye {
        let list = at_most(coefficients, list, 4, "a fisheye has four")?;
        camera(CameraFormat::OpenCv, size_px, focal_px, principal_point_px, LensModel::KannalaBrandt, list)
    } else {
        let list = at_most(coefficients, list, 8, "those after the eighth are OpenCV's thin-prism and tilt terms")?;
        camera(CameraFormat::OpenCv, size_px, focal_px, principal_point_px, LensModel::BrownConrady, list)
    };
    if matches!(matrix, "M1" | "K1" | "cameraMatrix1" | "cameraMatrixL") {
        imported.notes.push(format!("this is a stereo pair; its first camera ({matrix}, {coefficients}) was taken"));
    }
    imported.notes.push("the file has no frame rate and no shutter times: fps is 30, the shutter global".to_owned());
    Ok(imported)
}

fn image_size(document: &Document) -> Result<[u32; 2], Problem> {
    let value = &document.value;
    for (width, height) in [("image_width", "image_height"), ("image_Width", "image_Height"), ("width", "height")] {
        if find(value, width).is_some() {
            return size(width, [number(value, width)?, number(value, height)?]);
        }
    }
    for key in ["image_size", "imageSize", "size", "resolution"] {
        if find(value, key).is_some() {
            return size(key, numbers_n(value, key)?);
        }
    }
    Err(Problem::new("image_width", "is missing: add `image_width` and `image_height` of the images that were calibrated"))
}
