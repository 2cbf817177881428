//! What the centre of a pixel sees, by a ray of its own in f64.
//!
//! Depth and coordinates of a pixel at a silhouette are those of one of two surfaces. The samples of an ideal
//! frame know the border between the two to a few hundredths of a pixel, and it does not show every surface;
//! a pixel that takes the wrong one is off by all of the parallax between them, and one in ten thousand such
//! pixels is more than all other errors together. A ray decides.

#[cfg(test)]
mod tests;

use std::sync::OnceLock;

use camsim_core::{
    mount::CameraPath,
    pose::CameraPose,
    scene::{
        TerrainTriangle,
        ray_packet::{PACKET_RAYS, PacketHit, PacketRay, RayPacket},
    },
    shutter::RowAxis,
};
use glam::{DMat3, DVec2, DVec3};

use crate::{
    ir::frame_plan::FramePlan,
    view::surfaces::{Among, SurfaceHit, Surfaces},
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
    /// A pixel of each line: of each row, or of each column in either field.
    lines: Vec<[u32; 2]>,
    /// Camera at mid-exposure of each line.
    mid: Vec<RowCamera>,
    /// Camera at the exposure phase of the coordinates; empty where that is mid-exposure.
    at_phase: Vec<RowCamera>,
    /// Cameras at the phases k / [`PHASES`] - 0.5 of each line, once they are asked for, and their velocities (NED)
    /// and angular rates (camera axes) at mid-exposure.
    at_phases: [OnceLock<Vec<RowCamera>>; PHASES + 1],
    movement: OnceLock<Vec<[DVec3; 2]>>,
}

/// Equal parts of an exposure at whose ends cameras are kept.
pub const PHASES: usize = 16;

impl<'a> FrameRays<'a> {
    /// Rays whose coordinates are of exposure phase `phase`, -0.5 to 0.5.
    pub(crate) fn new(path: &'a CameraPath, surfaces: &'a Surfaces, plan: &'a FramePlan, phase: f64) -> Self {
        let [columns, rows] = plan.camera.size_px;
        let lines = match plan.shutter.row_axis() {
            RowAxis::Rows => (0..rows).map(|y| [0, y]).collect(),
            RowAxis::Columns => (0..columns).flat_map(|x| [[x, 0], [x, 1]]).collect(),
        };
        let mut rays = Self {
            path,
            surfaces,
            plan,
            lines,
            mid: Vec::new(),
            at_phase: Vec::new(),
            at_phases: Default::default(),
            movement: OnceLock::new(),
        };
        rays.mid = rays.cameras(0.0);
        if phase * plan.shutter.exposure_s() != 0.0 {
            rays.at_phase = rays.cameras(phase);
        }
        rays
    }

    /// Camera of each line at an exposure phase.
    fn cameras(&self, phase: f64) -> Vec<RowCamera> {
        let camera = |&line: &[u32; 2]| {
            let t_s = self.time_s(line, phase);
            RowCamera::new(t_s, self.path.pose(t_s), &self.plan.key_pose)
        };
        self.lines.iter().map(camera).collect()
    }

    fn time_s(&self, [x, y]: [u32; 2], phase: f64) -> f64 {
        let FramePlan { shutter, stamp_s, .. } = self.plan;
        stamp_s + shutter.dt_pixel_s(x, y) + phase * shutter.exposure_pixel_s(x, y)
    }

    /// What the ray `uv` of a pixel meets.
    #[must_use]
    pub fn cast(&self, pixel: [u32; 2], uv: DVec2) -> PixelTruth {
        let hit = self.first_hit(&self.mid, pixel, uv);
        let (rows, of_source) = match self.at_phase.is_empty() {
            true => (&self.mid, hit),
            false => (&self.at_phase, self.first_hit(&self.at_phase, pixel, uv)),
        };
        let source_px = self.source_px(rows, pixel, uv, of_source.map(|hit| hit.t));
        self.truth(pixel, uv, hit, source_px)
    }

    fn first_hit(&self, rows: &[RowCamera], pixel: [u32; 2], uv: DVec2) -> Option<PacketHit> {
        let (RowCamera { t_s, pose, .. }, ray_ned) = self.ray(rows, pixel, uv);
        let hit = self.surfaces.first_hit_at(*t_s, pose.position_ned_m, ray_ned);
        hit.map(|hit| self.packet_hit(&hit))
    }

    fn packet_hit(&self, hit: &SurfaceHit) -> PacketHit {
        let SurfaceHit { depth_m, normal_ned, surface, terrain, .. } = *hit;
        let triangle = self.surfaces.terrain().zip(terrain).map(|(terrain, hit)| hit.triangle_of(terrain));
        PacketHit { t: depth_m, normal_ned, surface: surface as u32, triangle }
    }

