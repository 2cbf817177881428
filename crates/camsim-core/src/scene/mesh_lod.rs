//! Levels of detail of meshes: fewer triangles within a known distance of the full surface.
//!
//! Between a level and the full shape, the Hausdorff distance of the surfaces, including their colours and
//! texture coordinates (`mesh_lod/attribute_space.rs`), is at most the level's error. The viewing distance
//! turns it into pixels.

use std::{
    collections::{HashMap, HashSet},
    sync::{Arc, OnceLock},
};

use glam::{DMat3, DVec3};
use rayon::prelude::*;
use serde::Serialize;

use super::{Aabb, Mesh, Scene, Shape, in_view};
use crate::pose::CameraPose;

mod attribute_space;
mod hausdorff;
mod simplify;

use hausdorff::{hausdorff_bound_m, hausdorff_least_m};
use simplify::Simplifier;

/// Shapes with fewer triangles are always drawn in full.
const MIN_TRIANGLES: usize = 24;
/// Shapes with more triangles are not simplified: that would take longer than drawing many frames of them.
const MAX_TRIANGLES: usize = 200_000;
/// Largest ratio of the triangle counts of successive levels.
const TRIANGLE_RATIO: f64 = 0.75;
/// Error of the finest simplified level, relative to the shape's diagonal. Each further level allows twice
/// the error.
const FINEST_ERROR: f64 = 1.0 / 1024.0;
const LEVELS: i32 = 9;

/// A level of detail of a shape.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ShapeLod {
    /// Three indices per triangle, into the vertices of the full shape.
    pub indices: Arc<[u32]>,
    /// Bound on the distance between this surface and the full one, metres in the shape's own axes.
    pub error_m: f64,
}

/// Levels of detail of a shape, from the full one down. It is simplified when first asked for one within an
/// error; the levels' errors are measured when that is not below a lower bound of the least of them.
#[derive(Clone, Debug)]
pub struct ShapeLods {
    shape: Arc<Shape>,
    is_simplified: bool,
    simplified: OnceLock<Simplified>,
    levels: OnceLock<Vec<ShapeLod>>,
}

/// Coarser versions of a shape.
#[derive(Clone, Debug)]
struct Simplified {
    /// No version has a smaller error, metres; infinite without any.
    least_m: f64,
    indices: Vec<Arc<[u32]>>,
}

impl ShapeLods {
    /// Only the full shape.
    #[must_use]
    pub fn full(shape: Arc<Shape>) -> Self {
        Self { shape, is_simplified: false, simplified: OnceLock::new(), levels: OnceLock::new() }
    }

    /// Levels of a shape, unless it is too small or too large to be simplified.
    #[must_use]
    pub fn new(shape: Arc<Shape>) -> Self {
        let is_sound = shape.indices.iter().all(|&corner| (corner as usize) < shape.vertices.len());
        let is_simplified = (MIN_TRIANGLES..=MAX_TRIANGLES).contains(&(shape.indices.len() / 3)) && is_sound;
        Self { is_simplified, ..Self::full(shape) }
    }

    /// The levels, from the full one down, with increasing error.
    #[must_use]
    pub fn levels(&self) -> &[ShapeLod] {
        let measure = || match self.shape.has_normals() {
            true => self.measured::<{ attribute_space::LIT }>(),
            false => self.measured::<{ attribute_space::UNLIT }>(),
        };
        get_or_make(&self.levels, measure).as_slice()
    }

    /// Three indices per triangle of a level, into the vertices of the full shape.
    #[must_use]
    pub fn indices(&self, level: usize) -> &[u32] {
        if level == 0 { &self.shape.indices } else { &self.levels()[level].indices }
    }

    /// Index of the coarsest level within an error, metres in the shape's own axes.
    #[must_use]
    pub fn coarsest_within(&self, error_m: f64) -> usize {
        // False for NaN.
        match self.is_simplified && error_m > 0.0 && error_m >= self.simplified().least_m {
            true => self.levels().iter().rposition(|level| level.error_m <= error_m).unwrap_or(0),
            false => 0,
        }
    }

