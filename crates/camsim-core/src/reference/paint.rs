//! The colour of what a ray meets: texture bilinear in linear light at full resolution, fog, sky.

use std::sync::Arc;

use glam::DVec3;

use super::Hit;
use crate::scene::{Encoding, Scene, Texture, Wrap};

/// What is left of a contrast at the visibility range: 2 %, whose logarithm is -3.912.
const FOG_AT_VISIBILITY: f64 = 3.912;

/// The colours of a scene.
#[derive(Debug)]
pub(super) struct Paint {
    /// By surface number.
    surfaces: Vec<Option<Coat>>,
    sky: DVec3,
    fog_per_m: f64,
}

#[derive(Debug)]
struct Coat {
    texture: Arc<Texture>,
    wrap: Wrap,
    linear: [f64; 256],
}

impl Paint {
    pub(super) fn new(scene: &Scene) -> Self {
        let ground = scene.terrain.as_ref().map(|terrain| Coat::new(&terrain.texture, Wrap::Clamp));
        let meshes = scene.meshes.iter().map(|mesh| Some(Coat::new(&mesh.texture, mesh.wrap)));
        Self {
            surfaces: std::iter::once(ground).chain(meshes).collect(),
            sky: DVec3::from_array(scene.sky_linear.map(f64::from)),
            fog_per_m: scene.fog_visibility_m.map_or(0.0, |visibility_m| FOG_AT_VISIBILITY / visibility_m),
        }
    }

    /// Linear light that arrives along a ray whose depth has the unit `range_per_depth`.
    pub(super) fn color(&self, hit: Option<&Hit>, range_per_depth: f64) -> DVec3 {
        let Some((hit, coat)) = hit.and_then(|hit| Some((hit, self.surfaces.get(hit.surface as usize)?.as_ref()?))) else {
            return self.sky;
        };
        let color = coat.at(hit.texture_uv);
        if self.fog_per_m > 0.0 {
            let clear = (-self.fog_per_m * hit.depth_m * range_per_depth).exp();
            self.sky + clear * (color - self.sky)
        } else {
            color
        }
    }
}

impl Coat {
    fn new(texture: &Arc<Texture>, wrap: Wrap) -> Self {
        let linear = std::array::from_fn(|byte| {
            let stored = byte as f64 / 255.0;
            match texture.encoding {
                Encoding::Linear => stored,
                Encoding::Srgb if stored <= 0.040_45 => stored / 12.92,
                Encoding::Srgb => ((stored + 0.055) / 1.055).powf(2.4),
            }
        });
        Self { texture: texture.clone(), wrap, linear }
    }

    /// Bilinear between texel centres.
    fn at(&self, [u, v]: [f64; 2]) -> DVec3 {
        let [width, height] = self.texture.size_px;
        let (x0, x1, tx) = self.axis(u, width);
        let (y0, y1, ty) = self.axis(v, height);
        let top = self.texel(x0, y0) * (1.0 - tx) + self.texel(x1, y0) * tx;
        let bottom = self.texel(x0, y1) * (1.0 - tx) + self.texel(x1, y1) * tx;
        top * (1.0 - ty) + bottom * ty
    }

    /// The two texels about a coordinate, and the share of the second.
    fn axis(&self, coordinate: f64, size: u32) -> (usize, usize, f64) {
        let at = coordinate * f64::from(size) - 0.5;
        let at = if at.is_finite() { at } else { 0.0 };
        let below = at.floor();
        let wrapped = |texel: f64| match self.wrap {
            Wrap::Clamp => texel.clamp(0.0, f64::from(size) - 1.0) as usize,
            Wrap::Repeat => (texel.rem_euclid(f64::from(size)) as usize).min(size as usize - 1),
        };
        (wrapped(below), wrapped(below + 1.0), at - below)
    }

    fn texel(&self, x: usize, y: usize) -> DVec3 {
        let at = 4 * (y * self.texture.size_px[0] as usize + x);
        let rgb = &self.texture.rgba8[at..at + 3];
        DVec3::new(self.linear[rgb[0] as usize], self.linear[rgb[1] as usize], self.linear[rgb[2] as usize])
    }
}
