//! Levels of detail of shapes: fewer triangles, at a known distance from the full surface.
//!
//! A level is within its error of the full shape, and the shape of it, as surfaces with their colours and
//! texture coordinates (`levels/space.rs`). Seen from a distance that is a number of pixels.

use std::{
    collections::{HashMap, HashSet},
    sync::Arc,
};

use glam::{DMat3, DVec3};
use rayon::prelude::*;
use serde::Serialize;

use super::{Aabb, Mesh, Scene, Shape, in_view};
use crate::pose::CameraPose;

mod measure;
mod simplify;
mod space;

use simplify::Simplifier;

/// Shapes of fewer triangles are always drawn whole.
const FEWEST_TRIANGLES: usize = 24;
/// Shapes of more are not made simpler: it would take longer than drawing many frames of them.
const MOST_TRIANGLES: usize = 200_000;
/// A level has at most this part of the triangles of the one before.
const FEWER: f64 = 0.75;
/// What the errors asked for are of the shape's diagonal, from the finest on, each twice the one before.
const FINEST: f64 = 1.0 / 1024.0;
const LEVELS: i32 = 9;

/// A shape with fewer triangles.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ShapeLevel {
    /// Three a triangle, of the full shape's vertices.
    pub indices: Vec<u32>,
    /// Bound of the distance between this surface and the full one, metres in the shape's own axes.
    pub error_m: f64,
}

/// The levels of a shape, from the full one down.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ShapeLevels(Vec<ShapeLevel>);

impl ShapeLevels {
    /// The full shape alone.
    #[must_use]
    pub fn full(shape: &Shape) -> Self {
        Self(vec![ShapeLevel { indices: shape.indices.clone(), error_m: 0.0 }])
    }

    /// Simplifies a shape.
    #[must_use]
    pub fn new(shape: &Shape) -> Self {
        let is_sound = shape.indices.iter().all(|&corner| (corner as usize) < shape.vertices.len());
        if !(FEWEST_TRIANGLES..=MOST_TRIANGLES).contains(&(shape.indices.len() / 3)) || !is_sound {
            return Self::full(shape);
        }
        if shape.has_normals() {
            Self::simplified::<{ space::LIT }>(shape)
        } else {
            Self::simplified::<{ space::UNLIT }>(shape)
        }
    }

    fn simplified<const AXES: usize>(shape: &Shape) -> Self {
        let mut found = Self::full(shape);
        let bounds = shape.bounds();
        let diagonal_m = (bounds.max - bounds.min).length();
        let mut simplifier = Simplifier::<AXES>::new(shape);
        let full = simplifier.left();
        let hair_m = 1e-9 * (diagonal_m + bounds.min.abs().max(bounds.max.abs()).max_element());
        let (mut count, mut least_m) = (shape.indices.len() / 3, 0.0_f64);
        for level in 0..LEVELS {
            simplifier.collapse_within(FINEST * diagonal_m * 2_f64.powi(level));
            if simplifier.count() as f64 > FEWER * count as f64 {
                continue;
            }
            count = simplifier.count();
            let left = simplifier.left();
            let error_m = measure::apart_m(&simplifier.points, &full, &left, hair_m);
            if !error_m.is_finite() {
                break;
            }
            least_m = least_m.max(error_m);
            found.0.push(ShapeLevel { indices: left.into_iter().flatten().collect(), error_m: least_m });
        }
        found
    }

    /// From the full one down; their errors grow.
    #[must_use]
    pub fn levels(&self) -> &[ShapeLevel] {
        &self.0
    }

    /// The coarsest level that is within an error, metres in the shape's own axes.
    #[must_use]
    pub fn within(&self, error_m: f64) -> usize {
        // Not for a NaN.
        self.0.iter().rposition(|level| level.error_m <= error_m).unwrap_or(0)
    }
}

