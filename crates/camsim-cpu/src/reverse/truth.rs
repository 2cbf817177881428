//! Depth and coordinates beside the picture: twin of camsim-gpu/shaders/reverse/edges/truth.wgsl and
//! camsim-gpu/shaders/reverse/keys.

use super::{
    Stages,
    source::{LinePose, rotate, translation},
};
use crate::simd::lanes::{LANES, Lanes, Lanes2, Lanes3, fast_max, per_lane};
use camsim_plan::{TemporalStage, uniforms::Truth};

/// Homogeneous point in the mid-window camera: its ray, and the inverse depth times the same factor.
struct BlockReferencePoint {
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
        let key_inverse_depth = self.ideal.inverse_depth(self.frame, &position_px);
        let line_inverse_depth = self.line_inverse_depth_of(uv, mid, &key_inverse_depth);
        let point = self.reference(&position_px, &key_inverse_depth);
        let ned_component = |axis: usize| {
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
        let (north, east, down) = (ned_component(0), ned_component(1), ned_component(2));
        for (i, truth) in truth.iter_mut().enumerate() {
            if inside[i] == 0.0 {
                *truth = Truth::default();
                continue;
            }
            *truth =
                Truth { uv: [uv.x[i], uv.y[i]], source_px: [source.x[i], source.y[i]], ..Truth::default() };
            if line_inverse_depth[i] > 0.0 && point.inverse_depth[i] > 0.0 {
                truth.depth_m = 1.0 / line_inverse_depth[i];
                // Along the key ray of the source, at the depth found there: no absolute poses are subtracted
                // in single precision.
                truth.point_ned_m = [north[i], east[i], down[i]];
            }
        }
    }

    /// Inverse depth in the line's own camera of what the key camera sees at the ray's source.
    #[inline(always)]
    fn line_inverse_depth_of(&self, uv: &Lanes2, pose: &LinePose, key_inverse_depth: &Lanes) -> Lanes {
        if self.temporal == TemporalStage::Identity {
            return *key_inverse_depth;
        }
        let (direction, shift) = (rotate(pose, uv), translation(pose));
        per_lane(|i| {
            key_inverse_depth[i] * direction.z[i]
                / fast_max(key_inverse_depth[i].mul_add(-shift[2], 1.0), 1e-3)
        })
    }

    #[inline(always)]
    fn reference(&self, position_px: &Lanes2, key_inverse_depth: &Lanes) -> BlockReferencePoint {
        let ([fx, fy], [cx, cy]) = (self.frame.ideal_focal_px, self.frame.ideal_principal_px);
        let uv = Lanes2 {
            x: per_lane(|i| (position_px.x[i] - cx) / fx),
            y: per_lane(|i| (position_px.y[i] - cy) / fy),
        };
        let Some(pose) = self.reference_poses.get(self.key) else {
            return BlockReferencePoint {
                ray: Lanes3 { x: uv.x, y: uv.y, z: [1.0; LANES] },
                inverse_depth: *key_inverse_depth,
            };
        };
        let (ray, shift) = (rotate(pose, &uv), translation(pose));
        let moved = |axis: &Lanes, shift: f32| per_lane(|i| key_inverse_depth[i].mul_add(shift, axis[i]));
        BlockReferencePoint {
            ray: Lanes3 {
                x: moved(&ray.x, shift[0]),
                y: moved(&ray.y, shift[1]),
                z: moved(&ray.z, shift[2]),
            },
            inverse_depth: *key_inverse_depth,
        }
    }

    /// Source position in the ideal frame that the mid-window camera would have, pixels.
    #[inline(always)]
    fn reference_px(&self, position_px: &Lanes2) -> Lanes2 {
        if self.reference_poses.is_empty() {
            return *position_px;
        }
        let key_inverse_depth = self.ideal.inverse_depth(self.frame, position_px);
        let BlockReferencePoint { ray, .. } = self.reference(position_px, &key_inverse_depth);
        self.ideal_px(&ray.x, &ray.y, |i| 1.0 / ray.z[i])
    }
}
