//! Ray casting against the full-resolution terrain: a pyramid of bounding boxes over blocks of cells, then
//! both triangles of each cell.

use glam::DVec3;

use super::{
    Hit,
    mesh_bvh::hit_at,
    ray::{Bounds, Ray, ShearedPoint, intersect_triangle},
};
use crate::scene::{CHUNK_CELLS, Terrain};

/// Cells along a side of a block; a chunk holds a whole number of blocks.
const BLOCK: u32 = 4;
/// Surface index of the terrain.
const TERRAIN: u32 = 0;

/// Bounding boxes of one level of the pyramid, row by row.
#[derive(Debug)]
struct PyramidLevel {
    size: [u32; 2],
    boxes: Vec<Bounds>,
}

/// Level 0 has one box per block; each further level one box per 2 x 2 of the level below.
#[derive(Debug)]
pub(super) struct TerrainPyramid {
    levels: Vec<PyramidLevel>,
}

impl TerrainPyramid {
    pub(super) fn new(terrain: &Terrain) -> Self {
        let size = terrain.cells.map(|cells| cells.div_ceil(BLOCK));
        let boxes =
            (0..size[0] * size[1]).map(|i| block_bounds(terrain, [i % size[0], i / size[0]])).collect();
        let mut levels = vec![PyramidLevel { size, boxes }];
        while let Some(below) = levels.last().filter(|level| level.size != [1, 1]) {
            let size = below.size.map(|n| n.div_ceil(2));
            let quad = |i: u32| {
                let [x, y] = [2 * (i % size[0]), 2 * (i / size[0])];
                let children = (y..(y + 2).min(below.size[1]))
                    .flat_map(|y| (x..(x + 2).min(below.size[0])).map(move |x| [x, y]));
                children.fold(Bounds::NONE, |all, [x, y]| {
                    all.join(&below.boxes[(y * below.size[0] + x) as usize])
                })
            };
            let boxes = (0..size[0] * size[1]).map(quad).collect();
            levels.push(PyramidLevel { size, boxes });
        }
        Self { levels }
    }

    /// First intersection before `limit`.
    pub(super) fn first(&self, terrain: &Terrain, ray: &Ray, mut limit: f64) -> Option<Hit> {
        let mut best = None;
        // Each level leaves at most three siblings on the stack; 32 levels exceed what u32 cell counts allow.
        let mut stack = [(0.0_f64, 0_u32, [0_u32; 2]); 3 * 32 + 1];
        let mut waiting = 0;
        let root = self.levels.len() as u32 - 1;
        if self.enter(root, [0, 0], ray, limit).is_some() {
            stack[0] = (0.0, root, [0, 0]);
            waiting = 1;
        }
        while waiting > 0 {
            waiting -= 1;
            let (enter, level, [x, y]) = stack[waiting];
            if enter >= limit {
                continue;
            }
            if level == 0 {
                if let Some(hit) = first_in_block(terrain, [x, y], ray, limit) {
                    limit = hit.depth_m;
                    best = Some(hit);
                }
                continue;
            }
            let below = waiting;
            let size = self.levels[level as usize - 1].size;
            for child in [[2 * x, 2 * y], [2 * x + 1, 2 * y], [2 * x, 2 * y + 1], [2 * x + 1, 2 * y + 1]] {
                if child[0] < size[0]
                    && child[1] < size[1]
                    && let Some(enter) = self.enter(level - 1, child, ray, limit)
                {
                    stack[waiting] = (enter, level - 1, child);
                    waiting += 1;
                }
            }
            // The nearest node is popped first.
            stack[below..waiting].sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
        }
        best
    }

    /// Whether a ray meets the surface.
    pub(super) fn blocks(&self, terrain: &Terrain, ray: &Ray) -> bool {
        let mut stack = vec![(self.levels.len() as u32 - 1, [0_u32; 2])];
        while let Some((level, at)) = stack.pop() {
            if self.enter(level, at, ray, f64::INFINITY).is_none() {
                continue;
            }
            let Some(below) = level.checked_sub(1) else {
                if first_in_block(terrain, at, ray, f64::INFINITY).is_some() {
                    return true;
                }
                continue;
            };
            let size = self.levels[below as usize].size;
            let children = [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[x, y]| [2 * at[0] + x, 2 * at[1] + y]);
            let there = children.into_iter().filter(|child| child[0] < size[0] && child[1] < size[1]);
            stack.extend(there.map(|child| (below, child)));
        }
        false
    }

