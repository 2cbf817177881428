//! The reference renderer, *the reference* in comments and tests: it casts every ray in f64, at the instant of
//! its own row, from the trajectory into the scene. It is slow, exact and independent of the other renderers.
//!
//! It shares with them the scenario, the trajectory (with the mount), the motions of what moves, the forward
//! model of the lens, and what docs/accuracy/reference.md lists. Row times (`timing`), lens inverse
//! (`lens_inverse`), zoom, ray casting (`ray`, `terrain_pyramid`, `mesh_bvh`, `moving`), shadows (`shadow`), colour
//! (`shading`) and integration (`render`) are implementations of its own. The seeded photometric stage is shared,
//! because a seed has no meaning other than its noise. The definition of a silhouette ([`crate::silhouette`]) is
//! shared, too, by these measurements and by the predictions of the planner.

use std::sync::{Arc, Mutex, PoisonError};

use glam::{DVec2, DVec3};

use crate::{
    camera::{CameraError, CameraModel, ZoomTable},
    imaging::{ImageSensor, Optics},
    lens::{DEFAULT_REACH, Lens, ModelFacts},
    pose::CameraPose,
    scenario::{CameraSpec, Primary},
    scene::Scene,
    sequence::Sequence,
    shutter::{Shutter, ShutterError},
};

mod disocclusion;
mod flow;
mod flow_errors;
mod lamps;
mod lens_inverse;
mod measure;
mod mesh_bvh;
mod moving;
mod plane_errors;
mod planes;
mod ray;
mod render;
mod scene_rays;
mod shading;
mod shadow;
mod terrain_pyramid;
mod timing;
mod truth;

pub use disocclusion::{Disocclusion, disocclusion};
pub use flow_errors::{
    COVERAGE_TOLERANCE, CoverageErrors, FLOW_TOLERANCE_PX, FlowErrors, FlowStats, MOTION_TOLERANCE,
    coverage_errors, flow_errors,
};
use lens_inverse::LensInverse;
pub use measure::{
    CoordErrors, CoordTruth, ErrorStats, ErrorVerdict, ImageErrors, MAX_VOID_SHARE, coord_errors,
    image_errors, silhouettes,
};
use mesh_bvh::MeshBvh;
use moving::{MovingMeshes, moving_meshes};
pub use plane_errors::{NORMAL_TOLERANCE_RAD, PlaneErrors, plane_errors};
use ray::Ray;
pub use render::{Convergence, IdealView, RenderOptions};
use shading::Shading;
use terrain_pyramid::TerrainPyramid;
use timing::FrameTiming;
pub use truth::{DEPTH_TOLERANCE, TruthErrors, truth_errors};

/// Number of zoomed lenses that are cached: as many as there may be frames rendered in turn.
const ZOOM_CACHE_SIZE: usize = 4;

/// Why the reference cannot be built for a sequence.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ReferenceError {
    /// The camera or an entry of its zoom table.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// The shutter.
    #[error(transparent)]
    Shutter(#[from] ShutterError),
}

/// The reference renderer of one sequence. Immutable; shared between threads.
#[derive(Debug)]
pub struct ReferenceRenderer {
    sequence: Arc<Sequence>,
    timing: FrameTiming,
    /// `None` for a zoom lens.
    fixed: Option<LensInverse>,
    zoomed: Mutex<Vec<(u64, Arc<LensInverse>)>>,
    scene: Arc<PreparedScene>,
    optics: Option<Optics>,
    sensor: Option<ImageSensor>,
}

/// What is prepared of a scene for rays.
#[derive(Debug)]
struct PreparedScene {
    terrain_pyramid: Option<TerrainPyramid>,
    /// What stands still.
    mesh_bvh: MeshBvh,
    moving: Vec<MovingMeshes>,
    shading: Shading,
    /// Whether the scene has blended surfaces.
    blends: bool,
    /// Numbers of the meshes that emit light above white.
    lamps: Vec<usize>,
}

