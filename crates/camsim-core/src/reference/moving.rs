//! Ray casting against meshes that move: the ray is taken to where they were at path time 0.

use std::sync::Arc;

use super::{
    Hit,
    mesh_bvh::{BlendLayer, MeshBvh},
    ray::Ray,
};
use crate::scene::{Light, Mesh, RigidMotion};

/// Meshes that move together.
#[derive(Debug)]
pub(super) struct MovingMeshes {
    motion: Arc<RigidMotion>,
    /// As they stand at path time 0.
    bvh: MeshBvh,
}

/// All meshes of a scene that move, by their motions.
pub(super) fn moving_meshes(meshes: &[Mesh], light: Option<Light>) -> Vec<MovingMeshes> {
    let mut motions: Vec<Arc<RigidMotion>> = Vec::new();
    for motion in meshes.iter().filter_map(|mesh| mesh.motion.as_ref()) {
        if !motions.iter().any(|known| Arc::ptr_eq(known, motion)) {
            motions.push(motion.clone());
        }
    }
    let group = |motion: Arc<RigidMotion>| {
        let belongs = |mesh: &Mesh| mesh.motion.as_ref().is_some_and(|its| Arc::ptr_eq(its, &motion));
        MovingMeshes { bvh: MeshBvh::new(meshes, light, belongs), motion }
    };
    motions.into_iter().map(group).collect()
}

impl MovingMeshes {
    /// First intersection at path time `t_s`, before `limit`; of opaque surfaces only if `solid`.
    pub(super) fn first(&self, ray: &Ray, t_s: f64, limit: f64, solid: bool) -> Option<Hit> {
        let back = self.ray_at_start(ray, t_s)?;
        let hit = if solid { self.bvh.first_solid(&back, limit) } else { self.bvh.first(&back, limit) };
        hit.map(|hit| now(hit, ray))
    }

    /// All intersections with blended surfaces at path time `t_s`, before `limit`.
    pub(super) fn layers(&self, ray: &Ray, t_s: f64, limit: f64) -> Vec<BlendLayer> {
        let Some(back) = self.ray_at_start(ray, t_s) else { return Vec::new() };
        let mut layers = self.bvh.layers(&back, limit);
        layers.iter_mut().for_each(|layer| layer.hit = now(layer.hit, ray));
        layers
    }

    /// The ray relative to the meshes, which are then where they were at path time 0. Its parameter stays.
    fn ray_at_start(&self, ray: &Ray, t_s: f64) -> Option<Ray> {
        let state = self.motion.state(t_s);
        let direction = state.rotation.conjugate() * ray.direction;
        let back = Ray::new(state.point_at_start(ray.origin), direction)?;
        Some(back.turned_by(state.rotation))
    }
}

/// A hit with its point where it is now.
fn now(hit: Hit, ray: &Ray) -> Hit {
    Hit { point_ned_m: ray.origin + hit.depth_m * ray.direction, ..hit }
}
