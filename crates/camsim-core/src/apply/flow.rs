//! Optical flow instead of camera motion, for scenes with moving objects.
//!
//! Each pixel of the ideal frame has a displacement f over an interval T, in ideal pixels, by the motion of
//! camera and objects together. In between, motion is assumed uniform and straight: after the fraction `tau = dt
//! / T` of the interval, the content of pixel s is at `s + tau f(s)`. The source of a ray at position p is
//! the s with `s + tau f(s) = p`, and the nearest if there are several. For an accelerated image motion the
//! error is at most `|f''| |dt (T - dt)| / 2` (f'' in px/s^2, any dt), so flow over a short interval is more
//! accurate.
//!
//! | step | file |
//! |---|---|
//! | fills unknown flow from the nearest known pixel, finds motion boundaries | `flow/grid.rs` |
//! | a bilinear sheet over each four pixels: its points at p, and substitutes where it is torn | `flow/cell.rs` |
//! | candidate cells for p, from a tree of bounding boxes | `flow/blocks.rs` |
//!
//! Only the displacement `tau f` is compared with thresholds in pixels, so the result does not depend on the
//! interval for which the flow is given.

use std::ops::ControlFlow;

use glam::{DMat2, DVec2};

use super::NoSource;
use crate::temporal::{IdealGeometry, InverseDepthImage, Source};

mod blocks;
mod cell;
mod grid;

use blocks::{Blocks, FlowQuery};
use grid::Grid;

/// Most boxes that one query may open. A field with a single motion opens about a hundred; noise of 20 px in
/// every pixel opens ten thousand.
const MAX_BOXES: u32 = 1 << 15;
/// Radius around a position within which motion boundaries matter for a pixel, pixels.
const REACH_PX: f64 = 1.0;

/// Optical flow of an ideal frame.
#[derive(Clone, Debug, PartialEq)]
pub struct FlowField {
    /// Width and height, equal to those of the ideal frame.
    pub size_px: [u32; 2],
    /// Displacement right and down, pixels, row-major; NaN where unknown.
    pub px: Vec<[f32; 2]>,
    /// Interval of the displacement, seconds; negative for flow to an earlier instant.
    pub interval_s: f64,
}

/// Order among several sources of one position, the largest first: known flow before unknown, front of a
/// sheet before its back, then inverse depth, then, without depth, the length of the flow.
type Rank = [f64; 4];

/// Inverts an optical flow.
#[derive(Clone, Debug)]
pub(super) struct FlowSearch {
    grid: Grid,
    blocks: Blocks,
}

impl FlowSearch {
    pub(super) fn new(flow: &FlowField) -> Self {
        let grid = Grid::new(flow);
        let blocks = Blocks::new(&grid);
        Self { grid, blocks }
    }

    /// Source of `position_px` after the fraction `fraction` of the interval. `holes` marks pixels with unknown
    /// depth; empty means none.
    pub(super) fn source(
        &self,
        position_px: DVec2,
        fraction: f64,
        depth: &InverseDepthImage<'_>,
        holes: &[bool],
        ideal: &IdealGeometry,
    ) -> Result<Source, NoSource> {
        if !position_px.is_finite() {
            return Err(NoSource::Outside);
        }
        let mut best: Option<(Rank, DVec2)> = None;
        let mut behind: Option<(Rank, DVec2)> = None;
        let mut left = MAX_BOXES;
        let _ = self.blocks.visit(
            &FlowQuery { grid: &self.grid, position_px, fractions: &[fraction], reach_px: 0.0 },
            &mut left,
            &mut |[column, row], _| {
                let cell = self.grid.cell(column, row);
                cell.sources(position_px, fraction, |source_px, is_front| {
                    let rank = self.rank(source_px, is_front, depth);
                    if ideal.contains(source_px) && best.is_none_or(|known| rank > known.0) {
                        best = Some((rank, source_px));
                    }
                });
                if best.is_none() {
                    let rank = |corner_px| self.rank(corner_px, true, depth);
                    cell.fallback_sources(position_px, fraction, rank, |rank, source_px| {
                        if ideal.contains(source_px) && behind.is_none_or(|known| rank < known.0) {
                            behind = Some((rank, source_px));
                        }
                    });
                }
                ControlFlow::Continue(())
            },
        );
        if left == 0 {
            return Err(NoSource::TornFlow);
        }
        let (_, source_px) = best.or(behind).ok_or(NoSource::Outside)?;
        if !self.grid.is_known(source_px) {
            return Err(NoSource::UnknownFlow);
        }
        if !holes.is_empty() && holes[depth.nearest_index(source_px)] {
            return Err(NoSource::Hole);
        }
        Ok(Source { position_px: source_px, inverse_depth: depth.inverse_depth(source_px) })
    }

    fn rank(&self, source_px: DVec2, is_front: bool, depth: &InverseDepthImage<'_>) -> Rank {
        let known = f64::from(u8::from(self.grid.is_known(source_px)));
        [
            known,
            f64::from(u8::from(is_front)),
            depth.nearest(source_px),
            self.grid.nearest(source_px).length(),
        ]
    }

    /// Change of the source with the position of the ray: the inverse of `1 + tau df/ds`.
    pub(super) fn source_from_ray(&self, source_px: DVec2, fraction: f64) -> DMat2 {
        let (cell, within) = self.grid.cell_at(source_px);
        let forward = DMat2::IDENTITY + cell.slope(within, fraction) * fraction;
        if forward.determinant().abs() > 1e-3 { forward.inverse() } else { DMat2::IDENTITY }
    }

    /// Whether the source at a position may jump within an exposure: a motion boundary with a jump of more
    /// than `most_px`, or a fold of the sheet, reaches the position.
    pub(super) fn may_separate(&self, position_px: DVec2, fractions: [f64; 2], most_px: f64) -> bool {
        let exposure = (fractions[1] - fractions[0]).abs();
        let reach = fractions[0].abs().max(fractions[1].abs());
        let mut left = MAX_BOXES;
        let query = FlowQuery { grid: &self.grid, position_px, fractions: &fractions, reach_px: REACH_PX };
        let visited = self.blocks.visit(&query, &mut left, &mut |[column, row], within| {
            let may_tear = f64::from(within.tear) * exposure > most_px;
            // The rows of a matrix with a singular sum with the identity add up to 1 or more.
            let may_fold = 2.0 * f64::from(within.steep) * reach >= 1.0;
            if may_tear
                || (may_fold && fractions.iter().any(|fraction| self.grid.cell(column, row).folds(*fraction)))
            {
                return ControlFlow::Break(());
            }
            ControlFlow::Continue(())
        });
        visited.is_break() || left == 0
    }
}
