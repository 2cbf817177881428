//! Image motion of scene points: displacement from the stamp, and path over the exposure.

use std::sync::{Arc, Mutex, PoisonError, Weak};

use camsim_core::{camera::CameraModel, pose::CameraPose, reference::RaySample, scenario::CameraSpec};
use camsim_engine::CameraReference;
use glam::{DVec2, DVec3};

/// Columns and rows of the grid of pixels whose motion is shown.
const GRID: [u32; 2] = [20, 15];
/// Points of a path over the exposure.
const EXPOSURE_POINTS: u32 = 9;

/// Image motion of the scene point that a pixel sees at its mid-exposure.
#[derive(Clone, Debug, PartialEq)]
pub struct PixelPath {
    /// The pixel.
    pub pixel: DVec2,
    /// Image position of the point at the frame's stamp; `None` outside the lens's domain.
    pub at_stamp_px: Option<DVec2>,
    /// Image positions of the point from the begin to the end of the row's exposure; empty without exposure.
    pub exposure_px: Vec<DVec2>,
}

/// Motion of a grid of pixels over a frame. The last result is cached, since it is drawn in each pass.
pub fn grid_paths(reference: &Arc<CameraReference>, frame: u64) -> Arc<Vec<PixelPath>> {
    type PathCache = Option<(Weak<CameraReference>, u64, Arc<Vec<PixelPath>>)>;
    static CACHE: Mutex<PathCache> = Mutex::new(None);
    let mut cache = CACHE.lock().unwrap_or_else(PoisonError::into_inner);
    let is_same =
        |(cached_reference, cached_frame, _): &&(Weak<CameraReference>, u64, Arc<Vec<PixelPath>>)| {
            *cached_frame == frame && std::ptr::eq(cached_reference.as_ptr(), Arc::as_ptr(reference))
        };
    if let Some((_, _, paths)) = cache.as_ref().filter(is_same) {
        return paths.clone();
    }
    let [width, height] = reference.sequence().scenario.camera.size_px;
    let position =
        |k: u32, n: u32, side: u32| ((2 * u64::from(k) + 1) * u64::from(side) / (2 * u64::from(n))) as u32;
    let cells = (0..GRID[1]).flat_map(|y| (0..GRID[0]).map(move |x| [x, y]));
    let pixels = cells.map(|[x, y]| [position(x, GRID[0], width), position(y, GRID[1], height)]);
    let paths: Arc<Vec<PixelPath>> =
        Arc::new(pixels.filter_map(|pixel| pixel_path(reference, frame, pixel)).collect());
    *cache = Some((Arc::downgrade(reference), frame, paths.clone()));
    paths
}

/// Motion of the point that one pixel sees; `None` if the pixel has no ray.
pub fn pixel_path(reference: &CameraReference, frame: u64, pixel: [u32; 2]) -> Option<PixelPath> {
    let sample = reference.sample(frame, pixel, DVec2::ZERO, 0.0)?;
    let sequence = reference.sequence();
    let camera = camera_model(&sequence.scenario.camera)?;
    let position_px = |t_s: f64| project(&camera, &sequence.path.pose(t_s), &sample);
    let exposure_s = reference.exposure_s(frame, pixel);
    let phases = (0..EXPOSURE_POINTS).map(|k| f64::from(k) / f64::from(EXPOSURE_POINTS - 1) - 0.5);
    let exposure_px = if exposure_s > 0.0 {
        phases.filter_map(|phase| position_px(sample.t_s + phase * exposure_s)).collect()
    } else {
        Vec::new()
    };
    Some(PixelPath {
        pixel: DVec2::new(f64::from(pixel[0]), f64::from(pixel[1])),
        at_stamp_px: position_px(reference.stamp_s(frame)),
        exposure_px,
    })
}

/// The model of a camera; `None` if the specification is not legal. The last one is cached, because the
/// domain of a lens takes milliseconds to find and panes need it in each pass.
pub fn camera_model(spec: &CameraSpec) -> Option<Arc<CameraModel>> {
    static CACHE: Mutex<Option<(CameraSpec, Arc<CameraModel>)>> = Mutex::new(None);
    let mut cache = CACHE.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, camera)) = cache.as_ref().filter(|(cached_spec, _)| cached_spec == spec) {
        return Some(camera.clone());
    }
    let camera = Arc::new(CameraModel::from_spec(spec).ok()?);
    *cache = Some((spec.clone(), camera.clone()));
    Some(camera)
}

/// Image position, from another pose, of what a ray hits; of its direction for the sky. `None` outside the
/// lens's domain.
pub fn project(camera: &CameraModel, pose: &CameraPose, sample: &RaySample) -> Option<DVec2> {
    let ray_ned = match &sample.hit {
        Some(hit) => hit.point_ned_m - pose.position_ned_m,
        None => sample.pose.ned_from_camera * sample.uv.extend(1.0),
    };
    let ray_camera: DVec3 = pose.ned_from_camera.conjugate() * ray_ned;
    camera.lens.contains_ray(ray_camera).then(|| camera.project_ray(ray_camera))
}
