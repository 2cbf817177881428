//! Optical flow: where another picture shows what a pixel sees.

mod parallax;

use camsim_core::{
    row_time::{FrameCamera, ImagePoint, RowProjector, Shown, WorldPoint},
    scenario::FlowState,
    scene::ray_packet::{PACKET_RAYS, PacketRay, RayPacket},
};
use camsim_plan::Among;
use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::{
    hits::{SIDE, square},
    planes::{FramePixels, Pixel},
};
use parallax::Doubt;

/// Part of the path to a point that rounding may take for a surface in front of it.
const LAST_PART: f64 = 1e-6;

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
    let bands = flow.par_chunks_mut(SIDE * width).enumerate();
    bands.for_each_init(RayPacket::default, |packet, (number, values)| {
        let first = number * SIDE * width;
        let mut before = DVec2::ZERO;
        for x in (0..width).step_by(SIDE) {
            let places = square(width, values.len(), [x, 0], 1);
            let mut rays = [PacketRay::NONE; PACKET_RAYS];
            let mut is_any_in_doubt = false;
            for (ray, at) in rays.iter_mut().zip(places) {
                let Some((at, pixel)) = at.and_then(|at| Some((at, pixels.pixel(first + at)?))) else {
                    continue;
                };
                let is_in_doubt = doubt.is_at(first + at);
                let landing = Landing { pixels, projector: &projector, pixel, is_in_doubt };
                let Some((shift, state, open)) = landing.find(before) else { continue };
                before = shift;
                values[at] = value(shift, state);
                *ray = open.unwrap_or(PacketRay::NONE);
                is_any_in_doubt |= is_in_doubt;
            }
            if !rays.iter().any(PacketRay::is_there) {
                continue;
            }
            let hits = pixels.rays.first_hits(packet, &rays, hiding(is_any_in_doubt));
            for at in hits.iter().zip(places).filter_map(|(hit, at)| hit.and(at)) {
                values[at][2] = f32::from(FlowState::Occluded as u8);
            }
        }
    });
    flow
}

/// What may hide a point, by whether the terrain may.
fn hiding(is_in_doubt: bool) -> Among {
    if is_in_doubt { Among::All } else { Among::Models }
}

fn value(shift: DVec2, state: FlowState) -> [f32; 3] {
    let [dx, dy] = shift.as_vec2().to_array();
    [dx, dy, f32::from(state as u8)]
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
    /// Displacement, looked for near that of the pixel before, and a ray that decides whether it is hidden there,
    /// if that is open; `None` where there is no displacement.
    fn find(&self, before: DVec2) -> Option<(DVec2, FlowState, Option<PacketRay>)> {
        let from_px = DVec2::from_array(self.pixel.position.map(f64::from));
        let point = world_point(self.pixels, self.pixel);
        let (px, state, open) = match self.projector.by_steps(point, from_px + before) {
            Some(only) => (only.px, FlowState::Visible, self.ray_to(point, &only)),
            None => {
                let (px, state) = self.find_all(point, from_px)?;
                (px, state, None)
            }
        };
        Some((px - from_px, state, open))
    }

    /// Where the picture shows the point; of several positions the nearest at which nothing is in front of it.
    fn find_all(&self, point: WorldPoint<'_>, from_px: DVec2) -> Option<(DVec2, FlowState)> {
        let target = self.projector.frame();
        let mut found = target.find_all(point);
        found.sort_by(|a, b| a.px.distance(from_px).total_cmp(&b.px.distance(from_px)));
        let Some(nearest) = found.first() else {
            return target.outside(point, from_px).map(|px| (px, FlowState::Outside));
        };
        let is_hidden = |shown: &ImagePoint| {
            let ray = self.ray_to(point, &Shown::from(*shown));
            ray.is_some_and(|ray| self.pixels.rays.is_hidden(&ray, hiding(self.is_in_doubt)))
        };
        let mut seen = found.iter().filter(|shown| !is_hidden(shown));
        Some(match (seen.next(), seen.next()) {
            (None, _) => (nearest.px, FlowState::Occluded),
            (Some(only), None) => (only.px, FlowState::Visible),
            (Some(nearest), Some(_)) => (nearest.px, FlowState::Several),
        })
    }

    /// The ray to the point; `None` where nothing can hide it.
    fn ray_to(&self, point: WorldPoint<'_>, shown: &Shown) -> Option<PacketRay> {
        if !self.is_in_doubt && !self.pixels.rays.has_models() {
            return None;
        }
        let Shown { t_s, position_ned_m, depth_m, .. } = *shown;
        let direction_ned = match point {
            WorldPoint::Towards(direction_ned) => direction_ned,
            _ => (point.position_ned_m(t_s)? - position_ned_m) / depth_m,
        };
        let limit = (1.0 - LAST_PART) * depth_m;
        Some(PacketRay { t_s, origin_ned_m: position_ned_m, direction_ned, limit })
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
    let t_s = pixels.rays.mid_s(pixel.position);
    let [velocity_ned, rate_camera] = pixels.rays.camera_movement(pixel.position);
    let camera_from_ned = pixels.rays.pose(pixel.position).ned_from_camera.conjugate();
    let inverse_depth = pixel.hit.map_or(0.0, |hit| 1.0 / hit.depth_m);
    let ray = pixel.uv.extend(1.0);
    let of_surface = pixel.hit.and_then(|hit| {
        let motion = pixels.planner.sequence().scene.motion_of_surface(hit.surface)?;
        Some(motion.state(t_s).velocity(hit.point_ned_m))
    });
    let velocity: DVec3 = camera_from_ned * (velocity_ned - of_surface.unwrap_or(DVec3::ZERO));
    let ray_rate = -rate_camera.cross(ray) - velocity * inverse_depth;
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
