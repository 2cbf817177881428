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
            let middle = outermost(&camera, DVec2::ZERO, Some).unwrap_or(DVec3::Z);
            let axis_ned = pose.ned_from_camera * middle;
            let hit = map::footprint::ground(&sequence.scene, pose, axis_ned);
            let ground_m = hit.map_or(f64::INFINITY, |hit| hit.distance(pose.position_ned_m));
            let length_m = ground_m.clamp(LENGTH_RANGE[0] * radius_m, LENGTH_RANGE[1] * radius_m);
            // Rays end in a plane across the optical axis; oblique ones are cut off.
            let ray_end = |ray: DVec3| ray / ray.z.max(1.0 / MAX_RAY_LENGTH) * length_m;
            let rim = border_rays(&camera)
                .into_iter()
                .map(|ray| pose.position_ned_m + pose.ned_from_camera * ray_end(ray));
            Self { rim: rim.collect(), ground, fov_deg: camera.field_deg() }
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
fn border_rays(camera: &CameraModel) -> Vec<DVec3> {
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
    fn rim_of_a_pinhole_is_the_border_of_its_picture() {
        let rim = border_rays(&camera(&[]));
        assert_eq!(rim.len(), 4 * RAYS_PER_SIDE as usize);
        let corners = [[-1.0, -0.5], [1.0, -0.5], [1.0, 0.5], [-1.0, 0.5]];
        for (side, corner) in corners.into_iter().enumerate() {
            let ray = rim[side * RAYS_PER_SIDE as usize];
            let away = (ray.truncate() / ray.z - DVec2::from_array(corner)).length();
            assert!(away < 1e-9, "{side}: {rim:?}");
        }
    }

    #[test]
    fn rim_of_a_wide_lens_reaches_behind_the_camera() {
        let focal_px = 100.0 / 100_f64.to_radians();
        let wide = CameraModel::new([201, 201], [focal_px; 2], None, LensModel::KannalaBrandt, &[]);
        let rim = border_rays(&wide.expect("a camera"));
        let least_z = rim.iter().map(|ray| ray.z).fold(1.0, f64::min);
        assert!(least_z < -0.17 && rim.len() == 4 * RAYS_PER_SIDE as usize, "{rim:?}");
    }
}
