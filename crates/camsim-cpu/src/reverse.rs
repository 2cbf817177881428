//! The reverse pass, vectorised over blocks of pixels of a row.
//!
//! Twin, stage by stage, of the kernel in `camsim-gpu/shaders/reverse`, for the sampling methods of most
//! frames ([`camsim_plan::placement::cpu_vectorises`]). A software adapter's driver reads buffers, textures
//! and conditions lane by lane; here all four channels are read at once, stages that no pixel of a block
//! needs are skipped, and the output is written in place.

#![expect(clippy::needless_range_loop, reason = "numbers of one pixel have one index in all arrays")]

use camsim_core::{
    noise::tail_segments,
    temporal::{TapStage, silhouette_rays::nearest_first},
};
use camsim_plan::{BlurStage, FramePlan, RayStage};
use rayon::prelude::*;

use camsim_plan::{
    TemporalStage,
    uniforms::{FrameUniforms, Truth},
};

mod copied_pixels;
mod footprint;
mod gather;
mod ideal_texels;
mod photometric;
mod rays;
mod sideways;
mod silhouettes;
mod source;
mod truth;

use crate::simd::lanes::{LANES, ZERO, per_lane};
use crate::simd::vectors::{Vectors, widest};
#[cfg(target_arch = "x86_64")]
use camsim_core::simd::Avx2;
use footprint::{Footprint, GridTaps};
pub use ideal_texels::IdealTexels;
pub use rays::LensMap;
pub(crate) use silhouettes::{EdgeTiles, Listed, TILE_PX};
use source::LinePose;

/// Rows per task.
const ROWS_PER_TASK: usize = 16;

/// Whether the vectorised passes are fast on this processor: it has fused multiply-add, and on x86-64 vectors
/// of eight floats and half-float conversion.
#[must_use]
pub fn suits_processor() -> bool {
    #[cfg(target_arch = "x86_64")]
    return Avx2::find().is_some();
    #[cfg(not(target_arch = "x86_64"))]
    cfg!(target_arch = "aarch64")
}

/// Tables that all frames share.
#[derive(Debug)]
pub struct Kernel {
    segments: Vec<[f32; 2]>,
    grid_taps: GridTaps,
}

/// Inputs of a frame.
#[derive(Clone, Copy, Debug)]
pub struct KernelInputs<'a> {
    /// Uniforms of the frame.
    pub frame: &'a FrameUniforms,
    /// Relative poses of the lines.
    pub poses: &'a [LinePose],
    /// Lens map, if there is a lens.
    pub map: Option<&'a LensMap>,
    /// Vignette weight of every pixel, or one for all.
    pub vignette: &'a [f32],
    /// The ideal frames.
    pub ideals: &'a [IdealTexels<'a>],
    /// Where each has edge pixels; empty without silhouette rays.
    pub edges: &'a [EdgeTiles],
    /// Whether exact truth is left to rays: depths below 0.
    pub leaves_truth: bool,
}

/// A frame: linear R G B A, row-major; the truth from look-ups, if the plan has it; and the pixels that may see
/// several surfaces, if the plan has rays for them.
pub(crate) struct KernelFrame {
    pub color_rgba: Vec<f32>,
    pub truth: Option<Vec<Truth>>,
    pub listed: Vec<Listed>,
}

/// State shared by the stages of a frame.
#[derive(Clone, Copy)]
struct Stages<'a> {
    frame: &'a FrameUniforms,
    ideals: &'a [IdealTexels<'a>],
    edges: &'a [EdgeTiles],
    /// Number of the ideal frame that is read, and that frame.
    key: usize,
    ideal: IdealTexels<'a>,
    temporal: TemporalStage,
    blur: Option<BlurStage>,
    tap: TapStage,
    map: Option<&'a LensMap>,
    vignette: &'a [f32],
    poses: &'a [LinePose],
    /// Poses of the key cameras relative to the mid-window camera, if they differ and coordinates are output.
    reference_poses: &'a [LinePose],
    /// Uniforms for the truth, if it is looked up: without the sky-reach rule, since the sky is at its own
    /// position, whatever surface is beside it.
    truth_frame: Option<&'a FrameUniforms>,
    /// Position of the first output pixel in the ideal frame, if output pixels are ideal pixels.
    copied_from: Option<[u32; 2]>,
    segments: &'a [[f32; 2]],
    grid_taps: &'a GridTaps,
}

impl Kernel {
    /// Computes the tables.
    #[must_use]
    pub fn new() -> Self {
        Self { segments: tail_segments(), grid_taps: GridTaps::new() }
    }

