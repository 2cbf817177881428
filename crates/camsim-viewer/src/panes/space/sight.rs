//! What the camera of a frame sees: the rim of its field of view, how wide that is, and the ground within it.

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
const ALONG: u32 = 10;
/// Length of the pyramid, of the scene's radius: as far as the ground in the middle, but neither less nor
/// more than this.
const REACH: [f64; 2] = [0.06, 0.45];

/// Rays of the pyramid, times its height, at most.
const LONGEST: f64 = 2.5;

/// A frame's sight.
#[derive(Clone, Debug)]
pub struct PixelTruth {
    /// NED metres, all around the picture from a corner on; a quarter of them for each side.
    pub rim: Vec<DVec3>,
    /// The outermost ground that is seen, NED.
    pub ground: Arc<Vec<Vec<DVec3>>>,
    /// Angles between the outermost rays: from left to right, from top to bottom, between opposite corners.
    pub field_deg: [f64; 3],
}

impl PixelTruth {
    /// The last one, or another for another frame; `None` for a camera without rays.
    pub fn new(
        ui: &Ui,
        state: &State,
        sequence: &Arc<Sequence>,
        pose: &CameraPose,
        radius_m: f64,
    ) -> Option<Self> {
        type Kept = (Weak<Sequence>, u64, Option<u64>, Option<PixelTruth>);
        let frame = state.timeline.frame;
        // Of a zoom lens, the calibration that the frame on show was made with.
        let picture = state.heard.picture().filter(|picture| picture.plan.frame == frame);
        let zoom = picture.and_then(|picture| picture.plan.zoom);
        let id = Id::unique("sight of the camera");
        let kept = ui.data(|data| data.get_temp::<Kept>(id));
        let is_same = |kept: &Kept| {
            std::ptr::eq(kept.0.as_ptr(), Arc::as_ptr(sequence))
                && kept.1 == frame
                && kept.2 == zoom.map(f64::to_bits)
        };
        if let Some((.., sight)) = kept.filter(is_same) {
            return sight;
        }
        let spec = &sequence.scenario.camera;
        let camera = zoom.map_or_else(
            || motion::camera_of(spec),
            |zoom| CameraModel::at_zoom(spec, zoom).ok().map(Arc::new),
        );
        let sight = camera.map(|camera| {
            let ground = map::footprint(ui, sequence, frame, &camera, pose);
            let middle = outermost(&camera, DVec2::ZERO, Some).unwrap_or_default();
            let towards = pose.ned_from_camera * middle.extend(1.0).normalize();
            let hit = map::footprint::ground(&sequence.scene, pose, towards);
            let ahead_m = hit.map_or(f64::INFINITY, |hit| hit.distance(pose.position_ned_m));
            let reach_m = ahead_m.clamp(REACH[0] * radius_m, REACH[1] * radius_m);
            // In a plane across the look, but for rays that would meet it far away.
            let end = |uv: DVec2| uv.extend(1.0).clamp_length_max(LONGEST) * reach_m;
            let rim = rim(&camera).into_iter().map(|uv| pose.position_ned_m + pose.ned_from_camera * end(uv));
            Self { rim: rim.collect(), ground, field_deg: field_deg(&camera) }
        });
        ui.data_mut(|data| {
            data.insert_temp::<Kept>(
                id,
                (Arc::downgrade(sequence), frame, zoom.map(f64::to_bits), sight.clone()),
            )
        });
        sight
    }
}

/// Outermost rays towards places along the picture's border, clockwise from the upper left corner; a corner
/// that has no ray is where the lens ends.
fn rim(camera: &CameraModel) -> Vec<DVec2> {
    let half = DVec2::new(f64::from(camera.size_px[0].max(2) - 1), f64::from(camera.size_px[1].max(2) - 1));
    let corners =
        [DVec2::new(-1.0, -1.0), DVec2::new(1.0, -1.0), DVec2::new(1.0, 1.0), DVec2::new(-1.0, 1.0)];
    let along = (0..4 * ALONG).map(|k| {
        let (side, step) = ((k / ALONG) as usize, f64::from(k % ALONG) / f64::from(ALONG));
        half * corners[side].lerp(corners[(side + 1) % 4], step)
    });
    along.filter_map(|direction| outermost(camera, direction, Some)).collect()
}

/// Angles between opposite outermost rays.
fn field_deg(camera: &CameraModel) -> [f64; 3] {
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
    fn a_pinhole_sees_what_its_focal_length_says() {
        // 100, 50 and sqrt(100^2 + 50^2) px from the middle to the border.
        let expected = [100.0, 50.0, 111.803_398_875].map(|px: f64| 2.0 * (px / 100.0).atan().to_degrees());
        for (found, expected) in field_deg(&camera(&[])).into_iter().zip(expected) {
            assert!((found - expected).abs() < 1e-6, "{found} {expected}");
        }
        let rim = rim(&camera(&[]));
        assert_eq!(rim.len(), 4 * ALONG as usize);
        let corners = [[-1.0, -0.5], [1.0, -0.5], [1.0, 0.5], [-1.0, 0.5]];
        for (at, corner) in corners.into_iter().enumerate() {
            assert!((rim[at * ALONG as usize] - DVec2::from_array(corner)).length() < 1e-9, "{at}: {rim:?}");
        }
    }

    #[test]
    fn where_a_lens_folds_its_field_ends() {
        // r (1 - r^2 / 4) grows up to r = sqrt(4 / 3), 77 px of the 100 to the left border.
        let [across, down, _] = field_deg(&camera(&[-0.25, 0.0, 0.0, 0.0]));
        let fold_deg = 2.0 * (4.0_f64 / 3.0).sqrt().atan().to_degrees();
        assert!(across > 0.9 * fold_deg && across <= fold_deg + 1e-6, "{across} of {fold_deg}");
        assert!(down > 53.13 && down < fold_deg, "wider than the pinhole's 53.13: {down}");
    }
}
