//! OpenCV FileStorage (YAML, XML, JSON), and the like as Python scripts write it: a camera matrix, distortion
//! coefficients and an image size under one of their usual names.

use camsim_core::scenario::LensModel;
use serde_json::Value;

use super::choose::Entry;
use super::document::{
    Document, Problem, camera_matrix, find, flag, number, numbers, numbers_n, one_of, size, word,
};
use super::keys::{Key, Neutral, Use};
use super::{CameraFormat, ImportedCamera, camera, models, ros};

pub(super) const KEYS: &[Key] = &[
    Key::new(
        "camera_matrix",
        Use::Applied,
        "3 x 3; also with 0, 1, 2, L, R, _left, _right, Left, Right behind the name, for a stereo pair",
    ),
    Key::new("Camera_Matrix", Use::Applied, "as camera_matrix"),
    Key::new("cameraMatrix", Use::Applied, "as camera_matrix"),
    Key::new("CameraMatrix", Use::Applied, "as camera_matrix"),
    Key::new("CameraMat", Use::Applied, "as camera_matrix"),
    Key::new("camera_intrinsics", Use::Applied, "as camera_matrix"),
    Key::new("intrinsic_matrix", Use::Applied, "as camera_matrix"),
    Key::new("intrinsics_matrix", Use::Applied, "as camera_matrix"),
    Key::new("mtx", Use::Applied, "as camera_matrix"),
    Key::new("K", Use::Applied, "as camera_matrix"),
    Key::new("M", Use::Applied, "as camera_matrix"),
    Key::new("intrinsics", Use::Applied, "as camera_matrix"),
    Key::new(
        "distortion_coefficients",
        Use::Applied,
        "5, 8, or up to 14 of which those after the eighth are zero: k1 k2 p1 p2 k3 k4 k5 k6. Four need a word on the model, or --format",
    ),
    Key::new("Distortion_Coefficients", Use::Applied, "as distortion_coefficients"),
    Key::new("distortion_coeffs", Use::Applied, "as distortion_coefficients"),
    Key::new("distortionCoefficients", Use::Applied, "as distortion_coefficients"),
    Key::new("distCoeffs", Use::Applied, "as distortion_coefficients"),
    Key::new("dist_coeffs", Use::Applied, "as distortion_coefficients"),
    Key::new("DistCoeffs", Use::Applied, "as distortion_coefficients"),
    Key::new("dist_coeff", Use::Applied, "as distortion_coefficients"),
    Key::new("distCoeff", Use::Applied, "as distortion_coefficients"),
    Key::new("DistCoeff", Use::Applied, "as distortion_coefficients"),
    Key::new("distortion", Use::Applied, "as distortion_coefficients"),
    Key::new("dist_coefs", Use::Applied, "as distortion_coefficients"),
    Key::new("dist", Use::Applied, "as distortion_coefficients"),
    Key::new("D", Use::Applied, "as distortion_coefficients"),
    Key::new("image_width", Use::Applied, "width of the picture"),
    Key::new("image_height", Use::Applied, "height of the picture"),
    Key::new("image_Width", Use::Applied, "width of the picture"),
    Key::new("image_Height", Use::Applied, "height of the picture"),
    Key::new("imageWidth", Use::Applied, "width of the picture"),
    Key::new("imageHeight", Use::Applied, "height of the picture"),
    Key::new("width", Use::Applied, "width of the picture"),
    Key::new("height", Use::Applied, "height of the picture"),
    Key::new("img_width", Use::Applied, "width of the picture"),
    Key::new("img_height", Use::Applied, "height of the picture"),
    Key::new("camera_width", Use::Applied, "width of the picture"),
    Key::new("camera_height", Use::Applied, "height of the picture"),
    Key::new("image_size", Use::Applied, "width and height, in this order"),
    Key::new("imageSize", Use::Applied, "width and height, in this order"),
    Key::new("ImageSize", Use::Applied, "width and height, in this order"),
    Key::new("img_size", Use::Applied, "width and height, in this order"),
    Key::new("size", Use::Applied, "width and height, in this order"),
    Key::new("resolution", Use::Applied, "width and height, in this order"),
    Key::new("image_resolution", Use::Applied, "width and height, in this order"),
    Key::new("fisheye_model", Use::Applied, "1: the coefficients are a fisheye's"),
    Key::new("fisheye", Use::Applied, "the same"),
    Key::new("is_fisheye", Use::Applied, "the same"),
    Key::new(
        "model_type",
        Use::Applied,
        "a word that names the model: fisheye, equidistant, Kannala-Brandt; radtan, plumb_bob, Brown, rational, standard",
    ),
    Key::new("camera_model", Use::Applied, "the same; other words (a product's name) are no model"),
    Key::new("distortion_type", Use::Applied, "the same"),
    Key::new("lens_model", Use::Applied, "the same"),
    Key::new("projection_type", Use::Applied, "the same"),
    Key::new("model", Use::Applied, "the same"),
    Key::new("DistModel", Use::Applied, "the same"),
    Key::new("dist_model", Use::Applied, "the same"),
    Key::new(
        "image_shape",
        Use::Refused(Neutral::Never),
        "rows first or columns first? Write image_width and image_height instead",
    ),
    Key::new(
        "img_shape",
        Use::Refused(Neutral::Never),
        "rows first or columns first? Write image_width and image_height instead",
    ),
    Key::new(
        "shape",
        Use::Refused(Neutral::Never),
        "rows first or columns first? Write image_width and image_height instead",
    ),
    Key::new(
        "new_camera_matrix",
        Use::Named(Neutral::Never),
        "the matrix of undistorted pictures; those that come out are distorted",
    ),
    Key::new(
        "newcameramtx",
        Use::Named(Neutral::Never),
        "the matrix of undistorted pictures; those that come out are distorted",
    ),
    Key::new(
        "roi",
        Use::Named(Neutral::Zero),
        "the valid part of undistorted pictures; those that come out are distorted",
    ),
    Key::new(
        "R",
        Use::Named(Neutral::Identity),
        "stereo or rectification geometry, which a single camera has not",
    ),
    Key::new(
        "R1",
        Use::Named(Neutral::Identity),
        "stereo or rectification geometry, which a single camera has not",
    ),
    Key::new(
        "R2",
        Use::Named(Neutral::Identity),
        "stereo or rectification geometry, which a single camera has not",
    ),
    Key::new(
        "R_L",
        Use::Named(Neutral::Identity),
        "stereo or rectification geometry, which a single camera has not",
    ),
    Key::new(
        "R_R",
        Use::Named(Neutral::Identity),
        "stereo or rectification geometry, which a single camera has not",
    ),
    Key::new(
        "P",
        Use::Named(Neutral::Zero),
        "stereo or rectification geometry, which a single camera has not",
    ),
    Key::new(
        "P2",
        Use::Named(Neutral::Zero),
        "stereo or rectification geometry, which a single camera has not",
    ),
    Key::new(
        "P_L",
        Use::Named(Neutral::Zero),
        "stereo or rectification geometry, which a single camera has not",
    ),
    Key::new(
        "P_R",
        Use::Named(Neutral::Zero),
        "stereo or rectification geometry, which a single camera has not",
    ),
    Key::new(
        "T_L",
        Use::Named(Neutral::Zero),
        "stereo or rectification geometry, which a single camera has not",
    ),
    Key::new(
        "T_R",
        Use::Named(Neutral::Zero),
        "stereo or rectification geometry, which a single camera has not",
    ),
    Key::new(
        "T",
        Use::Named(Neutral::Zero),
        "stereo or rectification geometry, which a single camera has not",
    ),
    Key::new(
        "E",
        Use::Named(Neutral::Zero),
        "stereo or rectification geometry, which a single camera has not",
    ),
    Key::new(
        "F",
        Use::Named(Neutral::Zero),
        "stereo or rectification geometry, which a single camera has not",
    ),
    Key::new(
        "P1",
        Use::Named(Neutral::Zero),
        "stereo or rectification geometry, which a single camera has not",
    ),
    Key::new(
        "Q",
        Use::Named(Neutral::Zero),
        "stereo or rectification geometry, which a single camera has not",
    ),
    Key::new(
        "*_projection",
        Use::Named(Neutral::Zero),
        "stereo or rectification geometry, which a single camera has not",
    ),
    Key::new("CameraExtrinsicMat", Use::Named(Neutral::Identity), "pose of the camera: set mount by hand"),
    Key::new("extrinsic_parameters", Use::Silent, "poses of the calibration board"),
    Key::new("image_points", Use::Silent, "corners that were found"),
    Key::new("grid_points", Use::Silent, "corners of the board"),
    Key::new("per_view_reprojection_errors", Use::Silent, "how well it fitted"),
    Key::new("avg_reprojection_error", Use::Silent, "how well it fitted"),
    Key::new("*reprojection_error*", Use::Silent, "how well it fitted"),
    Key::new("ReprojectionError", Use::Silent, "how well it fitted"),
    Key::new("rms", Use::Silent, "how well it fitted"),
    Key::new("rvecs", Use::Silent, "poses of the calibration board"),
    Key::new("tvecs", Use::Silent, "poses of the calibration board"),
    Key::new("flags", Use::Silent, "options of the calibration"),
    Key::new("n*rames", Use::Silent, "how many pictures were used"),
    Key::new("n*rames*", Use::Silent, "how many pictures were used"),
    Key::new("nr_of_frames", Use::Silent, "how many pictures were used"),
    Key::new("board_*", Use::Silent, "the calibration board"),
    Key::new("square_size", Use::Silent, "the calibration board"),
    Key::new("marker_size", Use::Silent, "the calibration board"),
    Key::new("aspectRatio", Use::Silent, "an option of the calibration"),
    Key::new("fix_aspect_ratio", Use::Silent, "an option of the calibration"),
    Key::new("calibration_time", Use::Silent, "when it was made"),
];

