//! View frustum of the camera: border of its field of view, angles, footprint.

use std::sync::{Arc, Weak};

use camsim_core::{camera::CameraModel, pose::CameraPose, sequence::Sequence};
use eframe::egui::{Id, Ui};
use glam::{DVec2, DVec3};

use crate::{
    motion,
    panes::map::{self, footprint::outermost},
    state::State,
};

/// Rays along each side of the picture.
const RAYS_PER_SIDE: u32 = 10;
/// Range of the frustum's length, in radii of the scene; within it the length is the distance to the ground
/// in the middle.
const LENGTH_RANGE: [f64; 2] = [0.06, 0.45];

/// Length of a ray at the border in units of the frustum's length, at most.
const MAX_RAY_LENGTH: f64 = 2.5;

/// View frustum of a frame.
#[derive(Clone, Debug)]
pub struct ViewFrustum {
    /// Ends of the rays around the picture, NED metres, from the upper left corner; a quarter for each side.
    pub rim: Vec<DVec3>,
    /// Footprint, NED.
    pub ground: Arc<Vec<Vec<DVec3>>>,
    /// Horizontal, vertical and diagonal field of view, degrees.
    pub fov_deg: [f64; 3],
}

impl ViewFrustum {
    /// The cached frustum, or a new one for another frame; `None` for a camera without rays.
    pub fn cached(
        ui: &Ui,
        state: &State,
        sequence: &Arc<Sequence>,
        pose: &CameraPose,
        radius_m: f64,
    ) -> Option<Self> {
        type FrustumCache = (Weak<Sequence>, u64, Option<u64>, Option<ViewFrustum>);
        let frame = state.timeline.frame;
        // A zoom lens has the calibration of the shown frame.
        let picture = state.engine.picture().filter(|picture| picture.plan.frame == frame);
        let zoom = picture.and_then(|picture| picture.plan.zoom);
        let id = Id::unique("view frustum");
        let cache = ui.data(|data| data.get_temp::<FrustumCache>(id));
        let is_same = |cache: &FrustumCache| {
            std::ptr::eq(cache.0.as_ptr(), Arc::as_ptr(sequence))
                && cache.1 == frame
                && cache.2 == zoom.map(f64::to_bits)
        };
        if let Some((.., frustum)) = cache.filter(is_same) {
            return frustum;
        }
        let spec = &sequence.scenario.camera;
        let camera = zoom.map_or_else(
            || motion::camera_model(spec),
            |zoom| CameraModel::at_zoom(spec, zoom).ok().map(Arc::new),
        );
        let frustum = camera.map(|camera| {
            let ground = map::cached_footprint(ui, sequence, frame, &camera, pose);
            let middle = outermost(&camera, DVec2::ZERO, Some).unwrap_or_default();
            let axis_ned = pose.ned_from_camera * middle.extend(1.0).normalize();
            let hit = map::footprint::ground(&sequence.scene, pose, axis_ned);
            let ground_m = hit.map_or(f64::INFINITY, |hit| hit.distance(pose.position_ned_m));
            let length_m = ground_m.clamp(LENGTH_RANGE[0] * radius_m, LENGTH_RANGE[1] * radius_m);
            // Rays end in a plane across the optical axis; oblique ones are cut off.
            let ray_end = |uv: DVec2| uv.extend(1.0).clamp_length_max(MAX_RAY_LENGTH) * length_m;
            let rim = border_rays(&camera)
                .into_iter()
                .map(|uv| pose.position_ned_m + pose.ned_from_camera * ray_end(uv));
            Self { rim: rim.collect(), ground, fov_deg: fov_deg(&camera) }
        });
        ui.data_mut(|data| {
            data.insert_temp::<FrustumCache>(
                id,
                (Arc::downgrade(sequence), frame, zoom.map(f64::to_bits), frustum.clone()),
            )
        });
        frustum
    }
}

/// Outermost rays towards points along the picture's border, clockwise from the upper left corner.
fn border_rays(camera: &CameraModel) -> Vec<DVec2> {
    let half = DVec2::new(f64::from(camera.size_px[0].max(2) - 1), f64::from(camera.size_px[1].max(2) - 1));
    let corners =
        [DVec2::new(-1.0, -1.0), DVec2::new(1.0, -1.0), DVec2::new(1.0, 1.0), DVec2::new(-1.0, 1.0)];
    let along = (0..4 * RAYS_PER_SIDE).map(|k| {
        let (side, step) =
            ((k / RAYS_PER_SIDE) as usize, f64::from(k % RAYS_PER_SIDE) / f64::from(RAYS_PER_SIDE));
        half * corners[side].lerp(corners[(side + 1) % 4], step)
    });
    along.filter_map(|direction| outermost(camera, direction, Some)).collect()
}

/// Horizontal, vertical and diagonal angles between opposite outermost rays, degrees.
fn fov_deg(camera: &CameraModel) -> [f64; 3] {
    let [width, height] = camera.size_px.map(f64::from);
    let ray = |direction: DVec2| outermost(camera, direction, Some).map(|uv| uv.extend(1.0));
    let between = |direction: DVec2| match (ray(direction), ray(-direction)) {
        (Some(a), Some(b)) => a.angle_between(b).to_degrees(),
        _ => f64::NAN,
    };
    [DVec2::X, DVec2::Y, DVec2::new(width - 1.0, height - 1.0)].map(between)
}

#[cfg(test)]
mod tests {
    use camsim_core::scenario::LensModel;

    use super::*;

    fn camera(coefficients: &[f64]) -> CameraModel {
        CameraModel::new(
            [201, 101],
            [100.0, 100.0],
            Some([100.0, 50.0]),
            LensModel::BrownConrady,
            coefficients,
        )
        .expect("a camera")
    }

    #[test]
    fn pinhole_field_of_view_follows_from_the_focal_length() {
        // 100, 50 and sqrt(100^2 + 50^2) px from the middle to the border.
        let expected = [100.0, 50.0, 111.803_398_875].map(|px: f64| 2.0 * (px / 100.0).atan().to_degrees());
        for (angle_deg, expected) in fov_deg(&camera(&[])).into_iter().zip(expected) {
            assert!((angle_deg - expected).abs() < 1e-6, "{angle_deg} {expected}");
        }
        let rim = border_rays(&camera(&[]));
        assert_eq!(rim.len(), 4 * RAYS_PER_SIDE as usize);
        let corners = [[-1.0, -0.5], [1.0, -0.5], [1.0, 0.5], [-1.0, 0.5]];
        for (side, corner) in corners.into_iter().enumerate() {
            assert!(
                (rim[side * RAYS_PER_SIDE as usize] - DVec2::from_array(corner)).length() < 1e-9,
                "{side}: {rim:?}"
            );
        }
    }

    #[test]
    fn field_of_view_ends_at_the_fold_of_the_lens() {
        // r (1 - r^2 / 4) grows up to r = sqrt(4 / 3), 77 px of the 100 to the left border.
        let [across, down, _] = fov_deg(&camera(&[-0.25, 0.0, 0.0, 0.0]));
        let fold_deg = 2.0 * (4.0_f64 / 3.0).sqrt().atan().to_degrees();
        assert!(across > 0.9 * fold_deg && across <= fold_deg + 1e-6, "{across} of {fold_deg}");
        assert!(down > 53.13 && down < fold_deg, "wider than the pinhole's 53.13: {down}");
    }
}
