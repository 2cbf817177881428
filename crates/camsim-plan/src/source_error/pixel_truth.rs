//! What the centre of a pixel sees, by a ray of its own in f64.
//!
//! Depth and coordinates of a pixel at a silhouette are those of one of two surfaces. The samples of an ideal
//! frame know the border between the two to a few hundredths of a pixel, and it does not show every surface;
//! a pixel that takes the wrong one is off by all of the parallax between them, and one in ten thousand such
//! pixels is more than all other errors together. A ray decides.

#[cfg(test)]
mod tests;

use camsim_core::{mount::CameraPath, pose::CameraPose};
use glam::{DVec2, DVec3};

use crate::{ir::frame_plan::FramePlan, view::surfaces::Surfaces};

/// What the centre of a pixel sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelTruth {
    /// Source in the mid-window ideal frame, pixels, at the given exposure phase. It may lie beyond the
    /// frame's border, and behind that camera it is mirrored.
    pub source_px: DVec2,
    /// Point (NED, metres) and planar depth in the row's own camera (metres) at mid-exposure; `None` is sky.
    pub hit: Option<(DVec3, f64)>,
}

/// What the ray `uv` of a pixel meets, each at its own instant: source at exposure phase `phase` (-0.5 to
/// 0.5), point and depth at mid-exposure. The terrain is met at full detail, which what was drawn is within
/// [`FramePlan::terrain_error_px`] of.
pub(crate) fn pixel_truth(
    path: &CameraPath,
    surfaces: &Surfaces,
    plan: &FramePlan,
    [x, y]: [u32; 2],
    uv: DVec2,
    phase: f64,
) -> PixelTruth {
    let mid_s = plan.stamp_s + plan.shutter.dt_pixel_s(x, y);
    let cast = |t_s: f64| {
        let pose = path.pose(t_s);
        let ray_ned = pose.ned_from_camera * uv.extend(1.0);
        let depth_m = surfaces.first_hit(pose.position_ned_m, ray_ned).map(|hit| hit.depth_m);
        (pose, ray_ned, depth_m)
    };
    let source_px = |(pose, ray_ned, depth_m): (CameraPose, DVec3, Option<f64>)| {
        // Times the inverse depth, which is 0 for the sky.
        let shift_ned_m = pose.position_ned_m - plan.key_pose.position_ned_m;
        let point = ray_ned + depth_m.map_or(DVec3::ZERO, |depth_m| shift_ned_m / depth_m);
        plan.ideal.px_from_point(plan.key_pose.ned_from_camera.conjugate() * point)
    };
    let mid = cast(mid_s);
    let (pose, ray_ned, depth_m) = mid;
    let exposure_s = plan.shutter.exposure_s();
    PixelTruth {
        source_px: source_px(if phase * exposure_s == 0.0 { mid } else { cast(mid_s + phase * exposure_s) }),
        hit: depth_m.map(|depth_m| (pose.position_ned_m + depth_m * ray_ned, depth_m)),
    }
}
