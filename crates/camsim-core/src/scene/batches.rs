//! Meshes of one shape and material, which are drawn together, and how much detail a camera needs of each.

use std::{collections::HashMap, ops::Range, sync::Arc};

use glam::{DMat3, DVec3};

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
    /// of detail side by side; and for each batch and level its range of that list.
    #[must_use]
    pub fn in_view(&self, pose: &CameraPose, tolerance: &LodTolerance) -> (Vec<u32>, Vec<Vec<Range<u32>>>) {
        let mut visible = in_view(&self.bounds, pose, tolerance.tangents);
        let position = |visible: &[u32], member: u32| visible.partition_point(|&i| i < member);
        let ranges: Vec<_> = self
            .batches
            .iter()
            .map(|batch| position(&visible, batch.members.start)..position(&visible, batch.members.end))
            .collect();
        let by_level = self
            .batches
            .iter()
            .zip(ranges)
            .map(|(batch, range)| {
                self.sort_by_level(batch, &mut visible[range.clone()], range.start, pose, tolerance)
            })
            .collect();
        (visible, by_level)
    }

    /// Sorts the visible meshes of a batch by level of detail; gives the range of each level.
    fn sort_by_level(
        &self,
        batch: &Batch,
        visible: &mut [u32],
        first: usize,
        pose: &CameraPose,
        tolerance: &LodTolerance,
    ) -> Vec<Range<u32>> {
        let count = batch.levels.levels().len();
        let level = |&i: &u32| match count {
            0 | 1 => 0,
            _ => batch.levels.coarsest_within(
                tolerance.error_m(&self.bounds[i as usize], pose) / self.placed[i as usize].stretch,
            ),
        };
        visible.sort_by_cached_key(level);
        let levels: Vec<usize> = visible.iter().map(level).collect();
        let position = |level: usize| (first + levels.partition_point(|&other| other < level)) as u32;
        (0..count).map(|level| position(level)..position(level + 1)).collect()
    }
}
