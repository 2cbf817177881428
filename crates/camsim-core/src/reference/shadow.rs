//! Shadows: a ray from a hit to the sun, through everything where it is at the ray's own instant.

use super::{Hit, ReferenceRenderer, ray::Ray};

/// How far above its surface a ray to the sun begins, metres: more than rounding, less than anything shows.
const LIFT_M: f64 = 1e-6;

impl ReferenceRenderer {
    /// A hit with the light that it has at path time `t_s`: without the sun where that is hidden.
    pub(super) fn in_light(&self, t_s: f64, hit: Hit) -> Hit {
        if hit.sky_fraction < 1.0 && self.is_in_shadow(t_s, &hit) {
            Hit { tint: hit.tint.map(|part| part * hit.sky_fraction), sky_fraction: 1.0, ..hit }
        } else {
            hit
        }
    }

    /// Whether the sun is hidden from a hit at path time `t_s`, on the side that the ray came from: by the
    /// surface itself, by the terrain, or by surfaces that have depth, whichever side they show. False in a
    /// scene without shadows.
    #[must_use]
    pub fn is_in_shadow(&self, t_s: f64, hit: &Hit) -> bool {
        let scene = &self.sequence.scene;
        let Some(light) = scene.light.filter(|light| light.shadows) else { return false };
        if hit.normal_ned.dot(light.to_sun_ned) <= 0.0 {
            return true;
        }
        let Some(ray) = Ray::new(hit.point_ned_m + LIFT_M * hit.normal_ned, light.to_sun_ned) else {
            return false;
        };
        let ground = scene.terrain.as_ref().zip(self.scene.terrain_pyramid.as_ref());
        ground.is_some_and(|(terrain, terrain_pyramid)| terrain_pyramid.blocks(terrain, &ray))
            || self.scene.mesh_bvh.blocks(&ray)
            || self.scene.moving.iter().any(|meshes| meshes.blocks(&ray, t_s))
    }
}
