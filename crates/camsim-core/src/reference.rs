//! The oracle: every ray cast in f64 at its own instant from the trajectory into the scene. Slow, exact, and independent.
//!
//! It shares with the renderer and its twins the scenario, the trajectory (with the mount) and the lens's forward model, and nothing else:
//! line times, lens inverse, ray casting and integration are its own.

use std::sync::Arc;

use glam::{DVec2, DVec3};

use crate::{
    camera::{CameraError, CameraModel},
    pose::CameraPose,
    sequence::Sequence,
};

mod measure;

pub use measure::{CoordErrors, ErrorStats, coord_errors};

/// The reference renderer of one sequence.
#[derive(Debug)]
pub struct Oracle {
    sequence: Arc<Sequence>,
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
    /// 0 = terrain, 1 + i = mesh i of the scene.
    pub surface: u32,
}

impl Oracle {
    /// Prepares for looks into `sequence`.
    ///
    /// # Errors
    /// A camera that cannot be used.
    pub fn new(sequence: Arc<Sequence>) -> Result<Self, CameraError> {
        CameraModel::from_spec(&sequence.scenario.camera)?;
        Ok(Self { sequence })
    }

    /// The sequence.
    #[must_use]
    pub fn sequence(&self) -> &Arc<Sequence> {
        &self.sequence
    }

    /// The place `pixel + offset_px` (offset within -0.5..=0.5) of a frame at exposure phase `phase` in [-0.5, 0.5]; the whole pixel has the
    /// time of its line. `None` where the lens has no ideal ray.
    #[must_use]
    pub fn look(&self, frame: u64, pixel: [u32; 2], offset_px: DVec2, phase: f64) -> Option<Look> {
        let camera = &self.sequence.scenario.camera;
        let model = CameraModel::from_spec(camera).ok()?;
        let shutter = crate::shutter::Shutter::from_spec(&camera.shutter, camera.fps, camera.size_px).ok()?;
        let stamp_s = self.sequence.start_s + (frame as f64 + camera.phase) / camera.fps;
        let t_s = stamp_s + shutter.dt_pixel_s(pixel[0], pixel[1]) + phase * shutter.exposure_s();
        let uv = model.unproject(DVec2::new(f64::from(pixel[0]), f64::from(pixel[1])) + offset_px)?;
        let pose = self.sequence.path.pose(t_s);
        Some(Look { t_s, pose, uv, hit: self.cast(pose.position_ned_m, pose.ned_from_camera * uv.extend(1.0)) })
    }

    /// First surface along `origin + t direction`, t > 0; [`Hit::depth_m`] is t, which is planar depth for a direction with z = 1 in the camera.
    #[must_use]
    pub fn cast(&self, origin_ned_m: DVec3, direction_ned: DVec3) -> Option<Hit> {
        let scene = &self.sequence.scene;
        let mut best: Option<Hit> = None;
        let mut meet = |t: f64, texture_uv: [f64; 2], surface: u32| {
            best = Some(Hit { point_ned_m: origin_ned_m + t * direction_ned, depth_m: t, texture_uv, surface });
            t
        };
        let mut nearest = f64::INFINITY;
        if let Some(hit) = scene.terrain.as_ref().and_then(|terrain| terrain.intersect(origin_ned_m, direction_ned, nearest)) {
            nearest = meet(hit.t, hit.uv, 0);
        }
        for (i, mesh) in scene.meshes.iter().enumerate() {
            if let Some((t, uv)) = mesh.intersect(origin_ned_m, direction_ned, nearest) {
                nearest = meet(t, uv, 1 + i as u32);
            }
        }
        best
    }
}
