//! Sources of rays in the ideal frame: twins of camsim-gpu/shaders/reverse/temporal_inverse and
//! camsim-gpu/shaders/reverse/gather/nodes.

use super::Stages;
use crate::simd::lanes::{LANES, Lanes, Lanes2, Lanes3, ZERO, indicator, per_lane};
use camsim_plan::NodeDepths;
use camsim_plan::TemporalStage;

/// Rows of R, with t as the fourth element: x_key = R x_line + t.
pub(super) type LinePose = [[f32; 4]; 3];

/// Sources of a block of pixels at one instant.
#[derive(Clone, Copy, Debug)]
pub(super) struct BlockSources {
    /// Position, ideal pixels.
    pub position_px: Lanes2,
    /// 1 if in front of the key camera and inside the ideal frame, else 0.
    pub inside: Lanes,
}

/// Inverse depths in the key frame at the nodes of an exposure.
#[expect(clippy::large_enum_variant, reason = "there is one, on the stack, a block")]
enum NodeInverseDepths {
    /// Each node is solved independently.
    Solved,
    /// The result of the node before.
    Each(Lanes),
    /// Parabola `begin + fraction (slope + fraction bend)`.
    BlockCurve { begin: Lanes, slope: Lanes, bend: Lanes },
}

/// Iterates over the nodes of an exposure.
pub(super) struct Nodes<'a> {
    stages: &'a Stages<'a>,
    uv: &'a Lanes2,
    depths: NodeInverseDepths,
    node_fraction: f32,
}

#[inline(always)]
pub(super) fn rotate(pose: &LinePose, uv: &Lanes2) -> Lanes3 {
    let row = |r: [f32; 4]| per_lane(|i| uv.x[i].mul_add(r[0], uv.y[i].mul_add(r[1], r[2])));
    Lanes3 { x: row(pose[0]), y: row(pose[1]), z: row(pose[2]) }
}

pub(super) fn translation(pose: &LinePose) -> [f32; 3] {
    [pose[0][3], pose[1][3], pose[2][3]]
}

