//! Deviation of the full surface from the triangles of the hierarchy: exact, at the corners of the overlay of
//! both triangulations.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::{
    TerrainVertex,
    lattice::{self, CELLS, DEPTHS, LATTICE, NODE_CELLS, ROOTS, SIDE, VERTICES},
};

/// Number of errors per chunk: of its vertices, then of its cells.
pub(super) const PER_CHUNK: usize = VERTICES + CELLS;

/// Error near a void: the triangle is halved at any tolerance.
pub(super) const VOID: u16 = u16::MAX;

/// Encodes an error in metres as an order-preserving integer: the upper half of its f32, rounded up (by at
/// most 0.8 %). 0 means more exact than an exact surface.
pub(super) fn key_of_error(metres: f64) -> u16 {
    // Rounded up twice, so that a bound remains a bound.
    let bits = if metres > 0.0 { (metres as f32).next_up().min(f32::MAX).to_bits() } else { 0 };
    bits.div_ceil(1 << 16) as u16 + 1
}

/// Encodes a tolerance in metres as such an integer, rounded down; 0 for a tolerance that not even an exact
/// surface meets.
pub(super) fn key_of_tolerance(metres: f64) -> u16 {
    // NaN is met by nothing.
    if metres >= 0.0 { ((metres as f32).next_down().max(0.0).to_bits() >> 16) as u16 + 1 } else { 0 }
}

/// The full grid of a chunk.
pub(super) struct ChunkGrid<'a> {
    pub cells: [u32; 2],
    /// `(cells[0] + 1) * (cells[1] + 1)` vertices, row by row.
    pub vertices: &'a [TerrainVertex],
}

/// Largest deviation of the full surface from a coarser one at equal grid coordinates.
#[derive(Clone, Copy, Default)]
struct MaxDeviation {
    /// In the down coordinate.
    vertical: f64,
    /// Squared, in the north-east plane.
    horizontal2: f64,
}

impl MaxDeviation {
    fn add(&mut self, deviation: DVec3) {
        // Voids are NaN and are ignored by `max`.
        self.vertical = self.vertical.max(deviation.z.abs());
        self.horizontal2 = self.horizontal2.max(deviation.x * deviation.x + deviation.y * deviation.y);
    }
}

/// Errors of one chunk.
pub(super) struct ErrorTable {
    /// [`PER_CHUNK`] encoded errors of the triangles of this chunk alone. [`saturate`] raises them to those
    /// of all that need a vertex.
    pub keys: Vec<u16>,
    /// Largest horizontal deviation tested by squares of each of [`NODE_CELLS`].
    pub horizontal_m: [f64; NODE_CELLS.len()],
}

/// Errors of the triangles of one chunk.
pub(super) fn chunk_errors(grid: &ChunkGrid<'_>) -> ErrorTable {
    let mut errors =
        ErrorTable { keys: vec![key_of_error(0.0); PER_CHUNK], horizontal_m: [0.0; NODE_CELLS.len()] };
    for root in ROOTS {
        add_triangle(grid, root, 0, &mut errors);
    }
    for j in 0..grid.cells[1] {
        for i in 0..grid.cells[0] {
            add_cell(grid, [i, j], &mut errors);
        }
    }
    for size in 1..NODE_CELLS.len() {
        errors.horizontal_m[size] = errors.horizontal_m[size].max(errors.horizontal_m[size - 1]);
    }
    errors
}

fn add_triangle(grid: &ChunkGrid<'_>, triangle: [u32; 3], depth: u32, errors: &mut ErrorTable) {
    let corners = triangle.map(|vertex| {
        let [i, j] = lattice::position(vertex);
        [i.min(grid.cells[0]) as i32, j.min(grid.cells[1]) as i32]
    });
    let (middle, halves) = lattice::halves(triangle);
    let worst = triangle_error(grid, corners);
    let key = &mut errors.keys[middle as usize];
    *key = key_of_error(worst.vertical).max(*key);
    let horizontal_m = &mut errors.horizontal_m[lattice::node_size(depth)];
    *horizontal_m = horizontal_m.max(worst.horizontal2.sqrt());
    if depth + 1 < DEPTHS {
        halves.into_iter().for_each(|half| add_triangle(grid, half, depth + 1, errors));
    }
}