impl PreparedScene {
    fn new(scene: &Scene) -> Self {
        Self {
            terrain_pyramid: scene.terrain.as_ref().map(TerrainPyramid::new),
            mesh_bvh: MeshBvh::new(&scene.meshes, scene.light, |mesh| mesh.motion.is_none()),
            moving: moving_meshes(&scene.meshes, scene.light),
            shading: Shading::new(scene),
            blends: scene.has_blended(),
            lamps: scene.lamps().collect(),
        }
    }
}

/// What one image position sees at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RaySample {
    /// The instant in path time, seconds.
    pub t_s: f64,
    /// Pose of the camera at that instant.
    pub pose: CameraPose,
    /// Ideal ray (u, v) in the optical frame.
    pub uv: DVec2,
    /// First intersection of the ray; `None` is sky.
    pub hit: Option<Hit>,
}

/// Intersection of a ray with a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// The point in NED, metres.
    pub point_ned_m: DVec3,
    /// Planar depth in the camera at the instant of the ray, metres.
    pub depth_m: f64,
    /// Texture coordinates of the point.
    pub texture_uv: [f64; 2],
    /// Factor on the texture's colour at the point.
    pub tint: [f64; 3],
    /// Fraction of the light in it that is left in the shadow.
    pub sky_fraction: f64,
    /// Unit normal of the triangle, NED, on the side that the ray comes from; 0 for a triangle without area.
    pub normal_ned: DVec3,
    /// 0 = terrain, 1 + i = mesh i of the scene.
    pub surface: u32,
}

/// One frame, with the data that all its samples share.
#[derive(Debug)]
pub struct FrameView<'a> {
    reference: &'a ReferenceRenderer,
    stamp_s: f64,
    exposure_s: f64,
    lens: FrameLens<'a>,
}

#[derive(Debug)]
enum FrameLens<'a> {
    Fixed(&'a LensInverse),
    Zoomed(Arc<LensInverse>),
    /// The zoom value has no valid lens, so no pixel has a ray.
    Invalid,
}

impl ReferenceRenderer {
    /// Prepares the reference of a sequence.
    ///
    /// # Errors
    /// A camera or shutter that cannot be used.
    pub fn new(sequence: Arc<Sequence>) -> Result<Self, ReferenceError> {
        Self::renewed(None, sequence)
    }

    /// As [`Self::new`]; what `before` has prepared of the scene is kept if it is the same [`Arc`].
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn renewed(before: Option<&Self>, sequence: Arc<Sequence>) -> Result<Self, ReferenceError> {
        let camera = &sequence.scenario.camera;
        // Called for its checks only; the values are not used.
        CameraModel::from_spec(camera)?;
        ZoomTable::from_spec(camera)?;
        Shutter::from_spec(&camera.shutter, camera.fps, camera.size_px)?;
        if let Some(row) = sequence.zoom_track.iter().find(|row| row.1.is_nan()) {
            return Err(CameraError::ZoomValue(row.1).into());
        }
        let fixed = if camera.zoom.is_empty() { Some(lenses(camera, None)?) } else { None };
        let sensor = ImageSensor::new(&sequence.scenario.camera, sequence.scenario.seed);
        let known = before.filter(|before| Arc::ptr_eq(&before.sequence.scene, &sequence.scene));
        let scene = known.map(|known| known.scene.clone());
        Ok(Self { fixed, sensor, ..Self::of_prepared(scene, sequence) })
    }

    /// Rays through the scene of a sequence, without its camera.
    pub(crate) fn of_scene(sequence: Arc<Sequence>) -> Self {
        Self::of_prepared(None, sequence)
    }

    fn of_prepared(scene: Option<Arc<PreparedScene>>, sequence: Arc<Sequence>) -> Self {
        Self {
            timing: FrameTiming::new(&sequence),
            fixed: None,
            zoomed: Mutex::default(),
            scene: scene.unwrap_or_else(|| Arc::new(PreparedScene::new(&sequence.scene))),
            optics: Optics::new(&sequence.scenario.camera, sequence.scenario.seed),
            sensor: ImageSensor::new(&sequence.scenario.camera, sequence.scenario.seed),
            sequence,
        }
    }

