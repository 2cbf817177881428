//! A tree of bounding boxes over the cells of the flow. The bounds exclude most blocks, so that a query opens
//! few of them.

use std::ops::ControlFlow;

use glam::{DVec2, Vec2};

use super::grid::Grid;

/// Tolerance for rounding, pixels.
const ROUNDING_PX: f64 = 1e-5;

/// Bounds of a block of cells.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block {
    low: Vec2,
    high: Vec2,
    /// Largest tear of an edge, pixels of the flow.
    pub(super) tear: f32,
    /// Largest difference between neighbours.
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

    /// Whether cells between two corners may be at the position of the query.
    fn reaches(&self, low_px: DVec2, high_px: DVec2, query: &FlowQuery<'_>) -> bool {
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for fraction in query.fractions {
            let (a, b) = (*fraction * self.low.as_dvec2(), *fraction * self.high.as_dvec2());
            (low, high) = (low.min(a).min(b), high.max(a).max(b));
        }
        let slack = query.reach_px + ROUNDING_PX;
        (low_px + low - slack).cmple(query.position_px).all()
            && (high_px + high + slack).cmpge(query.position_px).all()
    }
}

/// One level of the tree: blocks of `2^k` cells per side, with k = 1 for the first. Blocks of single cells
/// are computed on demand.
#[derive(Clone, Debug)]
struct BlockLevel {
    count: [u32; 2],
    blocks: Vec<Block>,
}

/// All levels, up to a single block.
#[derive(Clone, Debug)]
pub(super) struct Blocks {
    /// Number of cells per side.
    count: [u32; 2],
    levels: Vec<BlockLevel>,
}

impl Blocks {
    pub(super) fn new(grid: &Grid) -> Self {
        let count = grid.size_px.map(|side| side + 1);
        let mut levels = vec![BlockLevel::of(count, |cell| Block::of_cell(grid, cell))];
        while let Some(last) = levels.last().filter(|level| level.blocks.len() > 1) {
            let next = BlockLevel::of(last.count, |at| last.block(at));
            levels.push(next);
        }
        Self { count, levels }
    }

    /// Calls `found` for each cell that may be within `reach_px` of the position of the query. `left` counts
    /// down the boxes that may still be opened; at 0 the search stops.
    pub(super) fn visit(
        &self,
        query: &FlowQuery<'_>,
        left: &mut u32,
        call: &mut impl FnMut([u32; 2], &Block) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        self.open(self.levels.len(), [0, 0], query, left, call)
    }

    fn open(
        &self,
        level: usize,
        at @ [x, y]: [u32; 2],
        query: &FlowQuery<'_>,
        left: &mut u32,
        call: &mut impl FnMut([u32; 2], &Block) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let count = if level == 0 { self.count } else { self.levels[level - 1].count };
        if *left == 0 || x >= count[0] || y >= count[1] {
            return ControlFlow::Continue(());
        }
        *left -= 1;
        let block =
            if level == 0 { Block::of_cell(query.grid, at) } else { self.levels[level - 1].block(at) };
        let side_px = f64::from(1_u32 << level);
        let low_px = DVec2::new(f64::from(x), f64::from(y)) * side_px - 1.0;
        if !block.reaches(low_px, low_px + side_px, query) {
            return ControlFlow::Continue(());
        }
        if level == 0 {
            return call(at, &block);
        }
        for [dx, dy] in [[0, 0], [1, 0], [0, 1], [1, 1]] {
            self.open(level - 1, [2 * x + dx, 2 * y + dy], query, left, call)?;
        }
        ControlFlow::Continue(())
    }
}

/// A query for the cells at a position.
pub(super) struct FlowQuery<'a> {
    pub(super) grid: &'a Grid,
    /// The position at one of `fractions` of the interval, or at any time between two of them.
    pub(super) position_px: DVec2,
    pub(super) fractions: &'a [f64],
    pub(super) reach_px: f64,
}

impl BlockLevel {
    /// Blocks of twice the side of those of the level below.
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
