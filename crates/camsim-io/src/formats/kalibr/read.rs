//! Kalibr camchain.

use serde_json::Value;

use crate::formats::axes::Rigid;
use crate::formats::reading::format::{ReadCamera, Reader, Selected, camera};
use crate::formats::reading::key_table::{KeyRow, Neutral, Treatment, applied, ignored, reported};
use crate::formats::reading::lens_models;
use crate::formats::reading::poses::{Extrinsics, Placement, difference};
use crate::formats::reading::selection::CameraEntry;
use crate::text::document::{Document, KeyProblem, find, numbers, numbers_n, one_of, size, word};

pub(crate) const POSE: &str =
    "pose relative to an IMU, whose axes are not the body's: `--body` or `--rig` applies it";
const BETWEEN: &str = "pose relative to the camera before it: `--body` or `--rig` applies it";
const OTHER_POSE: &str = "a pose under another name: as T_cam_imu, camera from IMU, or its inverse T_imu_cam, `--body` \
                          or `--rig` applies it";
pub(crate) const OFFSET: &str = "clock offset between camera and IMU, s, which shifts all stamps: `--body` or `--rig` \
                      applies it";

pub(crate) const READER: Reader = Reader {
    entries: |document| Ok(entries(document)),
    poses,
    ..Reader::new("kalibr", "Kalibr camchain", matches, &[("", KEYS)], |camera| import(camera.value()))
};

const KEYS: &[KeyRow] = &[
    applied("cam*.camera_model", "pinhole, omni (with radtan or none), ds, eucm, ucm"),
    applied(
        "cam*.intrinsics",
        "fx fy cx cy; before them xi (omni), xi alpha (ds), alpha beta (eucm), alpha (ucm)",
    ),
    applied("cam*.distortion_model", "radtan, equidistant, none; others are refused"),
    applied("cam*.distortion_coeffs", "k1 k2 p1 p2 (radtan) or k1 k2 k3 k4 (equidistant)"),
    applied("cam*.distortion_coefficients", "as above"),
    applied("cam*.resolution", "width, height"),
    KeyRow::new(
        Treatment::LineDelay(1e3),
        "cam*.line_delay",
        "s per row; the readout is this times the rows",
    ),
    KeyRow::new(
        Treatment::LineDelay(1e-6),
        "cam*.line_delay_nanoseconds",
        "ns per row; the readout is this times the rows",
    ),
    KeyRow::new(Treatment::FrameRate, "cam*.rate_hz", "frames per second"),
    reported(Neutral::Zero, "cam*.timeshift_cam_imu", OFFSET),
    reported(Neutral::Identity, "cam*.T_cam_imu cam*.T_imu_cam", POSE),
    reported(Neutral::Identity, "cam*.T_cn_cnm1", BETWEEN),
    reported(Neutral::Identity, "cam*.T_*", OTHER_POSE),
    reported(
        Neutral::Never,
        "cam*.mask*",
        "mask of unused pixels: set photometric.vignette if they are dark",
    ),
    ignored("cam*.cam_overlaps", "pairs of overlapping cameras"),
    ignored("cam*.rostopic", "a name"),
    ignored("imu*.**", "an IMU"),
];

/// `cam0`, `cam1`, ...
fn is_camera(key: &str) -> bool {
    key.strip_prefix("cam")
        .is_some_and(|digits| !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit()))
}

fn entries(document: &Document) -> Vec<CameraEntry<'_>> {
    let cameras = document
        .value
        .as_object()
        .into_iter()
        .flatten()
        .filter(|(key, value)| is_camera(key) && find(value, "intrinsics").is_some());
    cameras.map(|(key, value)| CameraEntry::new(key.clone(), value, key.clone())).collect()
}

fn matches(document: &Document) -> bool {
    !entries(document).is_empty()
}

pub(crate) fn import(value: &Value) -> Result<ReadCamera, KeyProblem> {
    let projection = word(value, "camera_model").unwrap_or("pinhole");
    if projection != "pinhole" {
        return import_wide(value, projection);
    }
    let [fx, fy, cx, cy] = numbers_n(value, "intrinsics")?;
    let size_px = size("resolution", numbers_n(value, "resolution")?)?;
    let key = one_of(value, &["distortion_coeffs", "distortion_coefficients"])?;
    let model = word(value, "distortion_model").unwrap_or_default();
    let list = lens_models::coefficients(value, "distortion_model", model, key)?;
    let (model, list) =
        lens_models::lens_by_name("distortion_model", model, key.unwrap_or("distortion_coeffs"), list)?;
    Ok(camera(size_px, [fx, fy], [cx, cy], model, list))
}

