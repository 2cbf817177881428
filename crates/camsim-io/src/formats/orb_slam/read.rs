//! Settings of ORB-SLAM2 and ORB-SLAM3: `Camera.fx` (2, and 3 before 1.0) or `Camera1.fx`.

use camsim_core::scenario::LensModel;
use serde_json::Value;

use crate::formats::axes::Rigid;
use crate::formats::reading::format::{ReadCamera, Reader, Selected, camera};
use crate::formats::reading::key_table::{KeyRow, Neutral, Treatment, applied, ignored, reported};
use crate::formats::reading::poses::{Extrinsics, Placement};
use crate::formats::reading::selection::CameraEntry;
use crate::formats::reading::stated_size::add_size;
use crate::text::document::{Document, KeyProblem, find, number, one_of, optional_number, size_of, word};

const POSE: &str = "pose of the camera, or of one to another: `--body` or `--rig` applies it";
const COEFFICIENT: &str = "coefficient; k1 k2 p1 p2 k3 of PinHole, k1 k2 k3 k4 of KannalaBrandt8";

pub(crate) const READER: Reader = Reader {
    complete,
    entries,
    poses,
    ..Reader::new("orb-slam", "ORB-SLAM2/3 YAML", matches, &[("", KEYS)], |camera| {
        import(camera.value(), &camera.entry().name)
    })
};

const KEYS: &[KeyRow] = &[
    applied("Camera.type", "PinHole (also if missing), KannalaBrandt8, Rectified; others are refused"),
    applied("Camera.width", "width; add it to ORB-SLAM2's files, which have none"),
    applied("Camera.height", "height"),
    KeyRow::new(Treatment::FrameRate, "Camera.fps", "frames per second"),
    applied("Camera*.fx Camera*.fy Camera*.cx Camera*.cy", "px"),
    applied("Camera*.k1 Camera*.k2 Camera*.k3", COEFFICIENT),
    applied("Camera*.k4", "KannalaBrandt8 only; else refused unless zero"),
    applied("Camera*.p1 Camera*.p2", COEFFICIENT),
    reported(
        Neutral::Never,
        "Camera.newWidth Camera.newHeight",
        "size to which the program reduces pictures; camsim renders the full size",
    ),
    reported(
        Neutral::One,
        "Camera.imageScale",
        "scale to which the program reduces pictures; camsim renders the full size",
    ),
    reported(Neutral::Zero, "Camera.bf", "the stereo baseline, which does not apply to a single camera"),
    reported(
        Neutral::Never,
        "Camera*.overlapping* Camera.lapping* Camera2.lapping*",
        "columns that both cameras of a pair share",
    ),
    ignored("Camera.RGB", "colour order in memory"),
    reported(Neutral::Identity, "Tbc Tlr IMU.T_b_c1 Stereo.T_c1_c2", POSE),
    reported(Neutral::Zero, "Stereo.b", "the stereo baseline, which does not apply to a single camera"),
    ignored("Stereo.ThDepth", "a setting of that program"),
    reported(Neutral::Never, "LEFT.** RIGHT.**", "rectified pair: import each camera's own calibration"),
    ignored("ThDepth", "a setting of that program"),
    ignored("*DepthMapFactor RGBD.DepthMapFactor", "scale of depth pictures"),
    ignored("IMU.**", "an IMU"),
    ignored("ORBextractor.** Viewer.** System.** File.** loopClosing", "a setting of that program"),
];

const CAMERAS: [&str; 3] = ["Camera", "Camera1", "Camera2"];

fn matches(document: &Document) -> bool {
    CAMERAS.iter().any(|camera| find(&document.value, &format!("{camera}.fx")).is_some())
}

fn complete(document: &mut Document, size_px: [u32; 2]) {
    if find(&document.value, "Camera.width").is_none() {
        add_size(&mut document.value, ["Camera.width", "Camera.height"], size_px);
    }
}

