//! How far a chunk's surface at a level is from the full one: exact, over the corners of the overlay of both triangulations.

use glam::{DVec3, Vec3};

use super::{LEVELS, LevelError, TerrainVertex, stitch::cell_triangles};

/// A chunk's full grid.
pub(super) struct ChunkGrid<'a> {
    pub cells: [u32; 2],
    /// `(cells[0] + 1) * (cells[1] + 1)`, row after row.
    pub vertices: &'a [TerrainVertex],
}

/// Squares of the two parts of a [`LevelError`].
#[derive(Clone, Copy, Default)]
struct Worst {
    total2: f64,
    horizontal2: f64,
}

impl Worst {
    fn add(&mut self, deviation: DVec3) {
        let horizontal2 = deviation.x * deviation.x + deviation.y * deviation.y;
        self.horizontal2 = self.horizontal2.max(horizontal2);
        self.total2 = self.total2.max(horizontal2 + deviation.z * deviation.z);
    }

    fn max(self, other: Self) -> Self {
        Self { total2: self.total2.max(other.total2), horizontal2: self.horizontal2.max(other.horizontal2) }
    }

    /// Rounded up: a bound must stay one in f32.
    fn to_error(self) -> LevelError {
        let up = |squared: f64| if squared > 0.0 { (squared.sqrt() as f32).next_up() } else { 0.0 };
        LevelError { total_m: up(self.total2), horizontal_m: up(self.horizontal2) }
    }
}

/// (unstitched, worst stitching) for each level, both growing with the level. The grid must hold no voids.
pub(super) fn level_errors(grid: &ChunkGrid<'_>) -> ([LevelError; LEVELS], [LevelError; LEVELS]) {
    let mut flat = [LevelError::default(); LEVELS];
    let mut stitched = [LevelError::default(); LEVELS];
    let (mut worst_flat, mut worst_stitched) = (Worst::default(), Worst::default());
    for level in 0..LEVELS as u8 {
        let (inner, ring) = level_error(grid, level);
        worst_flat = worst_flat.max(inner).max(ring[0]);
        worst_stitched = worst_stitched.max(worst_flat).max(ring[1]).max(ring[2]).max(ring[3]);
        flat[level as usize] = worst_flat.to_error();
        stitched[level as usize] = worst_stitched.to_error();
    }
    (flat, stitched)
}

/// Deviation of the cells away from the border, and of the cells on the border for four ways of stitching: none, north and south, east
/// and west, all. A border cell touches one edge, or two at a corner: these four show it every combination that any of the sixteen has.
fn level_error(grid: &ChunkGrid<'_>, level: u8) -> (Worst, [Worst; 4]) {
    let [nx, ny] = grid.cells.map(|n| n.div_ceil(1 << level));
    let coarser = level + 1;
    let edge_levels = [[level; 4], [coarser, level, coarser, level], [level, coarser, level, coarser], [coarser; 4]];
    // The coarsest level has no coarser neighbour.
    let ways = if usize::from(coarser) < LEVELS { 4 } else { 1 };
    let (mut inner, mut ring) = (Worst::default(), [Worst::default(); 4]);
    for b in 0..ny {
        for a in 0..nx {
            let on_border = a == 0 || b == 0 || a + 1 == nx || b + 1 == ny;
            if on_border {
                for way in 0..ways {
                    for triangle in cell_triangles([a, b], grid.cells, level, edge_levels[way]) {
                        triangle_error(grid, triangle, &mut ring[way]);
                    }
                }
            } else if level > 0 {
                for triangle in cell_triangles([a, b], grid.cells, level, edge_levels[0]) {
                    triangle_error(grid, triangle, &mut inner);
                }
            }
        }
    }
    (inner, ring)
}

fn triangle_error(grid: &ChunkGrid<'_>, triangle: [[u32; 2]; 3], worst: &mut Worst) {
    let corners = triangle.map(|p| p.map(|n| n as i32));
    let cross = |a: [i32; 2], b: [i32; 2], p: [i32; 2]| (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
    let area2 = cross(corners[0], corners[1], corners[2]);
    // 1: half of a grid cell, which is a triangle of the full surface if its diagonal runs the same way.
    if area2 == 0 || (area2 == -1 && is_full_triangle(corners)) {
        return;
    }
    let points = corners.map(|p| grid.at(p[0], p[1]));
    let axis = |k: usize| {
        let values = corners.map(|p| p[k]);
        (values[0].min(values[1]).min(values[2]), values[0].max(values[1]).max(values[2]))
    };
    let ((i0, i1), (j0, j1)) = (axis(0), axis(1));
    let scale = 1.0 / f64::from(area2);
    for j in j0..=j1 {
        for i in i0..=i1 {
            // All of area2's sign inside the triangle.
            let w0 = cross(corners[1], corners[2], [i, j]);
            let w1 = cross(corners[2], corners[0], [i, j]);
            let w2 = area2 - w0 - w1;
            if w0 <= 0 && w1 <= 0 && w2 <= 0 {
                let [w0, w1, w2] = [w0, w1, w2].map(|w| f64::from(w) * scale);
                worst.add(grid.at(i, j) - (points[0] * w0 + points[1] * w1 + points[2] * w2));
            }
        }
    }
    for k in 0..3 {
        edge_error(grid, corners[k], corners[(k + 1) % 3], points[k], points[(k + 1) % 3], worst);
    }
}

/// Whether a triangle of half a cell has its long side from north-west to south-east.
fn is_full_triangle(corners: [[i32; 2]; 3]) -> bool {
    (0..3).any(|k| {
        let [a, b] = [corners[k], corners[(k + 1) % 3]];
        let step = [b[0] - a[0], b[1] - a[1]];
        step[0] == step[1] && step[0].abs() == 1
    })
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
                Line::Diagonal => grid.between([i.floor() as i32, i.floor() as i32 - line], [1, 1], i - i.floor()),
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
