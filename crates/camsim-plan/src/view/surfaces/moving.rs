//! Rays that meet what moves: they are taken to where it was at path time 0.

use std::sync::Arc;

use camsim_core::scene::{Aabb, Mesh, RigidMotion, Scene, ray_bvh::RayBvh};
use glam::DVec3;

use super::{SurfaceHit, Surfaces};

/// Meshes that move together and may have depth.
#[derive(Debug)]
pub(super) struct MovingMeshes {
    motion: Arc<RigidMotion>,
    /// Indices in the scene.
    meshes: Vec<usize>,
    /// Boxes around them at path time 0.
    tree: RayBvh,
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

impl Surfaces {
    /// `hit`, or what moves in front of it and before `limit`.
    pub(super) fn nearer_moving(
        &self,
        t_s: f64,
        origin_ned_m: DVec3,
        direction_ned: DVec3,
        limit: f64,
        hit: Option<SurfaceHit>,
    ) -> Option<SurfaceHit> {
        self.moving.iter().fold(hit, |hit, group| {
            let state = group.motion.state(t_s);
            let origin = state.point_at_start(origin_ned_m);
            let direction = state.rotation.conjugate() * direction_ned;
            let meet = |k: u32, limit: f64| {
                let i = group.meshes[k as usize];
                self.triangle_hit(i, origin, direction, limit).map(|(t, on)| (t, (i, on)))
            };
            let limit = hit.map_or(limit, |hit| hit.depth_m);
            let Some((depth_m, (i, (corners, weights)))) = group.tree.first(origin, direction, limit, meet)
            else {
                return hit;
            };
            let now = self.scene.meshes[i].at(t_s);
            Some(self.hit_on(&now, i, depth_m, corners, weights, direction_ned))
        })
    }
}
