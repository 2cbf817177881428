//! What the terrain's level of detail changes at a source.

use camsim_core::scene::{TerrainDetail, TerrainHit};
use glam::DVec3;

use super::{DryRun, ExactSource};
use crate::view::surfaces::SurfaceHit;

impl DryRun<'_> {
    /// What the level of detail changes at the true source: depth there, and so parallax.
    pub fn level_of_detail_px(&self, source: &ExactSource, detail: Option<&TerrainDetail<'_>>) -> f64 {
        let Some(SurfaceHit { depth_m, terrain: Some(hit), .. }) = source.key_hit else { return 0.0 };
        let drawn_m = self.drawn_depth_m(detail, &hit, self.key_ray(source.source_px));
        // w of the row's camera, as `reproject` finds it from the key's.
        let (direction, shift) = (source.direction, source.relative.1);
        let inverse = |depth_m: f64| direction.z / (depth_m - shift.z).max(1e-9);
        let moved = |w: f64| self.ideal.px_from_point(direction + w * shift);
        moved(inverse(drawn_m)).distance(moved(inverse(depth_m)))
    }

    /// Displacement of the terrain: how far the position of the terrain's picture that is drawn at the true
    /// source is from there, ideal pixels: to first order, and no more than is allowed.
    pub fn terrain_px(&self, source: &ExactSource, detail: &TerrainDetail<'_>) -> f64 {
        let Some(SurfaceHit { depth_m, terrain: Some(hit), .. }) = source.key_hit else { return 0.0 };
        let ray_ned = self.key_ray(source.source_px);
        let drawn_m = self.drawn_depth_m(Some(detail), &hit, ray_ned);
        // Down to the full surface.
        let down_m = (depth_m - drawn_m) * ray_ned.dot(hit.normal_ned) / hit.normal_ned.z;
        let in_key = self.key_pose.ned_from_camera.inverse() * (drawn_m * ray_ned + down_m * DVec3::Z);
        let px = self.ideal.px_from_point(in_key).distance(source.source_px);
        // A normal along the horizon gives no displacement.
        if px < detail.max_error_px() { px } else { detail.max_error_px() }
    }

    /// Depth of the terrain as drawn, along a ray of the key camera that meets the full one at `hit`.
    fn drawn_depth_m(&self, detail: Option<&TerrainDetail<'_>>, hit: &TerrainHit, ray_ned: DVec3) -> f64 {
        detail.map_or(hit.t, |detail| detail.drawn_t(hit, self.key_pose.position_ned_m, ray_ned))
    }
}
