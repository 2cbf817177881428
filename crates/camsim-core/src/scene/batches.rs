//! Meshes of one shape and material, which are drawn together, and how much detail a camera needs of each.

use std::{collections::HashMap, ops::Range, sync::Arc};

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::{
    Aabb, Light, LodTolerance, Material, Mesh, Scene, SceneLods, Shape, ShapeLods, in_view,
    mesh_lod::lod_stretch,
};
use crate::pose::CameraPose;

/// All meshes of a scene, by batches.
#[derive(Debug)]
pub struct SceneBatches {
    /// By shape and material, in the order of the scene's first mesh of each.
    pub batches: Vec<Batch>,
    /// Poses of all meshes, those of a batch one after the other.
    pub placed: Vec<PlacedShape>,
    /// Boxes around them, NED.
    pub bounds: Vec<Aabb>,
}

/// Meshes of one shape and material.
#[derive(Clone, Debug)]
pub struct Batch {
    /// The shape.
    pub shape: Arc<Shape>,
    /// Its coarser versions.
    pub levels: Arc<ShapeLods>,
    /// What covers it.
    pub material: Material,
    /// The light that falls on it; none where the shape has no normals.
    pub light: Option<Light>,
    /// Its meshes in [`SceneBatches::placed`].
    pub members: Range<u32>,
}

/// Pose of a mesh.
#[derive(Clone, Debug)]
pub struct PlacedShape {
    /// NED position of the shape's origin, metres.
    pub origin_ned_m: DVec3,
    /// From the shape's axes to NED.
    pub ned_from_shape: DMat3,
    /// Largest factor by which the mesh is longer than its shape: [`lod_stretch`].
    pub stretch: f64,
}

impl SceneBatches {
    /// Groups the meshes of a scene.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        let mut groups: Vec<(&Mesh, Vec<usize>)> = Vec::new();
        let mut known: HashMap<*const Shape, Vec<usize>> = HashMap::new();
        for (i, mesh) in scene.meshes.iter().enumerate() {
            let of_shape = known.entry(Arc::as_ptr(&mesh.shape)).or_default();
            match of_shape.iter().find(|&&group| groups[group].0.material.is_same_as(&mesh.material)) {
                Some(&group) => groups[group].1.push(i),
                None => {
                    of_shape.push(groups.len());
                    groups.push((mesh, vec![i]));
                }
            }
        }
        let levels = SceneLods::new(scene);
        let (mut batches, mut order) = (Vec::new(), Vec::new());
        for (mesh, members) in groups {
            let first = order.len() as u32;
            order.extend(members);
            batches.push(Batch {
                shape: mesh.shape.clone(),
                levels: levels.shape_lods(&mesh.shape),
                material: mesh.material.clone(),
                light: scene.light.filter(|_| mesh.shape.has_normals()),
                members: first..order.len() as u32,
            });
        }
        let meshes = || order.iter().filter_map(|&i| scene.meshes.get(i));
        let place = |mesh: &Mesh| {
            let &Mesh { origin_ned_m, ned_from_shape, .. } = mesh;
            PlacedShape { origin_ned_m, ned_from_shape, stretch: lod_stretch(mesh) }
        };
        Self { batches, placed: meshes().map(place).collect(), bounds: meshes().map(Mesh::bounds).collect() }
    }

    /// Indices into [`SceneBatches::placed`] of the meshes that may be in view, those of one batch and level
    /// of detail side by side; and for each batch its range of that list by level, up to the coarsest of them.
    #[must_use]
    pub fn in_view(&self, pose: &CameraPose, tolerance: &LodTolerance) -> (Vec<u32>, Vec<Vec<Range<u32>>>) {
        let visible = in_view(&self.bounds, pose, tolerance.tangents);
        let position = |member: u32| visible.partition_point(|&i| i < member);
        let error_m =
            |i: u32| tolerance.error_m(&self.bounds[i as usize], pose) / self.placed[i as usize].stretch;
        // In parallel, since shapes are simplified when a coarser level may first be drawn.
        let by_level = self.batches.par_iter().map(|Batch { levels, members, .. }| {
            let visible = &visible[position(members.start)..position(members.end)];
            let mut by_level: Vec<_> =
                visible.iter().map(|&i| (levels.coarsest_within(error_m(i)), i)).collect();
            by_level.sort_unstable();
            by_level
        });
        let by_level: Vec<Vec<(usize, u32)>> = by_level.collect();
        let mut first = 0;
        let ranges = by_level.iter().map(|of_batch| {
            let position =
                |level: usize| (first + of_batch.partition_point(|&(other, _)| other < level)) as u32;
            let count = of_batch.last().map_or(0, |(coarsest, _)| coarsest + 1);
            let ranges = (0..count).map(|level| position(level)..position(level + 1)).collect();
            first += of_batch.len();
            ranges
        });
        let ranges = ranges.collect();
        (by_level.into_iter().flatten().map(|(_, i)| i).collect(), ranges)
    }
}
