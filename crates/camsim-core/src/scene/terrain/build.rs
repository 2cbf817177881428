//! From a grid of points to chunks.

use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use super::{
    Aabb, CHUNK_CELLS, Terrain, TerrainChunk, TerrainError, TerrainVertex,
    bounds::{BLOCK_CELLS, BlockTree},
    cell_triangles,
    errors::{self, ChunkErrors, ChunkGrid, chunk_errors},
    select::VERTEX_BITS,
};
use crate::scene::{Encoding, Texture};

/// Coordinates beyond this would not stay exact, metres.
const MAX_COORDINATE_M: f64 = 1e7;

/// Finest grid of vertex positions: 2^-24 m, so that position / quantum stays exact in f64 up to [`MAX_COORDINATE_M`].
const MIN_QUANTUM_EXPONENT: i32 = -24;

/// Input of [`Terrain::new`], with `cols * rows` entries in each list.
struct PointGrid<'a> {
    cols: u32,
    rows: u32,
    points: &'a [DVec3],
    uvs: &'a [[f32; 2]],
}

impl PointGrid<'_> {
    fn index(&self, column: u32, row: u32) -> usize {
        row as usize * self.cols as usize + column as usize
    }
}

/// A chunk's place in the grid.
#[derive(Clone, Copy)]
struct Place {
    first_cell: [u32; 2],
    cells: [u32; 2],
    first_vertex: u32,
}

impl Place {
    /// Vertices row after row.
    fn vertices(self) -> impl Iterator<Item = [u32; 2]> {
        let [x, y] = self.first_cell;
        (0..=self.cells[1]).flat_map(move |j| (0..=self.cells[0]).map(move |i| [x + i, y + j]))
    }
}

/// What is computed for each chunk on its own.
struct Part {
    chunk: TerrainChunk,
    vertices: Vec<TerrainVertex>,
    errors: ChunkErrors,
    void_cells: u64,
}

impl Terrain {
    /// A terrain from NED positions (metres) of `cols` x `rows` grid points, row after row from the north, each from the west; points that
    /// are not finite are voids. `uvs` are texture coordinates of the same points.
    ///
    /// Positions are rounded to [`Terrain::quantum_m`] (at most the chunk's size * 2^-23: half a millimetre for cells of 90 m).
    ///
    /// # Errors
    ///
    /// [`TerrainError`] says what is wrong with the grid.
    pub fn new(cols: u32, rows: u32, points: &[DVec3], uvs: &[[f32; 2]], texture: Arc<Texture>) -> Result<Self, TerrainError> {
        let grid = PointGrid { cols, rows, points, uvs };
        check(&grid)?;
        let cells = [cols - 1, rows - 1];
        let chunk_grid = cells.map(|n| n.div_ceil(CHUNK_CELLS));
        let places = places(cells, chunk_grid)?;
        let boxes: Vec<Aabb> = places.par_iter().map(|place| box_of(&grid, place.vertices())).collect();
        let quantum_m = quantum(&boxes);
        let parts: Vec<Part> = places.par_iter().zip(&boxes).map(|(place, bounds)| part(&grid, *place, bounds, quantum_m)).collect();

        let mut terrain = Self {
            vertices: Vec::with_capacity(parts.iter().map(|p| p.vertices.len()).sum()),
            chunks: Vec::with_capacity(parts.len()),
            chunk_grid,
            cells,
            errors: Vec::with_capacity(parts.iter().map(|p| p.errors.keys.len()).sum()),
            horizontal_m: Default::default(),
            void_cells: 0,
            texture,
            quantum_m,
            bounds: Aabb::EMPTY,
            tree: BlockTree::new([1, 1], vec![Aabb::EMPTY]),
        };
        for part in parts {
            for (largest_m, part_m) in terrain.horizontal_m.iter_mut().zip(part.errors.horizontal_m) {
                *largest_m = largest_m.max(part_m);
            }
            terrain.errors.extend(part.errors.keys);
            terrain.void_cells += part.void_cells;
            terrain.bounds = terrain.bounds.union(&part.chunk.bounds);
            terrain.vertices.extend(part.vertices);
            terrain.chunks.push(part.chunk);
        }
        errors::saturate(&mut terrain.errors, chunk_grid);
        if !terrain.chunks.iter().any(|chunk| chunk.has_surface) {
            return Err(TerrainError::AllVoid);
        }
        terrain.tree = terrain.block_tree();
        Ok(terrain)
    }

    /// A flat-earth terrain about the origin: `heights` (metres, up; NaN = void) at square cells of `cell_m`, row after row from the
    /// north. The texture (white if none) covers one pixel a height.
    ///
    /// # Errors
    ///
    /// As [`Terrain::new`].
    pub fn from_heights(cols: u32, rows: u32, cell_m: f64, heights: &[f64], texture: Option<Arc<Texture>>) -> Result<Self, TerrainError> {
        let middle = [0.5 * (f64::from(cols) - 1.0), 0.5 * (f64::from(rows) - 1.0)];
        let place = |index: usize| [f64::from(index as u32 % cols.max(1)), f64::from(index as u32 / cols.max(1))];
        let points: Vec<_> = heights
            .iter()
            .enumerate()
            .map(|(index, height)| {
                let [i, j] = place(index);
                DVec3::new((middle[1] - j) * cell_m, (i - middle[0]) * cell_m, -height)
            })
            .collect();
        let uvs: Vec<_> = (0..heights.len())
            .map(|index| {
                let [i, j] = place(index);
                [((i + 0.5) / f64::from(cols)) as f32, ((j + 0.5) / f64::from(rows)) as f32]
            })
            .collect();
        let texture = texture.unwrap_or_else(|| Arc::new(Texture::uniform([255; 4], Encoding::Srgb)));
        Self::new(cols, rows, &points, &uvs, texture)
    }

