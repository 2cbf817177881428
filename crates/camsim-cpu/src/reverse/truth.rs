//! Depth and coordinates beside the picture: twin of shaders/reverse/edges/seen.wgsl and
//! shaders/reverse/keys.

use super::{
    Reads,
    source::{Pose, rotate, translation},
};
use crate::simd::lanes::{LANES, Lanes, Lanes2, Lanes3, each, higher};
use camsim_plan::{TemporalStage, uniforms::Truth};

/// A place of an ideal frame in the mid-window camera: its ray, and the inverse depth times the same factor.
struct Reference {
    ray: Lanes3,
    inverse_depth: Lanes,
}

impl Reads<'_> {
    /// Truth about pixels whose line has this pose at mid-exposure. `at_phase_px`: where they look at the
    /// phase that is asked for.
    #[inline(always)]
    pub(super) fn truth(
        &self,
        uv: &Lanes2,
        mid: &Pose,
        at_phase_px: &Lanes2,
        inside: &Lanes,
        truth: &mut [Truth],
    ) {
        let source = self.reference_px(at_phase_px);
        let at_px = self.solve(uv, mid).at_px;
        let in_key = self.ideal.inverse_depth(self.frame, &at_px);
        let in_line = self.on_line(uv, mid, &in_key);
        let point = self.reference(&at_px, &in_key);
        let along = |axis: usize| {
            let frame = self.frame;
            let [x, y, z] =
                [frame.ned_from_key_x[axis], frame.ned_from_key_y[axis], frame.ned_from_key_z[axis]];
            each(|i| {
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
                // On the key ray of the source, at the depth found there: no absolute pose is differenced in
                // single precision.
                truth.point_ned_m = [north[i], east[i], down[i]];
            }
        }
    }

    /// The inverse depth that the line's own camera gives to what the key camera sees where a ray looks.
    #[inline(always)]
    fn on_line(&self, uv: &Lanes2, pose: &Pose, in_key: &Lanes) -> Lanes {
        if self.temporal == TemporalStage::Identity {
            return *in_key;
        }
        let (direction, shift) = (rotate(pose, uv), translation(pose));
        each(|i| in_key[i] * direction.z[i] / higher(in_key[i].mul_add(-shift[2], 1.0), 1e-3))
    }

    #[inline(always)]
    fn reference(&self, at_px: &Lanes2, in_key: &Lanes) -> Reference {
        let ([fx, fy], [cx, cy]) = (self.frame.ideal_focal_px, self.frame.ideal_principal_px);
        let uv = Lanes2 { x: each(|i| (at_px.x[i] - cx) / fx), y: each(|i| (at_px.y[i] - cy) / fy) };
        let Some(pose) = self.elsewhere else {
            return Reference { ray: Lanes3 { x: uv.x, y: uv.y, z: [1.0; LANES] }, inverse_depth: *in_key };
        };
        let (ray, shift) = (rotate(&pose, &uv), translation(&pose));
        let moved = |axis: &Lanes, shift: f32| each(|i| in_key[i].mul_add(shift, axis[i]));
        Reference {
            ray: Lanes3 {
                x: moved(&ray.x, shift[0]),
                y: moved(&ray.y, shift[1]),
                z: moved(&ray.z, shift[2]),
            },
            inverse_depth: *in_key,
        }
    }

    /// A place in the ideal frame that the mid-window camera would have.
    #[inline(always)]
    fn reference_px(&self, at_px: &Lanes2) -> Lanes2 {
        if self.elsewhere.is_none() {
            return *at_px;
        }
        let in_key = self.ideal.inverse_depth(self.frame, at_px);
        let Reference { ray, .. } = self.reference(at_px, &in_key);
        self.ideal_px(&ray.x, &ray.y, |i| 1.0 / ray.z[i])
    }
}
