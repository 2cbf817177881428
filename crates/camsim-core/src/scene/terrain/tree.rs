//! A quadtree of boxes over the grid.
//!
//! The four boxes below one are [tested against a ray at once](super::super::quad): they lie together in
//! memory, relative to the middle of the whole.

use glam::DVec3;

use super::bounds::Aabb;
use crate::scene::quad::{BoxRay, Quad, down};

/// Cells along each side of the tree's leaves.
pub(super) const BLOCK_CELLS: u32 = 4;
/// Nodes that wait at most: the root, and three on each level of the largest grid that there can be.
const MOST_WAITING: usize = 3 * 32 + 1;

/// An implicit quadtree: level 0 holds one box for each 4x4 cells, each level above one for 2x2 of the level
/// below, the last one box.
#[derive(Clone, Debug)]
pub(super) struct BlockTree {
    /// All coordinates are relative to it.
    middle: DVec3,
    /// Largest coordinate of a box, metres.
    extent_m: f64,
    levels: Vec<TreeLevel>,
}

#[derive(Clone, Debug)]
struct TreeLevel {
    size: [u32; 2],
    /// Squares of 2x2 boxes, row after row: the two of one row, and those of the next.
    quads: Vec<Quad>,
}

/// A box of the tree.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Node {
    pub level: u32,
    pub at: [u32; 2],
}

impl BlockTree {
    /// `boxes` of the blocks, row after row.
    pub fn new(size: [u32; 2], boxes: &[Aabb]) -> Self {
        let whole = boxes.iter().fold(Aabb::EMPTY, |all, each| all.union(each));
        let middle = if whole.is_empty() { DVec3::ZERO } else { whole.centre() };
        let extent_m = if whole.is_empty() { 0.0 } else { (whole.max - middle).max_element() };
        let mut levels = vec![TreeLevel::new(size)];
        for (at, each) in places(size).zip(boxes).filter(|(_, each)| !each.is_empty()) {
            levels[0].set(at, &Aabb { min: each.min - middle, max: each.max - middle });
        }
        let mut size = size;
        while size != [1, 1] {
            let below = &levels[levels.len() - 1];
            size = size.map(|n| n.div_ceil(2));
            let mut level = TreeLevel::new(size);
            for at in places(size) {
                let quad = below.quad(at);
                level.set(at, &(0..4).fold(Aabb::EMPTY, |all, lane| all.union(&quad.get(lane))));
            }
            levels.push(level);
        }
        Self { middle, extent_m, levels }
    }

    /// Memory that its boxes take.
    pub fn bytes(&self) -> usize {
        self.levels.iter().map(|level| size_of_val(&*level.quads)).sum()
    }

    /// The box around everything.
    pub fn root(&self) -> Node {
        Node { level: self.levels.len() as u32 - 1, at: [0, 0] }
    }

    /// Level of boxes around so many cells along a side: a power of two times [`BLOCK_CELLS`].
    fn level_of(cells: u32) -> u32 {
        (cells / BLOCK_CELLS).trailing_zeros()
    }

    /// The box around a square of so many cells, by column and row; `None` beyond the grid. The last one is
    /// around everything.
    pub fn square(&self, cells: u32, at: [i64; 2]) -> Option<Aabb> {
        let level = Self::level_of(cells).min(self.root().level);
        let size = self.levels[level as usize].size;
        let is_there = (0..2).all(|k| (0..i64::from(size[k])).contains(&at[k]));
        is_there.then(|| self.bounds(Node { level, at: at.map(|n| n as u32) }))
    }

    /// Visits the squares of so many cells along a side whose boxes, and those around them, are accepted.
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

