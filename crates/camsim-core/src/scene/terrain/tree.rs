//! A quadtree of bounding boxes over the grid.
//!
//! The four child boxes of a node are [tested against a ray together](super::super::box4). They are stored
//! together, relative to the centre of the tree.

use glam::DVec3;

use super::bounds::Aabb;
use crate::scene::{
    box4::{BeamBox, Box4, BoxRay, down},
    ray_packet::Beam,
};

/// Cells along each side of the tree's leaves.
pub(super) const BLOCK_CELLS: u32 = 4;
/// Most nodes on the stack: the root, and three on each level of the largest possible grid.
const MAX_WAITING: usize = 3 * 32 + 1;

/// An implicit quadtree: level 0 has one box per 4x4 cells, each further level one per 2x2 boxes of the level
/// below, and the last level a single box.
#[derive(Clone, Debug)]
pub(super) struct BlockTree {
    /// Centre, to which all coordinates are relative.
    middle: DVec3,
    /// Largest coordinate of a box, metres.
    extent_m: f64,
    levels: Vec<TreeLevel>,
}

#[derive(Clone, Debug)]
struct TreeLevel {
    size: [u32; 2],
    /// Groups of 2x2 boxes, row by row: the two of one row, then those of the next.
    quads: Vec<Box4>,
}

/// A box of the tree.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct BlockNode {
    pub level: u32,
    pub at: [u32; 2],
}

impl BlockTree {
    /// Builds the tree over the `boxes` of the blocks, row by row.
    pub fn new(size: [u32; 2], boxes: &[Aabb]) -> Self {
        let whole = boxes.iter().fold(Aabb::EMPTY, |all, each| all.union(each));
        let middle = if whole.is_empty() { DVec3::ZERO } else { whole.centre() };
        let extent_m = if whole.is_empty() { 0.0 } else { (whole.max - middle).max_element() };
        let mut levels = vec![TreeLevel::new(size)];
        for (at, each) in cells(size).zip(boxes).filter(|(_, each)| !each.is_empty()) {
            levels[0].set(at, &Aabb { min: each.min - middle, max: each.max - middle });
        }
        let mut size = size;
        while size != [1, 1] {
            let below = &levels[levels.len() - 1];
            size = size.map(|n| n.div_ceil(2));
            let mut level = TreeLevel::new(size);
            for at in cells(size) {
                let quad = below.quad(at);
                level.set(at, &(0..4).fold(Aabb::EMPTY, |all, lane| all.union(&quad.get(lane))));
            }
            levels.push(level);
        }
        Self { middle, extent_m, levels }
    }

    /// Memory of the boxes, bytes.
    pub fn bytes(&self) -> usize {
        self.levels.iter().map(|level| size_of_val(&*level.quads)).sum()
    }

    /// The root box.
    pub fn root(&self) -> BlockNode {
        BlockNode { level: self.levels.len() as u32 - 1, at: [0, 0] }
    }

    /// Level whose boxes span `cells` cells along a side, a power of two times [`BLOCK_CELLS`].
    fn level_of(cells: u32) -> u32 {
        (cells / BLOCK_CELLS).trailing_zeros()
    }

    /// Box of a square of `cells` cells by column and row; `None` beyond the grid. Squares larger than the
    /// grid get the root box.
    pub fn square(&self, cells: u32, at: [i64; 2]) -> Option<Aabb> {
        let level = Self::level_of(cells).min(self.root().level);
        let size = self.levels[level as usize].size;
        let is_there = (0..2).all(|k| (0..i64::from(size[k])).contains(&at[k]));
        is_there.then(|| self.bounds(BlockNode { level, at: at.map(|n| n as u32) }))
    }

    /// Visits the squares of `cells` cells along a side whose boxes, and those of their ancestors, are
    /// accepted.
    pub fn visit(&self, cells: u32, accept: &dyn Fn(&Aabb) -> bool, found: &mut dyn FnMut([u32; 2])) {
        let level = Self::level_of(cells);
        let mut stack = vec![self.root()];
        while let Some(node) = stack.pop() {
            if !accept(&self.bounds(node)) {
                continue;
            }
            if node.level <= level {
                found(node.at);
            } else {
                stack.extend(self.children(node));
            }
        }
    }