/// What OpenCV's samples and the projects after them call the camera matrix.
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

/// And the coefficients.
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

/// How the cameras of a stereo pair are told apart.
const SUFFIXES: [&str; 11] = ["", "1", "2", "0", "L", "R", "_left", "_right", "Left", "Right", "_1"];

/// Image sizes: width and height apart, and both in one list.
pub(super) const SIZES: [(&str, &str); 6] = [
    ("image_width", "image_height"),
    ("image_Width", "image_Height"),
    ("imageWidth", "imageHeight"),
    ("width", "height"),
    ("img_width", "img_height"),
    ("camera_width", "camera_height"),
];
pub(super) const SIZE_LISTS: [&str; 7] =
    ["image_size", "imageSize", "ImageSize", "img_size", "size", "resolution", "image_resolution"];

/// Names of matrix and coefficients of each camera. Two sets of one camera are refused by `entries`.
fn pairs(document: &Document) -> Vec<(String, Option<String>)> {
    let value = &document.value;
    let mut found = Vec::new();
    for suffix in SUFFIXES {
        for matrix in MATRICES.map(|name| format!("{name}{suffix}")) {
            if numbers(value, &matrix).is_ok_and(|list| list.len() == 9) {
                let coefficients = COEFFICIENTS
                    .map(|name| format!("{name}{suffix}"))
                    .into_iter()
                    .find(|name| find(value, name).is_some());
                found.push((matrix, coefficients));
            }
        }
    }
    // A matrix of its own camera has coefficients of its own, if any has.
    if found.iter().any(|(_, coefficients)| coefficients.is_some()) {
        found.retain(|(_, coefficients)| coefficients.is_some());
    }
    found
}