/// The levels of all shapes of a scene.
#[derive(Clone, Debug, Default)]
pub struct SceneLevels {
    of: HashMap<usize, Arc<ShapeLevels>>,
}

impl SceneLevels {
    /// Simplifies each shape of a scene once. What is mixed with what is behind it stays whole: how many
    /// layers there are, one behind the other, no distance between surfaces bounds.
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
            (
                key,
                Arc::new(if blended.contains(&key) {
                    ShapeLevels::full(shape)
                } else {
                    ShapeLevels::new(shape)
                }),
            )
        };
        Self { of: shapes.into_par_iter().map(levels).collect() }
    }

    /// Of a shape of the scene.
    #[must_use]
    pub fn of(&self, shape: &Arc<Shape>) -> Arc<ShapeLevels> {
        self.of
            .get(&(Arc::as_ptr(shape) as usize))
            .cloned()
            .unwrap_or_else(|| Arc::new(ShapeLevels::full(shape)))
    }
}

/// How far the surfaces of models may be from where they are, as an ideal frame sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevelTolerance {
    /// Of the ideal frame.
    pub focal_px: f64,
    /// Of the ideal frame: u_min, u_max, v_min, v_max.
    pub tangents: [f64; 4],
    /// How far a surface may be displaced in it, pixels.
    pub error_px: f64,
    /// How far the camera gets from the ideal frame's while it is looked at, metres, and how far that may
    /// displace a surface, pixels.
    pub travel_m: f64,
    /// As above.
    pub parallax_px: f64,
}

impl LevelTolerance {
    /// Metres by which the surfaces within a box may be displaced, seen from a pose.
    ///
    /// A point at the depth z and the tangents u, v moves by at most `f sqrt(1 + u^2 + v^2) / z` pixels a
    /// metre. What is displaced by `e` towards the camera has a parallax of another depth: `f travel e /
    /// z^2`, along a surface that is turned by up to 75 degrees four times that.
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

/// What an ideal frame draws of a scene's models.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct ModelDetail {
    /// Meshes that may be in view.
    pub meshes: u64,
    /// Their triangles, at the level of detail of each.
    pub triangles: u64,
    /// Their triangles at the finest level.
    pub finest_triangles: u64,
}

impl ModelDetail {
    /// The choice that the renderer makes.
    #[must_use]
    pub fn new(scene: &Scene, levels: &SceneLevels, pose: &CameraPose, tolerance: &LevelTolerance) -> Self {
        let bounds = scene.mesh_bounds();
        let mut found = Self::default();
        for i in in_view(&bounds, pose, tolerance.tangents) {
            let (mesh, bounds) = (&scene.meshes[i as usize], &bounds[i as usize]);
            let levels = levels.of(&mesh.shape);
            let level = levels.within(tolerance.error_m(bounds, pose) / level_stretch(mesh));
            found.meshes += 1;
            found.triangles += levels.levels()[level].indices.len() as u64 / 3;
            found.finest_triangles += mesh.shape.indices.len() as u64 / 3;
        }
        found
    }
}

/// By how much a mesh stretches what its shape's levels are away from it. More than anything where light
/// falls on a shape that is stretched in one direction more than in another: its normals turn towards each
/// other and apart then, of which the levels know nothing.
#[must_use]
pub fn level_stretch(mesh: &Mesh) -> f64 {
    let largest = stretch(&mesh.ned_from_shape);
    let even = mesh.ned_from_shape.determinant().abs().cbrt();
    if mesh.shape.has_normals() && largest > (1.0 + 1e-5) * even { f64::INFINITY } else { largest }
}

/// Largest factor by which a matrix stretches anything: exact where it turns and scales, else a bound.
#[must_use]
pub fn stretch(matrix: &DMat3) -> f64 {
    let square = matrix.transpose() * *matrix;
    (0..3).map(|axis| square.row(axis).abs().element_sum()).fold(0.0, f64::max).sqrt()
}

#[cfg(test)]
mod tests;