    /// Visits the blocks that a ray may hit, approximately front to back. `block` receives the ray parameter
    /// limit and returns the new one: that of a hit, if it found one.
    pub fn walk(
        &self,
        origin: DVec3,
        direction: DVec3,
        t_max: f64,
        block: &mut dyn FnMut([u32; 2], f64) -> f64,
    ) {
        let length = direction.length();
        let ray = BoxRay::new(origin - self.middle, direction / length, self.extent_m);
        // Rounded up to the next single-precision number.
        let metres = |t: f64| -down(-t * length);
        let (mut limit, mut limit_m) = (t_max, metres(t_max));
        let mut waiting = [(0.0_f32, BlockNode::default()); MAX_WAITING];
        let root = self.root();
        let (enter, is_met) = self.levels[root.level as usize].quads[0].enter(&ray, limit_m);
        waiting[0] = (enter.x, root);
        let mut count = (is_met & 1) as usize;
        while count > 0 {
            count -= 1;
            let (enter_m, node) = waiting[count];
            if enter_m > limit_m {
                continue;
            }
            let Some(below) = node.level.checked_sub(1) else {
                limit = block(node.at, limit);
                limit_m = metres(limit);
                continue;
            };
            let (enter, is_met) = self.levels[below as usize].quad(node.at).enter(&ray, limit_m);
            let first = count;
            for lane in (0..4).filter(|lane| is_met & (1 << lane) != 0) {
                // The nearest box is pushed last, so it is popped first.
                let mut slot = count;
                while slot > first && waiting[slot - 1].0 < enter[lane as usize] {
                    waiting[slot] = waiting[slot - 1];
                    slot -= 1;
                }
                waiting[slot] = (
                    enter[lane as usize],
                    BlockNode { level: below, at: [2 * node.at[0] + lane % 2, 2 * node.at[1] + lane / 2] },
                );
                count += 1;
            }
        }
    }

    /// Visits the blocks that a beam may meet, approximately front to back. `block` returns how far along it
    /// others matter.
    pub fn walk_beam(&self, beam: &Beam, farthest_m: f64, block: &mut dyn FnMut([u32; 2]) -> f64) {
        let beam = BeamBox::new(beam, self.middle, self.extent_m);
        let mut limit_m = -down(-farthest_m);
        let mut waiting = [(0.0_f32, BlockNode::default()); MAX_WAITING];
        let root = self.root();
        let (near, is_met) = self.levels[root.level as usize].quads[0].meet(&beam, limit_m);
        waiting[0] = (near.x, root);
        let mut count = (is_met & 1) as usize;
        while count > 0 {
            count -= 1;
            let (near_m, node) = waiting[count];
            if near_m > limit_m {
                continue;
            }
            let Some(below) = node.level.checked_sub(1) else {
                limit_m = -down(-block(node.at));
                continue;
            };
            let (near, is_met) = self.levels[below as usize].quad(node.at).meet(&beam, limit_m);
            let first = count;
            for lane in (0..4).filter(|lane| is_met & (1 << lane) != 0) {
                // The nearest box is pushed last, so it is popped first.
                let mut slot = count;
                while slot > first && waiting[slot - 1].0 < near[lane as usize] {
                    waiting[slot] = waiting[slot - 1];
                    slot -= 1;
                }
                let at = [2 * node.at[0] + lane % 2, 2 * node.at[1] + lane / 2];
                waiting[slot] = (near[lane as usize], BlockNode { level: below, at });
                count += 1;
            }
        }
    }

    /// A box, as enlarged by rounding.
    pub fn bounds(&self, node: BlockNode) -> Aabb {
        let Aabb { min, max } = self.levels[node.level as usize]
            .quad(node.at.map(|n| n / 2))
            .get((node.at[0] % 2 + 2 * (node.at[1] % 2)) as usize);
        Aabb { min: min + self.middle, max: max + self.middle }
    }

    /// Up to four child nodes; none for a leaf.
    pub fn children(&self, node: BlockNode) -> impl Iterator<Item = BlockNode> {
        let below = node.level.checked_sub(1);
        below.into_iter().flat_map(move |level| {
            let size = self.levels[level as usize].size;
            let [x, y] = node.at.map(|n| 2 * n);
            let all = [[x, y], [x + 1, y], [x, y + 1], [x + 1, y + 1]];
            all.into_iter()
                .filter(move |c| c[0] < size[0] && c[1] < size[1])
                .map(move |at| BlockNode { level, at })
        })
    }
}

impl TreeLevel {
    fn new(size: [u32; 2]) -> Self {
        let [across, down] = size.map(|n| n.div_ceil(2) as usize);
        Self { size, quads: vec![Box4::EMPTY; across * down] }
    }

    /// The four boxes within one of the level above.
    fn quad(&self, above: [u32; 2]) -> &Box4 {
        &self.quads[self.index(above)]
    }