pub(super) fn fits(document: &Document) -> bool {
    let container = document.root.is_empty() || document.root == "opencv_storage";
    container && !ros::fits(document) && !pairs(document).is_empty()
}

pub(super) fn entries(document: &Document) -> Vec<Entry<'_>> {
    let entry = |(matrix, coefficients): (String, Option<String>)| {
        let roots = [Some(matrix.clone()), coefficients].into_iter().flatten().collect();
        Entry { name: matrix, also: Vec::new(), value: &document.value, roots }
    };
    pairs(document).into_iter().map(entry).collect()
}

/// `asked` is whether the user named the format: then four coefficients without a model's name are
/// radial-tangential.
pub(super) fn import(
    entry: &Entry<'_>,
    format: CameraFormat,
    asked: bool,
) -> Result<ImportedCamera, Problem> {
    let value = entry.value;
    let matrix = entry.name.as_str();
    let (focal_px, principal_point_px) = camera_matrix(value, matrix)?;
    let key = entry.roots.get(1).ok_or_else(|| {
        Problem::new(
            "distortion_coefficients",
            format!("is missing, beside {matrix}: add it, as [0, 0, 0, 0, 0] if there is no distortion"),
        )
    })?;
    // Another list of the same camera under another name.
    let suffix = MATRICES.iter().find_map(|name| matrix.strip_prefix(name)).unwrap_or_default();
    let names = COEFFICIENTS.map(|name| format!("{name}{suffix}"));
    one_of(value, &names.each_ref().map(String::as_str))?;
    let size_px = image_size(value)?;
    let list = numbers(value, key)?;
    let named = model(value)?;
    let lens = match (format, named) {
        (CameraFormat::OpenCvFisheye, Some((said_by, LensModel::BrownConrady))) => {
            return Err(Problem::new(
                said_by,
                "says that the model is no fisheye: use `--format opencv`, or correct the file",
            ));
        }
        (CameraFormat::OpenCvFisheye, _) => LensModel::KannalaBrandt,
        (_, Some((_, model))) => model,
        (_, None) if list.len() == 4 && !asked => {
            let text = "has four coefficients, and nothing in the file says of which model: k1 k2 p1 p2 of OpenCV's calib3d (then `--format opencv`) or \
                        k1 k2 k3 k4 of its fisheye module (then `--format opencv-fisheye`)";
            return Err(Problem::new(key, text));
        }
        (_, None) => LensModel::BrownConrady,
    };
    let list = match lens {
        LensModel::KannalaBrandt => models::equidistant(key, list)?,
        _ => models::radial_tangential(key, list, 8)?,
    };
    Ok(camera(format, size_px, focal_px, principal_point_px, lens, list))
}

