//! Settings of ORB-SLAM2 and ORB-SLAM3: `Camera.fx` (2, and 3 before 1.0) or `Camera1.fx`.

use camsim_core::scenario::LensModel;
use serde_json::Value;

use super::choose::Entry;
use super::document::{Document, Problem, find, number, optional_number, size, word};
use super::keys::{Key, Neutral, Use};
use super::{CameraFormat, ImportedCamera, camera};

const POSE: &str = "pose of the camera, or of one to another: set mount by hand";
const COEFFICIENT: &str = "a coefficient; k1 k2 p1 p2 k3 of PinHole, k1 k2 k3 k4 of KannalaBrandt8";

pub(super) const KEYS: &[Key] = &[
    Key::new(
        "Camera.type",
        Use::Applied,
        "PinHole (also where it is missing), KannalaBrandt8, Rectified; others are refused",
    ),
    Key::new("Camera.width", Use::Applied, "width; must be added to ORB-SLAM2's files, which have none"),
    Key::new("Camera.height", Use::Applied, "height"),
    Key::new("Camera.fps", Use::Rate, "frames a second"),
    Key::new("Camera*.fx", Use::Applied, "px"),
    Key::new("Camera*.fy", Use::Applied, "px"),
    Key::new("Camera*.cx", Use::Applied, "px"),
    Key::new("Camera*.cy", Use::Applied, "px"),
    Key::new("Camera*.k1", Use::Applied, COEFFICIENT),
    Key::new("Camera*.k2", Use::Applied, COEFFICIENT),
    Key::new("Camera*.k3", Use::Applied, COEFFICIENT),
    Key::new("Camera*.k4", Use::Applied, "KannalaBrandt8's; refused elsewhere unless zero"),
    Key::new("Camera*.p1", Use::Applied, COEFFICIENT),
    Key::new("Camera*.p2", Use::Applied, COEFFICIENT),
    Key::new(
        "Camera.newWidth",
        Use::Named(Neutral::Never),
        "the size to which that program shrinks pictures; those that come out are whole",
    ),
    Key::new(
        "Camera.newHeight",
        Use::Named(Neutral::Never),
        "the size to which that program shrinks pictures; those that come out are whole",
    ),
    Key::new(
        "Camera.imageScale",
        Use::Named(Neutral::One),
        "the scale to which that program shrinks pictures; those that come out are whole",
    ),
    Key::new("Camera.bf", Use::Named(Neutral::Zero), "the stereo baseline, which a single camera has not"),
    Key::new("Camera*.overlapping*", Use::Named(Neutral::Never), "columns that both cameras of a pair see"),
    Key::new("Camera.lapping*", Use::Named(Neutral::Never), "columns that both cameras of a pair see"),
    Key::new("Camera2.lapping*", Use::Named(Neutral::Never), "columns that both cameras of a pair see"),
    Key::new("Camera.RGB", Use::Silent, "order of colours in memory"),
    Key::new("Tbc", Use::Named(Neutral::Identity), POSE),
    Key::new("Tlr", Use::Named(Neutral::Identity), POSE),
    Key::new("IMU.T_b_c1", Use::Named(Neutral::Identity), POSE),
    Key::new("Stereo.T_c1_c2", Use::Named(Neutral::Identity), POSE),
    Key::new("Stereo.b", Use::Named(Neutral::Zero), "the stereo baseline, which a single camera has not"),
    Key::new("Stereo.ThDepth", Use::Silent, "a setting of that program"),
    Key::new(
        "LEFT.**",
        Use::Named(Neutral::Never),
        "the rectified pair: import each camera's own calibration",
    ),
    Key::new(
        "RIGHT.**",
        Use::Named(Neutral::Never),
        "the rectified pair: import each camera's own calibration",
    ),
    Key::new("ThDepth", Use::Silent, "a setting of that program"),
    Key::new("*DepthMapFactor", Use::Silent, "scale of depth pictures"),
    Key::new("RGBD.DepthMapFactor", Use::Silent, "scale of depth pictures"),
    Key::new("IMU.**", Use::Silent, "an IMU"),
    Key::new("ORBextractor.**", Use::Silent, "a setting of that program"),
    Key::new("Viewer.**", Use::Silent, "a setting of that program"),
    Key::new("System.**", Use::Silent, "a setting of that program"),
    Key::new("File.**", Use::Silent, "a setting of that program"),
    Key::new("loopClosing", Use::Silent, "a setting of that program"),
];

const CAMERAS: [&str; 3] = ["Camera", "Camera1", "Camera2"];

pub(super) fn fits(document: &Document) -> bool {
    document.root.is_empty()
        && CAMERAS.iter().any(|camera| find(&document.value, &format!("{camera}.fx")).is_some())
}

pub(super) fn entries(document: &Document) -> Vec<Entry<'_>> {
    let there = CAMERAS.into_iter().filter(|camera| find(&document.value, &format!("{camera}.fx")).is_some());
    let own = |camera: &str| {
        ["fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4", "p1", "p2"]
            .map(|key| format!("{camera}.{key}"))
            .to_vec()
    };
    there
        .map(|camera| Entry {
            name: camera.to_owned(),
            also: Vec::new(),
            value: &document.value,
            roots: own(camera),
        })
        .collect()
}

pub(super) fn import(value: &Value, name: &str) -> Result<ImportedCamera, Problem> {
    let get = |key: &str| number(value, &format!("{name}.{key}"));
    let or_zero =
        |key: &str| optional_number(value, &format!("{name}.{key}")).map(|found| found.unwrap_or(0.0));
    let (focal_px, principal_point_px) = ([get("fx")?, get("fy")?], [get("cx")?, get("cy")?]);
    if find(value, "Camera.width").is_none() {
        let text = "is missing: add `Camera.width` and `Camera.height` of the pictures that were calibrated (ORB-SLAM2 takes them from the pictures)";
        return Err(Problem::new("Camera.width", text));
    }
    let size_px = size("Camera.width", [number(value, "Camera.width")?, number(value, "Camera.height")?])?;
    let kind = word(value, "Camera.type").unwrap_or("PinHole");
    let (model, coefficients) = match kind.to_ascii_lowercase().as_str() {
        "pinhole" | "rectified" => {
            if or_zero("k4")? != 0.0 {
                return Err(Problem::new(
                    format!("{name}.k4"),
                    format!("is not zero, but Camera.type is {kind}: name KannalaBrandt8, or delete it"),
                ));
            }
            let list = [or_zero("k1")?, or_zero("k2")?, or_zero("p1")?, or_zero("p2")?, or_zero("k3")?];
            if kind.eq_ignore_ascii_case("rectified") && list.iter().any(|k| *k != 0.0) {
                return Err(Problem::new(
                    format!("{name}.k1"),
                    "rectified pictures have no distortion: delete the coefficients, or name PinHole",
                ));
            }
            (LensModel::BrownConrady, list.to_vec())
        }
        "kannalabrandt8" | "kannalabrandt" => {
            if or_zero("p1")? != 0.0 || or_zero("p2")? != 0.0 {
                return Err(Problem::new(
                    format!("{name}.p1"),
                    "is not zero: KannalaBrandt8 has no tangential terms",
                ));
            }
            (LensModel::KannalaBrandt, vec![get("k1")?, get("k2")?, get("k3")?, get("k4")?])
        }
        _ => {
            return Err(Problem::new(
                "Camera.type",
                format!("is `{kind}`: PinHole, KannalaBrandt8 and Rectified can be imported"),
            ));
        }
    };
    Ok(camera(CameraFormat::OrbSlam, size_px, focal_px, principal_point_px, model, coefficients))
}
