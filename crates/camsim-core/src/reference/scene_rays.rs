//! Light along single rays.

use glam::DVec3;

use super::{Hit, Ray, ReferenceRenderer, limit_of};

impl ReferenceRenderer {
    /// Whether the scene has blended surfaces.
    pub(crate) fn has_blended(&self) -> bool {
        self.scene.blends
    }

    /// First intersection of a ray, with the light that it has at path time `t_s`.
    pub(crate) fn lit(&self, t_s: f64, origin_ned_m: DVec3, direction_ned: DVec3) -> Option<Hit> {
        self.cast_at(t_s, origin_ned_m, direction_ned).map(|hit| self.in_light(t_s, hit))
    }

    /// Light of a hit along a ray of length 1, or of the sky.
    pub(crate) fn light_of(&self, hit: Option<&Hit>) -> DVec3 {
        self.scene.shading.color(hit, 1.0)
    }

    /// Linear light along `direction` at path time `t_s`: of the first opaque surface and of every blended layer in
    /// front of it, composited by alpha. `range_per_depth` is the length of `direction`.
    pub(crate) fn radiance_along(
        &self,
        t_s: f64,
        origin_ned_m: DVec3,
        direction: DVec3,
        range_per_depth: f64,
    ) -> DVec3 {
        if !self.scene.blends {
            let hit = self.cast_at(t_s, origin_ned_m, direction).map(|hit| self.in_light(t_s, hit));
            return self.scene.shading.color(hit.as_ref(), range_per_depth);
        }
        let Some(ray) = Ray::new(origin_ned_m, direction) else {
            return self.scene.shading.color(None, range_per_depth);
        };
        let terrain_hit = self.cast_terrain(&ray);
        let solid = self.scene.mesh_bvh.first_solid(&ray, limit_of(terrain_hit)).or(terrain_hit);
        let solid = self.nearer_moving(&ray, t_s, solid, true);
        let mut layers = self.scene.mesh_bvh.layers(&ray, limit_of(solid));
        layers.extend(self.scene.moving.iter().flat_map(|meshes| meshes.layers(&ray, t_s, limit_of(solid))));
        // Front to back: each layer attenuates the light from behind.
        layers.sort_by(|a, b| a.hit.depth_m.total_cmp(&b.hit.depth_m));
        let (mut sum, mut left) = (DVec3::ZERO, 1.0);
        for layer in &layers {
            let alpha = layer.alpha.clamp(0.0, 1.0);
            sum += left
                * alpha
                * self.scene.shading.color(Some(&self.in_light(t_s, layer.hit)), range_per_depth);
            left *= 1.0 - alpha;
        }
        let solid = solid.map(|hit| self.in_light(t_s, hit));
        sum + left * self.scene.shading.color(solid.as_ref(), range_per_depth)
    }
}