/// A projection with parameters of its own before the focal lengths.
fn import_wide(value: &Value, projection: &str) -> Result<ReadCamera, KeyProblem> {
    let intrinsics = numbers(value, "intrinsics")?;
    let Some((parameters, [fx, fy, cx, cy])) = intrinsics.split_last_chunk::<4>() else {
        return Err(KeyProblem::new("intrinsics", format!("has {} numbers", intrinsics.len())));
    };
    let size_px = size("resolution", numbers_n(value, "resolution")?)?;
    let key = one_of(value, &["distortion_coeffs", "distortion_coefficients"])?;
    let model = word(value, "distortion_model").unwrap_or("none");
    let distortion = lens_models::coefficients(value, "distortion_model", model, key)?;
    let is_distorted = distortion.iter().any(|k| *k != 0.0);
    let is_radtan = projection == "omni" && ["radtan", "radial-tangential", "none"].contains(&model);
    if is_distorted && !(is_radtan && distortion.len() == 4) {
        let text = format!(
            "is `{model}` with `{projection}`: of these projections only omni is supported with distortion, radtan's \
             four coefficients"
        );
        return Err(KeyProblem::new("distortion_model", text));
    }
    let all = if is_distorted { [parameters, &distortion].concat() } else { parameters.to_vec() };
    let (model, coefficients) = lens_models::lens_by_name("camera_model", projection, "intrinsics", all)?;
    Ok(camera(size_px, [*fx, *fy], [*cx, *cy], model, coefficients))
}

/// `T_cam_imu` or OpenVINS' `T_imu_cam`; else the chain of `T_cn_cnm1`.
fn poses(found: &mut Extrinsics, camera: &Selected<'_>) -> Result<(), KeyProblem> {
    let (entries, index) = (camera.entries, camera.index);
    let (value, prefix) = (camera.value(), camera.prefix());
    found.shift(value, &prefix, "timeshift_cam_imu")?;
    found.in_body(value, &prefix, "T_cam_imu", true)?;
    found.in_body(value, &prefix, "T_imu_cam", false)?;
    let before = |key: &str| index > 0 && find(value, key).is_some();
    if found.placement.is_some() {
        if before("T_cn_cnm1") {
            check_chain(found, camera)?;
        }
        return Ok(());
    }
    let (start, origin) = start_of_chain(found, camera)?;
    let mut origin_from_camera = Rigid::IDENTITY;
    for entry in &entries[start + 1..=index] {
        if find(entry.value, "T_cn_cnm1").is_none() {
            return Ok(());
        }
        let pose = found.matrix(entry.value, &format!("{}.", entry.name), "T_cn_cnm1")?;
        origin_from_camera = origin_from_camera.of(&pose.inverse());
    }
    found.placement = match origin {
        Some(Placement::InBody(pose)) => Some(Placement::InBody(pose.of(&origin_from_camera))),
        Some(Placement::InFirst(_)) | None if entries.len() > 1 => {
            Some(Placement::InFirst(origin_from_camera))
        }
        _ => None,
    };
    Ok(())
}

/// Where the chain of poses to a camera begins: at the nearest camera before it whose pose to the inertial
/// sensor is known, or at the first camera. The number and pose of that camera.
fn start_of_chain(
    found: &mut Extrinsics,
    camera: &Selected<'_>,
) -> Result<(usize, Option<Placement>), KeyProblem> {
    let (entries, index) = (camera.entries, camera.index);
    for (number, entry) in entries[..index].iter().enumerate().rev() {
        let prefix = format!("{}.", entry.name);
        let mut before = Extrinsics::default();
        before.in_body(entry.value, &prefix, "T_cam_imu", true)?;
        before.in_body(entry.value, &prefix, "T_imu_cam", false)?;
        if before.placement.is_some() {
            found.applied.extend(before.applied);
            if found.shift_s.is_none() && find(entry.value, "timeshift_cam_imu").is_some() {
                found.notes.push(format!(
                    "{}.timeshift_cam_imu is missing, {prefix}timeshift_cam_imu is given: the clock of {} is taken \
                     to be the IMU's",
                    entries[index].name, entries[index].name
                ));
            }
            return Ok((number, before.placement));
        }
    }
    Ok((0, None))
}

/// A note if `T_cn_cnm1` contradicts the poses of both cameras.
fn check_chain(found: &mut Extrinsics, camera: &Selected<'_>) -> Result<(), KeyProblem> {
    let prefix = camera.prefix();
    let stated = found.matrix(camera.value(), &prefix, "T_cn_cnm1")?;
    let mut before = Extrinsics::default();
    poses(&mut before, &Selected { index: camera.index - 1, ..*camera })?;
    let (Some(Placement::InBody(own)), Some(Placement::InBody(before))) = (found.placement, before.placement)
    else {
        return Ok(());
    };
    let computed = own.inverse().of(&before);
    if let Some(by) = difference(&stated, &computed) {
        found.notes.push(format!(
            "{prefix}T_cn_cnm1 differs from the poses of both cameras to the IMU by {by}: the latter are taken"
        ));
    }
    Ok(())
}
