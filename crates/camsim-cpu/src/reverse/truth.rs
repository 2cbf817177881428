//! Depth and coordinates beside the picture: twin of shaders/reverse/edges/truth.wgsl and
//! shaders/reverse/keys.

use super::{
    Stages,
    source::{LinePose, rotate, translation},
};
use crate::simd::lanes::{LANES, Lanes, Lanes2, Lanes3, fast_max, per_lane};
use camsim_plan::{TemporalStage, uniforms::Truth};

/// Homogeneous point in the mid-window camera: its ray, and the inverse depth times the same factor.
struct ReferencePoint {
    ray: Lanes3,
    inverse_depth: Lanes,
}

impl Stages<'_> {
    /// Truth of pixels whose line has the pose `mid` at mid-exposure. `at_phase_px` are their sources at the
    /// exposure phase that is reported.
    #[inline(always)]
    pub(super) fn truth(
        &self,
        uv: &Lanes2,
        mid: &LinePose,
        at_phase_px: &Lanes2,
        inside: &Lanes,
        truth: &mut [Truth],
    ) {
        let source = self.reference_px(at_phase_px);
        let position_px = self.solve(uv, mid).position_px;
        let in_key = self.ideal.inverse_depth(self.frame, &position_px);
        let in_line = self.on_line(uv, mid, &in_key);
        let point = self.reference(&position_px, &in_key);
        let along = |axis: usize| {
            let frame = self.frame;
            let [x, y, z] =
                [frame.ned_from_key_x[axis], frame.ned_from_key_y[axis], frame.ned_from_key_z[axis]];
            per_lane(|i| {
                let far = 1.0 / point.inverse_depth[i];
                frame.key_position_ned_m[axis]
                    + point.ray.x[i] * far * x
                    + point.ray.y[i] * far * y
                    + point.ray.z[i] * far * z
            })
        };
        let (north, east, down) = (along(0), along(1), along(2));
        for (i, truth) in truth.iter_mut().enumerate() {
            if inside[i] == 0.0 {
                *truth = Truth::default();
                continue;
            }
            *truth =
                Truth { uv: [uv.x[i], uv.y[i]], source_px: [source.x[i], source.y[i]], ..Truth::default() };
            if in_line[i] > 0.0 && point.inverse_depth[i] > 0.0 {
                truth.depth_m = 1.0 / in_line[i];
                // Along the key ray of the source, at the depth found there: no absolute poses are subtracted
                // in single precision.
                truth.point_ned_m = [north[i], east[i], down[i]];
            }
        }
    }

    /// Inverse depth in the line's own camera of what the key camera sees at the ray's source.
    #[inline(always)]
    fn on_line(&self, uv: &Lanes2, pose: &LinePose, in_key: &Lanes) -> Lanes {
        if self.temporal == TemporalStage::Identity {
            return *in_key;
        }
        let (direction, shift) = (rotate(pose, uv), translation(pose));
        per_lane(|i| in_key[i] * direction.z[i] / fast_max(in_key[i].mul_add(-shift[2], 1.0), 1e-3))
    }

    #[inline(always)]
    fn reference(&self, position_px: &Lanes2, in_key: &Lanes) -> ReferencePoint {
        let ([fx, fy], [cx, cy]) = (self.frame.ideal_focal_px, self.frame.ideal_principal_px);
        let uv = Lanes2 {
            x: per_lane(|i| (position_px.x[i] - cx) / fx),
            y: per_lane(|i| (position_px.y[i] - cy) / fy),
        };
        let Some(pose) = self.reference_pose else {
            return ReferencePoint {
                ray: Lanes3 { x: uv.x, y: uv.y, z: [1.0; LANES] },
                inverse_depth: *in_key,
            };
        };
        let (ray, shift) = (rotate(&pose, &uv), translation(&pose));
        let moved = |axis: &Lanes, shift: f32| per_lane(|i| in_key[i].mul_add(shift, axis[i]));
        ReferencePoint {
            ray: Lanes3 {
                x: moved(&ray.x, shift[0]),
                y: moved(&ray.y, shift[1]),
                z: moved(&ray.z, shift[2]),
            },
            inverse_depth: *in_key,
        }
    }

    /// Source position in the ideal frame that the mid-window camera would have, pixels.
    #[inline(always)]
    fn reference_px(&self, position_px: &Lanes2) -> Lanes2 {
        if self.reference_pose.is_none() {
            return *position_px;
        }
        let in_key = self.ideal.inverse_depth(self.frame, position_px);
        let ReferencePoint { ray, .. } = self.reference(position_px, &in_key);
        self.ideal_px(&ray.x, &ray.y, |i| 1.0 / ray.z[i])
    }
}
