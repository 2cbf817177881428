//! Optical flow: where another picture shows what a pixel sees.

mod parallax;

use camsim_core::{
    row_time::{FrameCamera, RowProjector, Shown, WorldPoint},
    scenario::FlowState,
};
use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::planes::{FramePixels, Pixel};
use parallax::Doubt;

/// What a pixel sees, as a point of the world that follows what it is on; the sky is infinitely far away.
fn world_point<'a>(pixels: &'a FramePixels<'_>, pixel: Pixel<'_>) -> WorldPoint<'a> {
    match pixel.hit {
        Some(hit) => {
            let motion = pixels.planner.sequence().scene.motion_of_surface(hit.surface);
            WorldPoint::on(motion, hit.point_ned_m, pixels.rays.mid_s(pixel.position))
        }
        None => WorldPoint::Towards(pixels.rays.pose(pixel.position).ned_from_camera * pixel.uv.extend(1.0)),
    }
}

/// Displacement to the picture of another camera, pixels, and [`FlowState`] of every pixel.
pub(super) fn flow(pixels: &FramePixels<'_>, target: &FrameCamera) -> Vec<[f32; 3]> {
    let width = pixels.plan.camera.size_px[0] as usize;
    let (doubt, projector) = (Doubt::of(pixels, target), target.projector());
    let mut flow = vec![[0.0; 3]; pixels.truth.len()];
    flow.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        let mut before = DVec2::ZERO;
        for (i, value) in (y * width..).zip(row) {
            let Some(pixel) = pixels.pixel(i) else { continue };
            let landing = Landing { pixels, projector: &projector, pixel, is_in_doubt: doubt.is_at(i) };
            let Some((shift, state)) = landing.find(before) else { continue };
            before = shift;
            let [dx, dy] = shift.as_vec2().to_array();
            *value = [dx, dy, f32::from(state as u8)];
        }
    });
    flow
}

/// Where a picture shows what a pixel sees.
struct Landing<'a> {
    pixels: &'a FramePixels<'a>,
    projector: &'a RowProjector<'a>,
    pixel: Pixel<'a>,
    /// Whether terrain may hide it there.
    is_in_doubt: bool,
}

impl Landing<'_> {
    /// Displacement, looked for near that of the pixel before; `None` where there is none.
    fn find(&self, before: DVec2) -> Option<(DVec2, FlowState)> {
        let from_px = DVec2::from_array(self.pixel.position.map(f64::from));
        let point = world_point(self.pixels, self.pixel);
        let (px, state) = match self.projector.by_steps(point, from_px + before) {
            Some(only) if self.is_hidden(point, &only) => (only.px, FlowState::Occluded),
            Some(only) => (only.px, FlowState::Visible),
            None => self.find_all(point, from_px)?,
        };
        Some((px - from_px, state))
    }

    /// Where the picture shows the point; of several positions the nearest at which nothing is in front of it.
    fn find_all(&self, point: WorldPoint<'_>, from_px: DVec2) -> Option<(DVec2, FlowState)> {
        let target = self.projector.frame();
        let mut found = target.find_all(point);
        found.sort_by(|a, b| a.px.distance(from_px).total_cmp(&b.px.distance(from_px)));
        let Some(nearest) = found.first() else {
            return target.outside(point, from_px).map(|px| (px, FlowState::Outside));
        };
        let mut seen = found.iter().filter(|shown| !self.is_hidden(point, &Shown::from(**shown)));
        Some(match (seen.next(), seen.next()) {
            (None, _) => (nearest.px, FlowState::Occluded),
            (Some(only), None) => (only.px, FlowState::Visible),
            (Some(nearest), Some(_)) => (nearest.px, FlowState::Several),
        })
    }

    fn is_hidden(&self, point: WorldPoint<'_>, shown: &Shown) -> bool {
        let rays = self.pixels.rays;
        if !self.is_in_doubt && !rays.has_models() {
            return false;
        }
        let Shown { t_s, position_ned_m, depth_m, .. } = *shown;
        let ray_ned = match point {
            WorldPoint::Towards(direction_ned) => Some(direction_ned),
            _ => point.position_ned_m(t_s).map(|now_ned_m| (now_ned_m - position_ned_m) / depth_m),
        };
        let hides = |ray_ned| match self.is_in_doubt {
            true => rays.is_hidden(t_s, position_ned_m, ray_ned, depth_m),
            false => rays.is_behind_model(t_s, position_ned_m, ray_ned, depth_m),
        };
        ray_ned.is_some_and(hides)
    }
}

/// Velocity of the image of the point that a pixel sees, pixels a second, at the pixel's own instant:
///
/// ```text
/// X' = -w x X - v + v_surface,   (u, v)' = (X'.xy - (u, v) X'.z) / X.z,   px' = f J_lens (u, v)'
/// ```
///
/// with the camera's angular rate w and velocity v and that of the surface in the camera's axes; points of the
/// sky have v / X.z = 0.
pub(super) fn motion(pixels: &FramePixels<'_>, pixel: Pixel<'_>) -> [f32; 2] {
    let plan = pixels.plan;
    let path = &pixels.planner.sequence().path;
    let [x, y] = pixel.position;
    let t_s = plan.stamp_s + plan.shutter.dt_pixel_s(x, y);
    let camera_from_ned = pixels.rays.pose(pixel.position).ned_from_camera.conjugate();
    let inverse_depth = pixel.hit.map_or(0.0, |hit| 1.0 / hit.depth_m);
    let ray = pixel.uv.extend(1.0);
    let of_surface = pixel.hit.and_then(|hit| {
        let motion = pixels.planner.sequence().scene.motion_of_surface(hit.surface)?;
        Some(motion.state(t_s).velocity(hit.point_ned_m))
    });
    let velocity: DVec3 = camera_from_ned * (path.velocity_ned(t_s) - of_surface.unwrap_or(DVec3::ZERO));
    let ray_rate = -path.rate_camera(t_s).cross(ray) - velocity * inverse_depth;
    let uv_rate = ray_rate.truncate() - pixel.uv * ray_rate.z;
    let px_rate = plan.camera.focal_px * (plan.camera.lens.jacobian(pixel.uv) * uv_rate);
    px_rate.as_vec2().to_array()
}

/// Displacement of the point that a pixel sees at the begin and at the end of its exposure, pixels; 0 where
/// the camera of that instant does not show it.
pub(super) fn blur_path(pixels: &FramePixels<'_>, pixel: Pixel<'_>) -> [f32; 4] {
    let moved = |phase| moved_px(pixels, pixel, phase).unwrap_or_default().as_vec2().to_array();
    let ([x0, y0], [x1, y1]) = (moved(-0.5), moved(0.5));
    [x0, y0, x1, y1]
}

/// Displacement of the point that a pixel sees at an exposure phase, -0.5 to 0.5, pixels; `None` where the
/// camera of that instant does not show it.
pub(super) fn moved_px(pixels: &FramePixels<'_>, pixel: Pixel<'_>, phase: f64) -> Option<DVec2> {
    let from_px = DVec2::from_array(pixel.position.map(f64::from));
    let (t_s, pose) = pixels.rays.camera_at(pixel.position, phase);
    let shown = pixels.plan.camera.show(&pose, t_s, world_point(pixels, pixel));
    shown.map(|(px, _)| px - from_px)
}

#[cfg(test)]
mod tests;