    /// Leads a ray to the blocks that it may meet, the nearest first as far as their boxes tell. `block` gets
    /// the ray parameter up to which anything matters, and returns the one from then on: that of a hit, if it
    /// has found one.
    pub fn walk(
        &self,
        origin: DVec3,
        direction: DVec3,
        t_max: f64,
        block: &mut dyn FnMut([u32; 2], f64) -> f64,
    ) {
        let length = direction.length();
        let ray = BoxRay::new(origin - self.middle, direction / length, self.extent_m);
        // Up to the next number above.
        let metres = |t: f64| -down(-t * length);
        let (mut limit, mut limit_m) = (t_max, metres(t_max));
        let mut waiting = [(0.0_f32, Node::default()); MOST_WAITING];
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
                // Nearest last, so that it comes off first.
                let mut place = count;
                while place > first && waiting[place - 1].0 < enter[lane as usize] {
                    waiting[place] = waiting[place - 1];
                    place -= 1;
                }
                waiting[place] = (
                    enter[lane as usize],
                    Node { level: below, at: [2 * node.at[0] + lane % 2, 2 * node.at[1] + lane / 2] },
                );
                count += 1;
            }
        }
    }

    /// A box, as large as its rounding makes it.
    pub fn bounds(&self, node: Node) -> Aabb {
        let Aabb { min, max } = self.levels[node.level as usize]
            .quad(node.at.map(|n| n / 2))
            .get((node.at[0] % 2 + 2 * (node.at[1] % 2)) as usize);
        Aabb { min: min + self.middle, max: max + self.middle }
    }

    /// Up to four nodes of the level below; none for a leaf.
    pub fn children(&self, node: Node) -> impl Iterator<Item = Node> {
        let below = node.level.checked_sub(1);
        below.into_iter().flat_map(move |level| {
            let size = self.levels[level as usize].size;
            let [x, y] = node.at.map(|n| 2 * n);
            let all = [[x, y], [x + 1, y], [x, y + 1], [x + 1, y + 1]];
            all.into_iter()
                .filter(move |c| c[0] < size[0] && c[1] < size[1])
                .map(move |at| Node { level, at })
        })
    }
}

impl TreeLevel {
    fn new(size: [u32; 2]) -> Self {
        let [across, down] = size.map(|n| n.div_ceil(2) as usize);
        Self { size, quads: vec![Quad::EMPTY; across * down] }
    }

    /// The boxes within one of the level above.
    fn quad(&self, above: [u32; 2]) -> &Quad {
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

/// Columns and rows, row after row.
fn places(size: [u32; 2]) -> impl Iterator<Item = [u32; 2]> {
    (0..size[1]).flat_map(move |y| (0..size[0]).map(move |x| [x, y]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Boxes in a row and beside each other, some of them empty.
    fn boxes(size: [u32; 2], away: DVec3) -> Vec<Aabb> {
        let wave = |i: u32| (f64::from(i) * 0.618_033_988_749_895).fract();
        let of = |[x, y]: [u32; 2]| {
            let n = 31 * x + 17 * y;
            let low = away + DVec3::new(40.0 * f64::from(y), 40.0 * f64::from(x), 300.0 * wave(n));
            let top = low + DVec3::new(40.0, 40.0, 30.0 * wave(n + 5));
            if n % 11 == 3 { Aabb::EMPTY } else { Aabb { min: low, max: top } }
        };
        places(size).map(of).collect()
    }

    #[test]
    fn a_ray_is_led_to_every_box_that_it_meets() {
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
                let at = away + reach * DVec3::new(part(0.618), part(0.755), part(0.325));
                // Along the axes and aslant, from inside and from far away.
                let aslant = DVec3::new(part(0.57) - 0.5, part(0.31) - 0.5, part(0.83) - 0.5);
                let along = [DVec3::X, DVec3::Y, -DVec3::Z, aslant][i as usize % 4];
                let direction = along * [1.0, 1e-12, 3e7][i as usize % 3];
                let origin = at - direction * [0.0, 1.0, 4e3][i as usize / 4 % 3] / direction.length();
                let mut found = Vec::new();
                tree.walk(origin, direction, f64::INFINITY, &mut |block, limit| {
                    found.push(block);
                    limit
                });
                for (block, each) in places(size).zip(&boxes) {
                    let t =
                        each.enter(origin, crate::scene::terrain::bounds::inverse(direction), f64::INFINITY);
                    met += u32::from(t.is_some());
                    assert!(t.is_none() || found.contains(&block), "{size:?} {i}: {block:?} at {t:?}");
                }
            }
            assert!(met > 100, "{size:?}: {met}");
        }
    }

    #[test]
    fn boxes_hold_what_they_were_made_of() {
        let size = [37, 22];
        for away in [0.0, 6.4e6] {
            let boxes = boxes(size, DVec3::splat(away));
            let tree = BlockTree::new(size, &boxes);
            for (at, each) in places(size).zip(&boxes) {
                let found = tree.bounds(Node { level: 0, at });
                assert_eq!(found.is_empty(), each.is_empty());
                if !each.is_empty() {
                    let (low, high) = (each.min - found.min, found.max - each.max);
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
    fn what_lies_beyond_a_hit_is_left() {
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