    /// Renders a vectorised plan.
    ///
    /// # Panics
    /// Without an ideal frame for each of the plan's.
    #[must_use]
    pub fn render(&self, plan: &FramePlan, inputs: &KernelInputs<'_>) -> KernelFrame {
        match sideways::is_sideways(inputs.frame) {
            true => sideways::turned(inputs, |inputs| self.render_lines(plan, inputs)),
            false => self.render_lines(plan, inputs),
        }
    }

    /// Renders a picture whose lines are rows, or one that is transposed.
    fn render_lines(&self, plan: &FramePlan, inputs: &KernelInputs<'_>) -> KernelFrame {
        let has_truth = plan.truth;
        let KernelInputs { frame, poses, map, vignette, ideals, edges, leaves_truth } = *inputs;
        let looks_up = has_truth && !(leaves_truth && plan.has_exact_truth());
        assert_eq!(ideals.len(), plan.keys.len(), "an ideal frame for each key frame");
        let [width, height] = frame.size_px.map(|side| side as usize);
        let truth_frame = FrameUniforms { sky_reach_px: 0.0, ..*frame };
        let references = plan.keys.len() * height * poses_per_line(frame)..;
        let stages = Stages {
            frame,
            truth_frame: Some(&truth_frame).filter(|_| looks_up),
            ideals,
            edges,
            key: 0,
            ideal: ideals[0],
            temporal: plan.temporal,
            blur: plan.blur,
            tap: plan.taps,
            map: map.filter(|_| plan.ray == RayStage::LensMap),
            vignette,
            poses,
            reference_poses: poses.get(references).filter(|_| has_reference_poses(plan)).unwrap_or_default(),
            copied_from: plan.copied_from().filter(|_| !sideways::is_sideways(frame)),
            segments: &self.segments,
            grid_taps: &self.grid_taps,
        };
        let rows_of = |task: usize| task * ROWS_PER_TASK..height.min((task + 1) * ROWS_PER_TASK);
        let mut color_rgba = vec![0.0; 4 * width * height];
        let mut truth = vec![Truth::default(); if has_truth { width * height } else { 0 }];
        let blocks = if edges.is_empty() { 0 } else { width.div_ceil(LANES) };
        let mut listed = vec![Listed::default(); blocks * height];
        let (mut truth_left, mut listed_left) = (&mut truth[..], &mut listed[..]);
        let mut tasks = Vec::new();
        for (task, colors) in color_rgba.chunks_mut(4 * width * ROWS_PER_TASK).enumerate() {
            let rows = rows_of(task).len();
            let truth = truth_left.split_off_mut(..if has_truth { width * rows } else { 0 });
            let listed = listed_left.split_off_mut(..blocks * rows);
            tasks.push((task, colors, truth.unwrap_or_default(), listed.unwrap_or_default()));
        }
        tasks.into_par_iter().for_each(|(task, colors, truth, listed)| {
            stages.rows((task * ROWS_PER_TASK) as u32, colors, truth, listed);
        });
        KernelFrame { color_rgba, truth: has_truth.then_some(truth), listed }
    }
}

/// Whether coordinates must be transformed from the key cameras to the mid-window camera.
fn has_reference_poses(plan: &FramePlan) -> bool {
    let moves = matches!(plan.temporal, TemporalStage::Rotation | TemporalStage::Reproject { .. });
    moves && plan.truth && (plan.has_displaced_key() || plan.keys.len() > 1)
}

/// Entries per line of the pose table, as in camsim-gpu/shaders/reverse/temporal_inverse/line_entry.wgsl.
fn poses_per_line(frame: &FrameUniforms) -> usize {
    if frame.nodes == 1 { 1 } else { frame.nodes as usize + 1 }
}

impl Default for Kernel {
    fn default() -> Self {
        Self::new()
    }
}