fn add_cell(grid: &ChunkGrid<'_>, [i, j]: [u32; 2], errors: &mut ErrorTable) {
    let [nw, ne, sw, se] = [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[a, b]| grid.at(i as i32 + a, j as i32 + b));
    let north_west = j * SIDE + i;
    let to_turn = north_west % 2 == 1;
    if !(nw + ne + sw + se).is_finite() {
        if to_turn {
            errors.keys[VERTICES + north_west as usize / 2] = VOID;
        } else {
            // The cell's own diagonal is that of the halves, whose right angles are at these vertices.
            for vertex in [north_west + 1, north_west + SIDE] {
                errors.keys[vertex as usize] = VOID;
            }
        }
    } else if to_turn {
        let mut worst = MaxDeviation::default();
        worst.add(0.5 * (nw + se - ne - sw));
        errors.keys[VERTICES + north_west as usize / 2] = key_of_error(worst.vertical);
        errors.horizontal_m[0] = errors.horizontal_m[0].max(worst.horizontal2.sqrt());
    }
}

/// Corners are vertices of the chunk. In a chunk smaller than 64x64 cells they were moved to its border, and
/// form any kind of triangle.
fn triangle_error(grid: &ChunkGrid<'_>, corners: [[i32; 2]; 3]) -> MaxDeviation {
    let mut worst = MaxDeviation::default();
    let cross =
        |a: [i32; 2], b: [i32; 2], p: [i32; 2]| (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
    let area2 = cross(corners[0], corners[1], corners[2]);
    if area2 == 0 {
        return worst;
    }
    let points = corners.map(|p| grid.at(p[0], p[1]));
    let [rows, columns] = [1, 0].map(|k: usize| {
        let along = corners.map(|p| p[k]);
        along[0].min(along[1]).min(along[2])..=along[0].max(along[1]).max(along[2])
    });
    // The plane from corner 0: its change per step along a row or column.
    let (to_1, to_2) = (points[1] - points[0], points[2] - points[0]);
    let [[i1, j1], [i2, j2]] =
        [1, 2].map(|k: usize| [0, 1].map(|axis: usize| f64::from(corners[k][axis] - corners[0][axis])));
    let scale = 1.0 / f64::from(area2);
    let [per_column, per_row] = [(to_1 * j2 - to_2 * j1) * scale, (to_2 * i1 - to_1 * i2) * scale];
    for j in rows {
        let start = points[0] + f64::from(j - corners[0][1]) * per_row;
        // Inside the triangle all three have the sign of area2, which is negative. Along a row they change by
        // a constant.
        let outside = |i: i32| [0, 1, 2].map(|k: usize| cross(corners[k], corners[(k + 1) % 3], [i, j]));
        let mut sides = outside(*columns.start());
        let steps: [i32; 3] = std::array::from_fn(|k| corners[k][1] - corners[(k + 1) % 3][1]);
        for i in columns.clone() {
            if sides.iter().all(|&side| side <= 0) {
                worst.add(grid.at(i, j) - (start + f64::from(i - corners[0][0]) * per_column));
            }
            for (side, step) in sides.iter_mut().zip(steps) {
                *side += step;
            }
        }
    }
    for k in 0..3 {
        edge_error(grid, corners[k], corners[(k + 1) % 3], points[k], points[(k + 1) % 3], &mut worst);
    }
    worst
}

/// Deviation where an edge p-q of a coarse triangle crosses the lines of the full grid between its vertices.
fn edge_error(
    grid: &ChunkGrid<'_>,
    p: [i32; 2],
    q: [i32; 2],
    p_m: DVec3,
    q_m: DVec3,
    worst: &mut MaxDeviation,
) {
    let [di, dj] = [q[0] - p[0], q[1] - p[1]];
    if di == 0 || dj == 0 || di == dj {
        // The edge runs along a grid line and meets other lines at vertices only.
        return;
    }
    for family in [GridLine::I, GridLine::J, GridLine::Diagonal] {
        // The lines are value = integer; `value` is taken at p, `delta` is its change up to q.
        let (value, delta) = match family {
            GridLine::I => (p[0], di),
            GridLine::J => (p[1], dj),
            GridLine::Diagonal => (p[0] - p[1], di - dj),
        };
        for step in 1..delta.abs() {
            let t = f64::from(step) / f64::from(delta.abs());
            let line = value + delta.signum() * step;
            let (i, j) = (f64::from(p[0]) + t * f64::from(di), f64::from(p[1]) + t * f64::from(dj));
            let full = match family {
                GridLine::I => grid.between([line, j.floor() as i32], [0, 1], j - j.floor()),
                GridLine::J => grid.between([i.floor() as i32, line], [1, 0], i - i.floor()),
                GridLine::Diagonal => {
                    grid.between([i.floor() as i32, i.floor() as i32 - line], [1, 1], i - i.floor())
                }
            };
            worst.add(full - p_m.lerp(q_m, t));
        }
    }
}

/// The three families of lines of the full grid: i, j or i - j is an integer.
#[derive(Clone, Copy)]
enum GridLine {
    I,
    J,
    Diagonal,
}

impl ChunkGrid<'_> {
    /// Position relative to the chunk's centre.
    fn at(&self, i: i32, j: i32) -> DVec3 {
        let [i, j] = [(i as u32).min(self.cells[0]), (j as u32).min(self.cells[1])];
        Vec3::from(self.vertices[(j * (self.cells[0] + 1) + i) as usize].offset_m).as_dvec3()
    }

    /// Point on a grid line, at `fraction` of the distance from a vertex to the one `step` further.
    fn between(&self, from: [i32; 2], step: [i32; 2], fraction: f64) -> DVec3 {
        let start = self.at(from[0], from[1]);
        if fraction == 0.0 {
            start
        } else {
            start.lerp(self.at(from[0] + step[0], from[1] + step[1]), fraction)
        }
    }
}

