//! What it costs that a pixel of the ideal frame has one depth where light of several surfaces is mixed.
//!
//! The ideal frame mixes colours as its own camera sees them. A pixel of another line or instant looks where
//! the surface of its depth is, and there the other layers are not quite those that its own ray passes: they
//! are displaced by the parallax between them. What that costs is found by doing it: at each probe the light
//! of its own ray beside the light of the ideal camera's ray to the same point.

use glam::DVec2;
use rayon::prelude::*;
use serde::Serialize;

use super::{KeyFrame, LensReach, keys::nearest_first, probes::Probe, surfaces::Surfaces};
use camsim_core::{mount::CameraPath, shutter::Shutter};

/// Times what is expected: of a few thousand rays few may pass near a pane's border.
const SAFETY: f64 = 1.2;
/// Rays around each probe, over the part of the picture that it stands for: where panes are of one colour all
/// of the error is at their borders, which are few. Irrational steps, so that they are even over it.
const LOOKS: u32 = 12;
const SPREAD: DVec2 = DVec2::new(0.754_877_666_246_693, 0.569_840_290_998_053);
/// Phases of the exposure that the probes take turns in.
const PHASES: [f64; 3] = [0.0, -0.5, 0.5];
/// Depth of the point that the ideal camera meets, relative, within which it is the same: beyond that it is
/// hidden, and counted as a hole.
const SAME_POINT: f64 = 1e-3;

/// Light that is mixed, and what its one depth costs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Layers {
    /// Share of the pixels in which it is.
    pub share: f64,
    /// RMS error over the picture, 1/255 of the linear range.
    pub error_dn: f64,
}

/// A frame in which it is looked for.
pub(super) struct Search<'a> {
    pub reach: &'a LensReach,
    pub surfaces: &'a Surfaces,
    pub path: &'a CameraPath,
    pub shutter: &'a Shutter,
    pub stamp_s: f64,
    /// The ideal frames, of which each line looks into the nearest in time.
    pub keys: &'a [KeyFrame],
    /// Of the linear range for a pixel, for each unit of light that arrives.
    pub gain: &'a (dyn Fn([u32; 2]) -> f64 + Sync),
}

impl Search<'_> {
    /// `None` where nothing in the scene is mixed.
    pub fn layers(&self) -> Option<Layers> {
        if !self.surfaces.blends() {
            return None;
        }
        let probes = &self.reach.probes;
        // Summed in their order: a plan does not depend on how threads share work.
        let looks = |(i, probe): (usize, &Probe)| -> [Option<f64>; LOOKS as usize] {
            std::array::from_fn(|k| {
                self.square(i + k, probe, (f64::from(i as u32 * LOOKS + k as u32) * SPREAD).fract() - 0.5)
            })
        };
        let squares: Vec<_> = probes.par_iter().enumerate().map(looks).collect();
        let squares = squares.as_flattened();
        let count = squares.len().max(1) as f64;
        let mixed = squares.iter().flatten();
        let share = mixed.clone().count() as f64 / count;
        Some(Layers { share, error_dn: SAFETY * 255.0 * (mixed.sum::<f64>() / count).sqrt() })
    }

    /// Squared error at a place of a probe's part of the picture (-0.5 to 0.5), of the linear range, mean
    /// over the channels; `None` where light is of one surface.
    fn square(&self, i: usize, probe: &Probe, place: DVec2) -> Option<f64> {
        let phase = PHASES[i % PHASES.len()];
        let size_px = self.reach.camera.size_px;
        let offset_px = (self.reach.probe_px * place).round();
        let [x, y] = [(0, offset_px.x), (1, offset_px.y)].map(|(axis, offset): (usize, f64)| {
            (f64::from(probe.pixel[axis]) + offset).clamp(0.0, f64::from(size_px[axis] - 1)) as u32
        });
        let moved_px = DVec2::new(f64::from(x), f64::from(y)) - DVec2::from_array(probe.pixel.map(f64::from));
        let uv = probe.uv + probe.uv_from_px * moved_px;
        let mid_s = self.stamp_s + self.shutter.dt_pixel_s(x, y);
        let key_pose = nearest_first(self.keys, mid_s).first()?.pose;
        let pose = self.path.pose(mid_s + phase * self.shutter.exposure_s());
        let way_ned = pose.ned_from_camera * uv.extend(1.0);
        let met = self.surfaces.meet(pose.position_ned_m, way_ned);
        let range_per_depth = uv.extend(1.0).length();
        let own = self.surfaces.light(pose.position_ned_m, way_ned, met.as_ref(), range_per_depth);
        // The point in the key camera, or the direction to what is infinitely far.
        let to_point_ned =
            met.map_or(way_ned, |met| pose.position_ned_m + met.depth_m * way_ned - key_pose.position_ned_m);
        let in_key = key_pose.ned_from_camera.conjugate() * to_point_ned;
        let depth_m = in_key.z;
        let key_way_ned = to_point_ned / depth_m;
        let found = self.surfaces.meet(key_pose.position_ned_m, key_way_ned);
        let seen = self.surfaces.light(
            key_pose.position_ned_m,
            key_way_ned,
            found.as_ref(),
            (in_key / depth_m).length(),
        );
        if own.panes.is_empty() && seen.panes.is_empty() {
            return None;
        }
        let is_same = match (met, found) {
            (Some(_), Some(found)) => (found.depth_m - depth_m).abs() <= SAME_POINT * depth_m,
            (None, None) => depth_m > 0.0,
            _ => false,
        };
        let square = (self.gain)([x, y]).powi(2) * (own.color - seen.color).length_squared() / 3.0;
        Some(if is_same { square } else { 0.0 })
    }
}
