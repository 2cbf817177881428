//! Picture error by the one depth that a pixel of the ideal frame has where surfaces are blended.
//!
//! The ideal frame blends colours as its own camera sees them. A pixel of another row or instant looks where
//! the surface of its depth is, and there the other layers are not quite those that its own ray passes: they
//! are displaced by the parallax between them. What that costs is found by doing it: at each probe the light
//! of its own ray beside the light of the ideal camera's ray to the same point.

use camsim_core::{mount::CameraPath, shutter::Shutter};
use glam::DVec2;
use rayon::prelude::*;

use crate::{
    ir::{
        key_frame::{KeyFrame, nearest_first},
        margins,
        predicted::BlendedDepthError,
    },
    view::{lens_reach::LensReach, probes::Probe, surfaces::Surfaces},
};

/// Rays around each probe, over the part of the picture that it stands for: where panes are of one colour all
/// of the error is at their borders, which are few. Irrational steps, so that they are even over it.
const RAYS: u32 = 12;
const SPREAD: DVec2 = DVec2::new(0.754_877_666_246_693, 0.569_840_290_998_053);
/// Phases of the exposure that the probes take turns in.
const PHASES: [f64; 3] = [0.0, -0.5, 0.5];
/// Depth of the point that the ideal camera meets, relative, within which it is the same: beyond that it is
/// hidden, and counted as a hole.
const SAME_POINT: f64 = 1e-3;

/// A frame with blended surfaces.
pub(crate) struct BlendSearch<'a> {
    pub reach: &'a LensReach,
    pub surfaces: &'a Surfaces,
    pub path: &'a CameraPath,
    pub shutter: &'a Shutter,
    pub stamp_s: f64,
    /// The key frames, of which each row uses the nearest in time.
    pub keys: &'a [KeyFrame],
    /// Value of a pixel, of the linear range, for each unit of light that arrives.
    pub gain: &'a (dyn Fn([u32; 2]) -> f64 + Sync),
}

impl BlendSearch<'_> {
    /// The error over the picture; `None` where nothing in the scene is blended.
    pub fn error(&self) -> Option<BlendedDepthError> {
        if !self.surfaces.blends {
            return None;
        }
        let probes = &self.reach.probes;
        // Summed in their order: a plan does not depend on how threads share work.
        let rays = |(i, probe): (usize, &Probe)| -> [Option<f64>; RAYS as usize] {
            std::array::from_fn(|k| {
                self.square(i + k, probe, (f64::from(i as u32 * RAYS + k as u32) * SPREAD).fract() - 0.5)
            })
        };
        let squares: Vec<_> = probes.par_iter().enumerate().map(rays).collect();
        let squares = squares.as_flattened();
        let count = squares.len().max(1) as f64;
        let mixed = squares.iter().flatten();
        let fraction = mixed.clone().count() as f64 / count;
        Some(BlendedDepthError {
            fraction,
            error_dn: margins::BLENDED_DEPTH * 255.0 * (mixed.sum::<f64>() / count).sqrt(),
        })
    }

    /// Squared error at a position of a probe's part of the picture (-0.5 to 0.5), of the linear range, mean
    /// over the channels; `None` where light is of one surface.
    fn square(&self, i: usize, probe: &Probe, position: DVec2) -> Option<f64> {
        let phase = PHASES[i % PHASES.len()];
        let size_px = self.reach.camera.size_px;
        let offset_px = (self.reach.probe_px * position).round();
        let [x, y] = [(0, offset_px.x), (1, offset_px.y)].map(|(axis, offset): (usize, f64)| {
            (f64::from(probe.pixel[axis]) + offset).clamp(0.0, f64::from(size_px[axis] - 1)) as u32
        });
        let moved_px = DVec2::new(f64::from(x), f64::from(y)) - DVec2::from_array(probe.pixel.map(f64::from));
        let uv = probe.uv + probe.uv_from_px * moved_px;
        let mid_s = self.stamp_s + self.shutter.dt_pixel_s(x, y);
        let key_pose = nearest_first(self.keys, mid_s).first()?.pose;
        let pose = self.path.pose(mid_s + phase * self.shutter.exposure_pixel_s(x, y));
        let ray_ned = pose.ned_from_camera * uv.extend(1.0);
        let hit = self.surfaces.first_hit(pose.position_ned_m, ray_ned);
        let range_per_depth = uv.extend(1.0).length();
        let own = self.surfaces.light(pose.position_ned_m, ray_ned, hit.as_ref(), range_per_depth);
        // The point in the key camera, or the direction to what is infinitely far.
        let to_point_ned =
            hit.map_or(ray_ned, |hit| pose.position_ned_m + hit.depth_m * ray_ned - key_pose.position_ned_m);
        let in_key = key_pose.ned_from_camera.conjugate() * to_point_ned;
        let depth_m = in_key.z;
        let key_ray_ned = to_point_ned / depth_m;
        let key_hit = self.surfaces.first_hit(key_pose.position_ned_m, key_ray_ned);
        let key_light = self.surfaces.light(
            key_pose.position_ned_m,
            key_ray_ned,
            key_hit.as_ref(),
            (in_key / depth_m).length(),
        );
        if own.panes.is_empty() && key_light.panes.is_empty() {
            return None;
        }
        let is_same = match (hit, key_hit) {
            (Some(_), Some(key_hit)) => (key_hit.depth_m - depth_m).abs() <= SAME_POINT * depth_m,
            (None, None) => depth_m > 0.0,
            _ => false,
        };
        let square = (self.gain)([x, y]).powi(2) * (own.color - key_light.color).length_squared() / 3.0;
        Some(if is_same { square } else { 0.0 })
    }
}
