//! Textures with their mip levels, and filtered reads of them. Twin of
//! `camsim-gpu/shaders/ideal/surface.wgsl`, `camsim-gpu/shaders/ideal/prefilter` and
//! `camsim-gpu/shaders/ideal/texture`.

use std::{collections::HashMap, sync::Arc};

use camsim_core::scene::{Encoding, Prefilter, Scene, TexelForm, Texture, Wrap};
use glam::{DVec2, Vec4};
use rayon::prelude::*;

/// A texture and its mip levels, as linear light when read.
#[derive(Debug)]
pub(super) struct MipChain {
    texture: Arc<Texture>,
    /// Linear light of each byte of colour.
    light: [f32; 256],
    /// Levels 1, 2, ... down to one texel.
    levels: Vec<MipTexels>,
}

#[derive(Debug)]
struct MipTexels {
    size_px: [u32; 2],
    /// Bits of half floats of linear R G B A, not premultiplied.
    texels: Vec<[u16; 4]>,
}

/// How a texture is continued beyond its borders and read between its texels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sampling {
    pub wrap: [Wrap; 2],
    /// Whether the full-size picture is read at its nearest texel.
    pub nearest: bool,
    /// Whether reads are averaged weighted by alpha, as blended surfaces need it.
    pub premultiplied: bool,
}

/// The textures of the terrain and of all meshes; surfaces of one texture have it in common.
pub(super) fn of_scene(scene: &Scene) -> Vec<Arc<MipChain>> {
    let none = || (Arc::new(Texture::uniform([0, 0, 0, 255], Encoding::Linear)), None);
    let ground = scene.terrain.as_ref().map(|terrain| (terrain.texture.clone(), terrain.beyond));
    let textures: Vec<_> = std::iter::once(ground.unwrap_or_else(none))
        .chain(scene.meshes.iter().map(|mesh| (mesh.material.texture.clone(), None)))
        .collect();
    let (mut numbers, mut distinct) = (HashMap::new(), Vec::new());
    let number = |(texture, border): &(Arc<Texture>, Option<[u8; 4]>)| {
        *numbers.entry((Arc::as_ptr(texture), *border)).or_insert_with(|| {
            distinct.push((texture.clone(), *border));
            distinct.len() - 1
        })
    };
    let numbers: Vec<usize> = textures.iter().map(number).collect();
    let mips = |(texture, border): &_| Arc::new(MipChain::new(texture, *border));
    let distinct: Vec<Arc<MipChain>> = distinct.par_iter().map(mips).collect();
    numbers.into_iter().map(|number| distinct[number].clone()).collect()
}

impl MipChain {
    /// With `border`, the mip levels have a border of that colour (R G B A as stored).
    pub fn new(texture: &Arc<Texture>, border: Option<[u8; 4]>) -> Self {
        let halves = |texels: &[u8]| {
            let of_texel = |bytes: &[u8; 8]| {
                [0, 1, 2, 3].map(|k: usize| u16::from_ne_bytes([bytes[2 * k], bytes[2 * k + 1]]))
            };
            texels.as_chunks::<8>().0.iter().map(of_texel).collect()
        };
        let levels = texture.mips_with_border(TexelForm::Light, border);
        let levels = levels.iter().map(|mip| MipTexels { size_px: mip.size_px, texels: halves(&mip.texels) });
        Self { texture: texture.clone(), light: texture.encoding.decode_table(), levels: levels.collect() }
    }

    /// Width and height of the full-size picture.
    pub fn size(&self) -> DVec2 {
        DVec2::from_array(self.texture.size_px.map(f64::from))
    }

    /// Whether it is one colour all over.
    pub fn is_uniform(&self) -> bool {
        self.texture.size_px == [1, 1]
    }

    /// Mean over the reads of a filter around a position, linear R G B A.
    pub fn filtered(&self, uv: DVec2, filter: &Prefilter, sampling: Sampling) -> Vec4 {
        let (level, per_texel) = (filter.level(), self.size().recip());
        let (mut sum, mut count) = (Vec4::ZERO, 0.0);
        for offset in filter.offsets() {
            sum += self.read(uv + offset * per_texel, level, sampling);
            count += 1.0;
        }
        sum / count
    }

