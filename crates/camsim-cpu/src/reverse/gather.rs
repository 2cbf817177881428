//! Gather over the exposure: twin of camsim-gpu/shaders/reverse/gather.

use camsim_plan::PathStage;

use super::{
    Stages,
    footprint::{BlockSpline, Footprint},
    ideal_texels::HalfSums,
    source::{BlockSources, LinePose, Nodes},
};
use crate::simd::lanes::{LANES, Lanes, Lanes2, ZERO, indicator, per_lane};
use crate::simd::vectors::Vectors;

/// Result of the gather for a block.
pub(super) struct BlockGather {
    /// R G B A, mean over the exposure.
    pub color: [[f32; 4]; LANES],
    /// 1 if all nodes are inside the ideal frame, else 0.
    pub inside: Lanes,
    /// Sources at the exposure phase that is reported, ideal pixels.
    pub at_phase_px: Lanes2,
}

/// Polynomial of time through up to five nodes, by Newton's forward differences.
struct BlockCurve {
    path: PathStage,
    begin_px: Lanes2,
    differences: [Lanes2; 4],
    length_px: Lanes,
    inside: Lanes,
    end: BlockSources,
}

impl BlockCurve {
    /// Polynomial from a node, `step` steps after the first.
    #[inline(always)]
    fn new(
        path: PathStage,
        nodes: &mut Nodes<'_>,
        begin: &BlockSources,
        step: usize,
        stride: usize,
        poses: &[LinePose],
    ) -> Self {
        let mut differences = [Lanes2::ZERO; 4];
        let mut length_px = ZERO;
        let mut inside = begin.inside;
        let mut end = *begin;
        let steps = path.steps() as usize;
        for (k, difference) in differences.iter_mut().enumerate().take(steps) {
            let node = stride * (step + k + 1);
            let next = nodes.next(node, &poses[node]);
            *difference = next.position_px.minus(&end.position_px);
            let length = difference.length();
            length_px = per_lane(|i| length_px[i] + length[i]);
            inside = per_lane(|i| inside[i] * next.inside[i]);
            end = next;
        }
        // First differences of neighbours, then higher ones.
        for order in 1..steps {
            for k in (order..steps).rev() {
                differences[k] = differences[k].minus(&differences[k - 1]);
            }
        }
        Self { path, begin_px: begin.position_px, differences, length_px, inside, end }
    }

    /// A constant position.
    fn point(source: BlockSources) -> Self {
        Self {
            path: PathStage::Straight,
            begin_px: source.position_px,
            differences: [Lanes2::ZERO; 4],
            length_px: ZERO,
            inside: source.inside,
            end: source,
        }
    }

    /// Positions after a number of steps.
    #[inline(always)]
    fn along(&self, steps: &Lanes) -> Lanes2 {
        let (begin, [d1, d2, d3, d4]) = (&self.begin_px, &self.differences);
        Lanes2 {
            x: along(self.path, steps, &begin.x, [&d1.x, &d2.x, &d3.x, &d4.x]),
            y: along(self.path, steps, &begin.y, [&d1.y, &d2.y, &d3.y, &d4.y]),
        }
    }
}

/// One axis of the polynomial.
#[inline(always)]
fn along(path: PathStage, steps: &Lanes, begin: &Lanes, [d1, d2, d3, d4]: [&Lanes; 4]) -> Lanes {
    match path {
        PathStage::Straight => per_lane(|i| steps[i].mul_add(d1[i], begin[i])),
        PathStage::Parabola => {
            per_lane(|i| steps[i].mul_add((0.5 * (steps[i] - 1.0)).mul_add(d2[i], d1[i]), begin[i]))
        }
        PathStage::Quartic => per_lane(|i| {
            let third = (0.25 * (steps[i] - 3.0)).mul_add(d4[i], d3[i]);
            let second = ((steps[i] - 2.0) * (1.0 / 3.0)).mul_add(third, d2[i]);
            steps[i].mul_add((0.5 * (steps[i] - 1.0)).mul_add(second, d1[i]), begin[i])
        }),
    }
}

