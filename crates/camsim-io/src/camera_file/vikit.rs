//! rpg_vikit's flat camera file (YAML), which rpg_svo and FAST-LIVO read: `cam_model`, `cam_fx`, `cam_d0`.

use camsim_core::scenario::LensModel;
use serde_json::Value;

use super::document::{Document, Problem, find, number, optional_number, size, word};
use super::keys::{Key, Neutral, Use};
use super::{CameraFormat, ImportedCamera, camera};

pub(super) const KEYS: &[Key] = &[
    Key::new("cam_model", Use::Applied, "Pinhole, EquidistantCamera; ATAN, Ocam and others are refused"),
    Key::new("cam_width", Use::Applied, "width"),
    Key::new("cam_height", Use::Applied, "height"),
    Key::new("cam_fx", Use::Applied, "px"),
    Key::new("cam_fy", Use::Applied, "px"),
    Key::new("cam_cx", Use::Applied, "px"),
    Key::new("cam_cy", Use::Applied, "px"),
    Key::new("cam_d0", Use::Applied, "Pinhole's k1"),
    Key::new("cam_d1", Use::Applied, "Pinhole's k2"),
    Key::new("cam_d2", Use::Applied, "Pinhole's p1"),
    Key::new("cam_d3", Use::Applied, "Pinhole's p2"),
    Key::new("cam_d4", Use::Applied, "Pinhole's k3"),
    Key::new("k1", Use::Applied, "of EquidistantCamera; refused in Pinhole unless zero"),
    Key::new("k2", Use::Applied, "of EquidistantCamera; refused in Pinhole unless zero"),
    Key::new("k3", Use::Applied, "of EquidistantCamera; refused in Pinhole unless zero"),
    Key::new("k4", Use::Applied, "of EquidistantCamera; refused in Pinhole unless zero"),
    Key::new(
        "scale",
        Use::Named(Neutral::One),
        "the scale to which that program shrinks pictures before it works on them; those that come out are whole",
    ),
];

pub(super) fn fits(document: &Document) -> bool {
    document.root.is_empty()
        && ["cam_model", "cam_width"].iter().all(|key| find(&document.value, key).is_some())
}

pub(super) fn import(value: &Value) -> Result<ImportedCamera, Problem> {
    let or_zero = |key: &str| optional_number(value, key).map(|found| found.unwrap_or(0.0));
    let size_px = size("cam_width", [number(value, "cam_width")?, number(value, "cam_height")?])?;
    let unread =
        |keys: &[&str], model: &str| match keys.iter().find(|key| or_zero(key).is_ok_and(|k| k != 0.0)) {
            Some(key) => Err(Problem::new(
                *key,
                format!("is not zero, but {model} does not read it: delete it, or name the other model"),
            )),
            None => Ok(()),
        };
    let (model, coefficients) = match word(value, "cam_model").unwrap_or_default() {
        model @ "Pinhole" => {
            unread(&["k1", "k2", "k3", "k4"], model)?;
            (
                LensModel::BrownConrady,
                ["cam_d0", "cam_d1", "cam_d2", "cam_d3", "cam_d4"]
                    .into_iter()
                    .map(or_zero)
                    .collect::<Result<Vec<f64>, _>>()?,
            )
        }
        model @ "EquidistantCamera" => {
            unread(&["cam_d0", "cam_d1", "cam_d2", "cam_d3", "cam_d4"], model)?;
            (
                LensModel::KannalaBrandt,
                ["k1", "k2", "k3", "k4"]
                    .into_iter()
                    .map(|key| number(value, key))
                    .collect::<Result<Vec<f64>, _>>()?,
            )
        }
        other => {
            return Err(Problem::new(
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