    fn simplified(&self) -> &Simplified {
        get_or_make(&self.simplified, || match self.shape.has_normals() {
            true => simplified::<{ attribute_space::LIT }>(&self.shape),
            false => simplified::<{ attribute_space::UNLIT }>(&self.shape),
        })
    }

    fn measured<const AXES: usize>(&self) -> Vec<ShapeLod> {
        let mut levels = vec![ShapeLod { indices: self.shape.indices[..].into(), error_m: 0.0 }];
        if self.is_simplified {
            let full = Simplifier::<AXES>::new(&self.shape);
            let measure = |indices: &Arc<[u32]>| {
                let (left, tolerance_m) = (indices.as_chunks().0, tolerance_m(&self.shape));
                let error_m = hausdorff_bound_m(&full.points, &full.triangles, left, tolerance_m);
                ShapeLod { indices: indices.clone(), error_m }
            };
            levels.par_extend(self.simplified().indices.par_iter().map(measure));
        }
        let mut least_m = 0.0_f64;
        for level in &mut levels {
            least_m = least_m.max(level.error_m);
            level.error_m = least_m;
        }
        levels.retain(|level| level.error_m.is_finite());
        levels
    }
}

/// Simplifies a shape.
fn simplified<const AXES: usize>(shape: &Shape) -> Simplified {
    let mut simplifier = Simplifier::<AXES>::new(shape);
    let full = simplifier.remaining();
    simplifier.begin();
    let (mut count, mut indices, mut least_m) = (shape.indices.len() / 3, Vec::new(), f64::INFINITY);
    for level in 0..LEVELS {
        simplifier.collapse_within(FINEST_ERROR * diagonal_m(shape) * 2_f64.powi(level));
        if simplifier.count() as f64 > TRIANGLE_RATIO * count as f64 {
            continue;
        }
        count = simplifier.count();
        let left = simplifier.remaining();
        if indices.is_empty() {
            least_m = hausdorff_least_m(&simplifier.points, &full, &left, tolerance_m(shape));
        }
        indices.push(left.into_iter().flatten().collect());
    }
    Simplified { least_m, indices }
}

/// The value of a cell, which is made outside of its lock: with the lock held, the thread may take up a task
/// that waits for it.
fn get_or_make<T>(cell: &OnceLock<T>, make: impl FnOnce() -> T) -> &T {
    cell.get().unwrap_or_else(|| {
        let made = make();
        cell.get_or_init(|| made)
    })
}

fn diagonal_m(shape: &Shape) -> f64 {
    let bounds = shape.bounds();
    (bounds.max - bounds.min).length()
}

/// Distance within which surfaces may be the same but for rounding: the least error of a level.
fn tolerance_m(shape: &Shape) -> f64 {
    let bounds = shape.bounds();
    1e-9 * (diagonal_m(shape) + bounds.min.abs().max(bounds.max.abs()).max_element())
}

/// Levels of detail of all shapes of a scene.
#[derive(Clone, Debug, Default)]
pub struct SceneLods {
    of: HashMap<usize, Arc<ShapeLods>>,
}

impl SceneLods {
    /// Levels of each shape of a scene. Blended shapes are not simplified: a bound on the distance does
    /// not bound the number of layers along a ray.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        let mut shapes: HashMap<usize, &Arc<Shape>> = HashMap::new();
        let blended: HashSet<usize> = scene
            .meshes
            .iter()
            .filter(|mesh| mesh.material.blends)
            .map(|mesh| Arc::as_ptr(&mesh.shape) as usize)
            .collect();
        scene.meshes.iter().for_each(|mesh| {
            shapes.insert(Arc::as_ptr(&mesh.shape) as usize, &mesh.shape);
        });
        let levels = |(key, shape): (usize, &Arc<Shape>)| {
            let levels = if blended.contains(&key) { ShapeLods::full } else { ShapeLods::new };
            (key, Arc::new(levels(shape.clone())))
        };
        Self { of: shapes.into_iter().map(levels).collect() }
    }

    /// Levels of a shape of the scene.
    #[must_use]
    pub fn shape_lods(&self, shape: &Arc<Shape>) -> Arc<ShapeLods> {
        self.of
            .get(&(Arc::as_ptr(shape) as usize))
            .cloned()
            .unwrap_or_else(|| Arc::new(ShapeLods::full(shape.clone())))
    }
}

