//! Construction of a terrain from a grid of points.

use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use super::{
    Aabb, CHUNK_CELLS, Terrain, TerrainChunk, TerrainError, TerrainVertex, cell_triangles,
    errors::{self, ChunkGrid, chunk_errors},
    lattice::NODE_CELLS,
    select::VERTEX_BITS,
    tree::{BLOCK_CELLS, BlockTree},
};
use crate::scene::{Encoding, Texture};

/// Largest coordinate at which positions stay exact, metres.
const MAX_COORDINATE_M: f64 = 1e7;

/// Exponent of the finest grid of vertex positions: 2^-24 m, so that position / quantum stays exact in f64 up
/// to [`MAX_COORDINATE_M`].
const MIN_QUANTUM_EXPONENT: i32 = -24;

/// Number of chunks sampled for the first estimate of the quantum.
const SOME_CHUNKS: usize = 16;

/// Points of a grid. They are requested chunk by chunk, some more than once, by several threads, and not
/// stored: an implementation that computes them needs no memory for all of them.
pub trait TerrainGrid: Sync {
    /// NED position, in metres, of the point in a column (from the west) and row (from the north); not finite
    /// for a void.
    fn point_ned_m(&self, at: [u32; 2]) -> DVec3;
    /// Texture coordinates of that point.
    fn uv(&self, at: [u32; 2]) -> [f32; 2];
}

/// A grid of points in lists, row by row.
struct PointList<'a> {
    cols: u32,
    points: &'a [DVec3],
    uvs: &'a [[f32; 2]],
}

impl PointList<'_> {
    fn index(&self, [column, row]: [u32; 2]) -> usize {
        row as usize * self.cols as usize + column as usize
    }
}

impl TerrainGrid for PointList<'_> {
    fn point_ned_m(&self, at: [u32; 2]) -> DVec3 {
        self.points[self.index(at)]
    }

    fn uv(&self, at: [u32; 2]) -> [f32; 2] {
        self.uvs[self.index(at)]
    }
}

/// Position of a chunk in the grid.
#[derive(Clone, Copy)]
struct ChunkSpan {
    first_cell: [u32; 2],
    cells: [u32; 2],
    first_vertex: u32,
}

impl ChunkSpan {
    fn count(&self) -> usize {
        ((self.cells[0] + 1) * (self.cells[1] + 1)) as usize
    }

    /// Vertices row by row.
    fn vertices(self) -> impl Iterator<Item = [u32; 2]> {
        let [x, y] = self.first_cell;
        (0..=self.cells[1]).flat_map(move |j| (0..=self.cells[0]).map(move |i| [x + i, y + j]))
    }
}

/// Results for a single chunk, besides its vertices and errors.
struct ChunkPart {
    chunk: TerrainChunk,
    /// Bounding box of its points before rounding.
    bounds: Aabb,
    horizontal_m: [f64; NODE_CELLS.len()],
    void_cells: u64,
}

impl Terrain {
    /// A terrain from the NED positions (metres) of `cols` x `rows` grid points, row by row from the north,
    /// each row from the west. Points that are not finite are voids. `uvs` are the texture coordinates of the
    /// same points.
    ///
    /// Positions are rounded to [`Terrain::quantum_m`] (at most the size of a chunk * 2^-23, or half a
    /// millimetre for cells of 90 m).
    ///
    /// # Errors
    ///
    /// [`TerrainError`] says what is wrong with the grid.
    pub fn new(
        cols: u32,
        rows: u32,
        points: &[DVec3],
        uvs: &[[f32; 2]],
        texture: Arc<Texture>,
    ) -> Result<Self, TerrainError> {
        if cols < 2 || rows < 2 {
            return Err(TerrainError::TooSmall { cols, rows });
        }
        let expected = u64::from(cols) * u64::from(rows);
        if let Some(&got) = [points.len() as u64, uvs.len() as u64].iter().find(|&&n| n != expected) {
            return Err(TerrainError::Length { cols, rows, expected, got });
        }
        Self::from_grid(cols, rows, &PointList { cols, points, uvs }, texture)
    }

