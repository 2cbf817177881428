//! Distortion models by the names that several formats share.

use camsim_core::scenario::LensModel;

use serde_json::Value;

use super::document::{Problem, at_most, find, numbers};

/// Model and coefficients in the order that camsim has, out of a model's name; radial-tangential coefficients
/// are in OpenCV's order.
pub(super) fn by_name(
    model_key: &str,
    model: &str,
    key: &str,
    coefficients: Vec<f64>,
) -> Result<(LensModel, Vec<f64>), Problem> {
    let plain: String =
        model.chars().filter(char::is_ascii_alphanumeric).map(|c| c.to_ascii_lowercase()).collect();
    match plain.as_str() {
        "none" | "nodistortion" | "" if coefficients.iter().all(|k| *k == 0.0) => {
            Ok((LensModel::BrownConrady, Vec::new()))
        }
        "none" | "nodistortion" | "" => {
            let said = if plain.is_empty() { "says nothing" } else { "says that there is none" };
            Err(Problem::new(
                key,
                format!("has coefficients, but {model_key} {said}: name their model there, or delete them"),
            ))
        }
        "radtan" | "radialtangential" | "plumbbob" | "radtan5" => {
            Ok((LensModel::BrownConrady, radial_tangential(key, coefficients, 5)?))
        }
        "radialtangential8" | "radtan8" | "rationalpolynomial" | "rational" => {
            Ok((LensModel::BrownConrady, radial_tangential(key, coefficients, 8)?))
        }
        "equidistant" | "equi" | "fisheye" | "kannalabrandt" | "kannalabrandt4" | "kannalabrandt8"
        | "kb4" => Ok((LensModel::KannalaBrandt, equidistant(key, coefficients)?)),
        other => {
            let which = unknown(other).map_or(String::new(), |name| format!(" ({name})"));
            let text = format!(
                "is `{model}`{which}, which no lens here is: radial-tangential (radtan, plumb_bob, rational_polynomial), equidistant and none can be \
                 imported; calibrate with one of these"
            );
            Err(Problem::new(model_key, text))
        }
    }
}

/// The coefficients at `key`; a file that names a model must have them, and one without a model's name must
/// say that it has none.
pub(super) fn stated(
    value: &Value,
    model_key: &str,
    model: &str,
    key: Option<&str>,
) -> Result<Vec<f64>, Problem> {
    match key.filter(|key| find(value, key).is_some()) {
        Some(key) => numbers(value, key),
        None if model == "none" => Ok(Vec::new()),
        None if model.is_empty() => Err(Problem::new(
            model_key,
            "is missing, and so are coefficients: write `none` if the lens has no distortion",
        )),
        None => {
            let key = key.unwrap_or("distortion_coeffs");
            Err(Problem::new(
                key,
                format!(
                    "is missing, but {model_key} is `{model}`: add it, or write `none` there if the lens has no distortion"
                ),
            ))
        }
    }
}

/// What other programs' short names mean.
pub(super) fn unknown(plain: &str) -> Option<&'static str> {
    let has = |part: &str| plain.contains(part);
    match plain {
        "ds" => Some("double sphere"),
        "eucm" => Some("extended unified camera model"),
        "ucm" | "unifiedprojection" => Some("unified camera model"),
        "mei" => Some("MEI, omnidirectional"),
        "fov" | "atan" => Some("field-of-view model"),
        _ if has("omni") || has("mirror") => Some("MEI, omnidirectional"),
        _ if has("doublesphere") => Some("double sphere"),
        _ if has("scaramuzza") || has("ocam") => Some("OCamCalib's polynomial"),
        _ if has("ftheta") => Some("f-theta polynomial"),
        _ if has("spherical") || has("equirect") => Some("panorama"),
        _ => None,
    }
}

/// `k1 k2 p1 p2`, then `k3`, then `k4 k5 k6`; what comes after must be zero.
pub(super) fn radial_tangential(key: &str, coefficients: Vec<f64>, max: usize) -> Result<Vec<f64>, Problem> {
    match coefficients.len() {
        0 | 4 | 5 | 8 | 12 | 14 => at_most(
            key,
            coefficients,
            max,
            if max == 8 {
                "those after the eighth are OpenCV's thin-prism and tilt terms"
            } else {
                "its model has five"
            },
        ),
        count => {
            let text = format!(
                "has {count} numbers: k1 k2 p1 p2, k1 k2 p1 p2 k3, or these and k4 k5 k6 are meant; write the ones that are zero too"
            );
            Err(Problem::new(key, text))
        }
    }
}

/// `k1 k2 k3 k4`.
pub(super) fn equidistant(key: &str, coefficients: Vec<f64>) -> Result<Vec<f64>, Problem> {
    match coefficients.len() {
        4 => Ok(coefficients),
        count if count > 4 => at_most(key, coefficients, 4, "a fisheye has four"),
        count => Err(Problem::new(
            key,
            format!("has {count} numbers: k1 k2 k3 k4 are meant; write the ones that are zero too"),
        )),
    }
}
