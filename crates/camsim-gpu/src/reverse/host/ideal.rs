//! Reads of the ideal frame.

use crate::host::lanes::{LANES, Lanes, Lanes2, ZERO, each, higher, lower, whole, within};
use crate::host::vectors::Vectors;
use crate::layout::FrameUniforms;

/// Half floats of a texel.
const CHANNELS: usize = 4;

/// Colours of the left and of the right texels that a pixel's reads lie between, to be added in the end: R G B A each.
pub(super) type Halves = [f32; 2 * CHANNELS];

/// An ideal frame in the host's memory, as the device has copied it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct IdealOnHost<'a> {
    /// Linear R G B A, half floats.
    pub color: &'a [u16],
    /// Texels from one row to the next.
    pub color_stride: u32,
    /// Reversed depth, near / z.
    pub depth: &'a [f32],
    /// The same of depths.
    pub depth_stride: u32,
}

/// Where four texels around a place begin, and how far the place is from the first to the last.
struct Around {
    first: [u32; LANES],
    t: Lanes2,
}

/// Of the frame; places outside go to its border. Frames are at least two texels wide and high.
#[inline(always)]
fn around(frame: &FrameUniforms, at_px: &Lanes2, stride: u32) -> Around {
    let last = frame.ideal_size_px.map(|size| (size - 1) as f32);
    let at = Lanes2 { x: each(|i| within(at_px.x[i], last[0])), y: each(|i| within(at_px.y[i], last[1])) };
    let x = each(|i| within(at.x[i].floor(), last[0] - 1.0));
    let y = each(|i| within(at.y[i].floor(), last[1] - 1.0));
    let mut first = [0; LANES];
    for i in 0..LANES {
        first[i] = whole(y[i]) * stride + whole(x[i]);
    }
    Around { first, t: at.minus(&Lanes2 { x, y }) }
}

impl IdealOnHost<'_> {
    /// Inverse planar depth, 1/m: bilinear, which is exact on planes; the nearest texel where the four belong to different surfaces.
    #[inline(always)]
    pub(super) fn inverse_depth(&self, frame: &FrameUniforms, at_px: &Lanes2) -> Lanes {
        let Around { first, t } = around(frame, at_px, self.depth_stride);
        let (mut d00, mut d10, mut d01, mut d11) = (ZERO, ZERO, ZERO, ZERO);
        let span = self.depth_stride as usize + 2;
        for i in 0..LANES {
            [[d00[i], d10[i]], [d01[i], d11[i]]] = ends(self.depth, first[i] as usize, span);
        }
        let per_m = 1.0 / frame.near_m;
        each(|i| {
            let low = lower(lower(d00[i], d10[i]), lower(d01[i], d11[i]));
            let high = higher(higher(d00[i], d10[i]), higher(d01[i], d11[i]));
            let top = t.x[i].mul_add(d10[i] - d00[i], d00[i]);
            let bottom = t.x[i].mul_add(d11[i] - d01[i], d01[i]);
            let mixed = t.y[i].mul_add(bottom - top, top);
            let top = if t.x[i] > 0.5 { d10[i] } else { d00[i] };
            let bottom = if t.x[i] > 0.5 { d11[i] } else { d01[i] };
            let nearest = if t.y[i] > 0.5 { bottom } else { top };
            per_m * if low > 0.9 * high { mixed } else { nearest }
        })
    }

    /// Adds a bilinear read of linear colour, times a weight, for each pixel that takes one: what its left texels give and what its right ones do.
    #[inline(always)]
    pub(super) fn add_color(
        &self,
        vectors: impl Vectors,
        frame: &FrameUniforms,
        at_px: &Lanes2,
        is_taken: impl Fn(usize) -> bool,
        weight: impl Fn(usize) -> f32,
        sum: &mut [Halves; LANES],
    ) {
        let Around { first, t } = around(frame, at_px, self.color_stride);
        let span = CHANNELS * (self.color_stride as usize + 2);
        for i in 0..LANES {
            if !is_taken(i) {
                continue;
            }
            let [top, bottom] = ends(self.color, CHANNELS * first[i] as usize, span);
            let (top, bottom) = (vectors.numbers(top), vectors.numbers(bottom));
            for k in 0..2 * CHANNELS {
                let between = t.y[i].mul_add(bottom[k] - top[k], top[k]);
                // Left texels come first.
                let share = if k < CHANNELS { 1.0 - t.x[i] } else { t.x[i] };
                sum[i][k] = (weight(i) * share).mul_add(between, sum[i][k]);
            }
        }
    }
}

/// The first and the last values of so many from a place on; zeros beyond the end, where no place within the frame leads.
#[inline(always)]
fn ends<T: Copy + Default, const N: usize>(values: &[T], at: usize, span: usize) -> [[T; N]; 2] {
    let of = values.get(at..at + span).and_then(|values| Some([*values.first_chunk()?, *values.last_chunk()?]));
    of.unwrap_or([[T::default(); N]; 2])
}
