//! How exact a camera needs each part of a terrain to be.

use std::sync::OnceLock;

use glam::DVec3;

use super::{
    Aabb, CHUNK_CELLS, Terrain,
    errors::{PER_CHUNK, key_of_tolerance},
    lattice::{self, LATTICE, NODE_CELLS, Squares},
    query::Frustum,
};
use crate::pose::CameraPose;

/// Tolerance of what is out of sight: above that of anything else.
pub(super) const OUT_OF_SIGHT: u16 = u16::MAX - 1;

/// Squares of 8x8 cells along a side of a chunk.
pub(super) const BLOCKS: usize = (CHUNK_CELLS / NODE_CELLS[0]) as usize;

/// Squares of one size around a chunk: those of the chunk and one more on each side.
const AROUND: [usize; NODE_CELLS.len()] = [10, 6, 4, 3];

/// How a camera sees deviations of a surface.
///
/// A point p (from the camera, z along its axis) that is moved by d is seen at another place by
/// `focal |(z d - d_z p)_xy| / (z (z + d_z))`. For a vertical d the numerator is that of the horizontal part of p alone; for any d it is `|d| |p|` at most.
#[derive(Debug)]
struct Judge {
    frustum: Frustum,
    position_ned_m: DVec3,
    axis_ned: DVec3,
    /// `(z down - down_z p)_xy` = (these two) . p.
    across_ned: [DVec3; 2],
    /// Distance over depth, at most.
    slant: f64,
    focal_px: f64,
    max_error_px: f64,
}

impl Judge {
    fn new(camera: &CameraPose, tangents: [f64; 4], focal_px: f64, max_error_px: f64) -> Self {
        let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| camera.ned_from_camera * axis);
        let radius2 = tangents[0].abs().max(tangents[1].abs()).powi(2) + tangents[2].abs().max(tangents[3].abs()).powi(2);
        Self {
            frustum: Frustum::new(camera, tangents),
            position_ned_m: camera.position_ned_m,
            axis_ned: z,
            across_ned: [z * x.z - x * z.z, z * y.z - y * z.z],
            slant: (1.0 + radius2).sqrt(),
            focal_px,
            max_error_px,
        }
    }

    /// Smallest depth and largest distance of a box, metres.
    fn depths(&self, from_camera: &Aabb) -> (f64, f64) {
        let depth_m = -from_camera.support(-self.axis_ned);
        (depth_m.max(from_camera.distance_m(DVec3::ZERO) / self.slant), from_camera.farthest_m(DVec3::ZERO))
    }

    /// Largest vertical deviation within a box that moves nothing by more than the tolerance, if points are off by up to `horizontal_m` also
    /// in the north-east plane.
    ///
    /// From `focal (e across + h far) <= tolerance z (z - e |axis_z| - h)`. Each step rounds the way its arguments go, so of two boxes
    /// that hold one another the larger never gets the larger tolerance.
    fn tolerance(&self, bounds: &Aabb, horizontal_m: f64) -> u16 {
        if !self.frustum.may_see(bounds) {
            return OUT_OF_SIGHT;
        }
        let from_camera = Aabb { min: bounds.min - self.position_ned_m, max: bounds.max - self.position_ned_m };
        let (depth_m, far_m) = self.depths(&from_camera);
        if depth_m <= 0.0 {
            return 0;
        }
        let [x, y] = self.across_ned.map(|n| from_camera.support(n).max(from_camera.support(-n)));
        let across_m = (x * x + y * y).sqrt();
        let left_px_m = self.max_error_px * (depth_m - horizontal_m) - self.focal_px * horizontal_m * far_m / depth_m;
        key_of_tolerance(left_px_m / (self.focal_px * across_m / depth_m + self.max_error_px * self.axis_ned.z.abs()))
    }

    /// What horizontal deviations alone move within a box, pixels.
    fn horizontal_px(&self, bounds: &Aabb, horizontal_m: f64) -> f64 {
        let from_camera = Aabb { min: bounds.min - self.position_ned_m, max: bounds.max - self.position_ned_m };
        let (depth_m, far_m) = self.depths(&from_camera);
        match (horizontal_m > 0.0, depth_m > horizontal_m) {
            (false, _) => 0.0,
            (true, false) => f64::INFINITY,
            (true, true) => self.focal_px * horizontal_m * far_m / (depth_m * (depth_m - horizontal_m)),
        }
    }
}

/// What a chunk's triangles are judged by.
#[derive(Debug)]
pub(super) struct Tolerances {
    /// Of each of the lattice's sets of squares.
    pub of_set: Vec<u16>,
    /// Which squares of 8x8 cells are in sight, row after row.
    pub in_sight: [bool; BLOCKS * BLOCKS],
}

/// A terrain as one camera needs it: triangles are halved until their vertical errors are within the tolerance. A pure function of
/// terrain, camera and tolerance.
#[derive(Debug)]
pub struct TerrainDetail<'a> {
    pub(super) terrain: &'a Terrain,
    judge: Judge,
    /// Tolerance of each chunk.
    chunks: Vec<u16>,
    /// Chunks in sight that have a surface, by number.
    pub(super) in_sight: Vec<u32>,
    tolerances: Vec<OnceLock<Tolerances>>,
}