    fn block_tree(&self) -> BlockTree {
        let size = self.cells.map(|n| n.div_ceil(BLOCK_CELLS));
        let boxes = (0..size[0] * size[1])
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
        BlockTree::new(size, boxes)
    }
}

fn check(grid: &PointGrid<'_>) -> Result<(), TerrainError> {
    let &PointGrid { cols, rows, points, uvs } = grid;
    if cols < 2 || rows < 2 {
        return Err(TerrainError::TooSmall { cols, rows });
    }
    let expected = u64::from(cols) * u64::from(rows);
    if let Some(&got) = [points.len() as u64, uvs.len() as u64].iter().find(|&&n| n != expected) {
        return Err(TerrainError::Length { cols, rows, expected, got });
    }
    let farthest = |point: &DVec3| if point.is_finite() { point.abs().max_element() } else { 0.0 };
    let distance_m = points.par_iter().map(farthest).reduce(|| 0.0, f64::max);
    if distance_m > MAX_COORDINATE_M {
        return Err(TerrainError::TooFar { distance_m });
    }
    Ok(())
}

fn places(cells: [u32; 2], chunk_grid: [u32; 2]) -> Result<Vec<Place>, TerrainError> {
    let [cols, rows] = cells.map(|n| n + 1);
    if u64::from(chunk_grid[0]) * u64::from(chunk_grid[1]) > 1 << (u32::BITS - VERTEX_BITS) {
        return Err(TerrainError::TooLarge { cols, rows });
    }
    let mut places = Vec::new();
    let mut first_vertex = 0u32;
    for y in 0..chunk_grid[1] {
        for x in 0..chunk_grid[0] {
            let first_cell = [x * CHUNK_CELLS, y * CHUNK_CELLS];
            let size = [0, 1].map(|k: usize| (cells[k] - first_cell[k]).min(CHUNK_CELLS));
            places.push(Place { first_cell, cells: size, first_vertex });
            let count = (size[0] + 1) * (size[1] + 1);
            first_vertex = first_vertex.checked_add(count).ok_or(TerrainError::TooLarge { cols, rows })?;
        }
    }
    Ok(places)
}

fn box_of(grid: &PointGrid<'_>, vertices: impl Iterator<Item = [u32; 2]>) -> Aabb {
    let mut bounds = Aabb::EMPTY;
    for [column, row] in vertices {
        let point = grid.points[grid.index(column, row)];
        if point.is_finite() {
            bounds.include(point);
        }
    }
    bounds
}

fn chunk_centre(bounds: &Aabb) -> DVec3 {
    if bounds.is_empty() { DVec3::ZERO } else { bounds.centre().round() }
}

/// The power of two of which offsets are multiples: the largest offset of all chunks still fits 24 bits.
fn quantum(boxes: &[Aabb]) -> f64 {
    let largest = boxes
        .iter()
        .filter(|bounds| !bounds.is_empty())
        .map(|bounds| {
            let centre = chunk_centre(bounds);
            (bounds.max - centre).abs().max((bounds.min - centre).abs()).max_element()
        })
        .fold(1.0, f64::max);
    2f64.powi((largest.log2().ceil() as i32 - 23).max(MIN_QUANTUM_EXPONENT))
}

fn part(grid: &PointGrid<'_>, place: Place, bounds: &Aabb, quantum_m: f64) -> Part {
    let centre_ned_m = chunk_centre(bounds);
    let mut exact_bounds = Aabb::EMPTY;
    let vertices: Vec<TerrainVertex> = place
        .vertices()
        .map(|[column, row]| {
            let index = grid.index(column, row);
            let point = grid.points[index];
            let offset_m = if point.is_finite() {
                // Rounding the position, not the offset, is what makes chunks agree on shared vertices. Both steps are exact in f64.
                let rounded = (point / quantum_m).round() * quantum_m;
                exact_bounds.include(rounded);
                (rounded - centre_ned_m).as_vec3().to_array()
            } else {
                [f32::NAN; 3]
            };
            TerrainVertex { offset_m, uv: grid.uvs[index] }
        })
        .collect();

    let (triangles, void_cells) = count_without_voids(place.cells, &vertices);
    let chunk = TerrainChunk {
        centre_ned_m,
        bounds: exact_bounds,
        first_vertex: place.first_vertex,
        cells: place.cells,
        has_surface: triangles > 0,
        has_voids: vertices.iter().any(|vertex| vertex.offset_m[0].is_nan()),
    };
    let errors = chunk_errors(&ChunkGrid { cells: place.cells, vertices: &vertices });
    Part { chunk, vertices, errors, void_cells }
}

/// Triangles with three valid corners, and the number of cells that lost one or both.
fn count_without_voids(cells: [u32; 2], vertices: &[TerrainVertex]) -> (u64, u64) {
    let (mut triangles, mut void_cells) = (0, 0);
    for b in 0..cells[1] {
        for a in 0..cells[0] {
            let is_valid = |t: &[[u32; 2]; 3]| t.iter().all(|[i, j]| !vertices[(j * (cells[0] + 1) + i) as usize].offset_m[0].is_nan());
            let valid = cell_triangles([a, b]).iter().filter(|t| is_valid(t)).count();
            triangles += valid as u64;
            void_cells += u64::from(valid < 2);
        }
    }
    (triangles, void_cells)
}