    /// Linear R G B A between two mip levels.
    pub fn read(&self, uv: DVec2, level: f64, sampling: Sampling) -> Vec4 {
        let last = self.levels.len();
        let level = level.max(0.0).min(last as f64);
        let (below, fraction) = (level.floor() as usize, level.fract() as f32);
        let mut color = self.read_level(uv, below, sampling);
        // Nearest texels are those of the full-size picture when that alone is read.
        if fraction > 0.0 {
            let smoothed = Sampling { nearest: false, ..sampling };
            if sampling.nearest && below == 0 {
                color = self.read_level(uv, 0, smoothed);
            }
            color = color.lerp(self.read_level(uv, below + 1, smoothed), fraction);
        }
        match sampling.premultiplied {
            true => (color.truncate() * color.w).extend(color.w),
            false => color,
        }
    }

    fn read_level(&self, uv: DVec2, level: usize, sampling: Sampling) -> Vec4 {
        match level.checked_sub(1).and_then(|k| self.levels.get(k)) {
            None => {
                let bytes = self.texture.rgba8.as_chunks::<4>().0;
                bilinear(uv, self.texture.size_px, sampling, |i| {
                    let [r, g, b, a] = bytes[i].map(usize::from);
                    Vec4::new(self.light[r], self.light[g], self.light[b], a as f32 / 255.0)
                })
            }
            Some(MipTexels { size_px, texels }) => {
                let smoothed = Sampling { nearest: false, ..sampling };
                bilinear(uv, *size_px, smoothed, |i| Vec4::from_array(texels[i].map(from_half)))
            }
        }
    }
}

/// Value of the bits of a half float that is neither negative nor infinite.
fn from_half(bits: u16) -> f32 {
    /// 2^112: the difference of the exponents' biases.
    const SCALE: f32 = f32::from_bits((127 + 112) << 23);
    f32::from_bits(u32::from(bits) << 13) * SCALE
}

fn bilinear(uv: DVec2, size_px: [u32; 2], sampling: Sampling, texel: impl Fn(usize) -> Vec4) -> Vec4 {
    let [x, y] = [0, 1].map(|k: usize| axis(uv[k], size_px[k], sampling.wrap[k], sampling.nearest));
    let width = size_px[0] as usize;
    if sampling.nearest {
        return texel(y.first * width + x.first);
    }
    let row = |y: usize| texel(y * width + x.first).lerp(texel(y * width + x.second), x.fraction);
    row(y.first).lerp(row(y.second), y.fraction)
}

/// The two texels on both sides of a coordinate.
struct TexelPair {
    first: usize,
    second: usize,
    /// Weight of the second.
    fraction: f32,
}

