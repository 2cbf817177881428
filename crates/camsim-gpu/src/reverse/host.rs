//! The reverse pipeline on the host's own processors: for software adapters, whose device they are anyway.
//!
//! A twin, stage by stage, of the kernel in `shaders/reverse`, for the ways of sampling that most frames have
//! ([`serves`]). Such an adapter's driver compiles a kernel for pixels side by side and reads buffers,
//! textures and conditions lane by lane; here colour is read four channels at a time, what no pixel of a
//! block needs is left out, and the picture is written where it is wanted. Only ideal frame and lens map come
//! from the device.

#![expect(clippy::needless_range_loop, reason = "numbers of one pixel have one place in all arrays")]

use camsim_core::{noise::tail_segments, shutter::LinesAxis, temporal::TapStage};
use camsim_plan::{BlurStage, FramePlan, RayStage};
use rayon::prelude::*;

use crate::{
    layout::{FrameUniforms, Truth},
    reverse::{KeyKind, PipelineKey, TapKind, TemporalKind},
};

mod copied;
mod footprint;
mod gather;
mod ideal;
mod photometric;
mod rays;
mod source;
mod truth;

use crate::host::lanes::{LANES, ZERO, each};
#[cfg(target_arch = "x86_64")]
use crate::host::vectors::Avx2;
use crate::host::vectors::{Vectors, widest};
use footprint::{Cells, Footprint, MOST_TAPS};
pub(crate) use ideal::IdealOnHost;
pub(crate) use rays::LensMapOnHost;
use source::Pose;

/// Pixels of an ideal frame for each pixel that is made from it, at most: with 13 frames come in less time
/// than from the device with and without an exposure, with 29 without one not any more (docs/PERFORMANCE.md,
/// "The reverse pipeline on the host").
const MOST_COPIED: f64 = 12.0;
/// Rows that a task takes.
const ROWS_A_TASK: usize = 16;

/// Where the reverse pipeline runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReverseOn {
    /// On the device.
    Device,
    /// On the host, for frames that it [`serves`] and whose ideal frame it [draws](crate::ideal::host::draws)
    /// itself or that are [worth the copy](is_worth_the_copy): the default on a software adapter.
    Best,
    /// On the host, for all frames that it serves.
    Host,
}

impl ReverseOn {
    /// Whether the host makes frames of this plan from ideal frames of the device's.
    #[must_use]
    pub fn is_host(self, plan: &FramePlan) -> bool {
        match self {
            Self::Device => false,
            Self::Best => serves(plan) && is_worth_the_copy(plan),
            Self::Host => serves(plan),
        }
    }
}

/// Whether this processor has what makes it fast here: multiplication and addition in one, and on x86-64
/// vectors of eight and half floats.
#[must_use]
pub fn suits_processor() -> bool {
    #[cfg(target_arch = "x86_64")]
    return Avx2::find().is_some();
    #[cfg(not(target_arch = "x86_64"))]
    cfg!(target_arch = "aarch64")
}

/// Whether frames of this plan can be made here: of one ideal frame, without rays of its own at silhouettes,
/// by a lens that stays, lines that are rows, and grids of few reads. That is what most frames are by
/// default.
#[must_use]
pub fn serves(plan: &FramePlan) -> bool {
    let key = PipelineKey::of(plan);
    let is_plain = key.keys != KeyKind::Several && !plan.edges.has_rays() && !key.paper;
    let solves =
        matches!(key.temporal, TemporalKind::Identity | TemporalKind::Rotation | TemporalKind::Reproject);
    let keeps_lens = key.ray == RayStage::Pinhole || plan.zoom.is_none();
    let has_rows = plan.shutter.lines_axis() == LinesAxis::Rows;
    let has_few_taps = match plan.taps {
        TapStage::Grid { most } | TapStage::SplineOrGrid { most } => most <= MOST_TAPS,
        TapStage::Bilinear | TapStage::Spline | TapStage::Area => true,
    };
    let has_sides = plan.ideal.size_px.iter().all(|&side| side >= 2);
    is_plain && solves && keeps_lens && has_rows && has_few_taps && has_sides
}

/// Whether a frame that is [`served`](serves) takes less time here: its ideal frame is brought here in less
/// than its output frames save.
#[must_use]
pub fn is_worth_the_copy(plan: &FramePlan) -> bool {
    let area = |[width, height]: [u32; 2]| f64::from(width) * f64::from(height);
    let frames = plan.shared_by.map_or(1.0, |[first, last]| (last - first + 1) as f64);
    area(plan.ideal.size_px) <= MOST_COPIED * frames * area(plan.camera.size_px)
}

/// What stays from frame to frame.
#[derive(Debug)]
pub(crate) struct HostKernel {
    segments: Vec<[f32; 2]>,
    cells: Cells,
}

/// What a frame is made from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HostInputs<'a> {
    /// Its numbers.
    pub frame: &'a FrameUniforms,
    /// Relative poses of the lines.
    pub poses: &'a [Pose],
    /// Ideal rays, if there is a lens.
    pub map: Option<&'a LensMapOnHost>,
    /// Weights of the vignette: of every pixel, or one for all.
    pub vignette: &'a [f32],
    /// The ideal frame.
    pub ideal: IdealOnHost<'a>,
}

/// What the stages of a frame read.
struct Reads<'a> {
    frame: &'a FrameUniforms,
    ideal: IdealOnHost<'a>,
    temporal: TemporalKind,
    blur: Option<BlurStage>,
    tap: TapKind,
    map: Option<&'a LensMapOnHost>,
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

impl HostKernel {
    /// Makes the tables.
    #[must_use]
    pub fn new() -> Self {
        Self { segments: tail_segments(), cells: Cells::new() }
    }

    /// The picture of a plan that it [`serves`], linear R G B A, row-major; and the truth about it as looked
    /// up, where the plan asks for that.
    #[must_use]
    pub fn render(&self, plan: &FramePlan, inputs: &HostInputs<'_>) -> (Vec<f32>, Option<Vec<Truth>>) {
        let key = PipelineKey::of(plan);
        let tells_truth = key.truth;
        let HostInputs { frame, poses, map, vignette, ideal } = *inputs;
        let [width, height] = frame.size_px.map(|side| side as usize);
        let frame_of_truth = FrameUniforms { sky_reach_px: 0.0, ..*frame };
        let reads = Reads {
            frame,
            frame_of_truth: Some(&frame_of_truth).filter(|_| tells_truth),
            ideal,
            temporal: key.temporal,
            blur: plan.blur,
            tap: key.tap,
            map: map.filter(|_| key.ray == RayStage::LensMap),
            vignette,
            poses,
            elsewhere: poses
                .get(height * poses_a_line(frame))
                .copied()
                .filter(|_| key.keys == KeyKind::Elsewhere),
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

/// As in shaders/reverse/temporal_inverse/line_entry.wgsl.
fn poses_a_line(frame: &FrameUniforms) -> usize {
    if frame.nodes == 1 { 1 } else { frame.nodes as usize + 1 }
}

impl Default for HostKernel {
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
