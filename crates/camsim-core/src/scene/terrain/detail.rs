//! How exact a camera needs each part of a terrain to be.

use std::sync::{
    OnceLock,
    atomic::{AtomicU16, Ordering::Relaxed},
};

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

/// Not asked for yet: no tolerance is this high.
const UNKNOWN: u16 = u16::MAX;

/// Squares of one size along a side of a chunk and its surroundings: one more at each end.
const AROUND: [usize; NODE_CELLS.len()] = [10, 6, 4, 3];

/// Where the squares of each size begin among those around a chunk, and how many there are.
const FIRST: [usize; NODE_CELLS.len() + 1] = {
    let mut first = [0; NODE_CELLS.len() + 1];
    let mut size = 0;
    while size < NODE_CELLS.len() {
        first[size + 1] = first[size] + AROUND[size] * AROUND[size];
        size += 1;
    }
    first
};

/// How a camera sees deviations of a surface.
///
/// A point p (from the camera, z along its axis) that is moved by d is seen at another place by `focal |(z d
/// - d_z p)_xy| / (z (z + d_z))`. For a vertical d the numerator is that of the horizontal part of p alone;
/// for any d it is `|d| |p|` at most.
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
        let radius2 = tangents[0].abs().max(tangents[1].abs()).powi(2)
            + tangents[2].abs().max(tangents[3].abs()).powi(2);
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

    /// Largest vertical deviation within a box that moves nothing by more than the tolerance, if points are
    /// off by up to `horizontal_m` also in the north-east plane, and that is none either if it is looked at
    /// from any side.
    ///
    /// From `focal (e across + h far) <= tolerance z (z - e |axis_z| - h)` and `focal e <= tolerance z`: from
    /// straight above heights that are off move nothing in the picture, but all of it is in the depth. Each
    /// step rounds the way its arguments go, so of two boxes that hold one another the larger never gets the
    /// larger tolerance.
    fn tolerance(&self, bounds: &Aabb, horizontal_m: f64) -> u16 {
        if !self.frustum.may_see(bounds) {
            return OUT_OF_SIGHT;
        }
        let from_camera =
            Aabb { min: bounds.min - self.position_ned_m, max: bounds.max - self.position_ned_m };
        let (depth_m, far_m) = self.depths(&from_camera);
        if depth_m <= 0.0 {
            return 0;
        }
        let [x, y] = self.across_ned.map(|n| from_camera.support(n).max(from_camera.support(-n)));
        let across_m = (x * x + y * y).sqrt();
        let left_px_m =
            self.max_error_px * (depth_m - horizontal_m) - self.focal_px * horizontal_m * far_m / depth_m;
        let in_picture_m =
            left_px_m / (self.focal_px * across_m / depth_m + self.max_error_px * self.axis_ned.z.abs());
        key_of_tolerance(in_picture_m.min(self.max_error_px * depth_m / self.focal_px))
    }

    /// What horizontal deviations alone move within a box, pixels.
    fn horizontal_px(&self, bounds: &Aabb, horizontal_m: f64) -> f64 {
        let from_camera =
            Aabb { min: bounds.min - self.position_ned_m, max: bounds.max - self.position_ned_m };
        let (depth_m, far_m) = self.depths(&from_camera);
        match (horizontal_m > 0.0, depth_m > horizontal_m) {
            (false, _) => 0.0,
            (true, false) => f64::INFINITY,
            (true, true) => self.focal_px * horizontal_m * far_m / (depth_m * (depth_m - horizontal_m)),
        }
    }
}

/// What a chunk's triangles are judged by, as far as it was asked for. Whoever finds a number first finds the
/// same.
#[derive(Debug)]
pub(super) struct Tolerances {
    chunk: u32,
    of_set: Vec<AtomicU16>,
    of_square: [AtomicU16; FIRST[NODE_CELLS.len()]],
}

impl Tolerances {
    pub fn new(chunk: u32) -> Self {
        let unknown = || AtomicU16::new(UNKNOWN);
        Self {
            chunk,
            of_set: LATTICE.sets.iter().map(|_| unknown()).collect(),
            of_square: std::array::from_fn(|_| unknown()),
        }
    }

    /// For another chunk.
    pub fn reset(&mut self, chunk: u32) {
        self.chunk = chunk;
        self.of_set.iter_mut().chain(&mut self.of_square).for_each(|known| *known.get_mut() = UNKNOWN);
    }
}

/// A terrain as one camera needs it: triangles are halved until their vertical errors are within the
/// tolerance. A pure function of terrain, camera and tolerance.
#[derive(Debug)]
pub struct TerrainDetail<'a> {
    pub(super) terrain: &'a Terrain,
    judge: Judge,
    /// Chunks in sight that have a surface, by number.
    pub(super) in_sight: Vec<u32>,
    /// Of these chunks; a mesh does without.
    tolerances: Vec<OnceLock<Box<Tolerances>>>,
}