impl<'a> TerrainDetail<'a> {
    /// `tangents` = [u_min, u_max, v_min, v_max] of the ideal frame (u = x/z, v = y/z in the optical frame), `focal_px` its larger focal
    /// length. Nothing that is seen is moved by more than `max_error_px`; with a tolerance too small for anything it is the full surface.
    pub fn new(terrain: &'a Terrain, camera: &CameraPose, tangents: [f64; 4], focal_px: f64, max_error_px: f64) -> Self {
        let judge = Judge::new(camera, tangents, focal_px, max_error_px);
        let mut chunks = vec![OUT_OF_SIGHT; terrain.chunks.len()];
        let mut in_sight = Vec::new();
        terrain.tree.visit(CHUNK_CELLS, &|bounds| judge.frustum.may_see(bounds), &mut |[x, y], bounds| {
            let chunk = y * terrain.chunk_grid[0] + x;
            chunks[chunk as usize] = judge.tolerance(bounds, terrain.horizontal_m[NODE_CELLS.len() - 1]);
            if terrain.chunks[chunk as usize].has_surface {
                in_sight.push(chunk);
            }
        });
        in_sight.sort_unstable();
        let tolerances = terrain.chunks.iter().map(|_| OnceLock::new()).collect();
        Self { terrain, judge, chunks, in_sight, tolerances }
    }

    /// The tolerance that was asked for, pixels.
    pub fn max_error_px(&self) -> f64 {
        self.judge.max_error_px
    }

    /// What horizontal deviations, which no choice of triangles looks at one by one, move at most, pixels.
    pub(super) fn horizontal_px(&self) -> f64 {
        let largest_m = self.terrain.horizontal_m[NODE_CELLS.len() - 1];
        self.in_sight
            .iter()
            .map(|&chunk| self.judge.horizontal_px(&self.terrain.chunks[chunk as usize].bounds, largest_m))
            .fold(0.0, f64::max)
    }

    /// Errors of a chunk, as the terrain keeps them.
    pub(super) fn errors(&self, chunk: u32) -> &'a [u16] {
        &self.terrain.errors[chunk as usize * PER_CHUNK..][..PER_CHUNK]
    }

    /// Error of a chunk as two triangles, and its tolerance.
    pub(super) fn root(&self, chunk: u32) -> (u16, u16) {
        let (root, _) = lattice::halves(lattice::ROOTS[0]);
        let squares = &LATTICE.sets[usize::from(LATTICE.set_of_vertex[root as usize])];
        (self.errors(chunk)[root as usize], strictest(squares, &self.chunks_around(chunk), AROUND[squares.size]))
    }

    pub(super) fn tolerances(&self, chunk: u32) -> &Tolerances {
        self.tolerances[chunk as usize].get_or_init(|| self.find_tolerances(chunk))
    }

    fn chunks_around(&self, chunk: u32) -> [u16; AROUND[NODE_CELLS.len() - 1].pow(2)] {
        let [columns, rows] = self.terrain.chunk_grid.map(i64::from);
        let (x, y) = (i64::from(chunk) % columns, i64::from(chunk) / columns);
        std::array::from_fn(|k| {
            let (x, y) = (x + k as i64 % 3 - 1, y + k as i64 / 3 - 1);
            let is_chunk = (0..columns).contains(&x) && (0..rows).contains(&y);
            if is_chunk { self.chunks[(y * columns + x) as usize] } else { OUT_OF_SIGHT }
        })
    }

    fn find_tolerances(&self, chunk: u32) -> Tolerances {
        let columns = self.terrain.chunk_grid[0];
        let at = [chunk % columns, chunk / columns];
        let around: [Vec<u16>; NODE_CELLS.len()] = std::array::from_fn(|size| {
            if size + 1 == NODE_CELLS.len() {
                return self.chunks_around(chunk).to_vec();
            }
            let (cells, count) = (NODE_CELLS[size], AROUND[size] as i64);
            let first = at.map(|n| i64::from(n * (CHUNK_CELLS / cells)) - 1);
            let tolerance = |k: i64| {
                let bounds = self.terrain.tree.square(cells, [first[0] + k % count, first[1] + k / count]);
                bounds.map_or(OUT_OF_SIGHT, |bounds| self.judge.tolerance(bounds, self.terrain.horizontal_m[size]))
            };
            (0..count * count).map(tolerance).collect()
        });
        let of_set = LATTICE.sets.iter().map(|squares| strictest(squares, &around[squares.size], AROUND[squares.size])).collect();
        let block = |k: usize| around[0][(k / BLOCKS + 1) * AROUND[0] + k % BLOCKS + 1] != OUT_OF_SIGHT;
        Tolerances { of_set, in_sight: std::array::from_fn(block) }
    }
}

fn strictest(squares: &Squares, around: &[u16], side: usize) -> u16 {
    let rows = squares.rows().map(|row| &around[(row + 1) as usize * side..]);
    rows.flat_map(|row| squares.columns().map(|column| row[(column + 1) as usize])).fold(OUT_OF_SIGHT, u16::min)
}
