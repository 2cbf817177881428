//! The oracle: every ray cast in f64 at its own instant from the trajectory into the scene. Slow, exact, and
//! independent.
//!
//! It shares with the renderer and its twins the scenario, the trajectory (with the mount) and the lens's
//! forward model, and nothing else: line times ([`clock`]), lens inverse ([`eye`]), zoom, ray casting
//! ([`ray`], [`ground`], [`meshes`]), colour ([`paint`]) and integration ([`render`]) are its own. The seeded
//! photometric stage is the renderer's, since a seed has no other meaning than its noise. What its
//! measurements count apart as a silhouette is defined once, for them and for the plan's prediction.

use std::sync::{Arc, Mutex, PoisonError};

use glam::{DVec2, DVec3};

use crate::{
    camera::{CameraError, CameraModel, ZoomTable},
    lens::Lens,
    pose::CameraPose,
    scenario::CameraSpec,
    sequence::Sequence,
    shutter::{Shutter, ShutterError},
};

mod clock;
mod eye;
mod ground;
mod holes;
mod measure;
mod meshes;
mod paint;
mod ray;
mod render;
mod truth;

use clock::Clock;
use eye::Eye;
use ground::Ground;
pub use holes::{Holes, holes};
pub use measure::{
    CoordErrors, CoordTruth, ErrorStats, ImageErrors, Judged, MOST_VOID_SHARE, coord_errors, image_errors,
    silhouettes,
};
use meshes::Meshes;
use paint::Paint;
use ray::Ray;
pub use render::{Convergence, IdealView, RenderOptions};
pub use truth::{DEPTH_TOLERANCE, TruthErrors, truth_errors};

/// Zoomed lenses that are kept: as many as frames may be looked at in turn.
const ZOOMED_KEPT: usize = 4;

/// Why there is no oracle of a sequence.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum OracleError {
    /// The camera or an entry of its zoom table.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// The shutter.
    #[error(transparent)]
    Shutter(#[from] ShutterError),
}

/// The reference renderer of one sequence. Immutable; shared between threads.
#[derive(Debug)]
pub struct Oracle {
    sequence: Arc<Sequence>,
    clock: Clock,
    /// `None` for a zoom lens.
    fixed: Option<Eye>,
    zoomed: Mutex<Vec<(u64, Arc<Eye>)>>,
    ground: Option<Ground>,
    meshes: Meshes,
    paint: Paint,
    /// Whether anything is mixed with what is behind it.
    blends: bool,
}

/// What a place of the picture sees at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// The instant, path time, seconds.
    pub t_s: f64,
    /// Pose of the camera then.
    pub pose: CameraPose,
    /// Ideal ray (u, v) in the optical frame.
    pub uv: DVec2,
    /// First surface along the ray; `None` is sky.
    pub hit: Option<Hit>,
}

/// Where a ray first meets a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// The point, NED, metres.
    pub point_ned_m: DVec3,
    /// Planar depth in the optical frame of the ray's own camera pose, metres.
    pub depth_m: f64,
    /// Texture coordinates.
    pub texture_uv: [f64; 2],
    /// Factor of the texture's colour there.
    pub tint: [f64; 3],
    /// 0 = terrain, 1 + i = mesh i of the scene.
    pub surface: u32,
}

/// One frame through the oracle's eye: what all looks into it share.
#[derive(Debug)]
pub struct FrameView<'a> {
    oracle: &'a Oracle,
    stamp_s: f64,
    eye: FrameEye<'a>,
}

#[derive(Debug)]
enum FrameEye<'a> {
    Fixed(&'a Eye),
    Zoomed(Arc<Eye>),
    /// A zoom value without a lens: no pixel has a ray.
    Blind,
}

impl Oracle {
    /// Prepares for looks into `sequence`.
    ///
    /// # Errors
    /// A camera or shutter that cannot be used.
    pub fn new(sequence: Arc<Sequence>) -> Result<Self, OracleError> {
        let camera = &sequence.scenario.camera;
        // Only for what they refuse; their numbers are not used.
        CameraModel::from_spec(camera)?;
        ZoomTable::from_spec(camera)?;
        Shutter::from_spec(&camera.shutter, camera.fps, camera.size_px)?;
        if let Some(row) = sequence.zoom_track.iter().find(|row| row.1.is_nan()) {
            return Err(CameraError::ZoomValue(row.1).into());
        }
        let fixed = if camera.zoom.is_empty() {
            let principal_px = camera.principal_point_px.unwrap_or_else(|| centre_px(camera));
            Some(eye(camera, camera.focal_px, principal_px, &camera.lens.coefficients)?)
        } else {
            None
        };
        let scene = &sequence.scene;
        Ok(Self {
            clock: Clock::new(&sequence),
            fixed,
            zoomed: Mutex::default(),
            ground: scene.terrain.as_ref().map(Ground::new),
            meshes: Meshes::new(&scene.meshes, scene.light),
            paint: Paint::new(scene),
            blends: scene.has_blended(),
            sequence,
        })
    }

