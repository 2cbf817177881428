//! Optical flow in place of the camera's motion: for scenes in which things move by themselves.
//!
//! Each pixel of the ideal frame says where what it shows will be after an interval T, in its own pixels;
//! camera and things together. In between it is taken to go straight on, evenly: what pixel s shows is at `s
//! + tau f(s)` when the share `tau = dt / T` of the interval has gone by. A ray that looks at p then sees the
//! s with `s + tau f(s) = p`, and of several the nearest. What accelerates in the picture is off by at most
//! `|f''| |dt (T - dt)| / 2` (f'' in px/s^2, any dt); a flow over a short interval says more.
//!
//! | step | file |
//! |---|---|
//! | what has no flow takes that of the nearest that has; where two things meet | `flow/grid.rs` |
//! | a sheet over each four pixels, what of it is at p, and what stands in where it is torn | `flow/cell.rs` |
//! | which cells may be at p: a tree of boxes | `flow/blocks.rs` |
//!
//! Only `tau f`, the displacement that happens, is ever compared with a number of pixels: the same motion
//! written for another interval is the same picture.

use std::ops::ControlFlow;

use glam::{DMat2, DVec2};

use super::Unseen;
use crate::temporal::{IdealGeometry, InverseDepthImage, Source};

mod blocks;
mod cell;
mod grid;

use blocks::{Blocks, Look};
use grid::Grid;

/// Boxes that one look may open. A field of one thing takes a hundred; noise of 20 px in every pixel takes
/// ten thousand.
const MOST_BOXES: u32 = 1 << 15;
/// Around a place where things part: what a pixel's area reaches, pixels.
const REACH_PX: f64 = 1.0;

/// Where each pixel of an ideal frame goes.
#[derive(Clone, Debug, PartialEq)]
pub struct FlowField {
    /// Width, height: the ideal frame's.
    pub size_px: [u32; 2],
    /// Right and down, pixels, row-major; not a number where it is not known.
    pub px: Vec<[f32; 2]>,
    /// After how long, seconds; negative for a flow to an earlier instant.
    pub interval_s: f64,
}

/// Which of several things at one place is seen, the larger: of known flow before unknown; no sheet's back;
/// inverse depth; and for things without depth how far they move.
type Rank = [f64; 4];

/// Finds sources in a flow.
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

    /// What looks at `at_px` when the share `share` of the interval has gone by. `holes` says which pixels'
    /// depth is unknown; empty is none.
    pub(super) fn source(
        &self,
        at_px: DVec2,
        share: f64,
        depth: &InverseDepthImage<'_>,
        holes: &[bool],
        ideal: &IdealGeometry,
    ) -> Result<Source, Unseen> {
        if !at_px.is_finite() {
            return Err(Unseen::Outside);
        }
        let mut seen: Option<(Rank, DVec2)> = None;
        let mut behind: Option<(Rank, DVec2)> = None;
        let mut left = MOST_BOXES;
        let _ = self.blocks.visit(
            &Look { grid: &self.grid, at_px, shares: &[share], reach_px: 0.0 },
            &mut left,
            &mut |[column, row], _| {
                let cell = self.grid.cell(column, row);
                cell.sources(at_px, share, |source_px, is_front| {
                    let rank = self.rank(source_px, is_front, depth);
                    if ideal.contains(source_px) && seen.is_none_or(|known| rank > known.0) {
                        seen = Some((rank, source_px));
                    }
                });
                if seen.is_none() {
                    let rank = |corner_px| self.rank(corner_px, true, depth);
                    cell.stand_ins(at_px, share, rank, |rank, source_px| {
                        if ideal.contains(source_px) && behind.is_none_or(|known| rank < known.0) {
                            behind = Some((rank, source_px));
                        }
                    });
                }
                ControlFlow::Continue(())
            },
        );
        if left == 0 {
            return Err(Unseen::TornFlow);
        }
        let (_, source_px) = seen.or(behind).ok_or(Unseen::Outside)?;
        if !self.grid.is_known(source_px) {
            return Err(Unseen::UnknownFlow);
        }
        if !holes.is_empty() && holes[depth.nearest_index(source_px)] {
            return Err(Unseen::Hole);
        }
        Ok(Source { at_px: source_px, inverse_depth: depth.inverse_depth(source_px) })
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

    /// Change of the source for a change of where the ray looks: the inverse of `1 + tau df/ds`.
    pub(super) fn source_from_look(&self, source_px: DVec2, share: f64) -> DMat2 {
        let (cell, within) = self.grid.cell_at(source_px);
        let forward = DMat2::IDENTITY + cell.slope(within, share) * share;
        if forward.determinant().abs() > 1e-3 { forward.inverse() } else { DMat2::IDENTITY }
    }

    /// Whether what is seen at a place may change from one thing to another within an exposure: a border at
    /// which things part by more than `most_px`, or a fold, gets to the place.
    pub(super) fn parts(&self, at_px: DVec2, shares: [f64; 2], most_px: f64) -> bool {
        let exposure = (shares[1] - shares[0]).abs();
        let reach = shares[0].abs().max(shares[1].abs());
        let mut left = MOST_BOXES;
        let look = Look { grid: &self.grid, at_px, shares: &shares, reach_px: REACH_PX };
        let found = self.blocks.visit(&look, &mut left, &mut |[column, row], within| {
            let may_tear = f64::from(within.tear) * exposure > most_px;
            // Rows of a matrix that has no inverse beside 1 sum up to 1.
            let may_fold = 2.0 * f64::from(within.steep) * reach >= 1.0;
            if may_tear || (may_fold && shares.iter().any(|share| self.grid.cell(column, row).folds(*share)))
            {
                return ControlFlow::Break(());
            }
            ControlFlow::Continue(())
        });
        found.is_break() || left == 0
    }
}
