//! Whether anything is in front of a point.

use glam::DVec3;

use crate::view::surfaces::Surfaces;

/// Part of the path to a point within which a surface does not hide it, but is taken for the one that it lies
/// on. Corners of boards are rounded to 32 bits, and coordinates in tables to what their author wrote. At a
/// focal length of 1000 pixels it is a hundredth of a pixel's width at that distance.
const ON_SURFACE: f64 = 1e-5;

/// Whether at path time `t_s` a surface lies between a camera and a point, farther in front of it than [`ON_SURFACE`].
pub(super) fn is_hidden(surfaces: &Surfaces, t_s: f64, camera_ned_m: DVec3, point_ned_m: DVec3) -> bool {
    let ray = point_ned_m - camera_ned_m;
    let limit = 1.0 - ON_SURFACE;
    let by_ground =
        || surfaces.terrain().is_some_and(|terrain| terrain.intersect(camera_ned_m, ray, limit).is_some());
    surfaces.model_hit_at(t_s, camera_ned_m, ray, limit).is_some() || by_ground()
}