    /// What renders, for people, in place of an adapter's name.
    #[must_use]
    pub fn describe() -> String {
        format!("reference (f64 rays, {} threads)", rayon::current_num_threads())
    }

    /// The sequence.
    #[must_use]
    pub fn sequence(&self) -> &Arc<Sequence> {
        &self.sequence
    }

    /// Stamp of a frame, path time, seconds.
    #[must_use]
    pub fn stamp_s(&self, frame: u64) -> f64 {
        self.clock.stamp_s(frame)
    }

    /// One frame, for many looks.
    #[must_use]
    pub fn view(&self, frame: u64) -> FrameView<'_> {
        let stamp_s = self.clock.stamp_s(frame);
        let eye = match &self.fixed {
            Some(eye) => FrameEye::Fixed(eye),
            None => self
                .zoomed_eye(zoom_at(&self.sequence.zoom_track, stamp_s))
                .map_or(FrameEye::Blind, FrameEye::Zoomed),
        };
        FrameView { oracle: self, stamp_s, eye }
    }

    /// The place `pixel + offset_px` (offset within -0.5..=0.5) of a frame at exposure phase `phase` in
    /// [-0.5, 0.5]; the whole pixel has the time of its line. `None` where the lens has no ideal ray. For
    /// many looks into a frame of a zoom lens, [`Oracle::view`] is faster.
    #[must_use]
    pub fn look(&self, frame: u64, pixel: [u32; 2], offset_px: DVec2, phase: f64) -> Option<Look> {
        self.view(frame).look(pixel, offset_px, phase)
    }

    /// First surface along `origin + t direction`, t > 0, of what is mixed with what is behind it that from
    /// its cut-off on; [`Hit::depth_m`] is t, which is planar depth for a direction with z = 1 in the camera.
    /// Surfaces are met from both sides. `None` also for numbers that are not finite.
    #[must_use]
    pub fn cast(&self, origin_ned_m: DVec3, direction_ned: DVec3) -> Option<Hit> {
        let ray = Ray::new(origin_ned_m, direction_ned)?;
        let on_ground = self.on_ground(&ray);
        let limit = on_ground.map_or(f64::INFINITY, |hit| hit.depth_m);
        self.meshes.first(&ray, limit).or(on_ground)
    }

    fn on_ground(&self, ray: &Ray) -> Option<Hit> {
        let terrain = self.sequence.scene.terrain.as_ref();
        terrain
            .zip(self.ground.as_ref())
            .and_then(|(terrain, ground)| ground.first(terrain, ray, f64::INFINITY))
    }

    /// Linear light that a ray brings from the one surface that it is said to meet, with fog by slant range:
    /// where nothing is mixed, that is all. [`Oracle::light`] knows of layers.
    #[must_use]
    pub fn color(&self, uv: DVec2, hit: Option<&Hit>) -> DVec3 {
        self.paint.color(hit, uv.extend(1.0).length())
    }

    /// Linear light that the ray `uv` of a camera brings: of what lets none through, and of every layer
    /// before it, each at its own place and mixed by its alpha with what is behind it.
    #[must_use]
    pub fn light(&self, pose: &CameraPose, uv: DVec2) -> DVec3 {
        let (way, range_per_depth) = (uv.extend(1.0), uv.extend(1.0).length());
        let direction = pose.ned_from_camera * way;
        if !self.blends {
            return self.paint.color(self.cast(pose.position_ned_m, direction).as_ref(), range_per_depth);
        }
        let Some(ray) = Ray::new(pose.position_ned_m, direction) else {
            return self.paint.color(None, range_per_depth);
        };
        let on_ground = self.on_ground(&ray);
        let limit = on_ground.map_or(f64::INFINITY, |hit| hit.depth_m);
        let solid = self.meshes.first_solid(&ray, limit).or(on_ground);
        let mut layers = self.meshes.layers(&ray, solid.map_or(f64::INFINITY, |hit| hit.depth_m));
        // From the eye on: what is left of the light from behind becomes less with each layer.
        layers.sort_by(|a, b| a.hit.depth_m.total_cmp(&b.hit.depth_m));
        let (mut sum, mut left) = (DVec3::ZERO, 1.0);
        for layer in &layers {
            let alpha = layer.alpha.clamp(0.0, 1.0);
            sum += left * alpha * self.paint.color(Some(&layer.hit), range_per_depth);
            left *= 1.0 - alpha;
        }
        sum + left * self.paint.color(solid.as_ref(), range_per_depth)
    }

    /// Whether anything stands between two points; the last millionth of the way does not count.
    #[must_use]
    pub fn hides(&self, from_ned_m: DVec3, to_ned_m: DVec3) -> bool {
        self.cast(from_ned_m, to_ned_m - from_ned_m).is_some_and(|hit| hit.depth_m < 1.0 - 1e-6)
    }

    fn zoomed_eye(&self, zoom: f64) -> Option<Arc<Eye>> {
        // Not held while it is made: that is done in parallel, and a thread that waits for its parts may take
        // up work that asks for an eye itself.
        let kept = || self.zoomed.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, eye)) = kept().iter().find(|(bits, _)| *bits == zoom.to_bits()) {
            return Some(eye.clone());
        }
        let made = Arc::new(eye_at_zoom(&self.sequence.scenario.camera, zoom).ok()?);
        let mut kept = kept();
        if kept.len() >= ZOOMED_KEPT {
            kept.remove(0);
        }
        kept.push((zoom.to_bits(), made.clone()));
        Some(made)
    }
}