impl Stages<'_> {
    #[inline(always)]
    pub(super) fn ideal_px(&self, x: &Lanes, y: &Lanes, scale: impl Fn(usize) -> f32) -> Lanes2 {
        let ([fx, fy], [cx, cy]) = (self.frame.ideal_focal_px, self.frame.ideal_principal_px);
        let scale = per_lane(scale);
        Lanes2 {
            x: per_lane(|i| (x[i] * scale[i]).mul_add(fx, cx)),
            y: per_lane(|i| (y[i] * scale[i]).mul_add(fy, cy)),
        }
    }

    #[inline(always)]
    fn inside(&self, position_px: &Lanes2, z: &Lanes) -> Lanes {
        let [right, bottom] = self.frame.ideal_size_px.map(|size| size as f32 - 0.5);
        indicator(|i| {
            (z[i] > 0.0)
                & (position_px.x[i] >= -0.5)
                & (position_px.x[i] <= right)
                & (position_px.y[i] >= -0.5)
                & (position_px.y[i] <= bottom)
        })
    }

    /// Inverse depth on the line's ray of a surface with this inverse depth in the key frame. At or behind
    /// the image plane of the line's camera `guess` is returned.
    #[inline(always)]
    fn row_inverse_depth(
        direction: &Lanes3,
        shift: [f32; 3],
        key_inverse_depth: &Lanes,
        guess: &Lanes,
    ) -> Lanes {
        per_lane(|i| {
            let scale = key_inverse_depth[i].mul_add(-shift[2], 1.0);
            if scale > 1e-3 { key_inverse_depth[i] * direction.z[i] / scale } else { guess[i] }
        })
    }

    /// `count` depth look-ups from a guess on the line's ray. Returns the inverse depths after the last one:
    /// in the key frame, and on the line's ray.
    #[inline(always)]
    fn look_ups(&self, direction: &Lanes3, shift: [f32; 3], guess: &Lanes, count: u32) -> (Lanes, Lanes) {
        let (mut key_inverse_depth, mut on_line) = (ZERO, *guess);
        for look_up in 1..=count {
            let x = per_lane(|i| on_line[i].mul_add(shift[0], direction.x[i]));
            let y = per_lane(|i| on_line[i].mul_add(shift[1], direction.y[i]));
            let position_px = self.ideal_px(&x, &y, |i| 1.0 / on_line[i].mul_add(shift[2], direction.z[i]));
            key_inverse_depth = if look_up < count {
                self.ideal.inverse_depth(self.frame, &position_px)
            } else {
                self.ideal.surface_at(self.frame, &position_px)
            };
            on_line = Self::row_inverse_depth(direction, shift, &key_inverse_depth, &on_line);
        }
        (key_inverse_depth, on_line)
    }

    /// Depth look-ups from the key frame's plane.
    #[inline(always)]
    fn iterate_depth(&self, direction: &Lanes3, shift: [f32; 3]) -> (Lanes, Lanes) {
        let [a, b, c, _] = self.frame.planes[self.key];
        let distance_ratio = 1.0 - (a * shift[0] + b * shift[1] + c * shift[2]);
        let guess = match distance_ratio > 1e-3 {
            true => per_lane(|i| {
                (a * direction.x[i] + b * direction.y[i] + c * direction.z[i]).max(0.0) / distance_ratio
            }),
            false => ZERO,
        };
        self.look_ups(direction, shift, &guess, self.frame.iterations)
    }

    #[inline(always)]
    fn iterated_depth(&self, uv: &Lanes2, pose: &LinePose) -> Lanes {
        self.iterate_depth(&rotate(pose, uv), translation(pose)).0
    }

    #[inline(always)]
    fn iterated_depth_from(&self, guess: &Lanes, uv: &Lanes2, pose: &LinePose) -> Lanes {
        let (direction, shift) = (rotate(pose, uv), translation(pose));
        let on_line = Self::row_inverse_depth(&direction, shift, guess, &ZERO);
        self.look_ups(&direction, shift, &on_line, self.frame.iterations.max(2) - 1).0
    }

    /// Sources of surfaces with this inverse depth in the key frame.
    #[inline(always)]
    fn source_of_depth(
        &self,
        uv: &Lanes2,
        pose: &LinePose,
        key_inverse_depth: impl Fn(usize) -> f32,
    ) -> BlockSources {
        let (direction, shift) = (rotate(pose, uv), translation(pose));
        let ([fx, fy], [cx, cy]) = (self.frame.ideal_focal_px, self.frame.ideal_principal_px);
        let key_inverse_depth = per_lane(key_inverse_depth);
        let scale = per_lane(|i| key_inverse_depth[i].mul_add(-shift[2], 1.0));
        let per_z = per_lane(|i| 1.0 / direction.z[i]);
        let shifted =
            |far: f32, scale: f32, moved: f32| if scale > 1e-3 { scale.mul_add(far, moved) } else { far };
        let position_px = Lanes2 {
            x: per_lane(|i| {
                shifted(direction.x[i] * per_z[i], scale[i], key_inverse_depth[i] * shift[0]).mul_add(fx, cx)
            }),
            y: per_lane(|i| {
                shifted(direction.y[i] * per_z[i], scale[i], key_inverse_depth[i] * shift[1]).mul_add(fy, cy)
            }),
        };
        BlockSources { inside: self.inside(&position_px, &direction.z), position_px }
    }

    /// Source at the instant of a pose.
    #[inline(always)]
    pub(super) fn solve(&self, uv: &Lanes2, pose: &LinePose) -> BlockSources {
        match self.temporal {
            TemporalStage::Identity => {
                let position_px = self.ideal_px(&uv.x, &uv.y, |_| 1.0);
                BlockSources { inside: self.inside(&position_px, &[1.0; LANES]), position_px }
            }
            TemporalStage::Rotation => {
                let key_inverse_depth = rotate(pose, uv);
                let position_px = self
                    .ideal_px(&key_inverse_depth.x, &key_inverse_depth.y, |i| 1.0 / key_inverse_depth.z[i]);
                BlockSources { inside: self.inside(&position_px, &key_inverse_depth.z), position_px }
            }
            _ => {
                let (direction, shift) = (rotate(pose, uv), translation(pose));
                let (_, w) = self.iterate_depth(&direction, shift);
                let x = per_lane(|i| w[i].mul_add(shift[0], direction.x[i]));
                let y = per_lane(|i| w[i].mul_add(shift[1], direction.y[i]));
                let z = per_lane(|i| w[i].mul_add(shift[2], direction.z[i]));
                let position_px = self.ideal_px(&x, &y, |i| 1.0 / z[i]);
                BlockSources { inside: self.inside(&position_px, &z), position_px }
            }
        }
    }
}