/// The model that the file names, and where.
fn model(value: &Value) -> Result<Option<(&'static str, LensModel)>, Problem> {
    let mut named: Option<(&'static str, LensModel)> = None;
    let mut say = |key: &'static str, model: LensModel| match named {
        Some((before, other)) if other != model => {
            Err(Problem::new(key, format!("says another model than {before}: delete one")))
        }
        _ => {
            named = Some((key, model));
            Ok(())
        }
    };
    for key in ["fisheye_model", "fisheye", "is_fisheye"] {
        if let Some(fisheye) = flag(value, key)? {
            say(key, if fisheye { LensModel::KannalaBrandt } else { LensModel::BrownConrady })?;
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
        if let Some(other) = models::unknown(&plain) {
            return Err(Problem::new(
                key,
                format!(
                    "is `{word}` ({other}), which no lens here is: calibrate with OpenCV's calib3d or fisheye model"
                ),
            ));
        } else if has(&["fisheye", "equidist", "kannala", "kb4"]) {
            say(key, LensModel::KannalaBrandt)?;
        } else if has(&["radtan", "radialtang", "plumb", "brown", "rational", "standard"]) {
            say(key, LensModel::BrownConrady)?;
        }
    }
    Ok(named)
}

/// The size, however it is called; two that differ are refused.
pub(super) fn image_size(value: &Value) -> Result<[u32; 2], Problem> {
    let mut found: Option<(&str, [u32; 2])> = None;
    let apart =
        SIZES.iter().filter(|(width, height)| find(value, width).is_some() || find(value, height).is_some());
    let apart = apart
        .map(|(width, height)| Ok((*width, size(width, [number(value, width)?, number(value, height)?])?)));
    let lists = SIZE_LISTS
        .iter()
        .filter(|key| find(value, key).is_some())
        .map(|key| Ok((*key, size(key, numbers_n(value, key)?)?)));
    for one in apart.chain(lists) {
        let (key, size_px): (&str, [u32; 2]) = one?;
        match found {
            Some((before, other)) if other != size_px => {
                let text = format!(
                    "is {} x {}, but {before} says {} x {}: delete the one that is not the calibrated pictures'",
                    size_px[0], size_px[1], other[0], other[1]
                );
                return Err(Problem::new(key, text));
            }
            _ => found = Some((key, size_px)),
        }
    }
    let missing = || {
        Problem::new(
            "image_width",
            "is missing: add `image_width` and `image_height` of the pictures that were calibrated",
        )
    };
    found.map(|(_, size_px)| size_px).ok_or_else(missing)
}
