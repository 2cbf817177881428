//! How far the full surface is from the triangles of the hierarchy: exact, over the corners of the overlay of
//! both triangulations.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::{
    TerrainVertex,
    lattice::{self, CELLS, DEPTHS, LATTICE, NODE_CELLS, ROOTS, SIDE, VERTICES},
};

/// Errors of a chunk: of its vertices, then of its cells.
pub(super) const PER_CHUNK: usize = VERTICES + CELLS;

/// A void is near: whatever the tolerance, the triangle is halved.
pub(super) const VOID: u16 = u16::MAX;

/// An error in metres as a number that orders as errors do: the upper half of its f32, rounded up (by 0.8 %
/// at most). 0 stands for what is more exact than an exact surface.
pub(super) fn key_of_error(metres: f64) -> u16 {
    // Rounded up twice: a bound must stay one.
    let bits = if metres > 0.0 { (metres as f32).next_up().min(f32::MAX).to_bits() } else { 0 };
    bits.div_ceil(1 << 16) as u16 + 1
}

/// A tolerance in metres as such a number, rounded down; 0 for one that not even an exact surface keeps.
pub(super) fn key_of_tolerance(metres: f64) -> u16 {
    // NaN keeps nothing.
    if metres >= 0.0 { ((metres as f32).next_down().max(0.0).to_bits() >> 16) as u16 + 1 } else { 0 }
}

/// A chunk's full grid.
pub(super) struct ChunkGrid<'a> {
    pub cells: [u32; 2],
    /// `(cells[0] + 1) * (cells[1] + 1)`, row after row.
    pub vertices: &'a [TerrainVertex],
}

/// Deviation of points of the full surface from those of a coarser one at equal grid coordinates.
#[derive(Clone, Copy, Default)]
struct Worst {
    /// Of the down coordinate.
    vertical: f64,
    /// Square of that in the north-east plane.
    horizontal2: f64,
}

impl Worst {
    fn add(&mut self, deviation: DVec3) {
        // Voids are no numbers, and no matter.
        self.vertical = self.vertical.max(deviation.z.abs());
        self.horizontal2 = self.horizontal2.max(deviation.x * deviation.x + deviation.y * deviation.y);
    }
}

/// What one chunk knows about its errors.
pub(super) struct ChunkErrors {
    /// [`PER_CHUNK`] numbers, of the triangles within this chunk alone: [`saturate`] makes them those of
    /// everything that needs a vertex.
    pub keys: Vec<u16>,
    /// Largest horizontal deviation of what is judged by squares of each of [`NODE_CELLS`].
    pub horizontal_m: [f64; NODE_CELLS.len()],
}