    fn enter(&self, level: u32, [x, y]: [u32; 2], ray: &Ray, limit: f64) -> Option<f64> {
        let level = &self.levels[level as usize];
        let bounds = &level.boxes[(y * level.size[0] + x) as usize];
        if bounds.is_empty() { None } else { ray.enter_box(bounds.low, bounds.high, limit) }
    }
}

/// Chunk of a block, the block's first cell in that chunk, and its number of cells.
fn cells_of(terrain: &Terrain, block: [u32; 2]) -> (u32, [u32; 2], [u32; 2]) {
    let first = block.map(|n| n * BLOCK);
    let chunk = first[1] / CHUNK_CELLS * terrain.chunk_grid[0] + first[0] / CHUNK_CELLS;
    let in_chunk = first.map(|n| n % CHUNK_CELLS);
    let cells = terrain.chunks[chunk as usize].cells;
    (chunk, in_chunk, [0, 1].map(|k: usize| (cells[k] - in_chunk[k]).min(BLOCK)))
}

fn block_bounds(terrain: &Terrain, block: [u32; 2]) -> Bounds {
    let (chunk, [i0, j0], [columns, rows]) = cells_of(terrain, block);
    let mut bounds = Bounds::NONE;
    for j in j0..=j0 + rows {
        for i in i0..=i0 + columns {
            bounds.include(terrain.position_ned_m(chunk, i, j));
        }
    }
    bounds.grown()
}

fn first_in_block(terrain: &Terrain, block: [u32; 2], ray: &Ray, mut limit: f64) -> Option<Hit> {
    const SIDE: usize = BLOCK as usize + 1;
    let (chunk, [i0, j0], [columns, rows]) = cells_of(terrain, block);
    let mut sheared = [[None::<ShearedPoint>; SIDE]; SIDE];
    for (j, row) in (j0..=j0 + rows).zip(&mut sheared) {
        for (i, sheared) in (i0..=i0 + columns).zip(row) {
            let point: DVec3 = terrain.position_ned_m(chunk, i, j);
            *sheared = point.is_finite().then(|| ray.shear(point));
        }
    }
    let mut best = None;
    for j in 0..rows as usize {
        for i in 0..columns as usize {
            // The diagonal runs from north-west to south-east: (i, j) to (i + 1, j + 1).
            for corners in [[[i, j], [i + 1, j + 1], [i + 1, j]], [[i, j], [i, j + 1], [i + 1, j + 1]]] {
                let [Some(a), Some(b), Some(c)] = corners.map(|[i, j]| sheared[j][i]) else { continue };
                if let Some((t, weights)) = intersect_triangle([a, b, c], limit) {
                    limit = t;
                    best = Some((t, weights, corners));
                }
            }
        }
    }
    let (t, weights, corners) = best?;
    let span = &terrain.chunks[chunk as usize];
    let vertices = corners.map(|[i, j]| {
        let [i, j] = [i0 + i as u32, j0 + j as u32];
        (span.first_vertex + j * (span.cells[0] + 1) + i) as usize
    });
    let between = |value: &dyn Fn(usize) -> f32| {
        (0..3).map(|corner| weights[corner] * f64::from(value(vertices[corner]))).sum::<f64>()
    };
    let uv = [0, 1].map(|k: usize| between(&|vertex| terrain.vertices[vertex].uv[k]));
    let corners = corners.map(|[i, j]| terrain.position_ned_m(chunk, i0 + i as u32, j0 + j as u32));
    let hit = hit_at(ray, t, uv, corners, TERRAIN);
    if terrain.light_parts.is_empty() {
        return Some(hit);
    }
    let [of_sun, of_sky] = [0, 1].map(|k: usize| between(&|vertex| terrain.light_parts[vertex][k]));
    Some(Hit { sky_fraction: if of_sun > 0.0 { of_sky / (of_sun + of_sky) } else { 1.0 }, ..hit })
}
