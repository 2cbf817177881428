//! Lens models by the names that several formats share.

use camsim_core::lens::{ForeignLensError, foreign_lens};
use camsim_core::scenario::LensModel;

use serde_json::Value;

use super::document::{KeyProblem, at_most_coefficients, find, numbers};

/// Lens model and coefficients in camsim's order, by the name of a model. Radial-tangential coefficients are
/// in OpenCV's order.
pub(super) fn lens_by_name(
    model_key: &str,
    model: &str,
    key: &str,
    coefficients: Vec<f64>,
) -> Result<(LensModel, Vec<f64>), KeyProblem> {
    let normalized: String =
        model.chars().filter(char::is_ascii_alphanumeric).map(|c| c.to_ascii_lowercase()).collect();
    match normalized.as_str() {
        "none" | "nodistortion" | "" if coefficients.iter().all(|k| *k == 0.0) => {
            Ok((LensModel::BrownConrady, Vec::new()))
        }
        "none" | "nodistortion" | "" => {
            let state = if normalized.is_empty() { "is empty" } else { "states no distortion" };
            Err(KeyProblem::new(
                key,
                format!("has coefficients, but {model_key} {state}: name their model there, or delete them"),
            ))
        }
        "radtan" | "radialtangential" | "plumbbob" | "radtan5" => {
            Ok((LensModel::BrownConrady, radial_tangential(key, coefficients, 5)?))
        }
        "radialtangential8" | "radtan8" | "rationalpolynomial" | "rational" => {
            radial_tangential_or_prism(key, coefficients)
        }
        "equidistant" | "equi" | "fisheye" | "kannalabrandt" | "kannalabrandt4" | "kannalabrandt8"
        | "kb4" => Ok((LensModel::KannalaBrandt, equidistant(key, coefficients)?)),
        other => match foreign_lens(other, &coefficients) {
            Ok(lens) => Ok((lens.model, lens.coefficients)),
            Err(error @ ForeignLensError::Count { .. }) => Err(KeyProblem::new(key, error.to_string())),
            Err(ForeignLensError::Unknown(_)) => {
                let full_name =
                    unsupported_model_name(other).map_or(String::new(), |name| format!(" ({name})"));
                let text = format!(
                    "is `{model}`{full_name}, which is not supported: radial-tangential (radtan, plumb_bob, \
                     rational_polynomial), equidistant, omni, ds, eucm, ucm, fov and none can be imported; a lens of \
                     another model is a table of points (docs/LENSES.md)"
                );
                Err(KeyProblem::new(model_key, text))
            }
        },
    }
}

/// The coefficients at `key`. They are required unless the model is `none`.
pub(super) fn coefficients(
    value: &Value,
    model_key: &str,
    model: &str,
    key: Option<&str>,
) -> Result<Vec<f64>, KeyProblem> {
    match key.filter(|key| find(value, key).is_some()) {
        Some(key) => numbers(value, key),
        None if model == "none" => Ok(Vec::new()),
        None if model.is_empty() => Err(KeyProblem::new(
            model_key,
            "is missing, as are coefficients: write `none` if the lens has no distortion",
        )),
        None => {
            let key = key.unwrap_or("distortion_coeffs");
            Err(KeyProblem::new(
                key,
                format!(
                    "is missing, but {model_key} is `{model}`: add it, or write `none` there if the lens has \
                     no distortion"
                ),
            ))
        }
    }
}

/// Full name of an unsupported model by its normalized short name.
pub(super) fn unsupported_model_name(normalized: &str) -> Option<&'static str> {
    let has = |part: &str| normalized.contains(part);
    match normalized {
        "unifiedprojection" => Some("unified camera model"),
        _ if has("omni") || has("mirror") => Some("MEI, omnidirectional"),
        _ if has("doublesphere") => Some("double sphere"),
        _ if has("scaramuzza") || has("ocam") => Some("OCamCalib's polynomial"),
        _ if has("ftheta") => Some("f-theta polynomial"),
        _ if has("spherical") || has("equirect") => Some("panorama"),
        _ => None,
    }
}

/// Coefficients `k1 k2 p1 p2 k3 k4 k5 k6`; further ones must be zero.
pub(super) fn radial_tangential(
    key: &str,
    coefficients: Vec<f64>,
    max: usize,
) -> Result<Vec<f64>, KeyProblem> {
    match coefficients.len() {
        0 | 4 | 5 | 8 | 12 | 14 => at_most_coefficients(
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
                "has {count} numbers instead of k1 k2 p1 p2, k1 k2 p1 p2 k3, or these and k4 k5 k6; write \
                 zeros too"
            );
            Err(KeyProblem::new(key, text))
        }
    }
}

/// As [`radial_tangential`] with eight coefficients, or OpenCV's 12 or 14 with thin prism and tilt.
pub(super) fn radial_tangential_or_prism(
    key: &str,
    coefficients: Vec<f64>,
) -> Result<(LensModel, Vec<f64>), KeyProblem> {
    if coefficients.iter().skip(8).any(|k| *k != 0.0) && [12, 14].contains(&coefficients.len()) {
        return Ok((LensModel::BrownConradyPrism, coefficients));
    }
    Ok((LensModel::BrownConrady, radial_tangential(key, coefficients, 8)?))
}

/// Coefficients `k1 k2 k3 k4`.
pub(super) fn equidistant(key: &str, coefficients: Vec<f64>) -> Result<Vec<f64>, KeyProblem> {
    match coefficients.len() {
        4 => Ok(coefficients),
        count if count > 4 => at_most_coefficients(key, coefficients, 4, "a fisheye has four"),
        count => {
            Err(KeyProblem::new(key, format!("has {count} numbers instead of k1 k2 k3 k4; write zeros too")))
        }
    }
}
