//! camodocal's camera YAML, as VINS-Mono and VINS-Fusion read it: a model's name, and its parameters under names of their own.

use camsim_core::scenario::LensModel;

use super::document::{Document, Problem, find, number, size, word};
use super::{CameraFormat, ImportedCamera, camera};

pub(super) fn fits(document: &Document) -> bool {
    document.root.is_empty() && ["model_type", "projection_parameters"].iter().all(|key| find(&document.value, key).is_some())
}

pub(super) fn import(document: &Document) -> Result<ImportedCamera, Problem> {
    let value = &document.value;
    let size_px = size("image_width", [number(value, "image_width")?, number(value, "image_height")?])?;
    let all = |table: &str, keys: &[&str]| keys.iter().map(|key| number(value, &format!("{table}.{key}"))).collect::<Result<Vec<f64>, _>>();
    let projection = |keys: [&str; 4]| all("projection_parameters", &keys);
    let (model, numbers, coefficients) = match word(value, "model_type").unwrap_or_default() {
        "PINHOLE" => {
            let coefficients = all("distortion_parameters", &["k1", "k2", "p1", "p2"])?;
            (LensModel::BrownConrady, projection(["fx", "fy", "cx", "cy"])?, coefficients)
        }
        // Its k1 is 1 and not written: r = theta + k2 theta^3 + k3 theta^5 + k4 theta^7 + k5 theta^9.
        "KANNALA_BRANDT" => {
            let coefficients = all("projection_parameters", &["k2", "k3", "k4", "k5"])?;
            (LensModel::KannalaBrandt, projection(["mu", "mv", "u0", "v0"])?, coefficients)
        }
        other => {
            let text = format!(
                "is `{other}`: PINHOLE and KANNALA_BRANDT can be imported; calibrate with one of them (MEI's mirror has no equal here)"
            );
            return Err(Problem::new("model_type", text));
        }
    };
    let (focal_px, principal_point_px) = ([numbers[0], numbers[1]], [numbers[2], numbers[3]]);
    let mut imported = camera(CameraFormat::Camodocal, size_px, focal_px, principal_point_px, model, coefficients);
    imported.notes.push("the file has no frame rate and no shutter times: fps is 30, the shutter global".to_owned());
    Ok(imported)
}
