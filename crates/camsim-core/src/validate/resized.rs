//! Checks of `[camera.resized]`, before and after it is applied.

use super::{Check, Problem, validate_camera, validate_cameras, validate_rig};
use crate::{
    resized::delivered,
    scenario::{CameraSpec, MAX_SIDE_PX, Rig, keys::violations},
};

/// Checks what states another picture than the camera's own.
pub(super) fn check_resized(check: &mut Check, camera: &CameraSpec) {
    // Numbers outside of their intervals are named already.
    if let Some(resized) = &camera.resized
        && camera.size_px.iter().all(|side| (1..=MAX_SIDE_PX).contains(side))
        && violations(resized).is_empty()
    {
        check.problems.extend(delivered(camera).err().unwrap_or_default());
    }
    let Some([_, _, width, height]) = camera.files_of.map(|files| files.part_px) else { return };
    let is_empty = width == 0.0 || height == 0.0;
    check.require(!is_empty, "camera.files_of.part_px", || {
        format!(
            "must be [left, top, width, height] of the camera's picture in that of the files, with width and \
             height above 0, not {width} x {height}"
        )
    });
}

/// A checked rig, with `camera.resized` applied.
///
/// # Errors
/// All values out of range: of the cameras as stated or, where these are in range, of those that the change has
/// made.
pub fn checked_rig(rig: Rig) -> Result<Rig, Vec<Problem>> {
    let mut cameras = rig.scenarios().iter().map(|scenario| &scenario.camera);
    if cameras.clone().all(|camera| camera.resized.is_none()) {
        return accepted(validate_rig(&rig), rig);
    }
    if cameras.any(|camera| !validate_camera(camera).is_empty()) {
        return Err(validate_rig(&rig));
    }
    let rig = rig.try_map::<Vec<Problem>>(|mut scenario| {
        scenario.camera = delivered(&scenario.camera)?;
        Ok(scenario)
    })?;
    accepted(after(validate_rig(&rig)), rig)
}

/// As [`checked_rig`], for a camera alone.
///
/// # Errors
/// As [`checked_rig`].
pub fn checked_camera(camera: CameraSpec) -> Result<CameraSpec, Vec<Problem>> {
    let camera = accepted(validate_camera(&camera), camera)?;
    if camera.resized.is_none() {
        return Ok(camera);
    }
    let camera = delivered(&camera)?;
    accepted(after(validate_camera(&camera)), camera)
}

/// As [`checked_rig`], for `[[cameras]]` without the rest of a scenario.
///
/// # Errors
/// As [`checked_rig`].
pub fn checked_cameras(cameras: Vec<CameraSpec>) -> Result<Vec<CameraSpec>, Vec<Problem>> {
    let cameras = accepted(validate_cameras(&cameras), cameras)?;
    if cameras.iter().all(|camera| camera.resized.is_none()) {
        return Ok(cameras);
    }
    let cameras: Vec<CameraSpec> = cameras.iter().map(delivered).collect::<Result<_, _>>()?;
    accepted(after(validate_cameras(&cameras)), cameras)
}

fn accepted<T>(problems: Vec<Problem>, value: T) -> Result<T, Vec<Problem>> {
    if problems.is_empty() { Ok(value) } else { Err(problems) }
}

/// Problems of the values that a change has made.
fn after(problems: Vec<Problem>) -> Vec<Problem> {
    let of_change = |problem: Problem| match problem.key.starts_with("camera") {
        true => {
            Problem { message: format!("{} (as camera.resized has made it)", problem.message), ..problem }
        }
        false => problem,
    };
    problems.into_iter().map(of_change).collect()
}