impl Stages<'_> {
    /// Gathers pixels of a line. `poses` are at the nodes, then at mid-exposure. Colours are gathered only
    /// for pixels with `is_wanted` 1 (else 0).
    #[inline(always)]
    pub(super) fn gather(
        &self,
        vectors: impl Vectors,
        uv: &Lanes2,
        footprint: &Footprint<'_>,
        poses: &[LinePose],
        mid: &LinePose,
        is_wanted: &Lanes,
    ) -> BlockGather {
        let mut sum = [[0.0; 4]; LANES];
        let Some(blur) = self.blur else {
            let curve = BlockCurve::point(self.solve(uv, mid));
            let count = per_lane(|i| footprint.tap_count(i) * is_wanted[i] * curve.inside[i]);
            self.add_mean(vectors, &curve, &count, footprint, &ZERO, &mut sum);
            return BlockGather { color: sum, inside: curve.inside, at_phase_px: curve.begin_px };
        };
        let segments = blur.stretches();
        let per_segment = 1.0 / segments as f32;
        let min_samples = per_lane(|i| (footprint.tap_count(i) * per_segment).ceil());
        let mut nodes = Nodes::new(self, uv, poses, blur.depths);
        let mut source = nodes.next(0, &poses[0]);
        let mut inside = source.inside;
        let mut samples_taken = ZERO;
        let mut at_phase_px = Lanes2::ZERO;
        let segment_position = (self.frame.coords_phase + 0.5).clamp(0.0, 1.0) * segments as f32;
        for segment in 0..segments {
            let steps = blur.path.steps() as usize;
            let curve = BlockCurve::new(
                blur.path,
                &mut nodes,
                &source,
                segment as usize * steps,
                blur.stride as usize,
                poses,
            );
            inside = per_lane(|i| inside[i] * curve.inside[i]);
            let samples = self.samples(&curve.length_px, &min_samples);
            let count = per_lane(|i| samples[i] * inside[i] * is_wanted[i]);
            self.add_mean(vectors, &curve, &count, footprint, &samples_taken, &mut sum);
            samples_taken = per_lane(|i| samples_taken[i] + samples[i]);
            source = curve.end;
            if self.truth_frame.is_some() && segment == (segment_position as u32).min(segments - 1) {
                at_phase_px = curve.along(&[(segment_position - segment as f32) * steps as f32; LANES]);
            }
        }
        if self.truth_frame.is_some() && self.frame.coords_phase == 0.0 {
            at_phase_px = self.solve(uv, mid).position_px;
        }
        for part in sum.as_flattened_mut() {
            *part *= per_segment;
        }
        BlockGather { color: sum, inside, at_phase_px }
    }

    /// Number of samples for a path of this length.
    #[inline(always)]
    fn samples(&self, length_px: &Lanes, min_samples: &Lanes) -> Lanes {
        let (samples_per_px, max_count) = (self.frame.samples_per_px, self.frame.max_samples as f32);
        per_lane(|i| {
            let requested = (samples_per_px * length_px[i]).min(length_px[i] + 16.0).ceil();
            let capped = if requested < max_count { requested } else { max_count };
            if capped > min_samples[i] { capped } else { min_samples[i] }
        })
    }

    /// Adds the mean of `count` samples along a curve; `samples_taken` samples precede them.
    #[inline(always)]
    fn add_mean(
        &self,
        vectors: impl Vectors,
        curve: &BlockCurve,
        count: &Lanes,
        footprint: &Footprint<'_>,
        samples_taken: &Lanes,
        sum: &mut [[f32; 4]; LANES],
    ) {
        let steps = curve.path.steps() as f32;
        let fraction = per_lane(|i| 1.0 / count[i].max(1.0));
        let max_count = count.iter().fold(0.0, |max_count: f32, &count| max_count.max(count));
        let mut curve_sum = [[0.0; 8]; LANES];
        let mut sample = 0.0;
        while sample < max_count {
            let step = per_lane(|i| steps * fraction[i] * (sample + 0.5));
            let tap = per_lane(|i| samples_taken[i] + sample);
            self.add_sample(
                vectors,
                &curve.along(&step),
                footprint,
                &tap,
                |i| count[i] > sample,
                &mut curve_sum,
            );
            sample += 1.0;
        }
        for i in 0..LANES {
            for k in 0..4 {
                sum[i][k] += (curve_sum[i][k] + curve_sum[i][k + 4]) * fraction[i];
            }
        }
    }

    /// Adds one sample for each pixel that takes one: a tap of its grid, its area, or the spline.
    #[inline(always)]
    fn add_sample(
        &self,
        vectors: impl Vectors,
        position_px: &Lanes2,
        footprint: &Footprint<'_>,
        tap: &Lanes,
        is_taken: impl Fn(usize) -> bool,
        sum: &mut [HalfSums; LANES],
    ) {
        let Some(softness) = &footprint.softness else {
            return self.ideal.add_color(
                vectors,
                self.frame,
                &footprint.tap_position_px(position_px, tap),
                is_taken,
                |_| 1.0,
                sum,
            );
        };
        let wide = indicator(|i| footprint.is_wide(i));
        if wide.contains(&1.0) {
            let is_taken = |i: usize| is_taken(i) && wide[i] > 0.0;
            match &footprint.area {
                Some(sides_px) => {
                    self.ideal.add_area(vectors, self.frame, position_px, sides_px, is_taken, sum)
                }
                None => self.ideal.add_color(
                    vectors,
                    self.frame,
                    &footprint.tap_position_px(position_px, tap),
                    is_taken,
                    |_| 1.0,
                    sum,
                ),
            }
        }
        if wide.contains(&0.0) {
            let spline = BlockSpline::texel_neighbourhoods(position_px, softness);
            self.ideal.add_spline(vectors, self.frame, &spline, |i| is_taken(i) && wide[i] == 0.0, sum);
        }
    }
}