/// Errors of the triangles of one chunk.
pub(super) fn chunk_errors(grid: &ChunkGrid<'_>) -> ChunkErrors {
    let mut errors =
        ChunkErrors { keys: vec![key_of_error(0.0); PER_CHUNK], horizontal_m: [0.0; NODE_CELLS.len()] };
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

fn add_triangle(grid: &ChunkGrid<'_>, triangle: [u32; 3], depth: u32, errors: &mut ChunkErrors) {
    let corners = triangle.map(|vertex| {
        let [i, j] = lattice::place(vertex);
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

fn add_cell(grid: &ChunkGrid<'_>, [i, j]: [u32; 2], errors: &mut ChunkErrors) {
    let [nw, ne, sw, se] = [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[a, b]| grid.at(i as i32 + a, j as i32 + b));
    let north_west = j * SIDE + i;
    let to_turn = north_west % 2 == 1;
    if !(nw + ne + sw + se).is_finite() {
        if to_turn {
            errors.keys[VERTICES + north_west as usize / 2] = VOID;
        } else {
            // Its own diagonal is that of the halves: they have their right angles here.
            for vertex in [north_west + 1, north_west + SIDE] {
                errors.keys[vertex as usize] = VOID;
            }
        }
    } else if to_turn {
        let mut worst = Worst::default();
        worst.add(0.5 * (nw + se - ne - sw));
        errors.keys[VERTICES + north_west as usize / 2] = key_of_error(worst.vertical);
        errors.horizontal_m[0] = errors.horizontal_m[0].max(worst.horizontal2.sqrt());
    }
}

/// Corners are vertices of the chunk; where it is smaller than 64x64 cells they were moved to its border, and
/// form any kind of triangle.
fn triangle_error(grid: &ChunkGrid<'_>, corners: [[i32; 2]; 3]) -> Worst {
    let mut worst = Worst::default();
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
    // The plane, from its corner 0: what a step along a row or column adds.
    let (to_1, to_2) = (points[1] - points[0], points[2] - points[0]);
    let [[i1, j1], [i2, j2]] =
        [1, 2].map(|k: usize| [0, 1].map(|axis: usize| f64::from(corners[k][axis] - corners[0][axis])));
    let scale = 1.0 / f64::from(area2);
    let [per_column, per_row] = [(to_1 * j2 - to_2 * j1) * scale, (to_2 * i1 - to_1 * i2) * scale];
    for j in rows {
        let start = points[0] + f64::from(j - corners[0][1]) * per_row;
        // All of area2's sign, which is negative, inside the triangle; along a row they change by the same
        // number from column to column.
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
fn edge_error(grid: &ChunkGrid<'_>, p: [i32; 2], q: [i32; 2], p_m: DVec3, q_m: DVec3, worst: &mut Worst) {
    let [di, dj] = [q[0] - p[0], q[1] - p[1]];
    if di == 0 || dj == 0 || di == dj {
        // Runs along a line of the full grid: it meets others at vertices only.
        return;
    }
    for family in [Line::I, Line::J, Line::Diagonal] {
        // The lines are value = whole number; `value` is taken at p, `delta` is its change up to q.
        let (value, delta) = match family {
            Line::I => (p[0], di),
            Line::J => (p[1], dj),
            Line::Diagonal => (p[0] - p[1], di - dj),
        };
        for step in 1..delta.abs() {
            let t = f64::from(step) / f64::from(delta.abs());
            let line = value + delta.signum() * step;
            let (i, j) = (f64::from(p[0]) + t * f64::from(di), f64::from(p[1]) + t * f64::from(dj));
            let full = match family {
                Line::I => grid.between([line, j.floor() as i32], [0, 1], j - j.floor()),
                Line::J => grid.between([i.floor() as i32, line], [1, 0], i - i.floor()),
                Line::Diagonal => {
                    grid.between([i.floor() as i32, i.floor() as i32 - line], [1, 1], i - i.floor())
                }
            };
            worst.add(full - p_m.lerp(q_m, t));
        }
    }
}

/// The three families of lines of the full grid: i, j or i - j is a whole number.
#[derive(Clone, Copy)]
enum Line {
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

    /// Point of a line of the full grid, `share` of the way from a vertex to the one `step` further.
    fn between(&self, from: [i32; 2], step: [i32; 2], share: f64) -> DVec3 {
        let start = self.at(from[0], from[1]);
        if share == 0.0 { start } else { start.lerp(self.at(from[0] + step[0], from[1] + step[1]), share) }
    }
}

/// Raises the error of each vertex to that of all vertices and cells that need it, chunk borders included:
/// what is exact enough at a vertex then is so at all of them. `keys` holds [`PER_CHUNK`] numbers of each
/// chunk.
pub(super) fn saturate(keys: &mut [u16], chunk_grid: [u32; 2]) {
    for depth in (0..DEPTHS).rev() {
        keys.par_chunks_exact_mut(PER_CHUNK).for_each(|chunk| {
            for &vertex in &LATTICE.by_depth[depth as usize] {
                let [i, j] = lattice::place(vertex).map(|n| n as i32);
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

/// Where the vertices are that need one of a depth; at the last depth the cells, by their north-west
/// vertices.
fn needing(depth: u32) -> [[i32; 2]; 4] {
    let step = 32 >> (depth / 2);
    match depth {
        11 => [[0, 0], [-1, -1], [0, 0], [-1, -1]],
        _ if depth.is_multiple_of(2) => [[step, 0], [0, step], [-step, 0], [0, -step]],
        _ => [[step / 2, step / 2], [-step / 2, step / 2], [-step / 2, -step / 2], [step / 2, -step / 2]],
    }
}

/// Gives vertices of two chunks the larger of their errors.
fn share_borders(keys: &mut [u16], [columns, rows]: [u32; 2], depth: u32) {
    let step = (32 >> (depth / 2)) as usize;
    let side = SIDE as usize;
    let mut share = |a: usize, b: usize| {
        let worst = keys[a].max(keys[b]);
        (keys[a], keys[b]) = (worst, worst);
    };
    for chunk in 0..(columns * rows) as usize {
        let (first, along) = (chunk * PER_CHUNK, columns as usize);
        for at in (step..side).step_by(2 * step) {
            if !(chunk + 1).is_multiple_of(along) {
                share(first + at * side + side - 1, first + PER_CHUNK + at * side);
            }
            if chunk + along < along * rows as usize {
                share(first + (side - 1) * side + at, first + along * PER_CHUNK + at);
            }
        }
    }
}