impl FrameView<'_> {
    /// As [`Oracle::look`].
    #[must_use]
    pub fn look(&self, pixel: [u32; 2], offset_px: DVec2, phase: f64) -> Option<Look> {
        let uv = self.ray(pixel, offset_px)?;
        let t_s = self.mid_s(pixel) + phase * self.oracle.clock.exposure_s();
        let pose = self.oracle.sequence.path.pose(t_s);
        Some(Look { t_s, pose, uv, hit: self.hit(&pose, uv) })
    }

    /// Ideal ray (u, v) of a place.
    #[must_use]
    pub fn ray(&self, [x, y]: [u32; 2], offset_px: DVec2) -> Option<DVec2> {
        let eye: &Eye = match &self.eye {
            FrameEye::Fixed(eye) => eye,
            FrameEye::Zoomed(eye) => eye,
            FrameEye::Blind => return None,
        };
        eye.ray(DVec2::new(f64::from(x), f64::from(y)) + offset_px)
    }

    /// Mid-exposure of a pixel, path time, seconds.
    #[must_use]
    pub fn mid_s(&self, pixel: [u32; 2]) -> f64 {
        self.stamp_s + self.oracle.clock.dt_s(pixel)
    }

    fn hit(&self, pose: &CameraPose, uv: DVec2) -> Option<Hit> {
        self.oracle.cast(pose.position_ned_m, pose.ned_from_camera * uv.extend(1.0))
    }
}

fn eye(
    camera: &CameraSpec,
    focal_px: [f64; 2],
    principal_px: [f64; 2],
    coefficients: &[f64],
) -> Result<Eye, CameraError> {
    let lens = Lens::new(camera.lens.model, coefficients)
        .map_err(|source| CameraError::Lens { key: "camera".to_owned(), source })?;
    Ok(Eye::new(camera.size_px, focal_px, principal_px, lens))
}

/// Every number of a calibration linear in the zoom value between two entries of the table, held outside.
fn eye_at_zoom(camera: &CameraSpec, zoom: f64) -> Result<Eye, CameraError> {
    let table = &camera.zoom;
    let (Some(first), Some(last)) = (table.first(), table.last()) else {
        return Err(CameraError::ZoomValue(zoom));
    };
    let pair = table.windows(2).find(|pair| pair[0].at <= zoom && zoom < pair[1].at);
    let (low, high, share) = match pair {
        Some([low, high]) => (low, high, (zoom - low.at) / (high.at - low.at)),
        _ if zoom < first.at => (first, first, 0.0),
        _ => (last, last, 0.0),
    };
    let mix = |a: f64, b: f64| a * (1.0 - share) + b * share;
    let mix2 = |a: [f64; 2], b: [f64; 2]| [mix(a[0], b[0]), mix(a[1], b[1])];
    let centre = centre_px(camera);
    let principal_px =
        mix2(low.principal_point_px.unwrap_or(centre), high.principal_point_px.unwrap_or(centre));
    let count = low.coefficients.len().max(high.coefficients.len());
    let coefficient = |of: &[f64], i: usize| of.get(i).copied().unwrap_or(0.0);
    let coefficients: Vec<f64> = (0..count)
        .map(|i| mix(coefficient(&low.coefficients, i), coefficient(&high.coefficients, i)))
        .collect();
    eye(camera, mix2(low.focal_px, high.focal_px), principal_px, &coefficients)
}

fn centre_px(camera: &CameraSpec) -> [f64; 2] {
    camera.size_px.map(|size| 0.5 * (f64::from(size) - 1.0))
}

/// Zoom value at a time: linear between the rows of the track, held outside; 1 without a track.
fn zoom_at(track: &[(f64, f64)], t_s: f64) -> f64 {
    let (Some(first), Some(last)) = (track.first(), track.last()) else { return 1.0 };
    if t_s <= first.0 {
        return first.1;
    }
    let between = track.windows(2).find(|rows| rows[0].0 <= t_s && t_s < rows[1].0);
    between.map_or(last.1, |rows| {
        rows[0].1 + (rows[1].1 - rows[0].1) * ((t_s - rows[0].0) / (rows[1].0 - rows[0].0))
    })
}
