//! Tolerances of the parts of a terrain for one camera.

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

/// Tolerance of what is out of sight, above all others.
pub(super) const OUT_OF_SIGHT: u16 = u16::MAX - 1;

/// Marks a tolerance that was not computed yet; no tolerance has this value.
const UNKNOWN: u16 = u16::MAX;

/// Squares of each size along a side of a chunk, plus one at each end.
const AROUND: [usize; NODE_CELLS.len()] = [10, 6, 4, 3];

/// Index of the first square of each size around a chunk, and the total number.
const FIRST: [usize; NODE_CELLS.len() + 1] = {
    let mut first = [0; NODE_CELLS.len() + 1];
    let mut size = 0;
    while size < NODE_CELLS.len() {
        first[size + 1] = first[size] + AROUND[size] * AROUND[size];
        size += 1;
    }
    first
};

/// Projection of surface deviations into a camera.
///
/// A point p (relative to the camera, with z along its axis) that is displaced by d moves in the image by
/// `focal |(z d - d_z p)_xy| / (z (z + d_z))`. For a vertical d the numerator depends on the horizontal part
/// of p alone; for any d it is at most `|d| |p|`.
#[derive(Debug)]
struct ErrorMetric {
    frustum: Frustum,
    position_ned_m: DVec3,
    axis_ned: DVec3,
    /// `(z down - down_z p)_xy` = (these two) . p.
    across_ned: [DVec3; 2],
    /// Bound on distance over depth.
    slant: f64,
    focal_px: f64,
    max_error_px: f64,
}

impl ErrorMetric {
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

    /// Largest vertical deviation within a box that displaces nothing by more than the tolerance, for points
    /// that are also off by up to `horizontal_m` in the north-east plane, and whose own size is within the
    /// tolerance when seen from the side.
    ///
    /// From `focal (e across + h far) <= tolerance z (z - e |axis_z| - h)` and `focal e <= tolerance z`: seen
    /// from straight above, an error of height displaces nothing in the image, but is entirely in the depth.
    /// Each step rounds monotonically, so of two nested boxes the larger never gets the larger tolerance.
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

    /// Displacement by horizontal deviations alone within a box, pixels.
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

/// Tolerances of the squares of a chunk, computed on demand. All threads compute the same values.
#[derive(Debug)]
pub(super) struct Tolerances {
    chunk: u32,
    set_tolerance: Vec<AtomicU16>,
    square_tolerance: [AtomicU16; FIRST[NODE_CELLS.len()]],
}

impl Tolerances {
    pub fn new(chunk: u32) -> Self {
        let unknown = || AtomicU16::new(UNKNOWN);
        Self {
            chunk,
            set_tolerance: LATTICE.sets.iter().map(|_| unknown()).collect(),
            square_tolerance: std::array::from_fn(|_| unknown()),
        }
    }

    /// Resets the tolerances for another chunk.
    pub fn reset(&mut self, chunk: u32) {
        self.chunk = chunk;
        self.set_tolerance
            .iter_mut()
            .chain(&mut self.square_tolerance)
            .for_each(|known| *known.get_mut() = UNKNOWN);
    }
}

/// Level of detail of a terrain for one camera: triangles are halved until their vertical errors are within
/// the tolerance. A pure function of terrain, camera and tolerance.
#[derive(Debug)]
pub struct TerrainDetail<'a> {
    pub(super) terrain: &'a Terrain,
    judge: ErrorMetric,
    /// Indices of the chunks in sight that have a surface.
    pub(super) in_sight: Vec<u32>,
    /// Tolerances of these chunks; a mesh does not need to keep them.
    tolerances: Vec<OnceLock<Box<Tolerances>>>,
}

