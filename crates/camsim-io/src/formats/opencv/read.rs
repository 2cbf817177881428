//! OpenCV FileStorage (YAML, XML, JSON), and the like as Python scripts write it: a camera matrix, distortion
//! coefficients and an image size under one of their usual names.

use camsim_core::scenario::LensModel;
use serde_json::Value;

use crate::formats::reading::format::{ReadCamera, Reader, Selected, camera};
use crate::formats::reading::key_table::{KeyRow, Neutral, applied, ignored, refused, reported};
use crate::formats::reading::lens_models;
use crate::formats::reading::selection::CameraEntry;
use crate::formats::reading::stated_size::add_size;
use crate::formats::ros::read as ros;
use crate::text::document::{
    Document, KeyProblem, as_number, camera_matrix, find, flag, numbers, numbers_n, one_of, size, size_of,
    word,
};

/// Four coefficients are `k1 k2 p1 p2`.
pub(crate) const READER: Reader = Reader {
    roots: &["", "opencv_storage"],
    complete,
    entries,
    ..Reader::new("opencv", "OpenCV YAML/XML", matches, &[("", KEYS)], |camera| import(camera, false))
};

/// Coefficients of the fisheye module; never detected.
pub(crate) const FISHEYE_READER: Reader = Reader {
    name: "opencv-fisheye",
    title: "OpenCV YAML/XML of a fisheye",
    roots: &[],
    import: |camera| import(camera, true),
    ..READER
};

const KEYS: &[KeyRow] = &[
    applied(
        MATRIX,
        "3 x 3; also with the suffix 0, 1, 2, L, R, _left, _right, Left, Right for a stereo pair",
    ),
    applied(OTHER_MATRICES, "as camera_matrix"),
    applied(
        COEFFICIENTS,
        "5, 8, 12 or 14: k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4 tau_x tau_y. Four need a model, or --format",
    ),
    applied(OTHER_COEFFICIENTS, "as distortion_coefficients"),
    applied("image_width", "width of the picture"),
    applied("image_height", "height of the picture"),
    applied("image_Width", "width of the picture"),
    applied("image_Height", "height of the picture"),
    applied("imageWidth", "width of the picture"),
    applied("imageHeight", "height of the picture"),
    applied("width", "width of the picture"),
    applied("height", "height of the picture"),
    applied("img_width", "width of the picture"),
    applied("img_height", "height of the picture"),
    applied("camera_width", "width of the picture"),
    applied("camera_height", "height of the picture"),
    applied(SIZE_LISTS, "width and height, in this order"),
    applied("xi", "mirror parameter of the module omnidir, with k1 k2 p1 p2"),
    applied(FISHEYE_FLAG, "1: fisheye coefficients"),
    applied(OTHER_FISHEYE_FLAGS, "as above"),
    applied(
        "model_type",
        "name of the model: fisheye, equidistant, Kannala-Brandt; radtan, plumb_bob, Brown, rational, \
         standard",
    ),
    applied("camera_model", "as model_type; other texts, such as a product name, are ignored"),
    applied(OTHER_MODELS, "as above"),
    refused(
        Neutral::Never,
        "image_shape img_shape shape",
        "the order of rows and columns is ambiguous: write image_width and image_height instead",
    ),
    reported(
        Neutral::Never,
        "new_camera_matrix newcameramtx",
        "the matrix of undistorted pictures; camsim renders distorted ones",
    ),
    reported(Neutral::Zero, "roi", "the valid region of undistorted pictures; camsim renders distorted ones"),
    reported(
        Neutral::Identity,
        "R R1 R2 R_L R_R",
        "stereo or rectification geometry, which does not apply to a single camera",
    ),
    reported(
        Neutral::Zero,
        "P P2 P_L P_R T_L T_R T E F P1 Q *_projection",
        "stereo or rectification geometry, which does not apply to a single camera",
    ),
    reported(Neutral::Identity, "CameraExtrinsicMat", "pose of the camera: set mount instead"),
    ignored("extrinsic_parameters", "poses of the calibration board"),
    ignored("image_points", "detected corners"),
    ignored("grid_points", "corners of the board"),
    ignored(
        "per_view_reprojection_errors avg_reprojection_error *reprojection_error* ReprojectionError \
         rms",
        "calibration residual",
    ),
    ignored("rvecs tvecs", "poses of the calibration board"),
    ignored("flags", "options of the calibration"),
    ignored("n*rames n*rames* nr_of_frames", "number of pictures"),
    ignored("board_* square_size marker_size", "the calibration board"),
    ignored("aspectRatio fix_aspect_ratio", "an option of the calibration"),
    ignored("calibration_time", "date or version"),
];

/// Names of the camera matrix in OpenCV's samples and other projects.
const MATRIX: &str = "camera_matrix";
const OTHER_MATRICES: &str = "Camera_Matrix cameraMatrix CameraMatrix CameraMat camera_intrinsics intrinsic_matrix \
                              intrinsics_matrix mtx K M intrinsics";
/// Names of the distortion coefficients.
const COEFFICIENTS: &str = "distortion_coefficients";
const OTHER_COEFFICIENTS: &str = "Distortion_Coefficients distortion_coeffs distortionCoefficients distCoeffs \
                                  dist_coeffs DistCoeffs dist_coeff distCoeff DistCoeff distortion dist_coefs dist D";
