//! Terrain from a grid of heights: two triangles per cell, with the diagonal from north-west to south-east.
//!
//! The full grid is the exact surface. For drawing, each chunk of 64x64 cells is a hierarchy of right
//! triangles, which are halved as often as a camera needs it ([`TerrainDetail`]).
//!
//! # Absence of gaps
//!
//! * Vertex positions are rounded to multiples of one power of two, [`Terrain::quantum_m`], and chunk centres
//!   are whole metres. Offsets are exact in f32, and so is `centre_ned_m - camera` for a camera position
//!   rounded to whole metres. Their f32 sum rounds the same exact number for each chunk that shares a vertex,
//!   so the sums are equal bit by bit, at any distance.
//! * Two triangles that share their longest side are halved together or not at all: the decision depends only
//!   on the vertex between them, its error and the tolerance around it. The stored error of a vertex is the
//!   largest of all vertices that need it, and its tolerance is taken over at least the area of theirs: so
//!   all vertices that a used vertex needs are used as well.

mod back_faces;
mod bounds;
mod build;
mod detail;
#[cfg(test)]
mod drawn_tests;
mod errors;
mod lattice;
mod packet;
mod placed;
mod query;
mod select;
mod sun_map;
mod terrain_tiles;
#[cfg(test)]
mod tests;
mod tree;
mod walk;

use std::{fmt, sync::Arc};

use glam::{DVec3, Vec3};

use back_faces::BorderPart;
pub use bounds::Aabb;
#[cfg(test)]
pub(in crate::scene) use bounds::inverse;
pub use build::TerrainGrid;
pub use detail::TerrainDetail;
pub use placed::PlacedMesh;
pub use query::Frustum;
pub use query::SeenTriangle;
pub use query::TerrainHit;
pub use query::intersect_triangle;
pub use select::{DrawnCell, LodSelection, TerrainMesh};
pub use sun_map::SunMap;
pub use terrain_tiles::TerrainTiles;
use tree::BlockTree;
pub use walk::{TerrainTriangle, TerrainWalk, WalkHit};

use super::Texture;

/// Cells along each side of a full chunk.
pub const CHUNK_CELLS: u32 = 64;

/// A vertex of the grid.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct TerrainVertex {
    /// North, east, down in metres from the chunk's centre, a multiple of [`Terrain::quantum_m`]. NaN for a
    /// void, which no triangle uses.
    pub offset_m: [f32; 3],
    /// Texture coordinates: (0, 0) is the outer corner of the top-left pixel, (1, 1) that of the bottom-right
    /// one.
    pub uv: [f32; 2],
}

/// A chunk of up to 64x64 cells.
#[derive(Clone, Debug)]
pub struct TerrainChunk {
    /// Origin of the vertices' offsets, in whole metres.
    pub centre_ned_m: DVec3,
    /// Bounding box of the valid vertices; empty if there is none.
    pub bounds: Aabb,
    /// Index of the north-west vertex in [`Terrain::vertices`]. Rows of `cells[0] + 1` vertices follow, from
    /// north to south.
    pub first_vertex: u32,
    /// Cells from west to east and from north to south, 1..=64.
    pub cells: [u32; 2],
    /// Whether there is any surface to draw.
    pub has_surface: bool,
    /// Whether a height is missing. Triangles without it are drawn, at full detail around it.
    pub has_voids: bool,
}