/// Raises the error of each vertex to that of all vertices and cells that need it, across chunk borders: if a
/// vertex is exact enough, all of them are. `keys` holds [`PER_CHUNK`] encoded errors per chunk.
pub(super) fn saturate(keys: &mut [u16], chunk_grid: [u32; 2]) {
    for depth in (0..DEPTHS).rev() {
        keys.par_chunks_exact_mut(PER_CHUNK).for_each(|chunk| {
            for &vertex in &LATTICE.by_depth[depth as usize] {
                let [i, j] = lattice::position(vertex).map(|n| n as i32);
                chunk[vertex as usize] =
                    needing(depth).iter().fold(chunk[vertex as usize], |worst, [di, dj]| {
                        let [i, j] = [i + di, j + dj];
                        let cells =
                            if depth + 1 < DEPTHS { 0..=SIDE as i32 - 1 } else { 0..=SIDE as i32 - 2 };
                        if !cells.contains(&i) || !cells.contains(&j) {
                            return worst;
                        }
                        let other = (j * SIDE as i32 + i) as usize;
                        worst.max(chunk[if depth + 1 < DEPTHS { other } else { VERTICES + other / 2 }])
                    });
            }
        });
        if !depth.is_multiple_of(2) {
            share_borders(keys, chunk_grid, depth);
        }
    }
}

/// Offsets of the vertices that need a vertex of a depth; at the last depth, of the cells by their north-west
/// vertices.
fn needing(depth: u32) -> [[i32; 2]; 4] {
    let step = 32 >> (depth / 2);
    match depth {
        11 => [[0, 0], [-1, -1], [0, 0], [-1, -1]],
        _ if depth.is_multiple_of(2) => [[step, 0], [0, step], [-step, 0], [0, -step]],
        _ => [[step / 2, step / 2], [-step / 2, step / 2], [-step / 2, -step / 2], [step / 2, -step / 2]],
    }
}

/// Gives vertices that two chunks share the larger of their errors.
fn share_borders(keys: &mut [u16], [columns, rows]: [u32; 2], depth: u32) {
    let step = (32 >> (depth / 2)) as usize;
    let side = SIDE as usize;
    let mut fraction = |a: usize, b: usize| {
        let worst = keys[a].max(keys[b]);
        (keys[a], keys[b]) = (worst, worst);
    };
    for chunk in 0..(columns * rows) as usize {
        let (first, along) = (chunk * PER_CHUNK, columns as usize);
        for at in (step..side).step_by(2 * step) {
            if !(chunk + 1).is_multiple_of(along) {
                fraction(first + at * side + side - 1, first + PER_CHUNK + at * side);
            }
            if chunk + along < along * rows as usize {
                fraction(first + (side - 1) * side + at, first + along * PER_CHUNK + at);
            }
        }
    }
}