impl Stages<'_> {
    /// Renders rows from `first` with the widest vectors of the processor.
    fn rows(&self, first: u32, rows: &mut [f32], truth: &mut [Truth], listed: &mut [Listed]) {
        widest!(vectors => self.rows_by(vectors, first, rows, truth, listed))
    }

    #[inline(always)]
    fn rows_by(
        &self,
        vectors: impl Vectors,
        first: u32,
        rows: &mut [f32],
        truth: &mut [Truth],
        listed: &mut [Listed],
    ) {
        if let Some(from) = self.copied_from.filter(|_| truth.is_empty()) {
            return self.copied_rows(vectors, from, first, rows);
        }
        let width = self.frame.size_px[0] as usize;
        let blocks = width.div_ceil(LANES);
        let rows = rows.chunks_exact_mut(4 * width).zip(first..);
        let mut rows: Vec<_> = rows.map(|(row, y)| (row, y, self.with_key_of(y))).collect();
        // Vertically adjacent blocks come first: they read nearly the same part of the ideal frame.
        for (block, x) in (0..width).step_by(LANES).enumerate() {
            let end = width.min(x + LANES);
            for (number, (row, y, stages)) in rows.iter_mut().enumerate() {
                let truth = if truth.is_empty() { &mut [] } else { &mut truth[number * width..][x..end] };
                let of_block = stages.block(vectors, [x as u32, *y], &mut row[4 * x..4 * end], truth);
                if let Some(listed) = listed.get_mut(number * blocks + block) {
                    *listed = of_block;
                }
            }
        }
    }

    /// With the ideal frame that is nearest in time to a line. The fractions of the window, of which a table for
    /// several has one a line, are behind all poses.
    fn with_key_of(&self, y: u32) -> Self {
        let (count, [_, height]) = (self.ideals.len(), self.frame.size_px);
        let first = count * (height as usize * poses_per_line(self.frame) + 1);
        let fraction = |entry: &LinePose| f64::from(entry[0][0]);
        let fraction = self.poses.get(first + y as usize).filter(|_| count > 1).map_or(0.5, fraction);
        let key = nearest_first(fraction, count).next().unwrap_or_default();
        Self { key, ideal: self.ideals[key], ..*self }
    }

    /// Poses of a line: at the nodes of the exposure, then at mid-exposure.
    fn poses_of(&self, y: u32) -> &[LinePose] {
        let stride = poses_per_line(self.frame);
        let line = self.key * self.frame.size_px[1] as usize + y as usize;
        self.poses.get(line * stride..(line + 1) * stride).unwrap_or_default()
    }

    /// Renders a block, and lists the pixels that may see several surfaces.
    #[inline(always)]
    fn block(
        &self,
        vectors: impl Vectors,
        [x, y]: [u32; 2],
        block: &mut [f32],
        truth: &mut [Truth],
    ) -> Listed {
        let rays = rays::rays(self.frame, self.map, x, y);
        let weight = self.weights(x, y);
        let is_wanted = per_lane(|i| if weight[i] > 0.0 { rays.valid[i] } else { 0.0 });
        let (mut colors, mut inside) = ([[0.0; 4]; LANES], rays.valid);
        if self.truth_frame.is_none() {
            for (i, truth) in truth.iter_mut().enumerate().filter(|&(i, _)| rays.valid[i] > 0.0) {
                *truth = Truth { uv: [rays.uv.x[i], rays.uv.y[i]], depth_m: -1.0, ..Truth::default() };
            }
        }
        let is_needed = if self.truth_frame.is_some() { &rays.valid } else { &is_wanted };
        if let Some(mid) = self.poses_of(y).last().filter(|_| is_needed.iter().any(|&asked| asked > 0.0)) {
            let sides = || rays::sides(self.frame, self.map, x, y);
            let footprint = Footprint::new(self.grid_taps, self.tap, sides, self.frame.max_taps);
            // Colour first, then truth, in one loop: the inlined code exists once.
            for (frame, is_truth) in [(Some(self.frame), false), (self.truth_frame, true)] {
                let Some(frame) = frame else { continue };
                let stages = Self { frame, ..*self };
                let gathered = stages.gather(
                    vectors,
                    &rays.uv,
                    &footprint,
                    self.poses_of(y),
                    mid,
                    if is_truth { &ZERO } else { &is_wanted },
                );
                if is_truth {
                    stages.truth(&rays.uv, mid, &gathered.at_phase_px, &inside, truth);
                } else {
                    colors = self
                        .copied_from
                        .map_or(gathered.color, |from| self.copied_block(vectors, from, [x, y]));
                    // Pixels that the vignette blackens are not gathered.
                    inside = per_lane(|i| {
                        if weight[i] > 0.0 { rays.valid[i] * gathered.inside[i] } else { rays.valid[i] }
                    });
                }
            }
        }
        if inside.iter().all(|&inside| inside == 0.0) {
            block.fill(0.0);
            return Listed::default();
        }
        let listed =
            self.listed(&rays.uv, self.poses_of(y), &colors, &per_lane(|i| inside[i] * is_wanted[i]));
        let [r, g, b] = photometric::photometric(self.frame, self.segments, [x, y], &colors, &weight);
        for (i, pixel) in block.chunks_exact_mut(4).enumerate() {
            pixel.copy_from_slice(&[r[i] * inside[i], g[i] * inside[i], b[i] * inside[i], inside[i]]);
        }
        listed
    }

    /// Vignette weights of a block; 0 beyond the end of the row.
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
