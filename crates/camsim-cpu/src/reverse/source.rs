//! Where rays look in the ideal frame: twins of shaders/reverse/temporal_inverse and
//! shaders/reverse/gather/nodes.

use super::Reads;
use crate::simd::lanes::{LANES, Lanes, Lanes2, Lanes3, ZERO, each, whether};
use camsim_plan::NodeDepths;
use camsim_plan::TemporalStage;

/// Rows of R, with t in w: x_key = R x_line + t.
pub(super) type Pose = [[f32; 4]; 3];

/// Sources of pixels at one instant.
#[derive(Clone, Copy, Debug)]
pub(super) struct Source {
    /// Ideal pixels.
    pub at_px: Lanes2,
    /// In front of the key camera and inside the ideal frame: 1, else 0.
    pub inside: Lanes,
}

/// Depths that the nodes of an exposure take.
#[expect(clippy::large_enum_variant, reason = "there is one, on the stack, a block")]
enum Depths {
    /// None: each is solved for itself.
    Solved,
    /// What the node before has found.
    Each(Lanes),
    /// `begin + share (slope + share bend)`.
    Curve { begin: Lanes, slope: Lanes, bend: Lanes },
}

/// The nodes of an exposure, one after the other.
pub(super) struct Nodes<'a> {
    reads: &'a Reads<'a>,
    uv: &'a Lanes2,
    depths: Depths,
    node_share: f32,
}

#[inline(always)]
pub(super) fn rotate(pose: &Pose, uv: &Lanes2) -> Lanes3 {
    let row = |r: [f32; 4]| each(|i| uv.x[i].mul_add(r[0], uv.y[i].mul_add(r[1], r[2])));
    Lanes3 { x: row(pose[0]), y: row(pose[1]), z: row(pose[2]) }
}

pub(super) fn translation(pose: &Pose) -> [f32; 3] {
    [pose[0][3], pose[1][3], pose[2][3]]
}

impl Reads<'_> {
    #[inline(always)]
    pub(super) fn ideal_px(&self, x: &Lanes, y: &Lanes, scale: impl Fn(usize) -> f32) -> Lanes2 {
        let ([fx, fy], [cx, cy]) = (self.frame.ideal_focal_px, self.frame.ideal_principal_px);
        let scale = each(scale);
        Lanes2 {
            x: each(|i| (x[i] * scale[i]).mul_add(fx, cx)),
            y: each(|i| (y[i] * scale[i]).mul_add(fy, cy)),
        }
    }

    #[inline(always)]
    fn inside(&self, at_px: &Lanes2, z: &Lanes) -> Lanes {
        let [right, bottom] = self.frame.ideal_size_px.map(|size| size as f32 - 0.5);
        whether(|i| {
            (z[i] > 0.0)
                & (at_px.x[i] >= -0.5)
                & (at_px.x[i] <= right)
                & (at_px.y[i] >= -0.5)
                & (at_px.y[i] <= bottom)
        })
    }

    /// The inverse depth on the line's ray of what the key frame has the inverse depth `found` of. At or
    /// behind the line's own image plane the last guess is kept.
    #[inline(always)]
    fn row_inverse_depth(direction: &Lanes3, shift: [f32; 3], found: &Lanes, guess: &Lanes) -> Lanes {
        each(|i| {
            let scale = found[i].mul_add(-shift[2], 1.0);
            if scale > 1e-3 { found[i] * direction.z[i] / scale } else { guess[i] }
        })
    }

    /// Look-ups from a guess on the line on, the last of them beside the sky too: the key frame's inverse
    /// depth that the last one finds, and what that is on the line.
    #[inline(always)]
    fn looks(&self, direction: &Lanes3, shift: [f32; 3], guess: &Lanes, count: u32) -> (Lanes, Lanes) {
        let (mut in_key, mut on_line) = (ZERO, *guess);
        for look in 1..=count {
            let x = each(|i| on_line[i].mul_add(shift[0], direction.x[i]));
            let y = each(|i| on_line[i].mul_add(shift[1], direction.y[i]));
            let at_px = self.ideal_px(&x, &y, |i| 1.0 / on_line[i].mul_add(shift[2], direction.z[i]));
            in_key = if look < count {
                self.ideal.inverse_depth(self.frame, &at_px)
            } else {
                self.ideal.surface_at(self.frame, &at_px)
            };
            on_line = Self::row_inverse_depth(direction, shift, &in_key, &on_line);
        }
        (in_key, on_line)
    }

    /// Look-ups that begin with the key frame's plane.
    #[inline(always)]
    fn settle(&self, direction: &Lanes3, shift: [f32; 3]) -> (Lanes, Lanes) {
        let [a, b, c, _] = self.frame.planes[0];
        let before = 1.0 - (a * shift[0] + b * shift[1] + c * shift[2]);
        let guess = match before > 1e-3 {
            true => {
                each(|i| (a * direction.x[i] + b * direction.y[i] + c * direction.z[i]).max(0.0) / before)
            }
            false => ZERO,
        };
        self.looks(direction, shift, &guess, self.frame.iterations)
    }

    #[inline(always)]
    fn settled_depth(&self, uv: &Lanes2, pose: &Pose) -> Lanes {
        self.settle(&rotate(pose, uv), translation(pose)).0
    }

    #[inline(always)]
    fn settled_depth_from(&self, guess: &Lanes, uv: &Lanes2, pose: &Pose) -> Lanes {
        let (direction, shift) = (rotate(pose, uv), translation(pose));
        let on_line = Self::row_inverse_depth(&direction, shift, guess, &ZERO);
        self.looks(&direction, shift, &on_line, self.frame.iterations.max(2) - 1).0
    }

    /// Where a surface of this inverse depth in the key frame is seen.
    #[inline(always)]
    fn source_of_depth(&self, uv: &Lanes2, pose: &Pose, found: impl Fn(usize) -> f32) -> Source {
        let (direction, shift) = (rotate(pose, uv), translation(pose));
        let ([fx, fy], [cx, cy]) = (self.frame.ideal_focal_px, self.frame.ideal_principal_px);
        let found = each(found);
        let scale = each(|i| found[i].mul_add(-shift[2], 1.0));
        let per_z = each(|i| 1.0 / direction.z[i]);
        let place =
            |far: f32, scale: f32, moved: f32| if scale > 1e-3 { scale.mul_add(far, moved) } else { far };
        let at_px = Lanes2 {
            x: each(|i| place(direction.x[i] * per_z[i], scale[i], found[i] * shift[0]).mul_add(fx, cx)),
            y: each(|i| place(direction.y[i] * per_z[i], scale[i], found[i] * shift[1]).mul_add(fy, cy)),
        };
        Source { inside: self.inside(&at_px, &direction.z), at_px }
    }

    /// The source at the instant of a pose.
    #[inline(always)]
    pub(super) fn solve(&self, uv: &Lanes2, pose: &Pose) -> Source {
        match self.temporal {
            TemporalStage::Identity => {
                let at_px = self.ideal_px(&uv.x, &uv.y, |_| 1.0);
                Source { inside: self.inside(&at_px, &[1.0; LANES]), at_px }
            }
            TemporalStage::Rotation => {
                let in_key = rotate(pose, uv);
                let at_px = self.ideal_px(&in_key.x, &in_key.y, |i| 1.0 / in_key.z[i]);
                Source { inside: self.inside(&at_px, &in_key.z), at_px }
            }
            _ => {
                let (direction, shift) = (rotate(pose, uv), translation(pose));
                let (_, w) = self.settle(&direction, shift);
                let x = each(|i| w[i].mul_add(shift[0], direction.x[i]));
                let y = each(|i| w[i].mul_add(shift[1], direction.y[i]));
                let z = each(|i| w[i].mul_add(shift[2], direction.z[i]));
                let at_px = self.ideal_px(&x, &y, |i| 1.0 / z[i]);
                Source { inside: self.inside(&at_px, &z), at_px }
            }
        }
    }
}