    /// Name of the renderer for display, instead of that of an adapter.
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
        self.timing.stamp_s(frame)
    }

    /// Whether the camera has an image sensor, be it for the faces of its picture together.
    fn sensor_collects(&self) -> bool {
        self.sequence.scenario.camera.sensor.is_some()
    }

    /// Exposure time of a pixel of a frame, seconds.
    #[must_use]
    pub fn exposure_s(&self, frame: u64, pixel: [u32; 2]) -> f64 {
        self.sequence.blurred_s(frame) + self.timing.longer_s(pixel)
    }

    /// One frame, for taking many samples of it.
    #[must_use]
    pub fn view(&self, frame: u64) -> FrameView<'_> {
        let stamp_s = self.timing.stamp_s(frame);
        let exposure_s = self.sequence.blurred_s(frame);
        FrameView { reference: self, stamp_s, exposure_s, lens: self.lens_of(stamp_s) }
    }

    /// Samples the position `pixel + offset_px` (offset within -0.5..=0.5) of a frame at exposure phase
    /// `phase` in [-0.5, 0.5]. The whole pixel is exposed at the time of its row. `None` where the lens has
    /// no ideal ray. For many samples of a frame with a zoom lens, [`ReferenceRenderer::view`] is faster.
    #[must_use]
    pub fn sample(&self, frame: u64, pixel: [u32; 2], offset_px: DVec2, phase: f64) -> Option<RaySample> {
        self.view(frame).sample(pixel, offset_px, phase)
    }

    /// As [`ReferenceRenderer::cast_at`] at path time 0, for scenes in which nothing moves.
    #[must_use]
    pub fn cast(&self, origin_ned_m: DVec3, direction_ned: DVec3) -> Option<Hit> {
        self.cast_at(0.0, origin_ned_m, direction_ned)
    }

    /// First intersection of the ray `origin + t direction` with t > 0, with everything where it is at path
    /// time `t_s`. Blended surfaces count where their alpha reaches the cut-off. [`Hit::depth_m`] is t, which
    /// is planar depth for a direction with z = 1 in the camera. Surfaces are hit from both sides. `None` also
    /// for numbers that are not finite.
    #[must_use]
    pub fn cast_at(&self, t_s: f64, origin_ned_m: DVec3, direction_ned: DVec3) -> Option<Hit> {
        let ray = Ray::new(origin_ned_m, direction_ned)?;
        let terrain_hit = self.cast_terrain(&ray);
        let limit = limit_of(terrain_hit);
        let still = self.scene.mesh_bvh.first(&ray, limit).or(terrain_hit);
        self.nearer_moving(&ray, t_s, still, false)
    }

    /// `hit`, or what moves in front of it; opaque surfaces only if `solid`.
    fn nearer_moving(&self, ray: &Ray, t_s: f64, hit: Option<Hit>, solid: bool) -> Option<Hit> {
        self.scene.moving.iter().fold(hit, |hit, meshes| meshes.first(ray, t_s, limit_of(hit), solid).or(hit))
    }

    fn cast_terrain(&self, ray: &Ray) -> Option<Hit> {
        let terrain = self.sequence.scene.terrain.as_ref();
        terrain
            .zip(self.scene.terrain_pyramid.as_ref())
            .and_then(|(terrain, terrain_pyramid)| terrain_pyramid.first(terrain, ray, f64::INFINITY))
    }

    /// Linear light of one hit, with fog by slant range. In a scene without blended surfaces and shadows this
    /// is all the light of the ray; [`ReferenceRenderer::radiance`] includes both.
    #[must_use]
    pub fn color(&self, uv: DVec2, hit: Option<&Hit>) -> DVec3 {
        self.scene.shading.color(hit, uv.extend(1.0).length())
    }

    /// As [`ReferenceRenderer::radiance_at`] at path time 0, for scenes in which nothing moves.
    #[must_use]
    pub fn radiance(&self, pose: &CameraPose, uv: DVec2) -> DVec3 {
        self.radiance_at(0.0, pose, uv)
    }

    /// Linear light along the ray `uv` of a camera at path time `t_s`: of the first opaque surface and of every
    /// blended layer in front of it, composited by alpha.
    #[must_use]
    pub fn radiance_at(&self, t_s: f64, pose: &CameraPose, uv: DVec2) -> DVec3 {
        let ray = uv.extend(1.0);
        self.radiance_along(t_s, pose.position_ned_m, pose.ned_from_camera * ray, ray.length())
    }

    /// As [`ReferenceRenderer::is_occluded_at`] at path time 0, for scenes in which nothing moves.
    #[must_use]
    pub fn is_occluded(&self, from_ned_m: DVec3, to_ned_m: DVec3) -> bool {
        self.is_occluded_at(0.0, from_ned_m, to_ned_m)
    }

    /// Whether a surface lies between two points at path time `t_s`, leaving out the last millionth of the
    /// segment.
    #[must_use]
    pub fn is_occluded_at(&self, t_s: f64, from_ned_m: DVec3, to_ned_m: DVec3) -> bool {
        self.cast_at(t_s, from_ned_m, to_ned_m - from_ned_m).is_some_and(|hit| hit.depth_m < 1.0 - 1e-6)
    }

    fn zoomed_lens(&self, zoom: f64) -> Option<Arc<LensInverse>> {
        // The lock is not held while the lens is prepared. That runs in parallel, and a thread that waits for
        // its parts may take up another task that needs a zoomed lens.
        let cache = || self.zoomed.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, lens)) = cache().iter().find(|(bits, _)| *bits == zoom.to_bits()) {
            return Some(lens.clone());
        }
        let made = Arc::new(lenses(&self.sequence.scenario.camera, Some(zoom)).ok()?);
        let mut cache = cache();
        if cache.len() >= ZOOM_CACHE_SIZE {
            cache.remove(0);
        }
        cache.push((zoom.to_bits(), made.clone()));
        Some(made)
    }
}

