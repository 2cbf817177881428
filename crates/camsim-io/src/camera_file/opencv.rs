//! OpenCV FileStorage (YAML, XML, JSON), and the like as Python scripts write it: a camera matrix, distortion
//! coefficients and an image size under one of their usual names.

use camsim_core::scenario::LensModel;
use serde_json::Value;

use super::document::{
    Document, KeyProblem, as_number, camera_matrix, find, flag, number, numbers, numbers_n, one_of, size,
    word,
};
use super::key_table::{KeyRow, Neutral, Treatment};
use super::selection::CameraEntry;
use super::{CameraFormat, ImportedCamera, camera, lens_models, ros};

pub(super) const KEYS: &[KeyRow] = &[
    KeyRow::new(
        "camera_matrix",
        Treatment::Applied,
        "3 x 3; also with the suffix 0, 1, 2, L, R, _left, _right, Left, Right for a stereo pair",
    ),
    KeyRow::new("Camera_Matrix", Treatment::Applied, "as camera_matrix"),
    KeyRow::new("cameraMatrix", Treatment::Applied, "as camera_matrix"),
    KeyRow::new("CameraMatrix", Treatment::Applied, "as camera_matrix"),
    KeyRow::new("CameraMat", Treatment::Applied, "as camera_matrix"),
    KeyRow::new("camera_intrinsics", Treatment::Applied, "as camera_matrix"),
    KeyRow::new("intrinsic_matrix", Treatment::Applied, "as camera_matrix"),
    KeyRow::new("intrinsics_matrix", Treatment::Applied, "as camera_matrix"),
    KeyRow::new("mtx", Treatment::Applied, "as camera_matrix"),
    KeyRow::new("K", Treatment::Applied, "as camera_matrix"),
    KeyRow::new("M", Treatment::Applied, "as camera_matrix"),
    KeyRow::new("intrinsics", Treatment::Applied, "as camera_matrix"),
    KeyRow::new(
        "distortion_coefficients",
        Treatment::Applied,
        "5, 8, 12 or 14: k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4 tau_x tau_y. Four need a model, or --format",
    ),
    KeyRow::new("Distortion_Coefficients", Treatment::Applied, "as distortion_coefficients"),
    KeyRow::new("distortion_coeffs", Treatment::Applied, "as distortion_coefficients"),
    KeyRow::new("distortionCoefficients", Treatment::Applied, "as distortion_coefficients"),
    KeyRow::new("distCoeffs", Treatment::Applied, "as distortion_coefficients"),
    KeyRow::new("dist_coeffs", Treatment::Applied, "as distortion_coefficients"),
    KeyRow::new("DistCoeffs", Treatment::Applied, "as distortion_coefficients"),
    KeyRow::new("dist_coeff", Treatment::Applied, "as distortion_coefficients"),
    KeyRow::new("distCoeff", Treatment::Applied, "as distortion_coefficients"),
    KeyRow::new("DistCoeff", Treatment::Applied, "as distortion_coefficients"),
    KeyRow::new("distortion", Treatment::Applied, "as distortion_coefficients"),
    KeyRow::new("dist_coefs", Treatment::Applied, "as distortion_coefficients"),
    KeyRow::new("dist", Treatment::Applied, "as distortion_coefficients"),
    KeyRow::new("D", Treatment::Applied, "as distortion_coefficients"),
    KeyRow::new("image_width", Treatment::Applied, "width of the picture"),
    KeyRow::new("image_height", Treatment::Applied, "height of the picture"),
    KeyRow::new("image_Width", Treatment::Applied, "width of the picture"),
    KeyRow::new("image_Height", Treatment::Applied, "height of the picture"),
    KeyRow::new("imageWidth", Treatment::Applied, "width of the picture"),
    KeyRow::new("imageHeight", Treatment::Applied, "height of the picture"),
    KeyRow::new("width", Treatment::Applied, "width of the picture"),
    KeyRow::new("height", Treatment::Applied, "height of the picture"),
    KeyRow::new("img_width", Treatment::Applied, "width of the picture"),
    KeyRow::new("img_height", Treatment::Applied, "height of the picture"),
    KeyRow::new("camera_width", Treatment::Applied, "width of the picture"),
    KeyRow::new("camera_height", Treatment::Applied, "height of the picture"),
    KeyRow::new("image_size", Treatment::Applied, "width and height, in this order"),
    KeyRow::new("imageSize", Treatment::Applied, "width and height, in this order"),
    KeyRow::new("ImageSize", Treatment::Applied, "width and height, in this order"),
    KeyRow::new("img_size", Treatment::Applied, "width and height, in this order"),
    KeyRow::new("size", Treatment::Applied, "width and height, in this order"),
    KeyRow::new("resolution", Treatment::Applied, "width and height, in this order"),
    KeyRow::new("image_resolution", Treatment::Applied, "width and height, in this order"),
    KeyRow::new("xi", Treatment::Applied, "mirror parameter of the module omnidir, with k1 k2 p1 p2"),
    KeyRow::new("fisheye_model", Treatment::Applied, "1: fisheye coefficients"),
    KeyRow::new("fisheye", Treatment::Applied, "as above"),
    KeyRow::new("is_fisheye", Treatment::Applied, "as above"),
    KeyRow::new(
        "model_type",
        Treatment::Applied,
        "name of the model: fisheye, equidistant, Kannala-Brandt; radtan, plumb_bob, Brown, rational, \
         standard",
    ),
    KeyRow::new(
        "camera_model",
        Treatment::Applied,
        "as model_type; other texts, such as a product name, are ignored",
    ),
    KeyRow::new("distortion_type", Treatment::Applied, "as above"),
    KeyRow::new("lens_model", Treatment::Applied, "as above"),
    KeyRow::new("projection_type", Treatment::Applied, "as above"),
    KeyRow::new("model", Treatment::Applied, "as above"),
    KeyRow::new("DistModel", Treatment::Applied, "as above"),
    KeyRow::new("dist_model", Treatment::Applied, "as above"),
    KeyRow::new(
        "image_shape",
        Treatment::Refused(Neutral::Never),
        "the order of rows and columns is ambiguous: write image_width and image_height instead",
    ),
    KeyRow::new(
        "img_shape",
        Treatment::Refused(Neutral::Never),
        "the order of rows and columns is ambiguous: write image_width and image_height instead",
    ),
    KeyRow::new(
        "shape",
        Treatment::Refused(Neutral::Never),
        "the order of rows and columns is ambiguous: write image_width and image_height instead",
    ),
    KeyRow::new(
        "new_camera_matrix",
        Treatment::Reported(Neutral::Never),
        "the matrix of undistorted pictures; camsim renders distorted ones",
    ),
    KeyRow::new(
        "newcameramtx",
        Treatment::Reported(Neutral::Never),
        "the matrix of undistorted pictures; camsim renders distorted ones",
    ),
    KeyRow::new(
        "roi",
        Treatment::Reported(Neutral::Zero),
        "the valid region of undistorted pictures; camsim renders distorted ones",
    ),
    KeyRow::new(
        "R",
        Treatment::Reported(Neutral::Identity),
        "stereo or rectification geometry, which does not apply to a single camera",
    ),
    KeyRow::new(
        "R1",
        Treatment::Reported(Neutral::Identity),
        "stereo or rectification geometry, which does not apply to a single camera",
    ),
    KeyRow::new(
        "R2",
        Treatment::Reported(Neutral::Identity),
        "stereo or rectification geometry, which does not apply to a single camera",
    ),
    KeyRow::new(
        "R_L",
        Treatment::Reported(Neutral::Identity),
        "stereo or rectification geometry, which does not apply to a single camera",
    ),
    KeyRow::new(
        "R_R",
        Treatment::Reported(Neutral::Identity),
        "stereo or rectification geometry, which does not apply to a single camera",
    ),
    KeyRow::new(
        "P",
        Treatment::Reported(Neutral::Zero),
        "stereo or rectification geometry, which does not apply to a single camera",
    ),
    KeyRow::new(
        "P2",
        Treatment::Reported(Neutral::Zero),
        "stereo or rectification geometry, which does not apply to a single camera",
    ),
    KeyRow::new(
        "P_L",
        Treatment::Reported(Neutral::Zero),
        "stereo or rectification geometry, which does not apply to a single camera",
    ),
    KeyRow::new(
        "P_R",
        Treatment::Reported(Neutral::Zero),
        "stereo or rectification geometry, which does not apply to a single camera",
    ),
    KeyRow::new(
        "T_L",
        Treatment::Reported(Neutral::Zero),
        "stereo or rectification geometry, which does not apply to a single camera",
    ),
    KeyRow::new(
        "T_R",
        Treatment::Reported(Neutral::Zero),
        "stereo or rectification geometry, which does not apply to a single camera",
    ),
    KeyRow::new(
        "T",
        Treatment::Reported(Neutral::Zero),
        "stereo or rectification geometry, which does not apply to a single camera",
    ),
    KeyRow::new(
        "E",
        Treatment::Reported(Neutral::Zero),
        "stereo or rectification geometry, which does not apply to a single camera",
    ),
    KeyRow::new(
        "F",
        Treatment::Reported(Neutral::Zero),
        "stereo or rectification geometry, which does not apply to a single camera",
    ),
    KeyRow::new(
        "P1",
        Treatment::Reported(Neutral::Zero),
        "stereo or rectification geometry, which does not apply to a single camera",
    ),
    KeyRow::new(
        "Q",
        Treatment::Reported(Neutral::Zero),
        "stereo or rectification geometry, which does not apply to a single camera",
    ),
    KeyRow::new(
        "*_projection",
        Treatment::Reported(Neutral::Zero),
        "stereo or rectification geometry, which does not apply to a single camera",
    ),
    KeyRow::new(
        "CameraExtrinsicMat",
        Treatment::Reported(Neutral::Identity),
        "pose of the camera: set mount instead",
    ),
    KeyRow::new("extrinsic_parameters", Treatment::Ignored, "poses of the calibration board"),
    KeyRow::new("image_points", Treatment::Ignored, "detected corners"),
    KeyRow::new("grid_points", Treatment::Ignored, "corners of the board"),
    KeyRow::new("per_view_reprojection_errors", Treatment::Ignored, "calibration residual"),
    KeyRow::new("avg_reprojection_error", Treatment::Ignored, "calibration residual"),
    KeyRow::new("*reprojection_error*", Treatment::Ignored, "calibration residual"),
    KeyRow::new("ReprojectionError", Treatment::Ignored, "calibration residual"),
    KeyRow::new("rms", Treatment::Ignored, "calibration residual"),
    KeyRow::new("rvecs", Treatment::Ignored, "poses of the calibration board"),
    KeyRow::new("tvecs", Treatment::Ignored, "poses of the calibration board"),
    KeyRow::new("flags", Treatment::Ignored, "options of the calibration"),
    KeyRow::new("n*rames", Treatment::Ignored, "number of pictures"),
    KeyRow::new("n*rames*", Treatment::Ignored, "number of pictures"),
    KeyRow::new("nr_of_frames", Treatment::Ignored, "number of pictures"),
    KeyRow::new("board_*", Treatment::Ignored, "the calibration board"),
    KeyRow::new("square_size", Treatment::Ignored, "the calibration board"),
    KeyRow::new("marker_size", Treatment::Ignored, "the calibration board"),
    KeyRow::new("aspectRatio", Treatment::Ignored, "an option of the calibration"),
    KeyRow::new("fix_aspect_ratio", Treatment::Ignored, "an option of the calibration"),
    KeyRow::new("calibration_time", Treatment::Ignored, "date or version"),
];

