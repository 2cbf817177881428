//! Colour of a hit: texture, bilinear in linear light at full resolution, then fog and sky.

use std::sync::Arc;

use glam::DVec3;

use super::Hit;
use crate::scene::{Encoding, Material, Scene, Texture, Wrap};

/// Contrast left at the visibility range: 2 %, whose logarithm is -3.912 (Koschmieder).
const FOG_AT_VISIBILITY: f64 = 3.912;

/// Colours of a scene.
#[derive(Debug)]
pub(super) struct Shading {
    /// By surface index.
    surfaces: Vec<Option<SurfaceTexture>>,
    sky: DVec3,
    fog_per_m: f64,
}

/// Texture and material of a surface.
#[derive(Debug)]
pub(super) struct SurfaceTexture {
    texture: Arc<Texture>,
    wrap: [Wrap; 2],
    nearest: bool,
    emissive: DVec3,
    linear: [f64; 256],
}

impl Shading {
    pub(super) fn new(scene: &Scene) -> Self {
        let ground = scene
            .terrain
            .as_ref()
            .map(|terrain| SurfaceTexture::new(&Material::picture(terrain.texture.clone(), Wrap::Clamp)));
        let meshes = scene.meshes.iter().map(|mesh| Some(SurfaceTexture::new(&mesh.material)));
        Self {
            surfaces: std::iter::once(ground).chain(meshes).collect(),
            sky: DVec3::from_array(scene.sky_linear.map(f64::from)),
            fog_per_m: scene.fog_visibility_m.map_or(0.0, |visibility_m| FOG_AT_VISIBILITY / visibility_m),
        }
    }

    /// Linear light along a ray. `range_per_depth` is the slant range per unit of planar depth.
    pub(super) fn color(&self, hit: Option<&Hit>, range_per_depth: f64) -> DVec3 {
        let Some((hit, coat)) =
            hit.and_then(|hit| Some((hit, self.surfaces.get(hit.surface as usize)?.as_ref()?)))
        else {
            return self.sky;
        };
        let color = DVec3::from_array(hit.tint) * coat.color_at(hit.texture_uv) + coat.emissive;
        if self.fog_per_m > 0.0 {
            let clear = (-self.fog_per_m * hit.depth_m * range_per_depth).exp();
            self.sky + clear * (color - self.sky)
        } else {
            color
        }
    }
}

impl SurfaceTexture {
    pub(super) fn new(material: &Material) -> Self {
        let linear = std::array::from_fn(|byte| {
            let stored = byte as f64 / 255.0;
            match material.texture.encoding {
                Encoding::Linear => stored,
                Encoding::Srgb if stored <= 0.040_45 => stored / 12.92,
                Encoding::Srgb => ((stored + 0.055) / 1.055).powf(2.4),
            }
        });
        let emissive = DVec3::from_array(material.emissive.map(f64::from));
        Self {
            texture: material.texture.clone(),
            wrap: material.wrap,
            nearest: material.nearest,
            emissive,
            linear,
        }
    }

    fn color_at(&self, uv: [f64; 2]) -> DVec3 {
        self.read(uv, |pixel| {
            DVec3::new(
                self.linear[pixel[0] as usize],
                self.linear[pixel[1] as usize],
                self.linear[pixel[2] as usize],
            )
        })
    }

    /// Alpha at texture coordinates, 0..=1.
    pub(super) fn alpha_at(&self, uv: [f64; 2]) -> f64 {
        self.read(uv, |pixel| DVec3::splat(f64::from(pixel[3]) / 255.0)).x
    }

    /// Bilinear between texel centres, or the nearest texel.
    fn read(&self, [u, v]: [f64; 2], value: impl Fn(&[u8]) -> DVec3) -> DVec3 {
        let [width, height] = self.texture.size_px;
        let texel = |x: usize, y: usize| {
            let first_byte = 4 * (y * width as usize + x);
            value(&self.texture.rgba8[first_byte..first_byte + 4])
        };
        let (x0, x1, tx) = self.axis(u, width, self.wrap[0]);
        let (y0, y1, ty) = self.axis(v, height, self.wrap[1]);
        if self.nearest {
            return texel(if tx < 0.5 { x0 } else { x1 }, if ty < 0.5 { y0 } else { y1 });
        }
        let top = texel(x0, y0) * (1.0 - tx) + texel(x1, y0) * tx;
        let bottom = texel(x0, y1) * (1.0 - tx) + texel(x1, y1) * tx;
        top * (1.0 - ty) + bottom * ty
    }

    /// The two texels around a coordinate, and the weight of the second.
    fn axis(&self, coordinate: f64, size: u32, wrap: Wrap) -> (usize, usize, f64) {
        let texel = coordinate * f64::from(size) - 0.5;
        let texel = if texel.is_finite() { texel } else { 0.0 };
        let below = texel.floor();
        (wrap.texel(below, size), wrap.texel(below + 1.0, size), texel - below)
    }
}