/// A terrain: a grid of heights as drawable chunks.
#[derive(Clone)]
pub struct Terrain {
    /// Vertices chunk by chunk; those on borders are stored in each chunk that has them.
    pub vertices: Vec<TerrainVertex>,
    /// Chunks row by row from the north, each row from the west.
    pub chunks: Vec<TerrainChunk>,
    /// Chunks from west to east and from north to south.
    pub chunk_grid: [u32; 2],
    /// Cells from west to east and from north to south.
    pub cells: [u32; 2],
    /// Number of cells with a void corner; one triangle of such a cell may exist.
    pub void_cells: u64,
    /// Texture of the terrain.
    pub texture: Arc<Texture>,
    /// Colour of the terrain beyond the texture (R G B A as stored), given to the outermost texels at every
    /// level. `None` keeps those texels.
    pub beyond: Option<[u8; 4]>,
    /// Light of the sun and of the sky at each vertex, which the texture contains; empty without shadows.
    pub light_parts: Vec<[f32; 2]>,
    /// Grid of the vertex positions, metres (a power of two).
    pub quantum_m: f64,
    /// Bounding box of the terrain.
    pub bounds: Aabb,
    tree: BlockTree,
    /// The border, side by side.
    border: Vec<BorderPart>,
    /// Errors of the hierarchies of all chunks ([`errors::PER_CHUNK`] each), each the largest of all that
    /// need the vertex.
    errors: Vec<u16>,
    /// Largest horizontal deviation tested by squares of each of [`lattice::NODE_CELLS`], metres; close to
    /// zero except on curved grids.
    horizontal_m: [f64; lattice::NODE_CELLS.len()],
}

impl fmt::Debug for Terrain {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Terrain")
            .field("cells", &self.cells)
            .field("chunk_grid", &self.chunk_grid)
            .field("void_cells", &self.void_cells)
            .field("texture", &self.texture)
            .field("quantum_m", &self.quantum_m)
            .field("bounds", &self.bounds)
            .finish_non_exhaustive()
    }
}

/// Why a grid cannot be a terrain.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TerrainError {
    /// The grid has no cell.
    #[error("a grid of {cols} x {rows} heights has no cell: at least 2 x 2 are needed")]
    TooSmall {
        /// Vertices from west to east.
        cols: u32,
        /// Vertices from north to south.
        rows: u32,
    },
    /// The numbers of vertices and chunks exceed 32-bit indices.
    #[error(
        "a grid of {cols} x {rows} heights is too large: crop or thin it to less than 2 000 000 000 vertices"
    )]
    TooLarge {
        /// Vertices from west to east.
        cols: u32,
        /// Vertices from north to south.
        rows: u32,
    },
    /// Arrays of the wrong length.
    #[error("a grid of {cols} x {rows} heights needs {expected} values, but {got} were given")]
    Length {
        /// Vertices from west to east.
        cols: u32,
        /// Vertices from north to south.
        rows: u32,
        /// cols * rows.
        expected: u64,
        /// Length given.
        got: u64,
    },
    /// All heights are voids.
    #[error("not one triangle of the grid has three valid heights")]
    AllVoid,
    /// Coordinates too large for exact chunk positions.
    #[error("the grid reaches {distance_m:.3e} m from the origin: the local frame ends at 1e7 m")]
    TooFar {
        /// Largest coordinate, metres.
        distance_m: f64,
    },
}

impl Terrain {
    /// Position of vertex (i, j) of a chunk, i from the west and j from the north: NED in metres, exact; NaN
    /// for a void.
    #[inline]
    pub fn position_ned_m(&self, chunk: u32, i: u32, j: u32) -> DVec3 {
        let chunk = &self.chunks[chunk as usize];
        let vertex = &self.vertices[(chunk.first_vertex + j * (chunk.cells[0] + 1) + i) as usize];
        chunk.centre_ned_m + Vec3::from(vertex.offset_m).as_dvec3()
    }

    /// Index of the chunk that holds cell (column, row) of the full grid, and the cell's position in that
    /// chunk.
    #[inline]
    pub fn chunk_of_cell(&self, cell: [u32; 2]) -> (u32, [u32; 2]) {
        let [column, row] = cell.map(|n| n / CHUNK_CELLS);
        (row * self.chunk_grid[0] + column, cell.map(|n| n % CHUNK_CELLS))
    }
}

/// The two triangles of cell (a, b) of a chunk, as columns and rows of its vertices: (north-west, south-east,
/// north-east) and (north-west, south-west, south-east).
#[inline]
fn cell_triangles([a, b]: [u32; 2]) -> [[[u32; 2]; 3]; 2] {
    let [nw, ne, sw, se] = [[a, b], [a + 1, b], [a, b + 1], [a + 1, b + 1]];
    [[nw, se, ne], [nw, sw, se]]
}