impl<'a> TerrainDetail<'a> {
    /// `tangents` = [u_min, u_max, v_min, v_max] of the ideal frame (u = x/z, v = y/z in the optical frame),
    /// `focal_px` its larger focal length. Nothing that is seen is moved by more than `max_error_px`, and
    /// heights are off by no more than that looks from the side, so that from straight above depth is off by
    /// `max_error_px / focal_px` of it at most; with a tolerance too small for anything it is the full
    /// surface.
    pub fn new(
        terrain: &'a Terrain,
        camera: &CameraPose,
        tangents: [f64; 4],
        focal_px: f64,
        max_error_px: f64,
    ) -> Self {
        let judge = Judge::new(camera, tangents, focal_px, max_error_px);
        let mut in_sight = Vec::new();
        terrain.tree.visit(CHUNK_CELLS, &|bounds| judge.frustum.may_see(bounds), &mut |[x, y]| {
            let chunk = y * terrain.chunk_grid[0] + x;
            if terrain.chunks[chunk as usize].has_surface {
                in_sight.push(chunk);
            }
        });
        in_sight.sort_unstable();
        let tolerances = in_sight.iter().map(|_| OnceLock::new()).collect();
        Self { terrain, judge, in_sight, tolerances }
    }

    /// The tolerance that was asked for, pixels.
    pub fn max_error_px(&self) -> f64 {
        self.judge.max_error_px
    }

    /// Where the camera is, and its focal length, pixels.
    pub(super) fn seen_from(&self) -> (DVec3, f64) {
        (self.judge.position_ned_m, self.judge.focal_px)
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

    /// Kept for a chunk; `None` out of sight.
    pub(super) fn tolerances(&self, chunk: u32) -> Option<&Tolerances> {
        let place = self.in_sight.binary_search(&chunk).ok()?;
        Some(self.tolerances[place].get_or_init(|| Box::new(Tolerances::new(chunk))))
    }

    /// The strictest tolerance of one of the lattice's sets of squares.
    #[inline]
    pub(super) fn of_set(&self, known: &Tolerances, set: u16) -> u16 {
        match known.of_set[usize::from(set)].load(Relaxed) {
            UNKNOWN => self.find_set(known, set),
            tolerance => tolerance,
        }
    }

    /// A tolerance that none of a chunk is stricter than.
    pub(super) fn of_root(&self, known: &Tolerances) -> u16 {
        let (root, _) = lattice::halves(lattice::ROOTS[0]);
        self.of_set(known, LATTICE.set_of_vertex[root as usize])
    }

    #[cold]
    fn find_set(&self, known: &Tolerances, set: u16) -> u16 {
        let strictest = self.strictest(known, &LATTICE.sets[usize::from(set)]);
        known.of_set[usize::from(set)].store(strictest, Relaxed);
        strictest
    }

    /// Whether the square of 8x8 cells that holds a vertex and the cell to its south-east is in sight.
    pub(super) fn block_in_sight(&self, known: &Tolerances, vertex: u32) -> bool {
        let [column, row] = lattice::place(vertex).map(|n| (n / NODE_CELLS[0]) as i32);
        self.of_square(known, 0, column, row) != OUT_OF_SIGHT
    }

    /// Least depth of what is in sight of a square, and distance over depth at most; `None` out of sight.
    pub(super) fn least_depth(&self, cells: u32, at: [i64; 2]) -> Option<(f64, f64)> {
        let bounds =
            self.terrain.tree.square(cells, at).filter(|bounds| self.judge.frustum.may_see(bounds))?;
        let position_ned_m = self.judge.position_ned_m;
        let from_camera = Aabb { min: bounds.min - position_ned_m, max: bounds.max - position_ned_m };
        Some((self.judge.depths(&from_camera).0, self.judge.slant))
    }

    fn strictest(&self, known: &Tolerances, squares: &Squares) -> u16 {
        let mut strictest = OUT_OF_SIGHT;
        for row in squares.rows() {
            for column in squares.columns() {
                strictest = strictest.min(self.of_square(known, squares.size, column, row));
            }
        }
        strictest
    }

    /// Tolerance of a square by its place, counted from the chunk's first.
    fn of_square(&self, known: &Tolerances, size: usize, column: i32, row: i32) -> u16 {
        let of_square =
            &known.of_square[FIRST[size] + (row + 1) as usize * AROUND[size] + (column + 1) as usize];
        match of_square.load(Relaxed) {
            UNKNOWN => {
                let tolerance = self.find(known.chunk, size, column, row);
                of_square.store(tolerance, Relaxed);
                tolerance
            }
            tolerance => tolerance,
        }
    }

    fn find(&self, chunk: u32, size: usize, column: i32, row: i32) -> u16 {
        let grid = self.terrain.chunk_grid;
        let (cells, per_chunk) = (NODE_CELLS[size], CHUNK_CELLS / NODE_CELLS[size]);
        let at = [chunk % grid[0], chunk / grid[0]].map(|n| i64::from(n * per_chunk));
        let at = [at[0] + i64::from(column), at[1] + i64::from(row)];
        let bounds = self.terrain.tree.square(cells, at);
        bounds.map_or(OUT_OF_SIGHT, |bounds| self.judge.tolerance(&bounds, self.terrain.horizontal_m[size]))
    }
}
