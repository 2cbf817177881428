//! Walks from triangle to triangle: the intersection of a ray beside one whose triangle is known.
//!
//! Neighbouring pixels see the same triangle or one close to it. Seen from the ray's origin, a patch of
//! front-facing triangles is a flat mesh without folds, so crossing the edge that the ray lies beyond leads to
//! the triangle that it meets in a few steps. A walk that arrives has also shown that no silhouette of the
//! patch lies between the two rays.

use glam::DVec3;

use super::{CHUNK_CELLS, Terrain, TerrainHit, cell_triangles};

/// Most triangles that a walk crosses. Longer paths are left to [`Terrain::intersect`].
const MOST_STEPS: u32 = 24;

/// A triangle of the full surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TerrainTriangle {
    /// Cell of the full grid, from the west and from the north.
    pub(super) cell: [u32; 2],
    /// Which triangle of the cell, in the order of [`cell_triangles`].
    pub(super) half: u32,
}

/// The triangle across an edge.
struct Crossing {
    /// Steps to its cell, to the east and to the south.
    cell: [i32; 2],
    /// Its corners, as indices of the corners of the triangle that is left; [`NEW`] for the one that is not
    /// among them.
    corners: [usize; 3],
}

const NEW: usize = 3;

/// By the half of a cell and the corner opposite to the edge that is crossed.
const CROSSINGS: [[Crossing; 3]; 2] = [
    [
        Crossing { cell: [1, 0], corners: [2, 1, NEW] },
        Crossing { cell: [0, -1], corners: [NEW, 0, 2] },
        Crossing { cell: [0, 0], corners: [0, NEW, 1] },
    ],
    [
        Crossing { cell: [0, 1], corners: [1, NEW, 2] },
        Crossing { cell: [0, 0], corners: [0, 2, NEW] },
        Crossing { cell: [-1, 0], corners: [NEW, 1, 0] },
    ],
];

/// A walk over the terrain by rays from one point. It stays at the triangle that the last ray has met, so that
/// a ray beside it costs three products.
#[derive(Clone, Debug)]
pub struct TerrainWalk<'a> {
    terrain: &'a Terrain,
    origin_ned_m: DVec3,
    triangle: TerrainTriangle,
    /// Relative to the rays' origin, metres.
    corners_m: [DVec3; 3],
    /// Each the product of the ends of the edge opposite to the corner. Its product with a direction is the
    /// signed volume of [`super::intersect_triangle`]; that of a shared edge is negated, so that both sides agree
    /// where a ray passes.
    edges_m2: [DVec3; 3],
    /// Upwards, and of unit length.
    normal: DVec3,
    normal_ned: DVec3,
    /// Largest coordinate of a corner.
    reach_m: f64,
}

/// Where a walk ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WalkHit {
    /// The triangle.
    pub triangle: TerrainTriangle,
    /// Ray parameter.
    pub t: f64,
    /// Unit normal of the triangle, NED, upwards.
    pub normal_ned: DVec3,
}

impl TerrainHit {
    /// The triangle that was hit.
    #[must_use]
    pub fn triangle_of(&self, terrain: &Terrain) -> TerrainTriangle {
        let columns = terrain.chunk_grid[0];
        let chunk = [self.chunk % columns, self.chunk / columns];
        TerrainTriangle { cell: [0, 1].map(|k| chunk[k] * CHUNK_CELLS + self.cell[k]), half: self.half }
    }
}

impl Terrain {
    /// Chunk and vertices of a triangle.
    #[must_use]
    pub fn vertices_of(&self, triangle: TerrainTriangle) -> (u32, [u32; 3]) {
        let (number, cell) = self.chunk_of_cell(triangle.cell);
        let chunk = &self.chunks[number as usize];
        let vertex = |[i, j]: [u32; 2]| chunk.first_vertex + j * (chunk.cells[0] + 1) + i;
        (number, cell_triangles(cell)[triangle.half as usize].map(vertex))
    }

    /// Walks from a triangle that a ray nearby hits to the one that `origin + t direction` hits, as
    /// [`TerrainWalk::to`].
    #[must_use]
    pub fn walk(&self, from: TerrainTriangle, origin_ned_m: DVec3, direction_ned: DVec3) -> Option<WalkHit> {
        TerrainWalk::new(self, from, origin_ned_m).to(direction_ned)
    }

