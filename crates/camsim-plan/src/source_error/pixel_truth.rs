//! What the centre of a pixel sees, by a ray of its own in f64.
//!
//! Depth and coordinates of a pixel at a silhouette are those of one of two surfaces. The samples of an ideal
//! frame know the border between the two to a few hundredths of a pixel, and it does not show every surface;
//! a pixel that takes the wrong one is off by all of the parallax between them, and one in ten thousand such
//! pixels is more than all other errors together. A ray decides.

#[cfg(test)]
mod tests;

use camsim_core::{
    mount::CameraPath,
    pose::CameraPose,
    scene::{TerrainTriangle, TerrainWalk},
    shutter::RowAxis,
};
use glam::{DVec2, DVec3};

use crate::{ir::frame_plan::FramePlan, view::surfaces::Surfaces};

/// What the centre of a pixel sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelTruth {
    /// Source in the mid-window ideal frame, pixels, at the given exposure phase. It may lie beyond the
    /// frame's border, and behind that camera it is mirrored.
    pub source_px: DVec2,
    /// The surface at mid-exposure; `None` is sky.
    pub hit: Option<PixelHit>,
}

/// The surface that the centre of a pixel sees at mid-exposure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelHit {
    /// The point at the pixel's own instant, NED, metres.
    pub point_ned_m: DVec3,
    /// Planar depth in the row's own camera, metres.
    pub depth_m: f64,
    /// Unit normal of the triangle, NED, towards the camera.
    pub normal_ned: DVec3,
    /// 0 = terrain, 1 + i = mesh i of the scene.
    pub surface: u32,
    /// The triangle, on the terrain.
    pub triangle: Option<TerrainTriangle>,
}

/// A hit along a ray.
struct RayHit {
    depth_m: f64,
    normal_ned: DVec3,
    surface: u32,
    triangle: Option<TerrainTriangle>,
}

/// Camera at one instant.
#[derive(Clone, Copy, Debug)]
struct RowCamera {
    /// Path time, seconds.
    t_s: f64,
    pose: CameraPose,
}

/// Rays of the pixels of a frame, each at its own instant. The terrain is met at full detail, which what was
/// drawn is within [`FramePlan::terrain_error_px`] of.
#[derive(Debug)]
pub struct FrameRays<'a> {
    path: &'a CameraPath,
    surfaces: &'a Surfaces,
    plan: &'a FramePlan,
    /// Camera at mid-exposure of each row, or of each column in either field.
    mid: Vec<RowCamera>,
    /// Camera at the exposure phase of the coordinates; empty where that is mid-exposure.
    at_phase: Vec<RowCamera>,
}

impl<'a> FrameRays<'a> {
    /// Rays whose coordinates are of exposure phase `phase`, -0.5 to 0.5.
    pub(crate) fn new(path: &'a CameraPath, surfaces: &'a Surfaces, plan: &'a FramePlan, phase: f64) -> Self {
        let [columns, rows] = plan.camera.size_px;
        let pixels: Vec<[u32; 2]> = match plan.shutter.row_axis() {
            RowAxis::Rows => (0..rows).map(|y| [0, y]).collect(),
            RowAxis::Columns => (0..columns).flat_map(|x| [[x, 0], [x, 1]]).collect(),
        };
        let shutter = &plan.shutter;
        let cameras = |phase: f64| {
            let times = pixels.iter().map(|&[x, y]| {
                plan.stamp_s + shutter.dt_pixel_s(x, y) + phase * shutter.exposure_pixel_s(x, y)
            });
            times.map(|t_s| RowCamera { t_s, pose: path.pose(t_s) }).collect()
        };
        let at_phase = if phase * shutter.exposure_s() == 0.0 { Vec::new() } else { cameras(phase) };
        Self { path, surfaces, plan, mid: cameras(0.0), at_phase }
    }

    /// How far the drawn terrain may be from where it is, pixels of the output frame; 0 without a terrain.
    #[must_use]
    pub fn terrain_displacement_px(&self) -> f64 {
        let FramePlan { camera, ideal, terrain_error_px, .. } = self.plan;
        let camera_from_ideal = (camera.central_focal_px() / ideal.focal_px).max_element();
        self.surfaces.terrain().map_or(0.0, |_| terrain_error_px * camera_from_ideal)
    }

