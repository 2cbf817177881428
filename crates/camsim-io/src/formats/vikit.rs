//! rpg_vikit's flat camera file (YAML), which rpg_svo and FAST-LIVO read: `cam_model`, `cam_fx`, `cam_d0`.

use camsim_core::scenario::LensModel;
use serde_json::Value;

use crate::formats::reading::format::{ReadCamera, Reader, camera};
use crate::formats::reading::key_table::{KeyRow, Neutral, applied, reported};
use crate::text::document::{Document, KeyProblem, find, number, optional_number, size_of, word};

pub(crate) const READER: Reader =
    Reader::new("vikit", "rpg_svo and FAST-LIVO YAML", matches, &[("", KEYS)], |camera| {
        import(camera.value())
    });

const KEYS: &[KeyRow] = &[
    applied("cam_model", "Pinhole, EquidistantCamera; ATAN, Ocam and others are refused"),
    applied("cam_width", "width"),
    applied("cam_height", "height"),
    applied("cam_fx cam_fy cam_cx cam_cy", "px"),
    applied("cam_d0", "Pinhole's k1"),
    applied("cam_d1", "Pinhole's k2"),
    applied("cam_d2", "Pinhole's p1"),
    applied("cam_d3", "Pinhole's p2"),
    applied("cam_d4", "Pinhole's k3"),
    applied("k1 k2 k3 k4", "of EquidistantCamera; refused in Pinhole unless zero"),
    reported(
        Neutral::One,
        "scale",
        "scale to which the program reduces pictures; camsim renders the full size",
    ),
];

fn matches(document: &Document) -> bool {
    ["cam_model", "cam_width"].iter().all(|key| find(&document.value, key).is_some())
}

fn import(value: &Value) -> Result<ReadCamera, KeyProblem> {
    let or_zero = |key: &str| optional_number(value, key).map(|number| number.unwrap_or(0.0));
    let size_px = size_of(value, ["cam_width", "cam_height"])?;
    let (d, k) = (["cam_d0", "cam_d1", "cam_d2", "cam_d3", "cam_d4"], ["k1", "k2", "k3", "k4"]);
    let name = word(value, "cam_model").unwrap_or_default();
    let (model, unused, coefficients): (_, &[&str], Vec<_>) = match name {
        "Pinhole" => (LensModel::BrownConrady, &k, d.map(or_zero).into()),
        "EquidistantCamera" => (LensModel::KannalaBrandt, &d, k.map(|key| number(value, key)).into()),
        other => {
            let text = format!(
                "is `{other}`: Pinhole and EquidistantCamera can be imported; calibrate with one of them"
            );
            return Err(KeyProblem::new("cam_model", text));
        }
    };
    if let Some(key) = unused.iter().find(|key| or_zero(key).is_ok_and(|k| k != 0.0)) {
        let text = format!("is not zero, but {name} does not use it: delete it, or change cam_model");
        return Err(KeyProblem::new(*key, text));
    }
    let coefficients = coefficients.into_iter().collect::<Result<Vec<f64>, _>>()?;
    let focal_px = [number(value, "cam_fx")?, number(value, "cam_fy")?];
    let principal_point_px = [number(value, "cam_cx")?, number(value, "cam_cy")?];
    Ok(camera(size_px, focal_px, principal_point_px, model, coefficients))
}