    /// A corner of a triangle relative to a point, metres.
    #[inline]
    fn corner_m(&self, triangle: TerrainTriangle, corner: usize, origin: DVec3) -> DVec3 {
        let (chunk, cell) = self.chunk_of_cell(triangle.cell);
        let [i, j] = cell_triangles(cell)[triangle.half as usize][corner];
        self.position_ned_m(chunk, i, j) - origin
    }
}

impl<'a> TerrainWalk<'a> {
    /// A walk by rays from `origin_ned_m` that begins at a triangle.
    #[must_use]
    pub fn new(terrain: &'a Terrain, from: TerrainTriangle, origin_ned_m: DVec3) -> Self {
        let corners_m = [0, 1, 2].map(|k| terrain.corner_m(from, k, origin_ned_m));
        let mut walk = Self {
            terrain,
            origin_ned_m,
            triangle: from,
            corners_m,
            edges_m2: [0, 1, 2].map(|k| edge_m2(&corners_m, k)),
            normal: DVec3::ZERO,
            normal_ned: DVec3::ZERO,
            reach_m: 0.0,
        };
        walk.measure();
        walk
    }

    /// Where the walk is.
    #[must_use]
    pub fn triangle(&self) -> TerrainTriangle {
        self.triangle
    }

    /// Walks on to the triangle that `origin + t direction` hits, across triangles that face the origin. `None`
    /// if the path leads to a triangle that faces away, to a void or off the terrain, or is long; the walk is
    /// then anywhere on the path. The hit is on the same unfolded patch as the start, which need not be the
    /// first surface along the ray.
    #[must_use]
    #[inline]
    pub fn to(&mut self, direction_ned: DVec3) -> Option<WalkHit> {
        /// As in [`super::intersect_triangle`].
        const ROUNDING: f64 = 4e-15;
        let largest = ROUNDING * direction_ned.abs().max_element();
        for _ in 0..MOST_STEPS {
            let volumes = self.edges_m2.map(|edge| direction_ned.dot(edge));
            let sum = volumes[0] + volumes[1] + volumes[2];
            let slack = largest * self.reach_m * self.reach_m;
            // False for NaN, which is a void. Normals point up, so a triangle that faces the origin has
            // positive volumes.
            let is_facing = sum > 3.0 * slack;
            if !is_facing {
                return None;
            }
            let edge = (1..3).fold(0, |lowest, k| if volumes[k] < volumes[lowest] { k } else { lowest });
            if volumes[edge] >= -slack {
                let t = self.corners_m[0].dot(self.normal) / direction_ned.dot(self.normal);
                let Self { triangle, normal_ned, .. } = *self;
                return (t >= 0.0).then_some(WalkHit { triangle, t, normal_ned });
            }
            self.cross(edge)?;
        }
        None
    }

    /// Goes to the triangle across the edge opposite to a corner; `None` off the terrain.
    fn cross(&mut self, edge: usize) -> Option<()> {
        let TerrainTriangle { cell, half } = self.triangle;
        let crossing = &CROSSINGS[half as usize][edge];
        let [column, row] = [0, 1].map(|k| cell[k].checked_add_signed(crossing.cell[k]));
        let cell = [column?, row?];
        if cell[0] >= self.terrain.cells[0] || cell[1] >= self.terrain.cells[1] {
            return None;
        }
        self.triangle = TerrainTriangle { cell, half: 1 - half };
        let before = self.corners_m;
        self.corners_m = [0, 1, 2].map(|k| match crossing.corners[k] {
            NEW => self.terrain.corner_m(self.triangle, k, self.origin_ned_m),
            old => before[old],
        });
        let shared_m2 = self.edges_m2[edge];
        self.edges_m2 = [0, 1, 2].map(|k| match crossing.corners[k] {
            NEW => -shared_m2,
            _ => edge_m2(&self.corners_m, k),
        });
        self.measure();
        Some(())
    }

    #[inline]
    fn measure(&mut self) {
        let [a, b, c] = self.corners_m;
        self.normal = (b - a).cross(c - a);
        self.normal_ned = self.normal.normalize_or_zero();
        self.reach_m = a.abs().max(b.abs()).max(c.abs()).max_element();
    }
}

/// Product of the ends of the edge opposite to a corner.
#[inline]
fn edge_m2(corners_m: &[DVec3; 3], corner: usize) -> DVec3 {
    corners_m[(corner + 2) % 3].cross(corners_m[(corner + 1) % 3])
}
