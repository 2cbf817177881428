//! Meshes that move, prepared for rays that are taken to where these were at path time 0.

use std::sync::Arc;

use camsim_core::scene::{Aabb, Mesh, RigidMotion, Scene, ray_bvh::RayBvh};

/// Meshes that move together and may have depth.
#[derive(Debug)]
pub(super) struct MovingMeshes {
    pub motion: Arc<RigidMotion>,
    /// Indices in the scene.
    pub meshes: Vec<usize>,
    /// Boxes around them at path time 0.
    pub tree: RayBvh,
}

/// All meshes that move and that `counts`, by their motions.
pub(super) fn moving_meshes(scene: &Scene, counts: &dyn Fn(&Mesh) -> bool) -> Vec<MovingMeshes> {
    let mut groups: Vec<(Arc<RigidMotion>, Vec<usize>)> = Vec::new();
    for (i, mesh) in scene.meshes.iter().enumerate().filter(|(_, mesh)| counts(mesh)) {
        let Some(motion) = &mesh.motion else { continue };
        match groups.iter_mut().find(|(known, _)| Arc::ptr_eq(known, motion)) {
            Some((_, meshes)) => meshes.push(i),
            None => groups.push((motion.clone(), vec![i])),
        }
    }
    let prepared = |(motion, meshes): (Arc<RigidMotion>, Vec<usize>)| {
        let boxes: Vec<Aabb> = meshes.iter().map(|&i| scene.meshes[i].bounds()).collect();
        MovingMeshes { motion, tree: RayBvh::new(&boxes), meshes }
    };
    groups.into_iter().map(prepared).collect()
}
