//! Settings of ORB-SLAM2 and ORB-SLAM3: `Camera.fx` (2, and 3 before 1.0) or `Camera1.fx`.

use camsim_core::scenario::LensModel;
use serde_json::Value;

use super::document::{Document, KeyProblem, find, number, optional_number, size, word};
use super::key_table::{KeyRow, Neutral, Treatment};
use super::selection::CameraEntry;
use super::{CameraFormat, ImportedCamera, camera};

const POSE: &str = "pose of the camera, or of one to another: `--body` or `--rig` applies it";
const COEFFICIENT: &str = "coefficient; k1 k2 p1 p2 k3 of PinHole, k1 k2 k3 k4 of KannalaBrandt8";

pub(super) const KEYS: &[KeyRow] = &[
    KeyRow::new(
        "Camera.type",
        Treatment::Applied,
        "PinHole (also if missing), KannalaBrandt8, Rectified; others are refused",
    ),
    KeyRow::new("Camera.width", Treatment::Applied, "width; add it to ORB-SLAM2's files, which have none"),
    KeyRow::new("Camera.height", Treatment::Applied, "height"),
    KeyRow::new("Camera.fps", Treatment::FrameRate, "frames per second"),
    KeyRow::new("Camera*.fx", Treatment::Applied, "px"),
    KeyRow::new("Camera*.fy", Treatment::Applied, "px"),
    KeyRow::new("Camera*.cx", Treatment::Applied, "px"),
    KeyRow::new("Camera*.cy", Treatment::Applied, "px"),
    KeyRow::new("Camera*.k1", Treatment::Applied, COEFFICIENT),
    KeyRow::new("Camera*.k2", Treatment::Applied, COEFFICIENT),
    KeyRow::new("Camera*.k3", Treatment::Applied, COEFFICIENT),
    KeyRow::new("Camera*.k4", Treatment::Applied, "KannalaBrandt8 only; else refused unless zero"),
    KeyRow::new("Camera*.p1", Treatment::Applied, COEFFICIENT),
    KeyRow::new("Camera*.p2", Treatment::Applied, COEFFICIENT),
    KeyRow::new(
        "Camera.newWidth",
        Treatment::Reported(Neutral::Never),
        "size to which the program reduces pictures; camsim renders the full size",
    ),
    KeyRow::new(
        "Camera.newHeight",
        Treatment::Reported(Neutral::Never),
        "size to which the program reduces pictures; camsim renders the full size",
    ),
    KeyRow::new(
        "Camera.imageScale",
        Treatment::Reported(Neutral::One),
        "scale to which the program reduces pictures; camsim renders the full size",
    ),
    KeyRow::new(
        "Camera.bf",
        Treatment::Reported(Neutral::Zero),
        "the stereo baseline, which does not apply to a single camera",
    ),
    KeyRow::new(
        "Camera*.overlapping*",
        Treatment::Reported(Neutral::Never),
        "columns that both cameras of a pair share",
    ),
    KeyRow::new(
        "Camera.lapping*",
        Treatment::Reported(Neutral::Never),
        "columns that both cameras of a pair share",
    ),
    KeyRow::new(
        "Camera2.lapping*",
        Treatment::Reported(Neutral::Never),
        "columns that both cameras of a pair share",
    ),
    KeyRow::new("Camera.RGB", Treatment::Ignored, "colour order in memory"),
    KeyRow::new("Tbc", Treatment::Reported(Neutral::Identity), POSE),
    KeyRow::new("Tlr", Treatment::Reported(Neutral::Identity), POSE),
    KeyRow::new("IMU.T_b_c1", Treatment::Reported(Neutral::Identity), POSE),
    KeyRow::new("Stereo.T_c1_c2", Treatment::Reported(Neutral::Identity), POSE),
    KeyRow::new(
        "Stereo.b",
        Treatment::Reported(Neutral::Zero),
        "the stereo baseline, which does not apply to a single camera",
    ),
    KeyRow::new("Stereo.ThDepth", Treatment::Ignored, "a setting of that program"),
    KeyRow::new(
        "LEFT.**",
        Treatment::Reported(Neutral::Never),
        "rectified pair: import each camera's own calibration",
    ),
    KeyRow::new(
        "RIGHT.**",
        Treatment::Reported(Neutral::Never),
        "rectified pair: import each camera's own calibration",
    ),
    KeyRow::new("ThDepth", Treatment::Ignored, "a setting of that program"),
    KeyRow::new("*DepthMapFactor", Treatment::Ignored, "scale of depth pictures"),
    KeyRow::new("RGBD.DepthMapFactor", Treatment::Ignored, "scale of depth pictures"),
    KeyRow::new("IMU.**", Treatment::Ignored, "an IMU"),
    KeyRow::new("ORBextractor.**", Treatment::Ignored, "a setting of that program"),
    KeyRow::new("Viewer.**", Treatment::Ignored, "a setting of that program"),
    KeyRow::new("System.**", Treatment::Ignored, "a setting of that program"),
    KeyRow::new("File.**", Treatment::Ignored, "a setting of that program"),
    KeyRow::new("loopClosing", Treatment::Ignored, "a setting of that program"),
];

