//! Size and position of the ideal frame: a bound on the sources that the output frame needs.

use camsim_core::{
    camera::CameraModel,
    mount::CameraPath,
    shutter::Shutter,
    temporal::{IdealGeometry, displacement::Twist},
};
use glam::DVec2;

use super::{constant_twist::displaced, lens_reach::LensReach, motion::travel_m, surfaces::Surfaces};
use crate::ir::{
    key_frame::{KeyFrame, nearest_first},
    margins,
    plan_error::PlanError,
    stages::TemporalStage,
};

/// Directions that an ideal frame holds, tangents in its own camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TangentBounds {
    low: DVec2,
    high: DVec2,
}

impl TangentBounds {
    /// All of both.
    pub fn and(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// Its pixels. `scale` is that of its focal length to the camera's.
    pub fn pixels(self, camera: &CameraModel, scale: f64) -> IdealGeometry {
        let focal_px = camera.central_focal_px() * scale;
        // Whole pixels from the camera's own principal point: without lens and motion the two frames' pixels
        // fall together.
        let principal_px = camera.principal_point_px;
        let first_px = (self.low * focal_px + principal_px).floor() - margins::IDEAL_RIM_PX;
        let last_px = (self.high * focal_px + principal_px).ceil() + margins::IDEAL_RIM_PX;
        let size = last_px - first_px + 1.0;
        let side = |length: f64| {
            if length.is_finite() { length.clamp(2.0, f64::from(u32::MAX / 2)) as u32 } else { u32::MAX / 2 }
        };
        IdealGeometry {
            size_px: [side(size.x), side(size.y)],
            focal_px,
            principal_px: principal_px - first_px,
        }
    }
}

/// What an ideal frame must show to hold every source of the frame: each kept ray at its own row's instants
/// (start, middle and end of the exposure), at infinity and at the nearest depth in view, in the two keys
/// that are nearest in time. A solver of `constant_twist` also looks where the point is not: there too,
/// and at the ray's own position, where it reads the depth.
pub(crate) fn ideal_extent(
    reach: &LensReach,
    path: &CameraPath,
    shutter: &Shutter,
    stamp_s: f64,
    key_s: f64,
    keys: &[KeyFrame],
    surfaces: &Surfaces,
    constant_twist: Option<(TemporalStage, Twist)>,
) -> TangentBounds {
    let key = path.pose(key_s);
    let (first, last) = shutter.window_s();
    let travel_m = travel_m(path, [stamp_s + first, stamp_s + last], key_s);
    let slant = reach.slant();
    let tangents = still_tangents(reach, slant);
    let inverse_near = 1.0 / surfaces.nearest_m(&key, tangents, travel_m);
    let mut extent =
        TangentBounds { low: DVec2::splat(f64::INFINITY), high: DVec2::splat(f64::NEG_INFINITY) };
    let last_row = reach.camera.size_px[1] - 1;
    // The grid of the reach steps over rows of one parity: a neighbour stands for the other field.
    let in_fields = reach.rays.iter().flat_map(|&(uv, [x, y])| {
        let other = if shutter.interlace_s() > 0.0 { Some((y ^ 1).min(last_row)) } else { None };
        std::iter::once(y).chain(other).map(move |y| (uv, [x, y]))
    });
    for (uv, [x, y]) in in_fields {
        let mid_s = stamp_s + shutter.dt_pixel_s(x, y);
        let exposure_s = shutter.exposure_pixel_s(x, y);
        let mut include = |tangent: DVec2| extent = extent.and(TangentBounds { low: tangent, high: tangent });
        for phase in [-0.5, 0.0, 0.5] {
            let t_s = mid_s + phase * exposure_s;
            let pose = path.pose(t_s);
            for w in [0.0, inverse_near] {
                for key in nearest_first(keys, mid_s).into_iter().take(2) {
                    let (rotation, shift) = pose.relative_to(&key.pose);
                    let in_key = rotation * uv.extend(1.0) + w * shift;
                    if in_key.z > 0.02 {
                        include(in_key.truncate() / in_key.z);
                    }
                }
                if let Some(tangent) =
                    constant_twist.and_then(|(stage, twist)| displaced(stage, uv, w, &twist, t_s - key_s))
                {
                    include(tangent);
                    include(uv);
                }
            }
        }
    }
    extent
}

/// View of the camera were it still, with a tenth to spare.
fn still_tangents(reach: &LensReach, slant: f64) -> [f64; 4] {
    let mut tangents = [f64::INFINITY, f64::NEG_INFINITY, f64::INFINITY, f64::NEG_INFINITY];
    for (uv, _) in &reach.rays {
        tangents =
            [tangents[0].min(uv.x), tangents[1].max(uv.x), tangents[2].min(uv.y), tangents[3].max(uv.y)];
    }
    let spare = margins::STILL_VIEW * slant;
    [tangents[0] - spare, tangents[1] + spare, tangents[2] - spare, tangents[3] + spare]
}

/// Refuses an ideal frame that no renderer could hold.
pub(crate) fn check_size(
    frame: u64,
    size_px: [u32; 2],
    max_side_px: u32,
    max_ideal_px: u64,
) -> Result<(), PlanError> {
    let [width, height] = size_px.map(u64::from);
    if width.max(height) > u64::from(max_side_px) {
        return Err(PlanError::IdealTooLarge { frame, width, height, limit: max_side_px });
    }
    if width * height > max_ideal_px {
        return Err(PlanError::IdealOfTooManyPixels { frame, width, height });
    }
    Ok(())
}
