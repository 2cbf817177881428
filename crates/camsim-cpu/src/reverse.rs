//! The reverse pipeline on the host's own processors: for software adapters, whose device they are anyway.
//!
//! A twin, stage by stage, of the kernel in `shaders/reverse`, for the ways of sampling that most frames have
//! ([`serves`]). Such an adapter's driver compiles a kernel for pixels side by side and reads buffers,
//! textures and conditions lane by lane; here colour is read four channels at a time, what no pixel of a
//! block needs is left out, and the picture is written where it is wanted. Only ideal frame and lens map come
//! from the device.

#![expect(clippy::needless_range_loop, reason = "numbers of one pixel have one place in all arrays")]

use camsim_core::{noise::tail_segments, temporal::TapStage};
use camsim_plan::{BlurStage, FramePlan, RayStage};
use rayon::prelude::*;

use camsim_plan::{
    TemporalStage,
    uniforms::{FrameUniforms, Truth},
};

mod copied;
mod footprint;
mod gather;
mod ideal;
mod photometric;
mod rays;
mod source;
mod truth;

use crate::simd::lanes::{LANES, ZERO, each};
#[cfg(target_arch = "x86_64")]
use crate::simd::vectors::Avx2;
use crate::simd::vectors::{Vectors, widest};
use footprint::{Cells, Footprint};
pub use ideal::IdealTexels;
pub use rays::LensMap;
use source::Pose;

/// Rows that a task takes.
const ROWS_A_TASK: usize = 16;

/// Whether this processor has what makes it fast here: multiplication and addition in one, and on x86-64
/// vectors of eight and half floats.
#[must_use]
pub fn suits_processor() -> bool {
    #[cfg(target_arch = "x86_64")]
    return Avx2::find().is_some();
    #[cfg(not(target_arch = "x86_64"))]
    cfg!(target_arch = "aarch64")
}

/// What stays from frame to frame.
#[derive(Debug)]
pub struct Kernel {
    segments: Vec<[f32; 2]>,
    cells: Cells,
}

/// What a frame is made from.
#[derive(Clone, Copy, Debug)]
pub struct Inputs<'a> {
    /// Its numbers.
    pub frame: &'a FrameUniforms,
    /// Relative poses of the lines.
    pub poses: &'a [Pose],
    /// Ideal rays, if there is a lens.
    pub map: Option<&'a LensMap>,
    /// Weights of the vignette: of every pixel, or one for all.
    pub vignette: &'a [f32],
    /// The ideal frame.
    pub ideal: IdealTexels<'a>,
}

/// What the stages of a frame read.
struct Reads<'a> {
    frame: &'a FrameUniforms,
    ideal: IdealTexels<'a>,
    temporal: TemporalStage,
    blur: Option<BlurStage>,
    tap: TapStage,
    map: Option<&'a LensMap>,
    vignette: &'a [f32],
    poses: &'a [Pose],
    /// Pose of the key camera in the mid-window camera, if it is another one and somebody asks.
    elsewhere: Option<Pose>,
    /// The same numbers for depth and coordinates, where they are told: where the sky is does not depend on
    /// what is beside it.
    frame_of_truth: Option<&'a FrameUniforms>,
    /// The first pixel's place in the ideal frame, where pixels are those.
    copied_from: Option<[u32; 2]>,
    segments: &'a [[f32; 2]],
    cells: &'a Cells,
}

impl Kernel {
    /// Makes the tables.
    #[must_use]
    pub fn new() -> Self {
        Self { segments: tail_segments(), cells: Cells::new() }
    }

    /// The picture of a plan that it [`serves`], linear R G B A, row-major; and the truth about it as looked
    /// up, where the plan asks for that.
    #[must_use]
    pub fn render(&self, plan: &FramePlan, inputs: &Inputs<'_>) -> (Vec<f32>, Option<Vec<Truth>>) {
        let tells_truth = plan.truth;
        let Inputs { frame, poses, map, vignette, ideal } = *inputs;
        let [width, height] = frame.size_px.map(|side| side as usize);
        let frame_of_truth = FrameUniforms { sky_reach_px: 0.0, ..*frame };
        let reads = Reads {
            frame,
            frame_of_truth: Some(&frame_of_truth).filter(|_| tells_truth),
            ideal,
            temporal: plan.temporal,
            blur: plan.blur,
            tap: plan.taps,
            map: map.filter(|_| plan.ray == RayStage::LensMap),
            vignette,
            poses,
            elsewhere: poses.get(height * poses_a_line(frame)).copied().filter(|_| has_other_pose(plan)),
            copied_from: plan.copied_from(),
            segments: &self.segments,
            cells: &self.cells,
        };
        let mut picture = vec![0.0; 4 * width * height];
        let mut truth = vec![Truth::default(); if tells_truth { width * height } else { 0 }];
        let rows = picture.par_chunks_mut(4 * width * ROWS_A_TASK).zip(0_u32..u32::MAX);
        let of_task = |task: u32| task * ROWS_A_TASK as u32;
        match tells_truth {
            true => rows
                .zip(truth.par_chunks_mut(width * ROWS_A_TASK))
                .for_each(|((rows, task), truth)| reads.rows(of_task(task), rows, truth)),
            false => rows.for_each(|(rows, task)| reads.rows(of_task(task), rows, &mut [])),
        }
        (picture, tells_truth.then_some(truth))
    }
}