    /// What the ray `uv` of a pixel meets.
    #[must_use]
    pub fn cast(&self, pixel: [u32; 2], uv: DVec2) -> PixelTruth {
        let (RowCamera { t_s, pose }, ray_ned) = self.ray(&self.mid, pixel, uv);
        let hit = self.surfaces.first_hit_at(*t_s, pose.position_ned_m, ray_ned).map(|hit| RayHit {
            depth_m: hit.depth_m,
            normal_ned: hit.normal_ned,
            surface: hit.surface as u32,
            triangle: self.surfaces.terrain().zip(hit.terrain).map(|(terrain, hit)| hit.triangle_of(terrain)),
        });
        self.truth(pixel, uv, hit)
    }

    /// A walk over the terrain from pixel to pixel.
    #[must_use]
    pub fn pixel_walk(&self) -> PixelWalk<'_> {
        PixelWalk { rays: self, walk: None }
    }

    /// Whether a walk from a triangle that a pixel nearby sees ends at the triangle that this pixel sees: no
    /// silhouette of the terrain lies between them.
    #[must_use]
    pub fn connects(&self, from: TerrainTriangle, pixel: [u32; 2], uv: DVec2, to: TerrainTriangle) -> bool {
        if from == to {
            return true;
        }
        let (RowCamera { pose, .. }, ray_ned) = self.ray(&self.mid, pixel, uv);
        let walk = |from| self.surfaces.terrain()?.walk(from, pose.position_ned_m, ray_ned);
        // A ray on an edge hits both of its triangles.
        walk(from).is_some_and(|hit| {
            hit.triangle == to || walk(to).is_some_and(|there| (hit.t - there.t).abs() <= ON_AN_EDGE * hit.t)
        })
    }

    /// Camera of a pixel at mid-exposure.
    #[must_use]
    #[inline]
    pub fn pose(&self, pixel: [u32; 2]) -> &CameraPose {
        &self.ray(&self.mid, pixel, DVec2::ZERO).0.pose
    }

    /// Instant and camera of a pixel at an exposure phase, -0.5 (begin) to 0.5 (end).
    #[must_use]
    pub fn camera_at(&self, [x, y]: [u32; 2], phase: f64) -> (f64, CameraPose) {
        let FramePlan { shutter, stamp_s, .. } = self.plan;
        let t_s = stamp_s + shutter.dt_pixel_s(x, y) + phase * shutter.exposure_pixel_s(x, y);
        (t_s, self.path.pose(t_s))
    }

    /// The surface (0 = terrain, 1 + i = mesh i of the scene) that the ray `uv` of a camera meets first at path
    /// time `t_s`.
    #[must_use]
    pub fn surface(&self, t_s: f64, pose: &CameraPose, uv: DVec2) -> Option<u32> {
        let ray_ned = pose.ned_from_camera * uv.extend(1.0);
        let hit = self.surfaces.first_hit_at(t_s, pose.position_ned_m, ray_ned);
        hit.map(|hit| hit.surface as u32)
    }

    /// Mid-exposure of a pixel, path time, seconds.
    #[must_use]
    #[inline]
    pub fn mid_s(&self, pixel: [u32; 2]) -> f64 {
        self.ray(&self.mid, pixel, DVec2::ZERO).0.t_s
    }

    /// Whether at path time `t_s` a surface lies between a camera and what it sees along a ray at planar depth
    /// `depth_m` (infinite for the sky), leaving out the last millionth of the path.
    #[must_use]
    pub fn is_hidden(&self, t_s: f64, position_ned_m: DVec3, ray_ned: DVec3, depth_m: f64) -> bool {
        let hit = self.surfaces.first_hit_at(t_s, position_ned_m, ray_ned);
        hit.is_some_and(|hit| hit.depth_m < (1.0 - LAST_PART) * depth_m)
    }

    /// Whether at path time `t_s` a model lies between a camera and what it sees along a ray at planar depth
    /// `depth_m`, as [`Self::is_hidden`].
    #[must_use]
    pub fn is_behind_model(&self, t_s: f64, position_ned_m: DVec3, ray_ned: DVec3, depth_m: f64) -> bool {
        let limit = (1.0 - LAST_PART) * depth_m;
        self.surfaces.model_hit_at(t_s, position_ned_m, ray_ned, limit).is_some()
    }

    /// Whether there is anything but terrain.
    #[must_use]
    pub fn has_models(&self) -> bool {
        !self.surfaces.scene.meshes.is_empty()
    }

    /// Whether anything moves.
    #[must_use]
    pub fn moves(&self) -> bool {
        self.surfaces.moves()
    }

    /// Lower bound of the planar depth of anything in view, from within `travel_m` of the frame's camera,
    /// metres.
    #[must_use]
    pub fn nearest_m(&self, travel_m: f64) -> f64 {
        self.surfaces.nearest_m(&self.plan.key_pose, self.plan.tangents(), travel_m)
    }

    /// Row of the readout that a pixel belongs to, of one of the fields for columns.
    #[inline]
    fn line(&self, [x, y]: [u32; 2]) -> usize {
        match self.plan.shutter.row_axis() {
            RowAxis::Rows => y as usize,
            RowAxis::Columns => 2 * x as usize + (y % 2) as usize,
        }
    }

    #[inline]
    fn ray<'b>(&self, rows: &'b [RowCamera], pixel: [u32; 2], uv: DVec2) -> (&'b RowCamera, DVec3) {
        let row = &rows[self.line(pixel)];
        (row, row.pose.ned_from_camera * uv.extend(1.0))
    }

    #[inline]
    fn truth(&self, pixel: [u32; 2], uv: DVec2, hit: Option<RayHit>) -> PixelTruth {
        let (RowCamera { pose, .. }, ray_ned) = self.ray(&self.mid, pixel, uv);
        let source_px = if self.at_phase.is_empty() {
            self.source_px(pose, ray_ned, hit.as_ref().map(|hit| hit.depth_m))
        } else {
            let (RowCamera { t_s, pose }, ray_ned) = self.ray(&self.at_phase, pixel, uv);
            let hit = self.surfaces.first_hit_at(*t_s, pose.position_ned_m, ray_ned);
            self.source_px(pose, ray_ned, hit.map(|hit| hit.depth_m))
        };
        let hit = hit.map(|RayHit { depth_m, normal_ned, surface, triangle }| PixelHit {
            point_ned_m: pose.position_ned_m + depth_m * ray_ned,
            depth_m,
            normal_ned: if normal_ned.dot(ray_ned) > 0.0 { -normal_ned } else { normal_ned },
            surface,
            triangle,
        });
        PixelTruth { source_px, hit }
    }

    #[inline]
    fn source_px(&self, pose: &CameraPose, ray_ned: DVec3, depth_m: Option<f64>) -> DVec2 {
        let key_pose = &self.plan.key_pose;
        // Times the inverse depth, which is 0 for the sky.
        let shift_ned_m = pose.position_ned_m - key_pose.position_ned_m;
        let point = ray_ned + depth_m.map_or(DVec3::ZERO, |depth_m| shift_ned_m / depth_m);
        self.plan.ideal.px_from_point(key_pose.ned_from_camera.conjugate() * point)
    }
}