impl<'a> Nodes<'a> {
    /// Nodes of a line: `poses` are at the nodes, then at mid-exposure.
    #[inline(always)]
    pub fn new(stages: &'a Stages<'a>, uv: &'a Lanes2, poses: &[LinePose], depths: NodeDepths) -> Self {
        let last = poses.len() - 2;
        let depths = match (stages.temporal, depths) {
            (TemporalStage::Reproject { .. }, NodeDepths::Each) => {
                NodeInverseDepths::Each(stages.iterated_depth(uv, &poses[0]))
            }
            (TemporalStage::Reproject { .. }, NodeDepths::Mid) => NodeInverseDepths::BlockCurve {
                begin: stages.iterated_depth(uv, &poses[last + 1]),
                slope: ZERO,
                bend: ZERO,
            },
            (TemporalStage::Reproject { .. }, NodeDepths::Ends) => {
                let begin = stages.iterated_depth(uv, &poses[0]);
                let end = stages.iterated_depth_from(&begin, uv, &poses[last]);
                NodeInverseDepths::BlockCurve { begin, slope: per_lane(|i| end[i] - begin[i]), bend: ZERO }
            }
            (TemporalStage::Reproject { .. }, NodeDepths::Three) => {
                let middle = stages.iterated_depth(uv, &poses[last + 1]);
                let begin = stages.iterated_depth_from(&middle, uv, &poses[0]);
                let end = stages.iterated_depth_from(&middle, uv, &poses[last]);
                NodeInverseDepths::BlockCurve {
                    begin,
                    slope: per_lane(|i| 4.0 * middle[i] - 3.0 * begin[i] - end[i]),
                    bend: per_lane(|i| 2.0 * begin[i] + 2.0 * end[i] - 4.0 * middle[i]),
                }
            }
            _ => NodeInverseDepths::Solved,
        };
        Self { stages, uv, depths, node_fraction: 1.0 / last as f32 }
    }

    /// Source of the next node, by its number (the first is 0) and pose.
    #[inline(always)]
    pub fn next(&mut self, node: usize, pose: &LinePose) -> BlockSources {
        match &mut self.depths {
            NodeInverseDepths::Solved => self.stages.solve(self.uv, pose),
            NodeInverseDepths::Each(key_inverse_depth) => {
                if node > 0 {
                    *key_inverse_depth = self.stages.iterated_depth_from(key_inverse_depth, self.uv, pose);
                }
                self.stages.source_of_depth(self.uv, pose, |i| key_inverse_depth[i])
            }
            NodeInverseDepths::BlockCurve { begin, slope, bend } => {
                let fraction = node as f32 * self.node_fraction;
                self.stages.source_of_depth(self.uv, pose, |i| {
                    bend[i].mul_add(fraction, slope[i]).mul_add(fraction, begin[i])
                })
            }
        }
    }
}