impl FrameView<'_> {
    /// Exposure time of a pixel, seconds.
    fn exposure_s(&self, pixel: [u32; 2]) -> f64 {
        self.exposure_s + self.reference.timing.longer_s(pixel)
    }

    /// Light that a pixel collects, as a multiple of that of the exposure of the row that is read first.
    fn light_gain(&self, pixel: [u32; 2]) -> f64 {
        if self.exposure_s > 0.0 { self.exposure_s(pixel) / self.exposure_s } else { 1.0 }
    }

    /// As [`ReferenceRenderer::sample`].
    #[must_use]
    pub fn sample(&self, pixel: [u32; 2], offset_px: DVec2, phase: f64) -> Option<RaySample> {
        let uv = self.ray(pixel, offset_px)?;
        let t_s = self.mid_s(pixel) + phase * self.exposure_s(pixel);
        let pose = self.reference.sequence.path.pose(t_s);
        Some(RaySample { t_s, pose, uv, hit: self.hit(t_s, &pose, uv) })
    }

    /// Ideal ray (u, v) of an image position.
    #[must_use]
    pub fn ray(&self, pixel: [u32; 2], offset_px: DVec2) -> Option<DVec2> {
        self.lens()?.ray_of(pixel, offset_px)
    }

    /// As [`FrameView::ray`], of the lenses of red and blue; `None` where they have that of green.
    pub(super) fn ray_of_red_and_blue(
        &self,
        pixel: [u32; 2],
        offset_px: DVec2,
    ) -> Option<[Option<DVec2>; 2]> {
        let others = self.lens()?.others.as_ref()?;
        Some(others.each_ref().map(|lens| lens.ray_of(pixel, offset_px)))
    }

    fn lens(&self) -> Option<&LensInverse> {
        match &self.lens {
            FrameLens::Fixed(lens) => Some(lens),
            FrameLens::Zoomed(lens) => Some(lens),
            FrameLens::Invalid => None,
        }
    }

    /// Mid-exposure of a pixel, path time, seconds.
    #[must_use]
    pub fn mid_s(&self, pixel: [u32; 2]) -> f64 {
        self.stamp_s + self.reference.timing.dt_s(pixel)
    }

    fn hit(&self, t_s: f64, pose: &CameraPose, uv: DVec2) -> Option<Hit> {
        self.reference.cast_at(t_s, pose.position_ned_m, pose.ned_from_camera * uv.extend(1.0))
    }
}