/// Names of the camera matrix in OpenCV's samples and other projects.
pub(super) const MATRICES: [&str; 12] = [
    "camera_matrix",
    "Camera_Matrix",
    "cameraMatrix",
    "CameraMatrix",
    "CameraMat",
    "camera_intrinsics",
    "intrinsic_matrix",
    "intrinsics_matrix",
    "mtx",
    "K",
    "M",
    "intrinsics",
];

/// Names of the distortion coefficients.
pub(super) const COEFFICIENTS: [&str; 14] = [
    "distortion_coefficients",
    "Distortion_Coefficients",
    "distortion_coeffs",
    "distortionCoefficients",
    "distCoeffs",
    "dist_coeffs",
    "DistCoeffs",
    "dist_coeff",
    "distCoeff",
    "DistCoeff",
    "distortion",
    "dist_coefs",
    "dist",
    "D",
];

/// Suffixes of the cameras of a stereo pair.
const SUFFIXES: [&str; 11] = ["", "1", "2", "0", "L", "R", "_left", "_right", "Left", "Right", "_1"];

/// Names of width and height.
pub(super) const SIZES: [(&str, &str); 6] = [
    ("image_width", "image_height"),
    ("image_Width", "image_Height"),
    ("imageWidth", "imageHeight"),
    ("width", "height"),
    ("img_width", "img_height"),
    ("camera_width", "camera_height"),
];
/// Names of lists of width and height.
pub(super) const SIZE_LISTS: [&str; 7] =
    ["image_size", "imageSize", "ImageSize", "img_size", "size", "resolution", "image_resolution"];