const CAMERAS: [&str; 3] = ["Camera", "Camera1", "Camera2"];

pub(super) fn matches(document: &Document) -> bool {
    document.root.is_empty()
        && CAMERAS.iter().any(|camera| find(&document.value, &format!("{camera}.fx")).is_some())
}

pub(super) fn entries(document: &Document) -> Vec<CameraEntry<'_>> {
    let present =
        CAMERAS.into_iter().filter(|camera| find(&document.value, &format!("{camera}.fx")).is_some());
    let roots = |camera: &str| {
        ["fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4", "p1", "p2"]
            .map(|key| format!("{camera}.{key}"))
            .to_vec()
    };
    present
        .map(|camera| CameraEntry {
            name: camera.to_owned(),
            aliases: Vec::new(),
            value: &document.value,
            roots: roots(camera),
        })
        .collect()
}

pub(super) fn import(value: &Value, name: &str) -> Result<ImportedCamera, KeyProblem> {
    let get = |key: &str| number(value, &format!("{name}.{key}"));
    let or_zero =
        |key: &str| optional_number(value, &format!("{name}.{key}")).map(|number| number.unwrap_or(0.0));
    let (focal_px, principal_point_px) = ([get("fx")?, get("fy")?], [get("cx")?, get("cy")?]);
    if find(value, "Camera.width").is_none() {
        let text = "is missing: add `Camera.width` and `Camera.height` of the calibration pictures \
                    (ORB-SLAM2 takes them from the pictures), or give --size";
        return Err(KeyProblem::new("Camera.width", text));
    }
    let size_px = size("Camera.width", [number(value, "Camera.width")?, number(value, "Camera.height")?])?;
    let kind = word(value, "Camera.type").unwrap_or("PinHole");
    let (model, coefficients) = match kind.to_ascii_lowercase().as_str() {
        "pinhole" | "rectified" => {
            if or_zero("k4")? != 0.0 {
                return Err(KeyProblem::new(
                    format!("{name}.k4"),
                    format!("is not zero, but Camera.type is {kind}: set KannalaBrandt8, or delete it"),
                ));
            }
            let list = [or_zero("k1")?, or_zero("k2")?, or_zero("p1")?, or_zero("p2")?, or_zero("k3")?];
            if kind.eq_ignore_ascii_case("rectified") && list.iter().any(|k| *k != 0.0) {
                return Err(KeyProblem::new(
                    format!("{name}.k1"),
                    "rectified pictures have no distortion: delete the coefficients, or set PinHole",
                ));
            }
            (LensModel::BrownConrady, list.to_vec())
        }
        "kannalabrandt8" | "kannalabrandt" => {
            if or_zero("p1")? != 0.0 || or_zero("p2")? != 0.0 {
                return Err(KeyProblem::new(
                    format!("{name}.p1"),
                    "is not zero: KannalaBrandt8 has no tangential terms",
                ));
            }
            (LensModel::KannalaBrandt, vec![get("k1")?, get("k2")?, get("k3")?, get("k4")?])
        }
        _ => {
            return Err(KeyProblem::new(
                "Camera.type",
                format!("is `{kind}`: PinHole, KannalaBrandt8 and Rectified can be imported"),
            ));
        }
    };
    Ok(camera(CameraFormat::OrbSlam, size_px, focal_px, principal_point_px, model, coefficients))
}
