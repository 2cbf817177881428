//! Lens models by the names that several formats share.

use std::f64::consts::TAU;

use camsim_core::lens::{ForeignLensError, foreign_lens};
use camsim_core::scenario::LensModel;

use serde_json::Value;

use super::format::{ReadCamera, camera};
use crate::text::document::{KeyProblem, at_most_coefficients, find, numbers, optional_number};

/// Lens model and coefficients in camsim's order, by the name of a model. Radial-tangential coefficients are
/// in OpenCV's order.
pub(crate) fn lens_by_name(
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
            Err(ForeignLensError::Unknown(_)) => Err(KeyProblem::new(
                model_key,
                unsupported_model(
                    model,
                    "radial-tangential (radtan, plumb_bob, rational_polynomial), equidistant, omni, ds, eucm, ucm, \
                     fov and none can be imported; a lens of another model is a table of points \
                     (docs/reference/LENSES.md)",
                ),
            )),
        },
    }
}

/// The coefficients at `key`. They are required unless the model is `none`.
pub(crate) fn coefficients(
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

/// Whether a name is that of a panorama.
pub(crate) fn is_panorama(model: &str) -> bool {
    let model = model.to_ascii_lowercase();
    model.contains("spherical") || model.contains("equirect") || model.contains("panoram")
}

/// What to say of a model that is not imported, and what to do.
pub(crate) fn unsupported_model(model: &str, advice: &str) -> String {
    if is_panorama(model) {
        return format!(
            "is `{model}`, a panorama: write a CAMERA.toml of size_px = [W, H], focal_px = [W / (2 pi), W / (2 pi)] and \
             lens.model = \"equirectangular\""
        );
    }
    let full_name = unsupported_model_name(model).map_or(String::new(), |name| format!(" ({name})"));
    format!("is `{model}`{full_name}, which is not supported: {advice}")
}

/// Full name of an unsupported model by its short name.
pub(crate) fn unsupported_model_name(model: &str) -> Option<&'static str> {
    let normalized: String =
        model.chars().filter(char::is_ascii_alphanumeric).map(|c| c.to_ascii_lowercase()).collect();
    let has = |part: &str| normalized.contains(part);
    match normalized.as_str() {
        "unifiedprojection" => Some("unified camera model"),
        _ if has("omni") || has("mirror") => Some("MEI, omnidirectional"),
        _ if has("doublesphere") => Some("double sphere"),
        _ if has("scaramuzza") || has("ocam") => Some("OCamCalib's polynomial"),
        _ if has("ftheta") => Some("f-theta polynomial"),
        _ if is_panorama(model) => Some("panorama"),
        _ => None,
    }
}

/// A panorama whose width is a whole turn. `others` are keys of a lens, which a panorama has not.
pub(crate) fn panorama(
    value: &Value,
    (key, model): (&str, &str),
    size_px: [u32; 2],
    others: &[&str],
) -> Result<ReadCamera, KeyProblem> {
    for other in others {
        if optional_number(value, other)?.is_some_and(|number| number != 0.0) {
            let text = format!("is `{model}`, a panorama, which has no {other}: delete it, or correct {key}");
            return Err(KeyProblem::new(key, text));
        }
    }
    let [width, height] = size_px.map(f64::from);
    let centre = [0.5 * (width - 1.0), 0.5 * (height - 1.0)];
    Ok(camera(size_px, [width / TAU; 2], centre, LensModel::Equirectangular, Vec::new()))
}

/// Coefficients `k1 k2 p1 p2 k3 k4 k5 k6`; further ones must be zero.
pub(crate) fn radial_tangential(
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
pub(crate) fn radial_tangential_or_prism(
    key: &str,
    coefficients: Vec<f64>,
) -> Result<(LensModel, Vec<f64>), KeyProblem> {
    if coefficients.iter().skip(8).any(|k| *k != 0.0) && [12, 14].contains(&coefficients.len()) {
        return Ok((LensModel::BrownConradyPrism, coefficients));
    }
    Ok((LensModel::BrownConrady, radial_tangential(key, coefficients, 8)?))
}

/// Coefficients `k1 k2 k3 k4`.
pub(crate) fn equidistant(key: &str, coefficients: Vec<f64>) -> Result<Vec<f64>, KeyProblem> {
    match coefficients.len() {
        4 => Ok(coefficients),
        count if count > 4 => at_most_coefficients(key, coefficients, 4, "a fisheye has four"),
        count => {
            Err(KeyProblem::new(key, format!("has {count} numbers instead of k1 k2 k3 k4; write zeros too")))
        }
    }
}
