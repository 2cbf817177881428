//! What the centre of a pixel sees, by a ray of its own in f64.
//!
//! Depth and coordinates of a pixel at a silhouette are those of one of two surfaces. The samples of an ideal
//! frame know the border between the two to a few hundredths of a pixel, and it does not show every surface;
//! a pixel that takes the wrong one is off by all of the parallax between them, and one in ten thousand such
//! pixels is more than all other errors together. A ray decides.

#[cfg(test)]
mod tests;

use camsim_core::{mount::CameraPath, pose::CameraPose, scene::TerrainTriangle, shutter::RowAxis};
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
        let cameras = |shift_s: f64| {
            let times = pixels.iter().map(|&[x, y]| plan.stamp_s + plan.shutter.dt_pixel_s(x, y) + shift_s);
            times.map(|t_s| RowCamera { t_s, pose: path.pose(t_s) }).collect()
        };
        let shift_s = phase * plan.shutter.exposure_s();
        let at_phase = if shift_s == 0.0 { Vec::new() } else { cameras(shift_s) };
        Self { path, surfaces, plan, mid: cameras(0.0), at_phase }
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

    /// What the ray `uv` of a pixel meets if that is on the same unfolded patch of the terrain as a triangle
    /// that a pixel nearby sees ([`camsim_core::scene::Terrain::walk`]), and no model is within `window` times
    /// its depth in front of it.
    #[must_use]
    pub fn walk(&self, from: TerrainTriangle, pixel: [u32; 2], uv: DVec2, window: f64) -> Option<PixelTruth> {
        let (RowCamera { t_s, pose }, ray_ned) = self.ray(&self.mid, pixel, uv);
        let terrain = self.surfaces.terrain()?;
        let (triangle, depth_m) = terrain.walk(from, pose.position_ned_m, ray_ned)?;
        // What moves is not in the picture that was looked up.
        let in_front_m = if self.surfaces.moves() { depth_m } else { window * depth_m };
        let start_ned_m = pose.position_ned_m + (depth_m - in_front_m) * ray_ned;
        let is_hidden = self.surfaces.model_hit_at(*t_s, start_ned_m, ray_ned, in_front_m).is_some();
        let normal_ned = terrain.normal_ned(triangle);
        let hit = RayHit { depth_m, normal_ned, surface: 0, triangle: Some(triangle) };
        (!is_hidden).then(|| self.truth(pixel, uv, Some(hit)))
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
        walk(from).is_some_and(|(triangle, depth_m)| {
            triangle == to || walk(to).is_some_and(|(_, to_m)| (depth_m - to_m).abs() <= ON_AN_EDGE * depth_m)
        })
    }

    /// Camera of a pixel at mid-exposure.
    #[must_use]
    pub fn pose(&self, pixel: [u32; 2]) -> &CameraPose {
        &self.ray(&self.mid, pixel, DVec2::ZERO).0.pose
    }

    /// Instant and camera of a pixel at an exposure phase, -0.5 (begin) to 0.5 (end).
    #[must_use]
    pub fn camera_at(&self, [x, y]: [u32; 2], phase: f64) -> (f64, CameraPose) {
        let FramePlan { shutter, stamp_s, .. } = self.plan;
        let t_s = stamp_s + shutter.dt_pixel_s(x, y) + phase * shutter.exposure_s();
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
    pub fn mid_s(&self, pixel: [u32; 2]) -> f64 {
        self.ray(&self.mid, pixel, DVec2::ZERO).0.t_s
    }

    /// Whether at path time `t_s` a surface lies between a camera and what it sees along a ray at planar depth
    /// `depth_m` (infinite for the sky), leaving out the last millionth of the way.
    #[must_use]
    pub fn is_hidden(&self, t_s: f64, position_ned_m: DVec3, ray_ned: DVec3, depth_m: f64) -> bool {
        let hit = self.surfaces.first_hit_at(t_s, position_ned_m, ray_ned);
        hit.is_some_and(|hit| hit.depth_m < (1.0 - LAST_PART) * depth_m)
    }

    fn ray<'b>(&self, rows: &'b [RowCamera], [x, y]: [u32; 2], uv: DVec2) -> (&'b RowCamera, DVec3) {
        let row = match self.plan.shutter.row_axis() {
            RowAxis::Rows => &rows[y as usize],
            RowAxis::Columns => &rows[2 * x as usize + (y % 2) as usize],
        };
        (row, row.pose.ned_from_camera * uv.extend(1.0))
    }

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

    fn source_px(&self, pose: &CameraPose, ray_ned: DVec3, depth_m: Option<f64>) -> DVec2 {
        let key_pose = &self.plan.key_pose;
        // Times the inverse depth, which is 0 for the sky.
        let shift_ned_m = pose.position_ned_m - key_pose.position_ned_m;
        let point = ray_ned + depth_m.map_or(DVec3::ZERO, |depth_m| shift_ned_m / depth_m);
        self.plan.ideal.px_from_point(key_pose.ned_from_camera.conjugate() * point)
    }
}

/// Part of the way to a point that rounding may take for a surface in front of it.
const LAST_PART: f64 = 1e-6;
/// Relative difference of the depths that the two triangles of an edge give to a ray that hits it: rounding.
const ON_AN_EDGE: f64 = 1e-9;