/// Names of lists of width and height.
const SIZE_LISTS: &str = "image_size imageSize ImageSize img_size size resolution image_resolution";
/// Names of what says whether it is a fisheye.
const FISHEYE_FLAG: &str = "fisheye_model";
const OTHER_FISHEYE_FLAGS: &str = "fisheye is_fisheye";
/// Names of the lens model.
const MODELS: &str = "model_type camera_model";
const OTHER_MODELS: &str = "distortion_type lens_model projection_type model DistModel dist_model";

fn names(first: &'static str, others: &'static str) -> impl Iterator<Item = &'static str> {
    first.split_whitespace().chain(others.split_whitespace())
}

/// Names of the distortion coefficients.
pub(crate) fn coefficient_keys() -> impl Iterator<Item = &'static str> {
    names(COEFFICIENTS, OTHER_COEFFICIENTS)
}

/// Suffixes of the cameras of a stereo pair.
const SUFFIXES: [&str; 11] = ["", "1", "2", "0", "L", "R", "_left", "_right", "Left", "Right", "_1"];

/// Names of width and height.
const SIZES: [(&str, &str); 6] = [
    ("image_width", "image_height"),
    ("image_Width", "image_Height"),
    ("imageWidth", "imageHeight"),
    ("width", "height"),
    ("img_width", "img_height"),
    ("camera_width", "camera_height"),
];

/// Names of matrix and coefficients of each camera.
fn matrix_and_coefficients(document: &Document) -> Vec<(String, Option<String>)> {
    let value = &document.value;
    let mut pairs = Vec::new();
    for suffix in SUFFIXES {
        for matrix in names(MATRIX, OTHER_MATRICES).map(|name| format!("{name}{suffix}")) {
            if numbers(value, &matrix).is_ok_and(|list| list.len() == 9) {
                let coefficients = coefficient_keys()
                    .map(|name| format!("{name}{suffix}"))
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

fn matches(document: &Document) -> bool {
    !ros::matches(document) && !matrix_and_coefficients(document).is_empty()
}

fn complete(document: &mut Document, size_px: [u32; 2]) {
    if image_size(&document.value).is_err() {
        add_size(&mut document.value, ["image_width", "image_height"], size_px);
    }
}

/// The cameras. Matrices without coefficients are refused if those have other names.
fn entries(document: &Document) -> Result<Vec<CameraEntry<'_>>, KeyProblem> {
    let value = &document.value;
    let cameras = matrix_and_coefficients(document);
    if cameras.is_empty() {
        return Err(KeyProblem::new("camera_matrix", "is missing, or is not 3 x 3"));
    }
    let entry = |(matrix, coefficients): (String, Option<String>)| {
        if coefficients.is_none() && elsewhere(value).is_some() {
            return Err(missing_coefficients(value, &matrix));
        }
        let roots = [Some(matrix.clone()), coefficients].into_iter().flatten().collect();
        Ok(CameraEntry { name: matrix, aliases: Vec::new(), value, roots })
    };
    cameras.into_iter().map(entry).collect()
}

/// Imports a camera. If the user named the format, four coefficients without a model are
/// radial-tangential.
fn import(selected: &Selected<'_>, is_fisheye: bool) -> Result<ReadCamera, KeyProblem> {
    let (entry, value) = (selected.entry(), selected.value());
    let matrix = entry.name.as_str();
    let (focal_px, principal_point_px) = camera_matrix(value, matrix)?;
    let key = entry.roots.get(1).ok_or_else(|| missing_coefficients(value, matrix))?;
    // Several lists of one camera must be equal.
    let suffix = names(MATRIX, OTHER_MATRICES).find_map(|name| matrix.strip_prefix(name)).unwrap_or_default();
    let keys: Vec<String> = coefficient_keys().map(|name| format!("{name}{suffix}")).collect();
    one_of(value, &keys.iter().map(String::as_str).collect::<Vec<_>>())?;
    let size_px = image_size(value)?;
    let list = numbers(value, key)?;
    if let Some(xi) = mirror(value)? {
        let coefficients = [&[xi], &list[..]].concat();
        let (model, coefficients) = lens_models::lens_by_name("xi", "omni", key, coefficients)?;
        return Ok(camera(size_px, focal_px, principal_point_px, model, coefficients));
    }
    let lens = match (is_fisheye, model(value)?) {
        (true, Some((model_key, LensModel::BrownConrady))) => {
            return Err(KeyProblem::new(
                model_key,
                "states a model that is not a fisheye: use `--format opencv`, or correct the file",
            ));
        }
        (true, _) => LensModel::KannalaBrandt,
        (_, Some((_, model))) => model,
        (_, None) if list.len() == 4 && !selected.is_explicit => {
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
    Ok(camera(size_px, focal_px, principal_point_px, lens, list))
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
pub(crate) fn elsewhere(value: &Value) -> Option<(Vec<&str>, Vec<f64>)> {
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
    for key in names(FISHEYE_FLAG, OTHER_FISHEYE_FLAGS) {
        if let Some(fisheye) = flag(value, key)? {
            set(key, if fisheye { LensModel::KannalaBrandt } else { LensModel::BrownConrady })?;
        }
    }
    for key in names(MODELS, OTHER_MODELS) {
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
pub(crate) fn image_size(value: &Value) -> Result<[u32; 2], KeyProblem> {
    let mut stated: Option<(&str, [u32; 2])> = None;
    let pairs =
        SIZES.iter().filter(|(width, height)| find(value, width).is_some() || find(value, height).is_some());
    let pairs = pairs.map(|(width, height)| Ok((*width, size_of(value, [width, height])?)));
    let lists = SIZE_LISTS
        .split_whitespace()
        .filter(|key| find(value, key).is_some())
        .map(|key| Ok((key, size(key, numbers_n(value, key)?)?)));
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
