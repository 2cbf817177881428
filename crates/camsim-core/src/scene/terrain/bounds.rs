//! Boxes, and a quadtree of boxes over the grid.

use glam::DVec3;

/// A box along the NED axes, metres. Empty if any `min` is above its `max`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Smallest coordinates.
    pub min: DVec3,
    /// Largest coordinates.
    pub max: DVec3,
}

impl Aabb {
    /// The box that holds nothing.
    pub const EMPTY: Self = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    /// Whether it holds nothing.
    pub fn is_empty(&self) -> bool {
        !self.min.cmple(self.max).all()
    }

    /// Grows to hold a point.
    pub fn include(&mut self, point: DVec3) {
        self.min = self.min.min(point);
        self.max = self.max.max(point);
    }

    /// The box around both.
    pub fn union(&self, other: &Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Middle of the box.
    pub fn centre(&self) -> DVec3 {
        0.5 * (self.min + self.max)
    }

    /// Distance from a point to the nearest point of the box, 0 inside; infinite for an empty box.
    pub fn distance_m(&self, point: DVec3) -> f64 {
        if self.is_empty() {
            return f64::INFINITY;
        }
        (self.min - point).max(point - self.max).max(DVec3::ZERO).length()
    }

    /// Distance from a point to the farthest point of the box; 0 for an empty box.
    pub fn farthest_m(&self, point: DVec3) -> f64 {
        if self.is_empty() {
            return 0.0;
        }
        (self.max - point).abs().max((self.min - point).abs()).length()
    }

    /// The largest value of `normal . x` over the box.
    pub(super) fn support(&self, normal: DVec3) -> f64 {
        (normal * self.min).max(normal * self.max).element_sum()
    }

    /// First ray parameter in `0..=t_max` inside the box, for a ray given by its origin and 1 / direction.
    ///
    /// Both ends are widened by some rounding errors: a box must never hide a hit of a triangle within it.
    pub(super) fn enter(&self, origin: DVec3, inverse_direction: DVec3, t_max: f64) -> Option<f64> {
        const WIDER: f64 = 1e-14;
        let (mut t_enter, mut t_exit) = (0.0_f64, t_max);
        for axis in 0..3 {
            let near = (self.min[axis] - origin[axis]) * inverse_direction[axis];
            let far = (self.max[axis] - origin[axis]) * inverse_direction[axis];
            // 0 * infinity: the ray runs within a face's plane, which is inside.
            if !near.is_nan() && !far.is_nan() {
                t_enter = t_enter.max(near.min(far) * (1.0 - WIDER));
                t_exit = t_exit.min(near.max(far) * (1.0 + WIDER));
            }
        }
        (t_enter <= t_exit && !self.is_empty()).then_some(t_enter)
    }
}

/// Cells along each side of the tree's leaves.
pub(super) const BLOCK_CELLS: u32 = 8;

/// An implicit quadtree: level 0 holds one box for each 8x8 cells, each level above one for 2x2 of the level below, the last one box.
#[derive(Clone, Debug)]
pub(super) struct BlockTree {
    levels: Vec<TreeLevel>,
}

#[derive(Clone, Debug)]
struct TreeLevel {
    size: [u32; 2],
    boxes: Vec<Aabb>,
}

/// A box of the tree.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    pub level: usize,
    pub at: [u32; 2],
}

impl BlockTree {
    /// `boxes` of the blocks, row after row.
    pub fn new(size: [u32; 2], boxes: Vec<Aabb>) -> Self {
        let mut levels = vec![TreeLevel { size, boxes }];
        let mut size = size;
        while size != [1, 1] {
            let below = &levels[levels.len() - 1];
            size = size.map(|n| n.div_ceil(2));
            let boxes = (0..size[1])
                .flat_map(|y| (0..size[0]).map(move |x| [x, y]))
                .map(|at| children(at, below.size).fold(Aabb::EMPTY, |all, child| all.union(below.get(child))))
                .collect();
            levels.push(TreeLevel { size, boxes });
        }
        Self { levels }
    }

    /// The box around everything.
    pub fn root(&self) -> Node {
        Node { level: self.levels.len() - 1, at: [0, 0] }
    }

    pub fn bounds(&self, node: Node) -> &Aabb {
        self.levels[node.level].get(node.at)
    }

    /// Up to four nodes of the level below; none for a leaf.
    pub fn children(&self, node: Node) -> impl Iterator<Item = Node> {
        let below = node.level.checked_sub(1);
        below.into_iter().flat_map(move |level| children(node.at, self.levels[level].size).map(move |at| Node { level, at }))
    }
}

impl TreeLevel {
    fn get(&self, at: [u32; 2]) -> &Aabb {
        &self.boxes[(at[1] * self.size[0] + at[0]) as usize]
    }
}

fn children(at: [u32; 2], size: [u32; 2]) -> impl Iterator<Item = [u32; 2]> {
    let [x, y] = at.map(|n| 2 * n);
    [[x, y], [x + 1, y], [x, y + 1], [x + 1, y + 1]].into_iter().filter(move |c| c[0] < size[0] && c[1] < size[1])
}
