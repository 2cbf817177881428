//! rpg_vikit's flat camera file (YAML), which rpg_svo and FAST-LIVO read: `cam_model`, `cam_fx`, `cam_d0`.

use camsim_core::scenario::LensModel;
use serde_json::Value;

use super::document::{Document, KeyProblem, find, number, optional_number, size, word};
use super::key_table::{KeyRow, Neutral, Treatment};
use super::{CameraFormat, ImportedCamera, camera};

pub(super) const KEYS: &[KeyRow] = &[
    KeyRow::new(
        "cam_model",
        Treatment::Applied,
        "Pinhole, EquidistantCamera; ATAN, Ocam and others are refused",
    ),
    KeyRow::new("cam_width", Treatment::Applied, "width"),
    KeyRow::new("cam_height", Treatment::Applied, "height"),
    KeyRow::new("cam_fx", Treatment::Applied, "px"),
    KeyRow::new("cam_fy", Treatment::Applied, "px"),
    KeyRow::new("cam_cx", Treatment::Applied, "px"),
    KeyRow::new("cam_cy", Treatment::Applied, "px"),
    KeyRow::new("cam_d0", Treatment::Applied, "Pinhole's k1"),
    KeyRow::new("cam_d1", Treatment::Applied, "Pinhole's k2"),
    KeyRow::new("cam_d2", Treatment::Applied, "Pinhole's p1"),
    KeyRow::new("cam_d3", Treatment::Applied, "Pinhole's p2"),
    KeyRow::new("cam_d4", Treatment::Applied, "Pinhole's k3"),
    KeyRow::new("k1", Treatment::Applied, "of EquidistantCamera; refused in Pinhole unless zero"),
    KeyRow::new("k2", Treatment::Applied, "of EquidistantCamera; refused in Pinhole unless zero"),
    KeyRow::new("k3", Treatment::Applied, "of EquidistantCamera; refused in Pinhole unless zero"),
    KeyRow::new("k4", Treatment::Applied, "of EquidistantCamera; refused in Pinhole unless zero"),
    KeyRow::new(
        "scale",
        Treatment::Reported(Neutral::One),
        "scale to which the program reduces pictures; camsim renders the full size",
    ),
];

pub(super) fn matches(document: &Document) -> bool {
    document.root.is_empty()
        && ["cam_model", "cam_width"].iter().all(|key| find(&document.value, key).is_some())
}

pub(super) fn import(value: &Value) -> Result<ImportedCamera, KeyProblem> {
    let or_zero = |key: &str| optional_number(value, key).map(|number| number.unwrap_or(0.0));
    let size_px = size("cam_width", [number(value, "cam_width")?, number(value, "cam_height")?])?;
    let refuse_unused =
        |keys: &[&str], model: &str| match keys.iter().find(|key| or_zero(key).is_ok_and(|k| k != 0.0)) {
            Some(key) => Err(KeyProblem::new(
                *key,
                format!("is not zero, but {model} does not use it: delete it, or change cam_model"),
            )),
            None => Ok(()),
        };
    let (model, coefficients) = match word(value, "cam_model").unwrap_or_default() {
        model @ "Pinhole" => {
            refuse_unused(&["k1", "k2", "k3", "k4"], model)?;
            (
                LensModel::BrownConrady,
                ["cam_d0", "cam_d1", "cam_d2", "cam_d3", "cam_d4"]
                    .into_iter()
                    .map(or_zero)
                    .collect::<Result<Vec<f64>, _>>()?,
            )
        }
        model @ "EquidistantCamera" => {
            refuse_unused(&["cam_d0", "cam_d1", "cam_d2", "cam_d3", "cam_d4"], model)?;
            (
                LensModel::KannalaBrandt,
                ["k1", "k2", "k3", "k4"]
                    .into_iter()
                    .map(|key| number(value, key))
                    .collect::<Result<Vec<f64>, _>>()?,
            )
        }
        other => {
            return Err(KeyProblem::new(
                "cam_model",
                format!(
                    "is `{other}`: Pinhole and EquidistantCamera can be imported; calibrate with one of them"
                ),
            ));
        }
    };
    let focal_px = [number(value, "cam_fx")?, number(value, "cam_fy")?];
    let principal_point_px = [number(value, "cam_cx")?, number(value, "cam_cy")?];
    Ok(camera(CameraFormat::Vikit, size_px, focal_px, principal_point_px, model, coefficients))
}