/// Names of matrix and coefficients of each camera.
fn matrix_and_coefficients(document: &Document) -> Vec<(String, Option<String>)> {
    let value = &document.value;
    let mut pairs = Vec::new();
    for suffix in SUFFIXES {
        for matrix in MATRICES.map(|name| format!("{name}{suffix}")) {
            if numbers(value, &matrix).is_ok_and(|list| list.len() == 9) {
                let coefficients = COEFFICIENTS
                    .map(|name| format!("{name}{suffix}"))
                    .into_iter()
                    .find(|name| find(value, name).is_some());
                pairs.push((matrix, coefficients));
            }
        }
    }
    // If any camera has coefficients, matrices without them belong to no camera.
    if pairs.iter().any(|(_, coefficients)| coefficients.is_some()) {
        pairs.retain(|(_, coefficients)| coefficients.is_some());
    }
    pairs
}

pub(super) fn matches(document: &Document) -> bool {
    let container = document.root.is_empty() || document.root == "opencv_storage";
    container && !ros::matches(document) && !matrix_and_coefficients(document).is_empty()
}

pub(super) fn entries(document: &Document) -> Vec<CameraEntry<'_>> {
    let entry = |(matrix, coefficients): (String, Option<String>)| {
        let roots = [Some(matrix.clone()), coefficients].into_iter().flatten().collect();
        CameraEntry { name: matrix, aliases: Vec::new(), value: &document.value, roots }
    };
    matrix_and_coefficients(document).into_iter().map(entry).collect()
}

