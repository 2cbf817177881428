//! The plane that is nearest to what a camera sees.

use camsim_core::pose::CameraPose;
use glam::{DMat3, DVec2, DVec3};

use crate::ir::seen_plane::SeenPlane;

/// The plane of the least squared difference of inverse planar depths (1/m), seen along (u, v, 1). The
/// sky is not to be among them: beyond the horizon a plane has none either. Infinitely far where they do
/// not determine one.
pub(crate) fn fit(camera: CameraPose, seen: impl Iterator<Item = (DVec2, f64)>) -> SeenPlane {
    let (mut squares, mut sum) = (DMat3::ZERO, DVec3::ZERO);
    for (uv, inverse_depth) in seen {
        let ray = uv.extend(1.0);
        squares += DMat3::from_cols(ray * ray.x, ray * ray.y, ray * ray.z);
        sum += ray * inverse_depth;
    }
    let normal_per_m = squares.inverse() * sum;
    SeenPlane { camera, normal_per_m: if normal_per_m.is_finite() { normal_per_m } else { DVec3::ZERO } }
}

#[cfg(test)]
mod tests {
    use glam::DQuat;

    use super::*;

    fn rays() -> impl Iterator<Item = DVec2> {
        (0..30).map(|i| DVec2::new(f64::from(i % 6) * 0.2 - 0.5, f64::from(i / 6) * 0.2 - 0.4))
    }

    #[test]
    fn a_fitted_plane_is_the_same_from_elsewhere() {
        let camera = CameraPose {
            position_ned_m: DVec3::new(3e4, -2e4, -900.0),
            ned_from_camera: DQuat::from_rotation_x(0.3),
        };
        let normal = DVec3::new(2e-4, -3e-4, 1e-3);
        let plane = fit(camera, rays().map(|uv| (uv, normal.dot(uv.extend(1.0)))));
        assert!((plane.normal_per_m - normal).length() < 1e-15, "{plane:?}");
        let other = CameraPose {
            position_ned_m: camera.position_ned_m + DVec3::new(40.0, 7.0, -20.0),
            ned_from_camera: DQuat::from_rotation_y(0.5),
        };
        let elsewhere = plane.seen_from(&other);
        let (rotation, shift) = other.relative_to(&camera);
        for uv in rays() {
            let there = uv.extend(1.0) / elsewhere.dot(uv.extend(1.0));
            assert!((normal.dot(rotation * there + shift) - 1.0).abs() < 1e-12, "{uv}");
        }
    }

    #[test]
    fn an_undetermined_plane_is_infinitely_far() {
        let camera = CameraPose { position_ned_m: DVec3::ZERO, ned_from_camera: DQuat::IDENTITY };
        assert_eq!(fit(camera, std::iter::empty()).normal_per_m, DVec3::ZERO);
        assert_eq!(fit(camera, [(DVec2::ZERO, 1.0)].into_iter()).normal_per_m, DVec3::ZERO);
        let wall = SeenPlane { camera, normal_per_m: DVec3::new(0.0, 0.0, 0.1) };
        let behind = CameraPose { position_ned_m: DVec3::new(0.0, 0.0, 11.0), ..camera };
        assert_eq!(wall.seen_from(&behind), DVec3::ZERO);
    }
}