    /// As [`Terrain::new`], for points that are computed on demand: only the memory of the terrain itself is
    /// needed ([`Terrain::memory_bytes`]).
    ///
    /// # Errors
    ///
    /// As [`Terrain::new`].
    pub fn from_grid(
        cols: u32,
        rows: u32,
        grid: &dyn TerrainGrid,
        texture: Arc<Texture>,
    ) -> Result<Self, TerrainError> {
        if cols < 2 || rows < 2 {
            return Err(TerrainError::TooSmall { cols, rows });
        }
        let cells = [cols - 1, rows - 1];
        let chunk_grid = cells.map(|n| n.div_ceil(CHUNK_CELLS));
        let spans = spans(cells, chunk_grid)?;
        let mut vertices = vec![TerrainVertex::default(); spans.iter().map(ChunkSpan::count).sum()];
        let mut errors = vec![0; spans.len() * errors::PER_CHUNK];
        // Positions are expensive to compute. A few chunks nearly always determine the quantum; if another
        // chunk needs a larger one, the pass is repeated.
        let some =
            spans.iter().step_by(spans.len().div_ceil(SOME_CHUNKS)).map(|span| points_of(grid, *span).1);
        let mut quantum_m = quantum(some);
        let parts = loop {
            let parts: Vec<ChunkPart> = spans
                .par_iter()
                .zip(
                    split(&mut vertices, &spans)
                        .into_par_iter()
                        .zip(errors.par_chunks_exact_mut(errors::PER_CHUNK)),
                )
                .map(|(span, (vertices, errors))| part(grid, *span, quantum_m, vertices, errors))
                .collect();
            let exact_m = quantum(parts.iter().map(|part| part.bounds));
            if exact_m == quantum_m {
                break parts;
            }
            quantum_m = exact_m;
        };
        let farthest = |bounds: &Aabb| {
            if bounds.is_empty() { 0.0 } else { bounds.min.abs().max(bounds.max.abs()).max_element() }
        };
        let distance_m = parts.iter().map(|part| farthest(&part.bounds)).fold(0.0, f64::max);
        if distance_m > MAX_COORDINATE_M {
            return Err(TerrainError::TooFar { distance_m });
        }

        let mut terrain = Self {
            vertices,
            chunks: Vec::with_capacity(parts.len()),
            chunk_grid,
            cells,
            errors,
            horizontal_m: Default::default(),
            void_cells: 0,
            texture,
            beyond: None,
            light_parts: Vec::new(),
            quantum_m,
            bounds: Aabb::EMPTY,
            tree: BlockTree::new([1, 1], &[Aabb::EMPTY]),
            border: Vec::new(),
        };
        for part in parts {
            for (largest_m, part_m) in terrain.horizontal_m.iter_mut().zip(part.horizontal_m) {
                *largest_m = largest_m.max(part_m);
            }
            terrain.void_cells += part.void_cells;
            terrain.bounds = terrain.bounds.union(&part.chunk.bounds);
            terrain.chunks.push(part.chunk);
        }
        errors::saturate(&mut terrain.errors, chunk_grid);
        if !terrain.chunks.iter().any(|chunk| chunk.has_surface) {
            return Err(TerrainError::AllVoid);
        }
        terrain.tree = terrain.block_tree();
        terrain.border = terrain.border_parts();
        Ok(terrain)
    }

    /// Memory of the terrain without its texture, bytes: per height 20 for the vertex, 3 for the errors of
    /// the hierarchy and 4 for boxes.
    pub fn memory_bytes(&self) -> u64 {
        let lists = size_of_val(&*self.vertices)
            + size_of_val(&*self.errors)
            + size_of_val(&*self.chunks)
            + size_of_val(&*self.border);
        (lists + self.tree.bytes()) as u64
    }

    /// A flat-earth terrain about the origin. `heights` (metres, up; NaN = void) are on square cells of
    /// `cell_m`, row by row from the north. The texture (white if none) has one pixel per height.
    ///
    /// # Errors
    ///
    /// As [`Terrain::new`].
    pub fn from_heights(
        cols: u32,
        rows: u32,
        cell_m: f64,
        heights: &[f64],
        texture: Option<Arc<Texture>>,
    ) -> Result<Self, TerrainError> {
        let middle = [0.5 * (f64::from(cols) - 1.0), 0.5 * (f64::from(rows) - 1.0)];
        let span =
            |index: usize| [f64::from(index as u32 % cols.max(1)), f64::from(index as u32 / cols.max(1))];
        let points: Vec<_> = heights
            .iter()
            .enumerate()
            .map(|(index, height)| {
                let [i, j] = span(index);
                DVec3::new((middle[1] - j) * cell_m, (i - middle[0]) * cell_m, -height)
            })
            .collect();
        let uvs: Vec<_> = (0..heights.len())
            .map(|index| {
                let [i, j] = span(index);
                [((i + 0.5) / f64::from(cols)) as f32, ((j + 0.5) / f64::from(rows)) as f32]
            })
            .collect();
        let texture = texture.unwrap_or_else(|| Arc::new(Texture::uniform([255; 4], Encoding::Srgb)));
        Self::new(cols, rows, &points, &uvs, texture)
    }

    fn block_tree(&self) -> BlockTree {
        let size = self.cells.map(|n| n.div_ceil(BLOCK_CELLS));
        let boxes: Vec<Aabb> = (0..size[0] * size[1])
            .into_par_iter()
            .map(|index| {
                let first = [index % size[0] * BLOCK_CELLS, index / size[0] * BLOCK_CELLS];
                let (chunk, [i0, j0]) = self.chunk_of_cell(first);
                let cells = self.chunks[chunk as usize].cells;
                let mut bounds = Aabb::EMPTY;
                for j in j0..=(j0 + BLOCK_CELLS).min(cells[1]) {
                    for i in i0..=(i0 + BLOCK_CELLS).min(cells[0]) {
                        let point = self.position_ned_m(chunk, i, j);
                        if point.is_finite() {
                            bounds.include(point);
                        }
                    }
                }
                bounds
            })
            .collect();
        BlockTree::new(size, &boxes)
    }
}