/// Tolerance of the levels of detail of meshes in an ideal frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LodTolerance {
    /// Focal length of the ideal frame, pixels.
    pub focal_px: f64,
    /// Bounds of the ideal frame as tangents: u_min, u_max, v_min, v_max.
    pub tangents: [f64; 4],
    /// Largest displacement of a surface in the ideal frame, pixels.
    pub error_px: f64,
    /// Largest distance of the output cameras from the key camera, metres.
    pub travel_m: f64,
    /// Largest displacement of a surface by the change of its parallax over `travel_m`, pixels.
    pub parallax_px: f64,
}

impl LodTolerance {
    /// Largest displacement, in metres, of the surfaces within a box, seen from a pose.
    ///
    /// A point at depth z and tangents u, v moves by at most `f sqrt(1 + u^2 + v^2) / z` pixels per metre. A
    /// displacement of `e` towards the camera changes the parallax by `f travel e / z^2`; along a surface
    /// inclined by up to 75 degrees that is four times as much.
    #[must_use]
    pub fn error_m(&self, bounds: &Aabb, pose: &CameraPose) -> f64 {
        let ahead = pose.ned_from_camera * DVec3::Z;
        let half = 0.5 * (bounds.max - bounds.min);
        let z_m = ahead.dot(bounds.centre() - pose.position_ned_m) - half.dot(ahead.abs()) - self.travel_m;
        if z_m.is_nan() || z_m <= 0.0 {
            return 0.0;
        }
        let [u_min, u_max, v_min, v_max] = self.tangents;
        let widest =
            (1.0 + u_min.abs().max(u_max.abs()).powi(2) + v_min.abs().max(v_max.abs()).powi(2)).sqrt();
        let px_per_m = self.focal_px * widest / z_m;
        let by_parallax_m = self.parallax_px * z_m / (4.0 * self.focal_px * widest * self.travel_m) * z_m;
        (self.error_px / px_per_m).min(by_parallax_m)
    }
}

/// Triangle counts of the meshes in an ideal frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct ModelLod {
    /// Number of meshes that may be in view.
    pub meshes: u64,
    /// Their triangles at the chosen level of detail.
    pub triangles: u64,
    /// Their triangles at the finest level.
    pub finest_triangles: u64,
}

impl ModelLod {
    /// Counts for the levels that the renderer chooses.
    #[must_use]
    pub fn new(scene: &Scene, levels: &SceneLods, pose: &CameraPose, tolerance: &LodTolerance) -> Self {
        let bounds = scene.mesh_bounds();
        let mut detail = Self::default();
        for i in in_view(&bounds, pose, tolerance.tangents) {
            let (mesh, bounds) = (&scene.meshes[i as usize], &bounds[i as usize]);
            let levels = levels.shape_lods(&mesh.shape);
            let level = levels.coarsest_within(tolerance.error_m(bounds, pose) / lod_stretch(mesh));
            detail.meshes += 1;
            detail.triangles += levels.indices(level).len() as u64 / 3;
            detail.finest_triangles += mesh.shape.indices.len() as u64 / 3;
        }
        detail
    }
}

/// Factor by which a mesh stretches the errors of its shape's levels. It is infinite for a lit shape with
/// anisotropic scale, which changes the angles between normals; the errors of the levels do not bound that.
#[must_use]
pub fn lod_stretch(mesh: &Mesh) -> f64 {
    let largest = stretch(&mesh.ned_from_shape);
    let even = mesh.ned_from_shape.determinant().abs().cbrt();
    if mesh.shape.has_normals() && largest > (1.0 + 1e-5) * even { f64::INFINITY } else { largest }
}

/// Largest factor by which a matrix stretches a vector: exact for rotation with uniform scale, otherwise a
/// bound.
#[must_use]
pub fn stretch(matrix: &DMat3) -> f64 {
    let square = matrix.transpose() * *matrix;
    (0..3).map(|axis| square.row(axis).abs().element_sum()).fold(0.0, f64::max).sqrt()
}

#[cfg(test)]
mod tests;
