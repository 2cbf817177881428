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
        hit.map(|hit| now(hit, ray, &back))
    }

    /// Whether a ray meets a surface that has depth at path time `t_s`.
    pub(super) fn blocks(&self, ray: &Ray, t_s: f64) -> bool {
        self.ray_at_start(ray, t_s).is_some_and(|back| self.bvh.blocks(&back))
    }

    /// All intersections with blended surfaces at path time `t_s`, before `limit`.
    pub(super) fn layers(&self, ray: &Ray, t_s: f64, limit: f64) -> Vec<BlendLayer> {
        let Some(back) = self.ray_at_start(ray, t_s) else { return Vec::new() };
        let mut layers = self.bvh.layers(&back, limit);
        layers.iter_mut().for_each(|layer| layer.hit = now(layer.hit, ray, &back));
        layers
    }

    /// The ray relative to the meshes, which are then where they were at path time 0. Its parameter stays.
    fn ray_at_start(&self, ray: &Ray, t_s: f64) -> Option<Ray> {
        let state = self.motion.state(t_s);
        let direction = state.rotation.conjugate() * ray.direction;
        let mut back = Ray::new(state.point_at_start(ray.origin), direction)?;
        back.ned_from_ray = Some(state.rotation);
        Some(back)
    }
}

/// A hit of the ray `back` with its point and its normal as they are now.
fn now(hit: Hit, ray: &Ray, back: &Ray) -> Hit {
    let normal_ned = back.ned_from_ray.map_or(hit.normal_ned, |turn| turn * hit.normal_ned);
    Hit { point_ned_m: ray.origin + hit.depth_m * ray.direction, normal_ned, ..hit }
}