/// Refuses matrices without coefficients if those have other names.
pub(super) fn check_coefficients(entries: &[CameraEntry<'_>]) -> Result<(), KeyProblem> {
    match entries.iter().find(|entry| entry.roots.len() == 1 && elsewhere(entry.value).is_some()) {
        Some(entry) => Err(missing_coefficients(entry.value, &entry.name)),
        None => Ok(()),
    }
}

/// Imports a camera. If the user named the format (`is_explicit`), four coefficients without a model are
/// radial-tangential.
pub(super) fn import(
    entry: &CameraEntry<'_>,
    format: CameraFormat,
    is_explicit: bool,
) -> Result<ImportedCamera, KeyProblem> {
    let value = entry.value;
    let matrix = entry.name.as_str();
    let (focal_px, principal_point_px) = camera_matrix(value, matrix)?;
    let key = entry.roots.get(1).ok_or_else(|| missing_coefficients(value, matrix))?;
    // Several lists of one camera must be equal.
    let suffix = MATRICES.iter().find_map(|name| matrix.strip_prefix(name)).unwrap_or_default();
    let names = COEFFICIENTS.map(|name| format!("{name}{suffix}"));
    one_of(value, &names.each_ref().map(String::as_str))?;
    let size_px = image_size(value)?;
    let list = numbers(value, key)?;
    if let Some(xi) = mirror(value)? {
        let coefficients = [&[xi], &list[..]].concat();
        let (model, coefficients) = lens_models::lens_by_name("xi", "omni", key, coefficients)?;
        return Ok(camera(format, size_px, focal_px, principal_point_px, model, coefficients));
    }
    let stated_model = model(value)?;
    let lens = match (format, stated_model) {
        (CameraFormat::OpenCvFisheye, Some((model_key, LensModel::BrownConrady))) => {
            return Err(KeyProblem::new(
                model_key,
                "states a model that is not a fisheye: use `--format opencv`, or correct the file",
            ));
        }
        (CameraFormat::OpenCvFisheye, _) => LensModel::KannalaBrandt,
        (_, Some((_, model))) => model,
        (_, None) if list.len() == 4 && !is_explicit => {
            let text = "has four coefficients, and the file does not state their model: k1 k2 p1 p2 of \
                        OpenCV's calib3d (then `--format opencv`) or k1 k2 k3 k4 of its fisheye module (then \
                        `--format opencv-fisheye`)";
            return Err(KeyProblem::new(key, text));
        }
        (_, None) => LensModel::BrownConrady,
    };
    let (lens, list) = match lens {
        LensModel::KannalaBrandt => (lens, lens_models::equidistant(key, list)?),
        _ => lens_models::radial_tangential_or_prism(key, list)?,
    };
    Ok(camera(format, size_px, focal_px, principal_point_px, lens, list))
}

/// What to say if no known key has the coefficients of a matrix: those under names of other programs are given as
/// they are to be written.
fn missing_coefficients(value: &Value, matrix: &str) -> KeyProblem {
    let key = "distortion_coefficients";
    match elsewhere(value) {
        Some((names, list)) => KeyProblem::new(
            key,
            format!(
                "is missing for {matrix}, and {} have the lens: write `distortion_coefficients: {list:?}` instead of \
                 them (k1 k2 p1 p2 k3 ...). MATLAB counts cx and cy from 1, and writes sizes as rows, columns",
                names.join(", ")
            ),
        ),
        None => KeyProblem::new(
            key,
            format!("is missing for {matrix}: add it, as [0, 0, 0, 0, 0] if there is no distortion"),
        ),
    }
}

/// Coefficients under one key each, or as radial and tangential ones: the keys, and the list in OpenCV's order.
pub(super) fn elsewhere(value: &Value) -> Option<(Vec<&str>, Vec<f64>)> {
    let (mut names, mut k, mut p) = (Vec::new(), vec![0.0; 3], vec![0.0; 2]);
    for (name, item) in value.as_object()? {
        let plain = name.to_ascii_lowercase();
        let is_tangential = plain.contains("tangential");
        let list = numbers(value, name).unwrap_or_default();
        if (is_tangential || plain.contains("radial")) && !list.is_empty() {
            let to = if is_tangential { &mut p } else { &mut k };
            list.iter().enumerate().for_each(|(index, number)| set(to, index, *number));
        } else if let (Some(number), Some((kind, index))) = (as_number(item), coefficient(&plain)) {
            set(if kind == 'p' { &mut p } else { &mut k }, index, number);
        } else {
            continue;
        }
        names.push(name.as_str());
    }
    let rest = k.split_off(3);
    let mut all = [&k[..2], &p[..2], &k[2..], &rest].concat();
    // OpenCV has five or eight.
    all.resize(if all.len() > 5 { all.len().max(8) } else { 5 }, 0.0);
    (!names.is_empty()).then_some((names, all))
}

/// `k1` as k, 0; `p2` as p, 1.
fn coefficient(name: &str) -> Option<(char, usize)> {
    let (kind, number) = name.split_at_checked(1)?;
    let index = number.parse::<usize>().ok().filter(|number| (1..=6).contains(number))? - 1;
    Some((kind.chars().next().filter(|kind| ['k', 'p'].contains(kind))?, index))
}

/// Sets a number of a list, which grows as needed.
fn set(list: &mut Vec<f64>, index: usize, number: f64) {
    list.resize(list.len().max(index + 1), 0.0);
    list[index] = number;
}

/// The mirror parameter of OpenCV's module omnidir, as a number or a matrix of one; zero is none.
fn mirror(value: &Value) -> Result<Option<f64>, KeyProblem> {
    if find(value, "xi").is_none() {
        return Ok(None);
    }
    let [xi] = numbers_n(value, "xi")?;
    Ok(Some(xi).filter(|xi| *xi != 0.0))
}

/// The stated model and its key.
fn model(value: &Value) -> Result<Option<(&'static str, LensModel)>, KeyProblem> {
    let mut stated: Option<(&'static str, LensModel)> = None;
    let mut set = |key: &'static str, model: LensModel| match stated {
        Some((before, other)) if other != model => {
            Err(KeyProblem::new(key, format!("contradicts the model of {before}: delete one")))
        }
        _ => {
            stated = Some((key, model));
            Ok(())
        }
    };
    for key in ["fisheye_model", "fisheye", "is_fisheye"] {
        if let Some(fisheye) = flag(value, key)? {
            set(key, if fisheye { LensModel::KannalaBrandt } else { LensModel::BrownConrady })?;
        }
    }
    for key in [
        "model_type",
        "camera_model",
        "distortion_type",
        "lens_model",
        "projection_type",
        "model",
        "DistModel",
        "dist_model",
    ] {
        let Some(word) = word(value, key) else { continue };
        let plain: String =
            word.chars().filter(char::is_ascii_alphanumeric).map(|c| c.to_ascii_lowercase()).collect();
        let has = |parts: &[&str]| parts.iter().any(|part| plain.contains(part));
        if lens_models::unsupported_model_name(word).is_some() {
            let advice = "calibrate with OpenCV's calib3d or fisheye model";
            return Err(KeyProblem::new(key, lens_models::unsupported_model(word, advice)));
        } else if has(&["fisheye", "equidist", "kannala", "kb4"]) {
            set(key, LensModel::KannalaBrandt)?;
        } else if has(&["radtan", "radialtang", "plumb", "brown", "rational", "standard"]) {
            set(key, LensModel::BrownConrady)?;
        }
    }
    Ok(stated)
}

/// The image size under any of its names; different ones are refused.
pub(super) fn image_size(value: &Value) -> Result<[u32; 2], KeyProblem> {
    let mut stated: Option<(&str, [u32; 2])> = None;
    let pairs =
        SIZES.iter().filter(|(width, height)| find(value, width).is_some() || find(value, height).is_some());
    let pairs = pairs
        .map(|(width, height)| Ok((*width, size(width, [number(value, width)?, number(value, height)?])?)));
    let lists = SIZE_LISTS
        .iter()
        .filter(|key| find(value, key).is_some())
        .map(|key| Ok((*key, size(key, numbers_n(value, key)?)?)));
    for item in pairs.chain(lists) {
        let (key, size_px): (&str, [u32; 2]) = item?;
        match stated {
            Some((before, other)) if other != size_px => {
                let text = format!(
                    "is {} x {}, but {before} is {} x {}: delete the one that is not the size of the \
                     calibration pictures",
                    size_px[0], size_px[1], other[0], other[1]
                );
                return Err(KeyProblem::new(key, text));
            }
            _ => stated = Some((key, size_px)),
        }
    }
    let missing = || {
        KeyProblem::new(
            "image_width",
            "is missing: add `image_width` and `image_height` of the calibration pictures, or give --size",
        )
    };
    stated.map(|(_, size_px)| size_px).ok_or_else(missing)
}