fn entries(document: &Document) -> Result<Vec<CameraEntry<'_>>, KeyProblem> {
    let present =
        CAMERAS.into_iter().filter(|camera| find(&document.value, &format!("{camera}.fx")).is_some());
    let roots = |camera: &str| {
        ["fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4", "p1", "p2"]
            .map(|key| format!("{camera}.{key}"))
            .to_vec()
    };
    Ok(present
        .map(|camera| CameraEntry {
            name: camera.to_owned(),
            aliases: Vec::new(),
            value: &document.value,
            roots: roots(camera),
        })
        .collect())
}

fn import(value: &Value, name: &str) -> Result<ReadCamera, KeyProblem> {
    let get = |key: &str| number(value, &format!("{name}.{key}"));
    let or_zero =
        |key: &str| optional_number(value, &format!("{name}.{key}")).map(|number| number.unwrap_or(0.0));
    let (focal_px, principal_point_px) = ([get("fx")?, get("fy")?], [get("cx")?, get("cy")?]);
    if find(value, "Camera.width").is_none() {
        let text = "is missing: add `Camera.width` and `Camera.height` of the calibration pictures \
                    (ORB-SLAM2 takes them from the pictures), or give --size";
        return Err(KeyProblem::new("Camera.width", text));
    }
    let size_px = size_of(value, ["Camera.width", "Camera.height"])?;
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
    Ok(camera(size_px, focal_px, principal_point_px, model, coefficients))
}

/// `IMU.T_b_c1` and `Stereo.T_c1_c2`, or before version 1.0 `Tbc` and `Tlr`.
fn poses(found: &mut Extrinsics, camera: &Selected<'_>) -> Result<(), KeyProblem> {
    let root = &camera.document.value;
    found.in_body(root, "", "IMU.T_b_c1", false)?;
    found.in_body(root, "", "Tbc", false)?;
    let pair = one_of(root, &["Stereo.T_c1_c2", "Tlr"])?;
    if camera.entry().name != "Camera2" {
        if found.placement.is_none() && pair.is_some() {
            found.placement = Some(Placement::InFirst(Rigid::IDENTITY));
        }
        // The second camera is placed and judged by them.
        if let Some(key) = pair {
            found.applied.extend([key, "Stereo.b", "Camera.bf"].map(str::to_owned));
        }
        return Ok(());
    }
    let Some(key) = pair else {
        // The pose of the first camera says nothing of the second.
        found.placement = None;
        return Ok(());
    };
    let first_from_camera = found.matrix(root, "", key)?;
    judge_baselines(found, root, key, first_from_camera.translation_m.length())?;
    found.placement = Some(match found.placement {
        Some(Placement::InBody(b_from_first)) => Placement::InBody(b_from_first.of(&first_from_camera)),
        _ => Placement::InFirst(first_from_camera),
    });
    Ok(())
}

/// Names baselines that differ from that of the pose.
fn judge_baselines(found: &mut Extrinsics, root: &Value, pose: &str, metres: f64) -> Result<(), KeyProblem> {
    let focal = one_of(root, &["Camera1.fx", "Camera.fx"])?;
    let focal_px = focal.map(|key| number(root, key)).transpose()?;
    // The focal length of Camera.bf may be that of rectified pictures.
    for (key, per_metre, most_off) in [("Stereo.b", Some(1.0), 0.02), ("Camera.bf", focal_px, 0.1)] {
        let (Some(stated), Some(per_metre)) = (optional_number(root, key)?, per_metre) else { continue };
        let baseline_m = stated / per_metre;
        if (baseline_m - metres).abs() > most_off * metres {
            found.notes.push(format!(
                "not applied: {key} = {stated}, a baseline of {baseline_m:.4} m: the cameras are {metres:.4} m \
                 apart by {pose}, which is used; correct the wrong one"
            ));
        }
        found.applied.push(key.to_owned());
    }
    Ok(())
}