/// `nearest`: the first texel is the nearest one.
fn axis(coordinate: f64, size: u32, wrap: Wrap, nearest: bool) -> TexelPair {
    // Large coordinates first lose their whole periods: the texel then keeps its precision.
    let period = match wrap {
        Wrap::Clamp => 0.0,
        Wrap::Repeat => coordinate.floor(),
        Wrap::Mirror => 2.0 * (0.5 * coordinate).floor(),
    };
    let position = (coordinate - period) * f64::from(size) - if nearest { 0.0 } else { 0.5 };
    let position = if position.is_finite() { position } else { 0.0 };
    let below = position.floor();
    let last = i64::from(size) - 1;
    let texel = |i: i64| -> usize {
        let within = match wrap {
            _ if (0..=last).contains(&i) => i,
            Wrap::Clamp => i.clamp(0, last),
            Wrap::Repeat => i.rem_euclid(last + 1),
            Wrap::Mirror => {
                let twice = i.rem_euclid(2 * (last + 1));
                twice.min(2 * last + 1 - twice)
            }
        };
        within as usize
    };
    let first = below as i64;
    TexelPair {
        first: texel(first),
        second: texel(first.saturating_add(1)),
        fraction: (position - below) as f32,
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use camsim_core::scene::{Encoding, PrefilterTaps};
    use glam::{DMat2, DVec4};
    use half::f16;

    use super::*;

    const WRAPS: [Wrap; 3] = [Wrap::Clamp, Wrap::Repeat, Wrap::Mirror];

    #[test]
    fn halves_have_their_values() {
        for bits in 0..0x7c00_u16 {
            assert_eq!(from_half(bits), f16::from_bits(bits).to_f32(), "{bits:#x}");
        }
    }

    #[test]
    fn full_size_reads_are_those_of_the_texture() {
        let size_px = [5, 3];
        let bytes = (0..4 * 15).map(|i: u32| camsim_core::noise::pcg4d([i, 1, 2, 3])[0] as u8).collect();
        let texture = Arc::new(Texture { size_px, rgba8: bytes, encoding: Encoding::Linear });
        let mips = MipChain::new(&texture, None);
        for (wrap_u, wrap_v, nearest) in WRAPS
            .into_iter()
            .flat_map(|u| WRAPS.map(move |v| (u, v)))
            .flat_map(|(u, v)| [(u, v, false), (u, v, true)])
        {
            let wrap = [wrap_u, wrap_v];
            for k in 0..500 {
                let uv = DVec2::new(0.0173 * f64::from(k) - 3.9, 3.3 - 0.0119 * f64::from(k));
                let value = |channel: usize| move |texel: &[u8]| f64::from(texel[channel]) / 255.0;
                let read = |channel: usize| texture.sample_at(uv.to_array(), wrap, nearest, value(channel));
                let expected = DVec4::new(read(0), read(1), read(2), read(3));
                let found = mips.read(uv, 0.0, Sampling { wrap, nearest, premultiplied: false });
                assert!((found.as_dvec4() - expected).abs().max_element() < 1e-6, "{wrap:?} {nearest} {uv}");
                let found = mips.read(uv, 0.0, Sampling { wrap, nearest, premultiplied: true });
                let times_alpha = (expected.truncate() * expected.w).extend(expected.w);
                assert!(
                    (found.as_dvec4() - times_alpha).abs().max_element() < 1e-6,
                    "{wrap:?} {nearest} {uv}"
                );
            }
        }
    }

    #[test]
    fn mip_levels_have_the_border_of_the_ground() {
        let texture =
            Arc::new(Texture { size_px: [8, 8], rgba8: vec![255; 4 * 64], encoding: Encoding::Srgb });
        let sampling = Sampling { wrap: [Wrap::Clamp; 2], nearest: false, premultiplied: false };
        let border = [0, 128, 0, 255];
        let mips = MipChain::new(&texture, Some(border));
        let green = camsim_core::scene::linear_from_srgb(128.0 / 255.0);
        for (uv, level, expected) in [(0.0, 0.0, 1.0), (0.0, 1.0, green), (0.5, 1.0, 1.0), (0.5, 2.0, green)]
        {
            let found = mips.read(DVec2::splat(uv), level, sampling);
            assert!((found.y - expected).abs() < 2e-4, "{uv} at level {level}: {found}");
        }
    }

    #[test]
    fn a_ramp_stays_a_ramp_at_all_levels_and_reads() {
        let rgba8 = (0..256 * 256_u32).flat_map(|i| [(i % 256) as u8, (i / 256) as u8, 0, 255]).collect();
        let texture = Arc::new(Texture { size_px: [256, 256], rgba8, encoding: Encoding::Linear });
        let mips = MipChain::new(&texture, None);
        let sampling = Sampling { wrap: [Wrap::Clamp; 2], nearest: false, premultiplied: false };
        let (mut levels, mut reads_seen) = ([0; 5], [0; 4]);
        for (number, reads) in PrefilterTaps::ALL.into_iter().enumerate() {
            for k in 0..60 {
                let angle = 0.31 * f64::from(k);
                let turn = DMat2::from_angle(angle);
                let sides = DVec2::new(0.3 + 0.2 * f64::from(k % 31), 0.2 + 0.1 * f64::from(k % 17));
                let filter = Prefilter::new(turn * DMat2::from_diagonal(sides), reads);
                let uv = DVec2::new(0.4 + 0.003 * f64::from(k), 0.61 - 0.004 * f64::from(k));
                let found = mips.filtered(uv, &filter, sampling).as_dvec4();
                let expected = (256.0 * uv - 0.5) / 255.0;
                // Half floats round by 2^-12 of a value.
                assert!(
                    (found.truncate().truncate() - expected).abs().max_element() < 3e-4,
                    "{reads:?} {sides}"
                );
                assert!(found.z.abs() < 1e-6 && (found.w - 1.0).abs() < 1e-6, "{found}");
                levels[filter.level() as usize] += 1;
                reads_seen[number] += filter.offsets().count();
            }
        }
        assert!(levels[..3].iter().all(|&count| count > 5), "{levels:?}");
        assert!(reads_seen[3] > 4 * 60 && reads_seen[..3] == [60, 120, 240], "{reads_seen:?}");
    }
}