fn spans(cells: [u32; 2], chunk_grid: [u32; 2]) -> Result<Vec<ChunkSpan>, TerrainError> {
    let [cols, rows] = cells.map(|n| n + 1);
    if u64::from(chunk_grid[0]) * u64::from(chunk_grid[1]) > 1 << (u32::BITS - VERTEX_BITS) {
        return Err(TerrainError::TooLarge { cols, rows });
    }
    let mut spans = Vec::new();
    let mut first_vertex = 0u32;
    for y in 0..chunk_grid[1] {
        for x in 0..chunk_grid[0] {
            let first_cell = [x * CHUNK_CELLS, y * CHUNK_CELLS];
            let size = [0, 1].map(|k: usize| (cells[k] - first_cell[k]).min(CHUNK_CELLS));
            spans.push(ChunkSpan { first_cell, cells: size, first_vertex });
            let count = (size[0] + 1) * (size[1] + 1);
            first_vertex = first_vertex.checked_add(count).ok_or(TerrainError::TooLarge { cols, rows })?;
        }
    }
    Ok(spans)
}

/// The vertices of each chunk, as mutable slices.
fn split<'a>(mut vertices: &'a mut [TerrainVertex], spans: &[ChunkSpan]) -> Vec<&'a mut [TerrainVertex]> {
    let first = |span: &ChunkSpan| {
        let (own, rest) = std::mem::take(&mut vertices).split_at_mut(span.count());
        vertices = rest;
        own
    };
    spans.iter().map(first).collect()
}

/// Positions of a chunk's vertices, and their bounding box.
fn points_of(grid: &dyn TerrainGrid, span: ChunkSpan) -> (Vec<DVec3>, Aabb) {
    let points: Vec<DVec3> = span.vertices().map(|at| grid.point_ned_m(at)).collect();
    let mut bounds = Aabb::EMPTY;
    points.iter().filter(|point| point.is_finite()).for_each(|&point| bounds.include(point));
    (points, bounds)
}

fn chunk_centre(bounds: &Aabb) -> DVec3 {
    if bounds.is_empty() { DVec3::ZERO } else { bounds.centre().round() }
}

/// Quantum of the offsets, a power of two: the largest offset of all chunks still fits 24 bits.
fn quantum(boxes: impl Iterator<Item = Aabb>) -> f64 {
    let largest = boxes
        .filter(|bounds| !bounds.is_empty())
        .map(|bounds| {
            let centre = chunk_centre(&bounds);
            (bounds.max - centre).abs().max((bounds.min - centre).abs()).max_element()
        })
        .fold(1.0, f64::max);
    2f64.powi((largest.log2().ceil() as i32 - 23).max(MIN_QUANTUM_EXPONENT))
}

fn part(
    grid: &dyn TerrainGrid,
    span: ChunkSpan,
    quantum_m: f64,
    vertices: &mut [TerrainVertex],
    errors: &mut [u16],
) -> ChunkPart {
    let (points, bounds) = points_of(grid, span);
    let centre_ned_m = chunk_centre(&bounds);
    let mut exact_bounds = Aabb::EMPTY;
    for ((vertex, point), at) in vertices.iter_mut().zip(points).zip(span.vertices()) {
        let offset_m = if point.is_finite() {
            // The position is rounded, not the offset, so that chunks agree on shared vertices. Both steps
            // are exact in f64.
            let rounded = (point / quantum_m).round() * quantum_m;
            exact_bounds.include(rounded);
            (rounded - centre_ned_m).as_vec3().to_array()
        } else {
            [f32::NAN; 3]
        };
        *vertex = TerrainVertex { offset_m, uv: grid.uv(at) };
    }

    let (triangles, void_cells) = count_without_voids(span.cells, vertices);
    let chunk = TerrainChunk {
        centre_ned_m,
        bounds: exact_bounds,
        first_vertex: span.first_vertex,
        cells: span.cells,
        has_surface: triangles > 0,
        has_voids: vertices.iter().any(|vertex| vertex.offset_m[0].is_nan()),
    };
    let table = chunk_errors(&ChunkGrid { cells: span.cells, vertices });
    errors.copy_from_slice(&table.keys);
    ChunkPart { chunk, bounds, horizontal_m: table.horizontal_m, void_cells }
}

/// Number of triangles with three valid corners, and of cells that lost one or both.
fn count_without_voids(cells: [u32; 2], vertices: &[TerrainVertex]) -> (u64, u64) {
    let (mut triangles, mut void_cells) = (0, 0);
    for b in 0..cells[1] {
        for a in 0..cells[0] {
            let is_valid = |t: &[[u32; 2]; 3]| {
                t.iter().all(|[i, j]| !vertices[(j * (cells[0] + 1) + i) as usize].offset_m[0].is_nan())
            };
            let valid = cell_triangles([a, b]).iter().filter(|t| is_valid(t)).count();
            triangles += valid as u64;
            void_cells += u64::from(valid < 2);
        }
    }
    (triangles, void_cells)
}
