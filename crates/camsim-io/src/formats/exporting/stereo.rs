//! Cameras of a rig that are a rectified pair as they are mounted: with the same camera matrix and parallel axes, side
//! by side or one above the other.

use glam::DVec3;

use super::DatasetError;
use super::run_folder::RunCamera;

/// How far two cameras may be from a pair: pixels of the matrix, radians of the axes, fraction of the distance
/// along the axis.
const TOLERANCE: f64 = 1e-6;

/// How far the camera is to the right of and below the first one of its pair, in metres; 0 without a pair.
pub(crate) fn offset_m(cameras: &[&RunCamera], camera: &RunCamera) -> Result<[f64; 2], DatasetError> {
    let mut most: Option<DVec3> = None;
    for other in cameras {
        let Some(from_other_m) = from(other, camera)? else { continue };
        // The first one is to the left of and above all others.
        let is_first = from_other_m.x > 0.0 || (from_other_m.x == 0.0 && from_other_m.y > 0.0);
        if is_first && most.is_none_or(|most| from_other_m.x + from_other_m.y > most.x + most.y) {
            most = Some(from_other_m);
        }
    }
    Ok(most.map_or([0.0; 2], |m| [m.x, m.y]))
}

/// Whether a camera is the right one of a pair of which the other is the left one, and both take their pictures at the
/// same instants.
pub(crate) fn is_right_of(left: &RunCamera, right: &RunCamera) -> Result<bool, DatasetError> {
    let instants = |camera: &RunCamera| {
        camera.frames.iter().map(|frame| (frame.number, camera.centre_ns(frame))).collect::<Vec<_>>()
    };
    let from_left_m = from(left, right)?;
    Ok(from_left_m.is_some_and(|m| m.x > 0.0 && m.y == 0.0) && instants(left) == instants(right))
}

/// A note where a rig has cameras that readers may take for a pair, and which are none.
pub(crate) fn note(cameras: &[RunCamera]) -> Result<Option<String>, DatasetError> {
    if cameras.len() < 2 {
        return Ok(None);
    }
    let mut alone = Vec::new();
    for (i, camera) in cameras.iter().enumerate() {
        let pairs = cameras.iter().map(|other| from(other, camera)).collect::<Result<Vec<_>, _>>()?;
        if pairs.iter().all(Option::is_none) {
            alone.push(format!("cam{i}"));
        }
    }
    Ok((!alone.is_empty()).then(|| {
        format!(
            "{}: not half of a rectified pair (the same size, focal length and principal point, parallel axes, side by \
             side or one above the other), so the projection matrix has no baseline",
            alone.join(", ")
        )
    }))
}

/// Position of a camera in the axes of another one, in metres, if the two are a pair; noise of rounding is 0.
fn from(other: &RunCamera, camera: &RunCamera) -> Result<Option<DVec3>, DatasetError> {
    let [a, b] = [other.intrinsics()?, camera.intrinsics()?];
    let matrix = |of: &super::Intrinsics| [of.focal_px, of.principal_px].concat();
    let has_same_matrix =
        a.size_px == b.size_px && matrix(&a).iter().zip(matrix(&b)).all(|(a, b)| (a - b).abs() <= TOLERANCE);
    let pose = other.body_from_camera().inverse().of(&camera.body_from_camera());
    let distance_m = pose.translation_m.length();
    let offset_m = pose.translation_m.map(|m| if m.abs() <= TOLERANCE * distance_m { 0.0 } else { m });
    let turn_rad = 2.0 * pose.rotation.xyz().length();
    let is_pair = has_same_matrix && turn_rad <= TOLERANCE && distance_m > 0.0 && offset_m.z == 0.0;
    Ok(is_pair.then_some(offset_m))
}
