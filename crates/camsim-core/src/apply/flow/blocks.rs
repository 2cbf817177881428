//! A tree of boxes over the cells: from it follows where none of a block's cells can be, so that a look opens
//! few of them.

use std::ops::ControlFlow;

use glam::{DVec2, Vec2};

use super::grid::Grid;

/// Slack for rounding, pixels.
const ROUNDING_PX: f64 = 1e-5;

/// What a block of cells holds.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block {
    low: Vec2,
    high: Vec2,
    /// Largest tear of an edge, pixels of the flow.
    pub(super) tear: f32,
    /// Largest difference of neighbours.
    pub(super) steep: f32,
}

impl Block {
    const NONE: Self = Self { low: Vec2::INFINITY, high: Vec2::NEG_INFINITY, tear: 0.0, steep: 0.0 };

    fn and(self, other: Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
            tear: self.tear.max(other.tear),
            steep: self.steep.max(other.steep),
        }
    }

    fn of_cell(grid: &Grid, [column, row]: [u32; 2]) -> Self {
        let cell = grid.cell(column, row);
        let [a, b, c, d] = cell.flows.map(DVec2::as_vec2);
        let steep = [b - a, d - c, c - a, d - b]
            .into_iter()
            .fold(0.0_f32, |most, step| most.max(step.abs().max_element()));
        let tear = cell.across.into_iter().chain(cell.down).fold(0.0, f64::max) as f32;
        Self { low: a.min(b).min(c).min(d), high: a.max(b).max(c).max(d), tear, steep }
    }

    /// Whether cells between two corners can be where it is looked for.
    fn reaches(&self, low_px: DVec2, high_px: DVec2, look: &Look<'_>) -> bool {
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for share in look.shares {
            let (a, b) = (*share * self.low.as_dvec2(), *share * self.high.as_dvec2());
            (low, high) = (low.min(a).min(b), high.max(a).max(b));
        }
        let slack = look.reach_px + ROUNDING_PX;
        (low_px + low - slack).cmple(look.at_px).all() && (high_px + high + slack).cmpge(look.at_px).all()
    }
}

/// One level: blocks of `2^k` cells each way, k = 1 for the first; those of single cells are worked out when
/// they are asked for.
#[derive(Clone, Debug)]
struct Level {
    count: [u32; 2],
    blocks: Vec<Block>,
}

/// All levels, up to one block.
#[derive(Clone, Debug)]
pub(super) struct Blocks {
    /// Cells each way.
    count: [u32; 2],
    levels: Vec<Level>,
}

impl Blocks {
    pub(super) fn new(grid: &Grid) -> Self {
        let count = grid.size_px.map(|side| side + 1);
        let mut levels = vec![Level::of(count, |cell| Block::of_cell(grid, cell))];
        while let Some(last) = levels.last().filter(|level| level.blocks.len() > 1) {
            let next = Level::of(last.count, |at| last.block(at));
            levels.push(next);
        }
        Self { count, levels }
    }

    /// Calls for each cell that can be within `reach_px` of where `look` looks. `left` counts down the boxes
    /// that may still be opened; at 0 the rest is left out.
    pub(super) fn visit(
        &self,
        look: &Look<'_>,
        left: &mut u32,
        call: &mut impl FnMut([u32; 2], &Block) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        self.open(self.levels.len(), [0, 0], look, left, call)
    }

    fn open(
        &self,
        level: usize,
        at @ [x, y]: [u32; 2],
        look: &Look<'_>,
        left: &mut u32,
        call: &mut impl FnMut([u32; 2], &Block) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let count = if level == 0 { self.count } else { self.levels[level - 1].count };
        if *left == 0 || x >= count[0] || y >= count[1] {
            return ControlFlow::Continue(());
        }
        *left -= 1;
        let block = if level == 0 { Block::of_cell(look.grid, at) } else { self.levels[level - 1].block(at) };
        let side_px = f64::from(1_u32 << level);
        let low_px = DVec2::new(f64::from(x), f64::from(y)) * side_px - 1.0;
        if !block.reaches(low_px, low_px + side_px, look) {
            return ControlFlow::Continue(());
        }
        if level == 0 {
            return call(at, &block);
        }
        for [dx, dy] in [[0, 0], [1, 0], [0, 1], [1, 1]] {
            self.open(level - 1, [2 * x + dx, 2 * y + dy], look, left, call)?;
        }
        ControlFlow::Continue(())
    }
}

/// What is looked for.
pub(super) struct Look<'a> {
    pub(super) grid: &'a Grid,
    /// What is at this place at one of `shares` of the interval, or between two of them.
    pub(super) at_px: DVec2,
    pub(super) shares: &'a [f64],
    pub(super) reach_px: f64,
}

impl Level {
    /// Blocks of twice the side of those that `below` gives.
    fn of(below_count: [u32; 2], below: impl Fn([u32; 2]) -> Block) -> Self {
        let count = below_count.map(|count| count.div_ceil(2));
        let mut blocks = vec![Block::NONE; count[0] as usize * count[1] as usize];
        for y in 0..below_count[1] {
            for x in 0..below_count[0] {
                let into = &mut blocks[(y / 2 * count[0] + x / 2) as usize];
                *into = into.and(below([x, y]));
            }
        }
        Self { count, blocks }
    }

    fn block(&self, [x, y]: [u32; 2]) -> Block {
        self.blocks[(y * self.count[0] + x) as usize]
    }
}