/// A walk over the terrain from pixel to pixel, along rows best.
#[derive(Debug)]
pub struct PixelWalk<'a> {
    rays: &'a FrameRays<'a>,
    /// By rays of a row of the readout.
    walk: Option<(usize, TerrainWalk<'a>)>,
}

impl PixelWalk<'_> {
    /// What the ray `uv` of a pixel meets if that is on the same unfolded patch of the terrain as a triangle
    /// that a pixel nearby sees ([`TerrainWalk::to`]), and no model is within `window` times its depth in front
    /// of it.
    #[must_use]
    #[inline]
    pub fn to(
        &mut self,
        from: TerrainTriangle,
        pixel: [u32; 2],
        uv: DVec2,
        window: f64,
    ) -> Option<PixelTruth> {
        let rays = self.rays;
        let (RowCamera { t_s, pose }, ray_ned) = rays.ray(&rays.mid, pixel, uv);
        let line = rays.line(pixel);
        let known = self.walk.take().filter(|(of, walk)| *of == line && walk.triangle() == from);
        let walk = match known {
            Some((_, walk)) => walk,
            None => TerrainWalk::new(rays.surfaces.terrain()?, from, pose.position_ned_m),
        };
        let (_, walk) = self.walk.insert((line, walk));
        let hit = walk.to(ray_ned)?;
        let depth_m = hit.t;
        // What moves is not in the picture that was looked up.
        let in_front_m = if rays.surfaces.moves() { depth_m } else { window * depth_m };
        let start_ned_m = pose.position_ned_m + (depth_m - in_front_m) * ray_ned;
        let is_hidden = rays.surfaces.model_hit_at(*t_s, start_ned_m, ray_ned, in_front_m).is_some();
        let hit = RayHit { depth_m, normal_ned: hit.normal_ned, surface: 0, triangle: Some(hit.triangle) };
        (!is_hidden).then(|| rays.truth(pixel, uv, Some(hit)))
    }
}

/// Part of the path to a point that rounding may take for a surface in front of it.
const LAST_PART: f64 = 1e-6;
/// Relative difference of the depths that the two triangles of an edge give to a ray that hits it: rounding.
const ON_AN_EDGE: f64 = 1e-9;
