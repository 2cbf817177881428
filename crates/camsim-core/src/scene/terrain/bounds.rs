//! Boxes, and a quadtree of boxes over the grid.

use glam::{DMat3, DVec3};

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

    /// Smallest box around this one, turned and scaled about (0, 0, 0) and then moved.
    pub(crate) fn turned(&self, turn: DMat3, shift: DVec3) -> Self {
        if self.is_empty() {
            return *self;
        }
        let half = 0.5 * (self.max - self.min);
        let reach = turn.x_axis.abs() * half.x + turn.y_axis.abs() * half.y + turn.z_axis.abs() * half.z;
        let centre = turn * self.centre() + shift;
        Self { min: centre - reach, max: centre + reach }
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

    /// First ray parameter in `0..=t_max` inside the box, for a ray given by its origin and [`inverse`] direction.
    ///
    /// The box is taken a nanometre larger, and both ends are widened by some rounding errors: it must never hide a hit of a triangle
    /// within it, nor one that a ray within the plane of a face meets.
    pub(in crate::scene) fn enter(&self, origin: DVec3, inverse_direction: DVec3, t_max: f64) -> Option<f64> {
        const WIDER: f64 = 1e-14;
        const LARGER_M: f64 = 1e-9;
        let near = (self.min - origin - LARGER_M) * inverse_direction;
        let far = (self.max - origin + LARGER_M) * inverse_direction;
        let t_enter = near.min(far).max_element().max(0.0) * (1.0 - WIDER);
        let t_exit = near.max(far).min_element().min(t_max) * (1.0 + WIDER);
        (t_enter <= t_exit && !self.is_empty()).then_some(t_enter)
    }
}

/// 1 / direction for [`Aabb::enter`]. A component of 0 counts as one too small to matter: its inverse is finite, and times 0 it is 0.
pub(in crate::scene) fn inverse(direction: DVec3) -> DVec3 {
    const NONE: f64 = 1e-290;
    DVec3::select(direction.abs().cmplt(DVec3::splat(NONE)), DVec3::splat(NONE), direction).recip()
}

/// Cells along each side of the tree's leaves.
pub(super) const BLOCK_CELLS: u32 = 4;

/// An implicit quadtree: level 0 holds one box for each 4x4 cells, each level above one for 2x2 of the level below, the last one box.
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

    /// Memory that its boxes take.
    pub fn bytes(&self) -> usize {
        self.levels.iter().map(|level| size_of_val(&*level.boxes)).sum()
    }

    /// The box around everything.
    pub fn root(&self) -> Node {
        Node { level: self.levels.len() - 1, at: [0, 0] }
    }

    /// Level of boxes around so many cells along a side: a power of two times [`BLOCK_CELLS`].
    fn level_of(cells: u32) -> usize {
        (cells / BLOCK_CELLS).trailing_zeros() as usize
    }

    /// The box around a square of so many cells, by column and row; `None` beyond the grid. The last one is around everything.
    pub fn square(&self, cells: u32, at: [i64; 2]) -> Option<&Aabb> {
        let level = &self.levels[Self::level_of(cells).min(self.levels.len() - 1)];
        let is_there = (0..2).all(|k| (0..i64::from(level.size[k])).contains(&at[k]));
        is_there.then(|| level.get(at.map(|n| n as u32)))
    }

    /// Visits the squares of so many cells along a side whose boxes, and those around them, are accepted.
    pub fn visit(&self, cells: u32, accept: &dyn Fn(&Aabb) -> bool, found: &mut dyn FnMut([u32; 2])) {
        let level = Self::level_of(cells);
        let mut stack = vec![self.root()];
        while let Some(node) = stack.pop() {
            if !accept(self.bounds(node)) {
                continue;
            }
            if node.level <= level {
                found(node.at);
            } else {
                stack.extend(self.children(node));
            }
        }
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
