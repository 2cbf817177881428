//! Walks from triangle to triangle: the intersection of a ray beside one whose triangle is known.
//!
//! Neighbouring pixels see the same triangle or one close to it. Seen from the ray's origin, a patch of
//! front-facing triangles is a flat mesh without folds, so crossing the edge that the ray lies beyond leads to
//! the triangle that it meets in a few steps. A walk that arrives has also shown that no silhouette of the
//! patch lies between the two rays.

use glam::DVec3;

use super::{CHUNK_CELLS, Terrain, TerrainHit, cell_triangles};

/// Most triangles that a walk crosses. Longer ways are left to [`Terrain::intersect`].
const MOST_STEPS: u32 = 24;

/// A triangle of the full surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TerrainTriangle {
    /// Cell of the full grid, from the west and from the north.
    cell: [u32; 2],
    /// Which triangle of the cell, in the order of [`cell_triangles`].
    half: u32,
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

/// A triangle on the way. The signed volumes over its edges are those of [`super::intersect_triangle`]; that
/// over a shared edge is negated, so that both sides agree where a ray passes.
struct Step {
    triangle: TerrainTriangle,
    /// Relative to the ray's origin, metres.
    corners_m: [DVec3; 3],
    /// Each over the edge opposite to the corner.
    volumes: [f64; 3],
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

    /// Unit normal of a triangle, NED, upwards.
    #[must_use]
    pub fn normal_ned(&self, triangle: TerrainTriangle) -> DVec3 {
        let [a, b, c] = [0, 1, 2].map(|k| self.corner_m(triangle, k, DVec3::ZERO));
        (b - a).cross(c - a).normalize_or_zero()
    }

    /// Walks from a triangle that a ray nearby hits to the one that `origin + t direction` hits, across
    /// triangles that face the origin. Returns that triangle and t; `None` if the way leads to a triangle
    /// that faces away, to a void or off the terrain, or is long. The hit is on the same unfolded patch as
    /// the start, which need not be the first surface along the ray.
    #[must_use]
    pub fn walk(
        &self,
        from: TerrainTriangle,
        origin_ned_m: DVec3,
        direction_ned: DVec3,
    ) -> Option<(TerrainTriangle, f64)> {
        /// As in [`super::intersect_triangle`].
        const ROUNDING: f64 = 4e-15;
        let largest = ROUNDING * direction_ned.abs().max_element();
        let mut step = self.first_step(from, origin_ned_m, direction_ned);
        for _ in 0..MOST_STEPS {
            let Step { triangle, corners_m: [a, b, c], volumes } = step;
            let sum = volumes[0] + volumes[1] + volumes[2];
            let reach_m = a.abs().max(b.abs()).max(c.abs()).max_element();
            let slack = largest * reach_m * reach_m;
            // False for NaN, which is a void. Normals point up, so a triangle that faces the origin has
            // positive volumes.
            let is_facing = sum > 3.0 * slack;
            if !is_facing {
                return None;
            }
            let edge = (1..3).fold(0, |lowest, k| if volumes[k] < volumes[lowest] { k } else { lowest });
            if volumes[edge] >= -slack {
                let normal = (b - a).cross(c - a);
                let t = a.dot(normal) / direction_ned.dot(normal);
                return (t >= 0.0).then_some((triangle, t));
            }
            step = self.next_step(&step, edge, origin_ned_m, direction_ned)?;
        }
        None
    }

    fn first_step(&self, triangle: TerrainTriangle, origin: DVec3, direction: DVec3) -> Step {
        let corners_m = [0, 1, 2].map(|k| self.corner_m(triangle, k, origin));
        Step { triangle, corners_m, volumes: [0, 1, 2].map(|k| volume(corners_m, k, direction)) }
    }

    /// The triangle across the edge opposite to a corner; `None` off the terrain.
    fn next_step(&self, step: &Step, edge: usize, origin: DVec3, direction: DVec3) -> Option<Step> {
        let half = step.triangle.half;
        let crossing = &CROSSINGS[half as usize][edge];
        let [column, row] = [0, 1].map(|k| step.triangle.cell[k].checked_add_signed(crossing.cell[k]));
        let cell = [column?, row?];
        if cell[0] >= self.cells[0] || cell[1] >= self.cells[1] {
            return None;
        }
        let triangle = TerrainTriangle { cell, half: 1 - half };
        let corners_m = [0, 1, 2].map(|k| match crossing.corners[k] {
            NEW => self.corner_m(triangle, k, origin),
            old => step.corners_m[old],
        });
        let volumes = [0, 1, 2].map(|k| match crossing.corners[k] {
            NEW => -step.volumes[edge],
            _ => volume(corners_m, k, direction),
        });
        Some(Step { triangle, corners_m, volumes })
    }

    /// A corner of a triangle relative to a point, metres.
    fn corner_m(&self, triangle: TerrainTriangle, corner: usize, origin: DVec3) -> DVec3 {
        let (chunk, cell) = self.chunk_of_cell(triangle.cell);
        let [i, j] = cell_triangles(cell)[triangle.half as usize][corner];
        self.position_ned_m(chunk, i, j) - origin
    }
}

/// Signed volume over the edge opposite to a corner.
fn volume(corners_m: [DVec3; 3], corner: usize, direction: DVec3) -> f64 {
    direction.dot(corners_m[(corner + 2) % 3].cross(corners_m[(corner + 1) % 3]))
}
