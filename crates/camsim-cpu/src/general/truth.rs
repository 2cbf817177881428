//! Depth and coordinates of pixels beside their colour. Twin of
//! `camsim-gpu/shaders/reverse/edges/truth.wgsl`.

use glam::{DVec2, DVec3};

use camsim_plan::uniforms::Truth;

use super::{Pixel, ReversePass, keys::ReferencePoint};

/// The point that the centre of a pixel sees at mid-exposure.
struct VisiblePoint {
    /// Inverse planar depth in the row's own camera, 1/m; 0 = sky.
    inverse_depth: f64,
    point: ReferencePoint,
}

impl ReversePass<'_> {
    /// Truth of a pixel by the temporal inverse; near silhouettes by its centre ray.
    pub(super) fn truth(&self, pixel: &Pixel<'_>, may_see_several: bool, nodes_px: &mut Vec<DVec2>) -> Truth {
        if self.gather.solver.is_exact() {
            if may_see_several && self.is_truth_unknown(pixel) {
                return unknown(pixel);
            }
            return self.truth_of(pixel, self.smooth_px(pixel, nodes_px), &self.smooth_mid(pixel));
        }
        let near = |fraction: f64| may_see_several && self.is_near_silhouette(pixel, fraction);
        let phase_fraction = self.coords_phase + 0.5;
        let source_px = match near(phase_fraction).then(|| self.centre_hit(pixel, phase_fraction)).flatten() {
            // These solvers have one key frame, that of the mid-window camera.
            Some((position_px, _)) => position_px,
            None => self.smooth_px(pixel, nodes_px),
        };
        let mid = match near(0.5).then(|| self.centre_hit(pixel, 0.5)).flatten() {
            Some((position_px, w)) => {
                // These solvers keep the depth constant: that in the key camera is w too.
                VisiblePoint { inverse_depth: w, point: self.keys[pixel.key].reference_point(position_px, w) }
            }
            None => self.smooth_mid(pixel),
        };
        self.truth_of(pixel, source_px, &mid)
    }

    /// Whether a pixel's centre ray passes a silhouette when it is asked for.
    pub(super) fn is_truth_unknown(&self, pixel: &Pixel<'_>) -> bool {
        [0.5, self.coords_phase + 0.5].into_iter().any(|fraction| self.is_near_silhouette(pixel, fraction))
    }

    /// Source at the exposure phase of the coordinates, in the mid-window camera.
    fn smooth_px(&self, pixel: &Pixel<'_>, nodes_px: &mut Vec<DVec2>) -> DVec2 {
        let key = &self.keys[pixel.key];
        let (uv, depth) = (pixel.ray.uv, key.depth_of_truth());
        let position_px =
            self.gather.position_at_phase(uv, &pixel.exposure, &depth, self.coords_phase, nodes_px);
        key.reference_px(position_px, depth.image.inverse_depth(position_px))
    }

    fn smooth_mid(&self, pixel: &Pixel<'_>) -> VisiblePoint {
        let key = &self.keys[pixel.key];
        let depth = key.depth_of_truth();
        let source = self.gather.solver.source_with_depth(pixel.ray.uv, &pixel.exposure.mid, &depth);
        let in_key = depth.image.inverse_depth(source.position_px);
        VisiblePoint {
            inverse_depth: source.inverse_depth,
            point: key.reference_point(source.position_px, in_key),
        }
    }

    fn truth_of(&self, pixel: &Pixel<'_>, source_px: DVec2, mid: &VisiblePoint) -> Truth {
        let mut truth = Truth { source_px: source_px.as_vec2().to_array(), ..truth_of_ray(pixel) };
        if mid.inverse_depth > 0.0 && mid.point.inverse_depth > 0.0 {
            truth.depth_m = (1.0 / mid.inverse_depth) as f32;
            let point: DVec3 = mid.point.scaled / mid.point.inverse_depth;
            let pose = &self.plan.key_pose;
            truth.point_ned_m = (pose.position_ned_m + pose.ned_from_camera * point).as_vec3().to_array();
        }
        truth
    }
}

/// Truth that is left to a ray in double precision.
pub(super) fn unknown(pixel: &Pixel<'_>) -> Truth {
    Truth { depth_m: -1.0, ..truth_of_ray(pixel) }
}

fn truth_of_ray(pixel: &Pixel<'_>) -> Truth {
    Truth { uv: pixel.ray.uv.as_vec2().to_array(), ..Truth::default() }
}