/// Whether coordinates have to be taken from the ideal frame's camera to the mid-window one.
fn has_other_pose(plan: &FramePlan) -> bool {
    let moves = matches!(plan.temporal, TemporalStage::Rotation | TemporalStage::Reproject { .. });
    moves && plan.truth && plan.has_displaced_key()
}

/// As in shaders/reverse/temporal_inverse/line_entry.wgsl.
fn poses_a_line(frame: &FrameUniforms) -> usize {
    if frame.nodes == 1 { 1 } else { frame.nodes as usize + 1 }
}

impl Default for Kernel {
    fn default() -> Self {
        Self::new()
    }
}

impl Reads<'_> {
    /// Rows from `first` on, by the widest vectors that the processor has.
    fn rows(&self, first: u32, rows: &mut [f32], truth: &mut [Truth]) {
        widest!(vectors => self.rows_by(vectors, first, rows, truth))
    }

    #[inline(always)]
    fn rows_by(&self, vectors: impl Vectors, first: u32, rows: &mut [f32], truth: &mut [Truth]) {
        if let Some(from) = self.copied_from.filter(|_| self.frame_of_truth.is_none()) {
            return self.copied_rows(vectors, from, first, rows);
        }
        let width = self.frame.size_px[0] as usize;
        // Blocks below each other first: what they read of the ideal frame is nearly the same.
        for x in (0..width).step_by(LANES) {
            let end = width.min(x + LANES);
            for (number, row) in rows.chunks_exact_mut(4 * width).enumerate() {
                let truth = if self.frame_of_truth.is_some() {
                    &mut truth[number * width..][x..end]
                } else {
                    &mut []
                };
                self.block(vectors, [x as u32, first + number as u32], &mut row[4 * x..4 * end], truth);
            }
        }
    }

    /// Poses of a line at the nodes of the exposure, then at mid-exposure.
    fn poses_of(&self, y: u32) -> &[Pose] {
        let stride = poses_a_line(self.frame);
        self.poses.get(y as usize * stride..(y as usize + 1) * stride).unwrap_or_default()
    }

    #[inline(always)]
    fn block(&self, vectors: impl Vectors, [x, y]: [u32; 2], block: &mut [f32], truth: &mut [Truth]) {
        let rays = rays::rays(self.frame, self.map, x, y);
        let weight = self.weights(x, y);
        let wanted = each(|i| if weight[i] > 0.0 { rays.valid[i] } else { 0.0 });
        let (mut colors, mut inside) = ([[0.0; 4]; LANES], rays.valid);
        let is_asked = if self.frame_of_truth.is_some() { &rays.valid } else { &wanted };
        if let Some(mid) = self.poses_of(y).last().filter(|_| is_asked.iter().any(|&asked| asked > 0.0)) {
            let sides = || rays::sides(self.frame, self.map, x, y);
            let area = Footprint::new(self.cells, self.tap, sides, self.frame.max_taps);
            // The picture first, then the truth about it: one place in the code, where all of this is written
            // out.
            for (frame, is_truth) in [(Some(self.frame), false), (self.frame_of_truth, true)] {
                let Some(frame) = frame else { continue };
                let reads = Reads { frame, ..*self };
                let gathered = reads.gather(
                    vectors,
                    &rays.uv,
                    &area,
                    self.poses_of(y),
                    mid,
                    if is_truth { &ZERO } else { &wanted },
                );
                if is_truth {
                    reads.truth(&rays.uv, mid, &gathered.at_phase_px, &inside, truth);
                } else {
                    colors =
                        self.copied_from.map_or(gathered.color, |from| self.copied(vectors, from, [x, y]));
                    // What is black whatever it shows is not looked for.
                    inside = each(|i| {
                        if weight[i] > 0.0 { rays.valid[i] * gathered.inside[i] } else { rays.valid[i] }
                    });
                }
            }
        }
        if inside.iter().all(|&inside| inside == 0.0) {
            block.fill(0.0);
            return;
        }
        let [r, g, b] = photometric::photometric(self.frame, self.segments, [x, y], &colors, &weight);
        for (i, pixel) in block.chunks_exact_mut(4).enumerate() {
            pixel.copy_from_slice(&[r[i] * inside[i], g[i] * inside[i], b[i] * inside[i], inside[i]]);
        }
    }

    /// Of the vignette; 0 beyond the row's end.
    #[inline(always)]
    fn weights(&self, x: u32, y: u32) -> [f32; LANES] {
        let mut weights = [0.0; LANES];
        let width = self.frame.size_px[0];
        match self.vignette {
            [one] => weights = [*one; LANES],
            all => {
                let row = &all[(y * width + x) as usize..((y + 1) * width) as usize];
                weights.iter_mut().zip(row).for_each(|(weight, given)| *weight = *given);
            }
        }
        weights
    }
}