/// Where a ray ends.
fn limit_of(hit: Option<Hit>) -> f64 {
    hit.map_or(f64::INFINITY, |hit| hit.depth_m)
}

/// The lens of a camera, with those of red and blue.
fn lenses(camera: &CameraSpec, zoom: Option<f64>) -> Result<LensInverse, CameraError> {
    let of = |camera: &CameraSpec| match zoom {
        Some(zoom) => lens_at_zoom(camera, zoom),
        None => {
            let principal_px = camera.principal_point_px.unwrap_or_else(|| centre_px(camera));
            lens_inverse(camera, camera.focal_px, principal_px, &camera.lens.coefficients)
        }
    };
    let mut lens = of(camera)?;
    if camera.is_chromatic() {
        let [red, blue] = [Primary::Red, Primary::Blue].map(|primary| of(&camera.of_primary(primary)));
        lens.others = Some(Box::new([red?, blue?]));
    }
    Ok(lens)
}

fn lens_inverse(
    camera: &CameraSpec,
    focal_px: [f64; 2],
    principal_px: [f64; 2],
    coefficients: &[f64],
) -> Result<LensInverse, CameraError> {
    let lens = Lens::of_camera(camera, focal_px.into(), principal_px.into(), coefficients, DEFAULT_REACH)
        .map_err(|source| CameraError::Lens { key: "camera".to_owned(), source })?;
    let lens = LensInverse::new(camera.size_px, focal_px, principal_px, lens);
    Ok(match &camera.image_circle {
        Some(circle) => lens.within(circle),
        None => lens,
    })
}

/// The camera at a zoom value: every number of the calibration is linear between two entries of the table and
/// constant beyond its ends.
fn lens_at_zoom(camera: &CameraSpec, zoom: f64) -> Result<LensInverse, CameraError> {
    let table = &camera.zoom;
    let (Some(first), Some(last)) = (table.first(), table.last()) else {
        return Err(CameraError::ZoomValue(zoom));
    };
    let pair = table.windows(2).find(|pair| pair[0].at <= zoom && zoom < pair[1].at);
    let (low, high, fraction) = match pair {
        Some([low, high]) => (low, high, (zoom - low.at) / (high.at - low.at)),
        _ if zoom < first.at => (first, first, 0.0),
        _ => (last, last, 0.0),
    };
    let mix = |a: f64, b: f64| a * (1.0 - fraction) + b * fraction;
    let mix2 = |a: [f64; 2], b: [f64; 2]| [mix(a[0], b[0]), mix(a[1], b[1])];
    let centre = centre_px(camera);
    let principal_px =
        mix2(low.principal_point_px.unwrap_or(centre), high.principal_point_px.unwrap_or(centre));
    let count = low.coefficients.len().max(high.coefficients.len());
    let coefficient = |of: &[f64], i: usize| ModelFacts::of(camera.lens.model).or_default(of, i);
    let coefficients: Vec<f64> = (0..count)
        .map(|i| mix(coefficient(&low.coefficients, i), coefficient(&high.coefficients, i)))
        .collect();
    lens_inverse(camera, mix2(low.focal_px, high.focal_px), principal_px, &coefficients)
}

fn centre_px(camera: &CameraSpec) -> [f64; 2] {
    camera.size_px.map(|size| 0.5 * (f64::from(size) - 1.0))
}

/// Zoom value at a time: linear between the rows of the track, constant beyond its ends; 1 without a track.
pub(crate) fn zoom_at(track: &[(f64, f64)], t_s: f64) -> f64 {
    let (Some(first), Some(last)) = (track.first(), track.last()) else { return 1.0 };
    if t_s <= first.0 {
        return first.1;
    }
    let between = track.windows(2).find(|rows| rows[0].0 <= t_s && t_s < rows[1].0);
    between.map_or(last.1, |rows| {
        rows[0].1 + (rows[1].1 - rows[0].1) * ((t_s - rows[0].0) / (rows[1].0 - rows[0].0))
    })
}
