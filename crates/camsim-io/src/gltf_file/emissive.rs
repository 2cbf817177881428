//! Textures of base colour and emissive light, and their sum as one texture.

use std::sync::Arc;

use camsim_core::scene::{Encoding, Texture, Wrap, linear_from_srgb, srgb_from_linear};

use super::material::VertexRule;

/// A texture with its sampler and its texture coordinates.
#[derive(Clone, Debug)]
pub(super) struct Layer {
    pub texture: Arc<Texture>,
    pub wrap: [Wrap; 2],
    pub nearest: bool,
    /// Texture coordinates.
    pub rule: VertexRule,
    /// Linear value, 0 to 1, of each stored byte.
    linear_from_byte: Arc<[f32; 256]>,
}

impl Layer {
    pub fn new(texture: Arc<Texture>, wrap: [Wrap; 2], nearest: bool, rule: VertexRule) -> Self {
        let stored = |byte: usize| byte as f32 / 255.0;
        let is_srgb = texture.encoding == Encoding::Srgb;
        let linear_from_byte =
            std::array::from_fn(|byte| if is_srgb { linear_from_srgb(stored(byte)) } else { stored(byte) });
        Self { texture, wrap, nearest, rule, linear_from_byte: Arc::new(linear_from_byte) }
    }

    /// Linear red, green, blue and alpha of a texel, 0 to 1.
    fn texel(&self, index: usize) -> [f32; 4] {
        let byte = |k: usize| self.texture.rgba8.get(4 * index + k).copied().unwrap_or_default();
        let linear = |k: usize| self.linear_from_byte[usize::from(byte(k))];
        [linear(0), linear(1), linear(2), f32::from(byte(3)) / 255.0]
    }

    /// Linear red, green, blue and alpha at texture coordinates, bilinear or nearest as the sampler says.
    pub fn sample(&self, uv: [f64; 2]) -> [f32; 4] {
        let size = self.texture.size_px;
        let texel = |x: f64, y: f64| {
            self.texel(self.wrap[1].texel(y, size[1]) * size[0] as usize + self.wrap[0].texel(x, size[0]))
        };
        let [x, y] = [0, 1].map(|k| uv[k] * f64::from(size[k]));
        if self.nearest {
            return texel(x.floor(), y.floor());
        }
        let [x, y] = [x - 0.5, y - 0.5];
        let (fraction_x, fraction_y) = ((x - x.floor()) as f32, (y - y.floor()) as f32);
        let row = |y: f64| mix(texel(x.floor(), y), texel(x.floor() + 1.0, y), fraction_x);
        mix(row(y.floor()), row(y.floor() + 1.0), fraction_y)
    }
}

fn mix(a: [f32; 4], b: [f32; 4], fraction: f32) -> [f32; 4] {
    std::array::from_fn(|k| a[k] + fraction * (b[k] - a[k]))
}

/// sRGB bytes of `factor * base + emissive_factor * emissive` (linear), clamped to white; alpha is the
/// base's.
pub(super) fn stored_color(
    base: [f32; 4],
    factor: [f32; 3],
    emissive: [f32; 4],
    emissive_factor: [f32; 3],
) -> [u8; 4] {
    let byte = |value: f32| (255.0 * value.clamp(0.0, 1.0)).round() as u8;
    let color = |k: usize| {
        byte(srgb_from_linear((factor[k] * base[k] + emissive_factor[k] * emissive[k]).clamp(0.0, 1.0)))
    };
    [color(0), color(1), color(2), byte(base[3])]
}

/// `base_factor * base + emissive_factor * emissive` of two layers with the same texture coordinates and
/// sampler; alpha is the base's. Each side of the result is as long as the larger texture's.
pub(super) fn add_emissive(
    base: &Layer,
    base_factor: [f32; 3],
    emissive: &Layer,
    emissive_factor: [f32; 3],
) -> Texture {
    let size_px: [u32; 2] = std::array::from_fn(|k| base.texture.size_px[k].max(emissive.texture.size_px[k]));
    let mut rgba8 = Vec::with_capacity(4 * size_px[0] as usize * size_px[1] as usize);
    for y in 0..size_px[1] {
        for x in 0..size_px[0] {
            let uv =
                [(f64::from(x) + 0.5) / f64::from(size_px[0]), (f64::from(y) + 0.5) / f64::from(size_px[1])];
            let index = y as usize * size_px[0] as usize + x as usize;
            let texel = |layer: &Layer| {
                if layer.texture.size_px == size_px { layer.texel(index) } else { layer.sample(uv) }
            };
            rgba8.extend(stored_color(texel(base), base_factor, texel(emissive), emissive_factor));
        }
    }
    Texture { size_px, rgba8, encoding: Encoding::Srgb }
}

#[cfg(test)]
pub(super) mod tests;