    /// What the rays of pixels near each other meet, as [`Self::cast`] for each; `found` gets their places among
    /// the pixels. `packet` is scratch.
    pub fn cast_packet(
        &self,
        packet: &mut RayPacket,
        pixels: &[Option<([u32; 2], DVec2)>; PACKET_RAYS],
        mut found: impl FnMut(usize, PixelTruth),
    ) {
        let hits_of = |rows: &[RowCamera], packet: &mut RayPacket| {
            let mut rays = [PacketRay::NONE; PACKET_RAYS];
            for (ray, pixel) in rays.iter_mut().zip(pixels) {
                let Some((pixel, uv)) = *pixel else { continue };
                let (RowCamera { t_s, pose, .. }, direction_ned) = self.ray(rows, pixel, uv);
                let limit = f64::INFINITY;
                *ray = PacketRay { t_s: *t_s, origin_ned_m: pose.position_ned_m, direction_ned, limit };
            }
            self.first_hits(packet, &rays, Among::All)
        };
        let hits = hits_of(&self.mid, packet);
        let at_phase = (!self.at_phase.is_empty()).then(|| hits_of(&self.at_phase, packet));
        let (rows, of_source) = at_phase.as_ref().map_or((&self.mid, &hits), |hits| (&self.at_phase, hits));
        for (i, hit) in hits.iter().enumerate() {
            let Some((pixel, uv)) = pixels[i] else { continue };
            let source_px = self.source_px(rows, pixel, uv, of_source[i].map(|hit| hit.t));
            found(i, self.truth(pixel, uv, *hit, source_px));
        }
    }

    /// What rays near each other meet first among some of the surfaces. `packet` is scratch.
    pub fn first_hits(
        &self,
        packet: &mut RayPacket,
        rays: &[PacketRay; PACKET_RAYS],
        among: Among,
    ) -> [Option<PacketHit>; PACKET_RAYS] {
        let mut hits = [None; PACKET_RAYS];
        let is_packet = packet.begin(rays);
        if is_packet {
            self.surfaces.meet_still(packet, among);
        }
        for (i, ray) in rays.iter().enumerate().filter(|(_, ray)| ray.is_there()) {
            if !is_packet {
                hits[i] = self.surfaces.first_hit_among(among, *ray).map(|hit| self.packet_hit(&hit));
                continue;
            }
            hits[i] = packet.hit(i);
            if self.surfaces.moves() && among != Among::Ground {
                let PacketRay { t_s, origin_ned_m, direction_ned, limit } = *ray;
                let limit = hits[i].map_or(limit, |hit| hit.t);
                let moving = self.surfaces.moving_hit_at(t_s, origin_ned_m, direction_ned, limit);
                hits[i] = moving.map(|hit| self.packet_hit(&hit)).or(hits[i]);
            }
        }
        hits
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
    pub fn camera_at(&self, pixel: [u32; 2], phase: f64) -> (f64, CameraPose) {
        let part = (phase + 0.5) * PHASES as f64;
        let kept = (part.fract() == 0.0).then(|| self.at_phases.get(part as usize)).flatten();
        if let Some(kept) = kept {
            let RowCamera { t_s, pose, .. } = kept.get_or_init(|| self.cameras(phase))[self.line(pixel)];
            return (t_s, pose);
        }
        let t_s = self.time_s(pixel, phase);
        (t_s, self.path.pose(t_s))
    }

    /// Velocity (NED, m/s) and angular rate (camera axes, rad/s) of a pixel's camera at mid-exposure.
    #[must_use]
    pub fn camera_movement(&self, pixel: [u32; 2]) -> [DVec3; 2] {
        let of_line =
            |camera: &RowCamera| [self.path.velocity_ned(camera.t_s), self.path.rate_camera(camera.t_s)];
        self.movement.get_or_init(|| self.mid.iter().map(of_line).collect())[self.line(pixel)]
    }

    /// Mid-exposure of a pixel, path time, seconds.
    #[must_use]
    #[inline]
    pub fn mid_s(&self, pixel: [u32; 2]) -> f64 {
        self.ray(&self.mid, pixel, DVec2::ZERO).0.t_s
    }

    /// Whether a ray meets a surface, or a model.
    #[must_use]
    pub fn is_hidden(&self, ray: &PacketRay, among: Among) -> bool {
        self.surfaces.first_hit_among(among, *ray).is_some()
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
    fn truth(&self, pixel: [u32; 2], uv: DVec2, hit: Option<PacketHit>, source_px: DVec2) -> PixelTruth {
        let (RowCamera { pose, .. }, ray_ned) = self.ray(&self.mid, pixel, uv);
        let hit = hit.map(|PacketHit { t, normal_ned, surface, triangle }| PixelHit {
            point_ned_m: pose.position_ned_m + t * ray_ned,
            depth_m: t,
            normal_ned: if normal_ned.dot(ray_ned) > 0.0 { -normal_ned } else { normal_ned },
            surface,
            triangle,
        });
        PixelTruth { source_px, hit }
    }

    #[inline]
    fn source_px(&self, rows: &[RowCamera], pixel: [u32; 2], uv: DVec2, depth_m: Option<f64>) -> DVec2 {
        let RowCamera { key_from_camera, shift_key_m, .. } = rows[self.line(pixel)];
        // Times the inverse depth, which is 0 for the sky.
        let shift = depth_m.map_or(DVec3::ZERO, |depth_m| shift_key_m / depth_m);
        self.plan.ideal.px_from_point(key_from_camera * uv.extend(1.0) + shift)
    }
}

/// Relative difference of the depths that the two triangles of an edge give to a ray that hits it: rounding.
const ON_AN_EDGE: f64 = 1e-9;