impl<'a> Nodes<'a> {
    /// Of a line's poses: at the nodes, then at mid-exposure.
    #[inline(always)]
    pub fn new(reads: &'a Reads<'a>, uv: &'a Lanes2, poses: &[Pose], depths: NodeDepths) -> Self {
        let last = poses.len() - 2;
        let depths = match (reads.temporal, depths) {
            (TemporalStage::Reproject { .. }, NodeDepths::Each) => {
                Depths::Each(reads.settled_depth(uv, &poses[0]))
            }
            (TemporalStage::Reproject { .. }, NodeDepths::Mid) => {
                Depths::Curve { begin: reads.settled_depth(uv, &poses[last + 1]), slope: ZERO, bend: ZERO }
            }
            (TemporalStage::Reproject { .. }, NodeDepths::Ends) => {
                let begin = reads.settled_depth(uv, &poses[0]);
                let end = reads.settled_depth_from(&begin, uv, &poses[last]);
                Depths::Curve { begin, slope: each(|i| end[i] - begin[i]), bend: ZERO }
            }
            (TemporalStage::Reproject { .. }, NodeDepths::Three) => {
                let middle = reads.settled_depth(uv, &poses[last + 1]);
                let begin = reads.settled_depth_from(&middle, uv, &poses[0]);
                let end = reads.settled_depth_from(&middle, uv, &poses[last]);
                Depths::Curve {
                    begin,
                    slope: each(|i| 4.0 * middle[i] - 3.0 * begin[i] - end[i]),
                    bend: each(|i| 2.0 * begin[i] + 2.0 * end[i] - 4.0 * middle[i]),
                }
            }
            _ => Depths::Solved,
        };
        Self { reads, uv, depths, node_share: 1.0 / last as f32 }
    }

    /// The next one: number and pose. The first is number 0.
    #[inline(always)]
    pub fn next(&mut self, node: usize, pose: &Pose) -> Source {
        match &mut self.depths {
            Depths::Solved => self.reads.solve(self.uv, pose),
            Depths::Each(found) => {
                if node > 0 {
                    *found = self.reads.settled_depth_from(found, self.uv, pose);
                }
                self.reads.source_of_depth(self.uv, pose, |i| found[i])
            }
            Depths::Curve { begin, slope, bend } => {
                let share = node as f32 * self.node_share;
                self.reads.source_of_depth(self.uv, pose, |i| {
                    bend[i].mul_add(share, slope[i]).mul_add(share, begin[i])
                })
            }
        }
    }
}
