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
    scene::{
        TerrainTriangle,
        ray_packet::{PACKET_RAYS, PacketRay, RayPacket},
    },
    shutter::RowAxis,
};
use glam::{DMat3, DVec2, DVec3};

use crate::{
    ir::frame_plan::FramePlan,
    view::surfaces::{SurfaceHit, Surfaces},
};

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
#[derive(Clone, Copy)]
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
    ned_from_camera: DMat3,
    /// To the key camera's axes, and from its position there.
    key_from_camera: DMat3,
    shift_key_m: DVec3,
}

impl RowCamera {
    fn new(t_s: f64, pose: CameraPose, key: &CameraPose) -> Self {
        let (key_from_camera, shift_key_m) = pose.relative_to(key);
        let ned_from_camera = DMat3::from_quat(pose.ned_from_camera);
        Self { t_s, pose, ned_from_camera, key_from_camera, shift_key_m }
    }
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
            times.map(|t_s| RowCamera::new(t_s, path.pose(t_s), &plan.key_pose)).collect()
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
        let hit = self.first_hit(&self.mid, pixel, uv).map(|hit| self.ray_hit(&hit));
        let source_px = match self.at_phase.is_empty() {
            true => self.source_px(&self.mid, pixel, uv, hit.map(|hit| hit.depth_m)),
            false => self.source_at_phase(pixel, uv),
        };
        self.truth(pixel, uv, hit, source_px)
    }

    fn first_hit(&self, rows: &[RowCamera], pixel: [u32; 2], uv: DVec2) -> Option<SurfaceHit> {
        let (RowCamera { t_s, pose, .. }, ray_ned) = self.ray(rows, pixel, uv);
        self.surfaces.first_hit_at(*t_s, pose.position_ned_m, ray_ned)
    }

    fn ray_hit(&self, hit: &SurfaceHit) -> RayHit {
        let SurfaceHit { depth_m, normal_ned, surface, terrain, .. } = *hit;
        let triangle = self.surfaces.terrain().zip(terrain).map(|(terrain, hit)| hit.triangle_of(terrain));
        RayHit { depth_m, normal_ned, surface: surface as u32, triangle }
    }

    /// What the rays of pixels near each other meet, as [`Self::cast`] for each; `found` gets their places among
    /// the pixels. `packet` is scratch.
    pub fn cast_packet(
        &self,
        packet: &mut RayPacket,
        pixels: &[Option<([u32; 2], DVec2)>; PACKET_RAYS],
        mut found: impl FnMut(usize, PixelTruth),
    ) {
        let Some(first) = self.hits_of_packet(packet, &self.mid, pixels) else {
            let each = pixels.iter().enumerate().filter_map(|(i, pixel)| Some((i, (*pixel)?)));
            return each.for_each(|(i, (pixel, uv))| found(i, self.cast(pixel, uv)));
        };
        let at_phase = (!self.at_phase.is_empty()).then(|| self.hits_of_packet(packet, &self.at_phase, pixels));
        for (i, hit) in first.iter().enumerate() {
            let Some((pixel, uv)) = pixels[i] else { continue };
            let source_px = match &at_phase {
                None => self.source_px(&self.mid, pixel, uv, hit.map(|hit| hit.depth_m)),
                Some(Some(hits)) => {
                    self.source_px(&self.at_phase, pixel, uv, hits[i].map(|hit| hit.depth_m))
                }
                Some(None) => self.source_at_phase(pixel, uv),
            };
            found(i, self.truth(pixel, uv, *hit, source_px));
        }
    }

    /// What each ray of a packet meets; `None` for rays that have to be traced alone.
    fn hits_of_packet(
        &self,
        packet: &mut RayPacket,
        rows: &[RowCamera],
        pixels: &[Option<([u32; 2], DVec2)>; PACKET_RAYS],
    ) -> Option<[Option<RayHit>; PACKET_RAYS]> {
        let mut rays = [NO_RAY; PACKET_RAYS];
        for (ray, pixel) in rays.iter_mut().zip(pixels) {
            let Some((pixel, uv)) = *pixel else { continue };
            let (RowCamera { pose, .. }, direction_ned) = self.ray(rows, pixel, uv);
            *ray = PacketRay { origin_ned_m: pose.position_ned_m, direction_ned, limit: f64::INFINITY };
        }
        if !packet.begin(&rays) {
            return None;
        }
        self.surfaces.meet_still(packet);
        let mut hits = [None; PACKET_RAYS];
        for (i, hit) in hits.iter_mut().enumerate() {
            *hit = packet.hit(i).map(|hit| RayHit {
                depth_m: hit.t,
                normal_ned: hit.normal_ned,
                surface: hit.surface,
                triangle: hit.triangle,
            });
        }
        if self.surfaces.moves() {
            for (hit, pixel) in hits.iter_mut().zip(pixels) {
                let Some((pixel, uv)) = *pixel else { continue };
                let (RowCamera { t_s, pose, .. }, ray_ned) = self.ray(rows, pixel, uv);
                let limit = hit.map_or(f64::INFINITY, |hit| hit.depth_m);
                let moving = self.surfaces.moving_hit_at(*t_s, pose.position_ned_m, ray_ned, limit);
                *hit = moving.map(|moving| self.ray_hit(&moving)).or(*hit);
            }
        }
        Some(hits)
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
        (row, row.ned_from_camera * uv.extend(1.0))
    }

    #[inline]
    fn truth(&self, pixel: [u32; 2], uv: DVec2, hit: Option<RayHit>, source_px: DVec2) -> PixelTruth {
        let (RowCamera { pose, .. }, ray_ned) = self.ray(&self.mid, pixel, uv);
        let hit = hit.map(|RayHit { depth_m, normal_ned, surface, triangle }| PixelHit {
            point_ned_m: pose.position_ned_m + depth_m * ray_ned,
            depth_m,
            normal_ned: if normal_ned.dot(ray_ned) > 0.0 { -normal_ned } else { normal_ned },
            surface,
            triangle,
        });
        PixelTruth { source_px, hit }
    }

    fn source_at_phase(&self, pixel: [u32; 2], uv: DVec2) -> DVec2 {
        let hit = self.first_hit(&self.at_phase, pixel, uv);
        self.source_px(&self.at_phase, pixel, uv, hit.map(|hit| hit.depth_m))
    }

    #[inline]
    fn source_px(&self, rows: &[RowCamera], pixel: [u32; 2], uv: DVec2, depth_m: Option<f64>) -> DVec2 {
        let RowCamera { key_from_camera, shift_key_m, .. } = rows[self.line(pixel)];
        // Times the inverse depth, which is 0 for the sky.
        let shift = depth_m.map_or(DVec3::ZERO, |depth_m| shift_key_m / depth_m);
        self.plan.ideal.px_from_point(key_from_camera * uv.extend(1.0) + shift)
    }
}

/// A place of a packet without a ray.
const NO_RAY: PacketRay = PacketRay { origin_ned_m: DVec3::ZERO, direction_ned: DVec3::Z, limit: -1.0 };
/// Part of the path to a point that rounding may take for a surface in front of it.
const LAST_PART: f64 = 1e-6;
/// Relative difference of the depths that the two triangles of an edge give to a ray that hits it: rounding.
const ON_AN_EDGE: f64 = 1e-9;