    fn set(&mut self, at: [u32; 2], bounds: &Aabb) {
        let index = self.index(at.map(|n| n / 2));
        self.quads[index].set((at[0] % 2 + 2 * (at[1] % 2)) as usize, bounds);
    }

    fn index(&self, above: [u32; 2]) -> usize {
        above[1] as usize * self.size[0].div_ceil(2) as usize + above[0] as usize
    }
}

/// Columns and rows, row by row.
fn cells(size: [u32; 2]) -> impl Iterator<Item = [u32; 2]> {
    (0..size[1]).flat_map(move |y| (0..size[0]).map(move |x| [x, y]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Boxes in rows and columns, some of them empty.
    fn boxes(size: [u32; 2], away: DVec3) -> Vec<Aabb> {
        let wave = |i: u32| (f64::from(i) * 0.618_033_988_749_895).fract();
        let bounds = |[x, y]: [u32; 2]| {
            let n = 31 * x + 17 * y;
            let low = away + DVec3::new(40.0 * f64::from(y), 40.0 * f64::from(x), 300.0 * wave(n));
            let top = low + DVec3::new(40.0, 40.0, 30.0 * wave(n + 5));
            if n % 11 == 3 { Aabb::EMPTY } else { Aabb { min: low, max: top } }
        };
        cells(size).map(bounds).collect()
    }

    #[test]
    fn walk_visits_every_box_that_a_ray_hits() {
        for (size, away) in
            [([1, 1], 0.0), ([5, 3], 10.0), ([37, 22], 1000.0), ([64, 64], -4e5), ([9, 70], 6.4e6)]
        {
            let away = away * DVec3::new(1.0, 0.3, -0.1);
            let boxes = boxes(size, away);
            let tree = BlockTree::new(size, &boxes);
            let mut met = 0;
            for i in 0..600 {
                let part = |step: f64| (f64::from(i) * step).fract();
                let reach = DVec3::new(40.0 * f64::from(size[1]), 40.0 * f64::from(size[0]), 330.0);
                let target = away + reach * DVec3::new(part(0.618), part(0.755), part(0.325));
                // Along the axes and oblique, from inside and from far away.
                let aslant = DVec3::new(part(0.57) - 0.5, part(0.31) - 0.5, part(0.83) - 0.5);
                let along = [DVec3::X, DVec3::Y, -DVec3::Z, aslant][i as usize % 4];
                let direction = along * [1.0, 1e-12, 3e7][i as usize % 3];
                let origin = target - direction * [0.0, 1.0, 4e3][i as usize / 4 % 3] / direction.length();
                let mut blocks = Vec::new();
                tree.walk(origin, direction, f64::INFINITY, &mut |block, limit| {
                    blocks.push(block);
                    limit
                });
                for (block, each) in cells(size).zip(&boxes) {
                    let t =
                        each.enter(origin, crate::scene::terrain::bounds::inverse(direction), f64::INFINITY);
                    met += u32::from(t.is_some());
                    assert!(t.is_none() || blocks.contains(&block), "{size:?} {i}: {block:?} target {t:?}");
                }
            }
            assert!(met > 100, "{size:?}: {met}");
        }
    }

    #[test]
    fn stored_boxes_contain_their_input() {
        let size = [37, 22];
        for away in [0.0, 6.4e6] {
            let boxes = boxes(size, DVec3::splat(away));
            let tree = BlockTree::new(size, &boxes);
            for (at, each) in cells(size).zip(&boxes) {
                let stored = tree.bounds(BlockNode { level: 0, at });
                assert_eq!(stored.is_empty(), each.is_empty());
                if !each.is_empty() {
                    let (low, high) = (each.min - stored.min, stored.max - each.max);
                    assert!(
                        low.min(high).min_element() >= 0.0 && low.max(high).max_element() < 1e-3,
                        "{at:?}: {low} {high}"
                    );
                }
            }
            assert_eq!(tree.square(4, [37, 0]), None);
            assert!(
                tree.square(BLOCK_CELLS << 9, [0, 0]).is_some_and(|whole| whole == tree.bounds(tree.root()))
            );
        }
    }

    #[test]
    fn walk_stops_at_a_hit() {
        let size = [64, 64];
        let tree = BlockTree::new(size, &boxes(size, DVec3::ZERO));
        let mut visited = 0;
        tree.walk(DVec3::new(1000.0, -10.0, 150.0), DVec3::Y, f64::INFINITY, &mut |_, _| {
            visited += 1;
            20.0
        });
        assert!(visited <= 2, "{visited}");
    }
}