impl<'a> TerrainDetail<'a> {
    /// `tangents` = [u_min, u_max, v_min, v_max] of the ideal frame (u = x/z, v = y/z in camera axes);
    /// `focal_px` is its larger focal length. No visible point is displaced by more than `max_error_px`.
    /// Heights are off by no more than that in a view from the side, so from straight above the depth is off
    /// by at most `max_error_px / focal_px` of itself. With a tolerance too small for any simplification, the
    /// result is the full surface.
    pub fn new(
        terrain: &'a Terrain,
        camera: &CameraPose,
        tangents: [f64; 4],
        focal_px: f64,
        max_error_px: f64,
    ) -> Self {
        let judge = ErrorMetric::new(camera, tangents, focal_px, max_error_px);
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

    /// The requested tolerance, pixels.
    pub fn max_error_px(&self) -> f64 {
        self.judge.max_error_px
    }

    /// Position of the camera, and its focal length in pixels.
    pub(super) fn viewpoint(&self) -> (DVec3, f64) {
        (self.judge.position_ned_m, self.judge.focal_px)
    }

    /// Bound on the displacement by horizontal deviations, which are not tested per triangle, pixels.
    pub(super) fn horizontal_px(&self) -> f64 {
        let largest_m = self.terrain.horizontal_m[NODE_CELLS.len() - 1];
        self.in_sight
            .iter()
            .map(|&chunk| self.judge.horizontal_px(&self.terrain.chunks[chunk as usize].bounds, largest_m))
            .fold(0.0, f64::max)
    }

    /// Errors of a chunk.
    pub(super) fn errors(&self, chunk: u32) -> &'a [u16] {
        &self.terrain.errors[chunk as usize * PER_CHUNK..][..PER_CHUNK]
    }

    /// Cached tolerances of a chunk; `None` out of sight.
    pub(super) fn tolerances(&self, chunk: u32) -> Option<&Tolerances> {
        let index = self.in_sight.binary_search(&chunk).ok()?;
        Some(self.tolerances[index].get_or_init(|| Box::new(Tolerances::new(chunk))))
    }

    /// Strictest tolerance over one of the lattice's sets of squares.
    #[inline]
    pub(super) fn set_tolerance(&self, known: &Tolerances, set: u16) -> u16 {
        match known.set_tolerance[usize::from(set)].load(Relaxed) {
            UNKNOWN => self.compute_set(known, set),
            tolerance => tolerance,
        }
    }

    /// Lower bound of all tolerances of a chunk.
    pub(super) fn root_tolerance(&self, known: &Tolerances) -> u16 {
        let (root, _) = lattice::halves(lattice::ROOTS[0]);
        self.set_tolerance(known, LATTICE.set_of_vertex[root as usize])
    }

    #[cold]
    fn compute_set(&self, known: &Tolerances, set: u16) -> u16 {
        let strictest = self.strictest(known, &LATTICE.sets[usize::from(set)]);
        known.set_tolerance[usize::from(set)].store(strictest, Relaxed);
        strictest
    }

    /// Whether the square of 8x8 cells that holds a vertex and the cell to its south-east is in sight.
    pub(super) fn block_in_sight(&self, known: &Tolerances, vertex: u32) -> bool {
        let [column, row] = lattice::position(vertex).map(|n| (n / NODE_CELLS[0]) as i32);
        self.square_tolerance(known, 0, column, row) != OUT_OF_SIGHT
    }

    /// Least depth of the visible part of a square, and largest distance over depth; `None` out of sight.
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
                strictest = strictest.min(self.square_tolerance(known, squares.size, column, row));
            }
        }
        strictest
    }

    /// Tolerance of a square by its position relative to the chunk's first square.
    fn square_tolerance(&self, known: &Tolerances, size: usize, column: i32, row: i32) -> u16 {
        let square_tolerance =
            &known.square_tolerance[FIRST[size] + (row + 1) as usize * AROUND[size] + (column + 1) as usize];
        match square_tolerance.load(Relaxed) {
            UNKNOWN => {
                let tolerance = self.compute(known.chunk, size, column, row);
                square_tolerance.store(tolerance, Relaxed);
                tolerance
            }
            tolerance => tolerance,
        }
    }

    fn compute(&self, chunk: u32, size: usize, column: i32, row: i32) -> u16 {
        let grid = self.terrain.chunk_grid;
        let (cells, per_chunk) = (NODE_CELLS[size], CHUNK_CELLS / NODE_CELLS[size]);
        let square = [chunk % grid[0], chunk / grid[0]].map(|n| i64::from(n * per_chunk));
        let square = [square[0] + i64::from(column), square[1] + i64::from(row)];
        let bounds = self.terrain.tree.square(cells, square);
        bounds.map_or(OUT_OF_SIGHT, |bounds| self.judge.tolerance(&bounds, self.terrain.horizontal_m[size]))
    }
}
