//! Where points of the scene are in a frame at other instants than their pixel's own.

use std::sync::{Arc, Mutex, PoisonError, Weak};

use camsim_core::{
    camera::CameraModel,
    pose::CameraPose,
    reference::{Oracle, RaySample},
    scenario::CameraSpec,
};
use glam::{DVec2, DVec3};

/// Pixels across the picture that are followed.
const ACROSS: [u32; 2] = [20, 15];
/// Points of a way over the exposure.
const POINTS: u32 = 9;

/// The way of what a pixel sees.
#[derive(Clone, Debug, PartialEq)]
pub struct PixelPath {
    /// The pixel.
    pub pixel: DVec2,
    /// Where it would be seen at the frame's stamp; `None` where that is out of the lens's sight.
    pub at_stamp_px: Option<DVec2>,
    /// Where it is seen from the beginning to the end of its row's exposure.
    pub exposure_px: Vec<DVec2>,
}

/// Ways of pixels all over a frame. The last answer is kept: panes ask anew with each pass.
pub fn paths(looks: &Arc<Oracle>, frame: u64) -> Arc<Vec<PixelPath>> {
    type Kept = Option<(Weak<Oracle>, u64, Arc<Vec<PixelPath>>)>;
    static KEPT: Mutex<Kept> = Mutex::new(None);
    let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, _, paths)) =
        kept.as_ref().filter(|(of, at, _)| *at == frame && std::ptr::eq(of.as_ptr(), Arc::as_ptr(looks)))
    {
        return paths.clone();
    }
    let [width, height] = looks.sequence().scenario.camera.size_px;
    let place =
        |k: u32, n: u32, side: u32| ((2 * u64::from(k) + 1) * u64::from(side) / (2 * u64::from(n))) as u32;
    let pixels = (0..ACROSS[1]).flat_map(|y| (0..ACROSS[0]).map(move |x| [x, y]));
    let found: Vec<PixelPath> = pixels
        .filter_map(|[x, y]| path(looks, frame, [place(x, ACROSS[0], width), place(y, ACROSS[1], height)]))
        .collect();
    let found = Arc::new(found);
    *kept = Some((Arc::downgrade(looks), frame, found.clone()));
    found
}

/// The way of what one pixel sees at its mid-exposure; `None` where it has no ray.
pub fn path(looks: &Oracle, frame: u64, pixel: [u32; 2]) -> Option<PixelPath> {
    let look = looks.sample(frame, pixel, DVec2::ZERO, 0.0)?;
    let sequence = looks.sequence();
    let camera = camera_of(&sequence.scenario.camera)?;
    let at = |t_s: f64| project(&camera, &sequence.path.pose(t_s), &look);
    let exposure_s = 1e-3 * sequence.scenario.camera.shutter.exposure_ms;
    let phases = (0..POINTS).map(|k| f64::from(k) / f64::from(POINTS - 1) - 0.5);
    let exposure_px = if exposure_s > 0.0 {
        phases.filter_map(|phase| at(look.t_s + phase * exposure_s)).collect()
    } else {
        Vec::new()
    };
    Some(PixelPath {
        pixel: DVec2::new(f64::from(pixel[0]), f64::from(pixel[1])),
        at_stamp_px: at(looks.stamp_s(frame)),
        exposure_px,
    })
}

/// A camera, made once: where its lens folds takes milliseconds to find, and panes ask with each pass. `None`
/// for one that cannot be rendered.
pub fn camera_of(spec: &CameraSpec) -> Option<Arc<CameraModel>> {
    static KEPT: Mutex<Option<(CameraSpec, Arc<CameraModel>)>> = Mutex::new(None);
    let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, camera)) = kept.as_ref().filter(|(of, _)| of == spec) {
        return Some(camera.clone());
    }
    let camera = Arc::new(CameraModel::from_spec(spec).ok()?);
    *kept = Some((spec.clone(), camera.clone()));
    Some(camera)
}

/// Where what a look sees is in the picture of another pose; the sky by its direction.
pub fn project(camera: &CameraModel, pose: &CameraPose, look: &RaySample) -> Option<DVec2> {
    let ned = match &look.hit {
        Some(hit) => hit.point_ned_m - pose.position_ned_m,
        None => look.pose.ned_from_camera * look.uv.extend(1.0),
    };
    let seen: DVec3 = pose.ned_from_camera.conjugate() * ned;
    let uv = (seen.z > 0.0).then(|| seen.truncate() / seen.z)?;
    camera.lens.contains(uv).then(|| camera.project(uv))
}
