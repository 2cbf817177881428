//! How much pictures change, by the size of what changes: what resampling and too few blur samples cost, in grey levels, depends on it.
//!
//! A texture's grain is its power spectrum, mean over directions and channels: variance for each square cycle a texel, in linear light. It
//! is found from the variances that go when 2x2, 4x4, ... texels become one, which needs no transform: a spectrum is fitted to them.

use std::sync::Arc;

use glam::DVec2;

use crate::scene::{Scene, Texture};

/// Side of the pieces of a texture that are looked at, and how many of them along each side.
const PIECE_PX: u32 = 256;
const PIECES: u32 = 2;
/// Texels along each side of a block that stand for it, where the whole of a large texture is looked at.
const OF_BLOCK: u32 = 4;
/// Frequency that the loss of the finest detail tells most about, cycles a texel; each further level is an octave lower.
const FINEST: f64 = 0.4;
/// Rounds of the fit.
const ROUNDS: u32 = 24;
/// Values a halving and directions of a quadrant that the fit integrates over.
const AN_OCTAVE: u32 = 4;
const DIRECTIONS: u32 = 4;

/// Grain of every surface of a scene, found once.
#[derive(Debug, Default)]
pub(super) struct SceneGrain {
    terrain: Option<Arc<Spectrum>>,
    meshes: Vec<Arc<Spectrum>>,
}

/// Power spectrum of a texture.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Spectrum {
    /// Natural logarithms at [`FINEST`] and the octaves below it; straight lines between them. Empty for a texture of one colour.
    log_density: Vec<f64>,
}

impl SceneGrain {
    pub fn new(scene: &Scene) -> Self {
        let mut known: Vec<(Arc<Texture>, Arc<Spectrum>)> = Vec::new();
        let mut of = |texture: &Arc<Texture>| {
            if let Some((_, spectrum)) = known.iter().find(|(seen, _)| Arc::ptr_eq(seen, texture)) {
                return spectrum.clone();
            }
            let spectrum = Arc::new(Spectrum::of(texture));
            known.push((texture.clone(), spectrum.clone()));
            spectrum
        };
        let terrain = scene.terrain.as_ref().map(|terrain| of(&terrain.texture));
        Self { terrain, meshes: scene.meshes.iter().map(|mesh| of(&mesh.texture)).collect() }
    }

    /// Of surface 0 (terrain) or 1 + i (mesh i).
    pub fn of(&self, surface: usize) -> Option<&Spectrum> {
        match surface.checked_sub(1) {
            None => self.terrain.as_deref(),
            Some(i) => self.meshes.get(i).map(AsRef::as_ref),
        }
    }
}

impl Spectrum {
    /// The same at all frequencies.
    #[cfg(test)]
    pub fn flat(log_density: f64) -> Self {
        Self { log_density: vec![log_density; 2] }
    }

    fn of(texture: &Texture) -> Self {
        let mut lost = losses_of_pieces(texture);
        // Details wider than a piece, from the whole: of a large texture its blocks are seen through a few of their texels.
        let halvings = (texture.size_px[0].min(texture.size_px[1]) / PIECE_PX).max(1).ilog2();
        if halvings > 0 {
            let whole = losses(thinned(texture, 1 << halvings));
            let beyond = lost.len().saturating_sub(halvings as usize);
            lost.extend(whole.into_iter().skip(beyond));
        }
        Self::fitted(&lost)
    }

    /// The spectrum whose detail of 2^level texels has the variances `lost`.
    fn fitted(lost: &[f64]) -> Self {
        let detail = lost.iter().rposition(|&variance| variance > 0.0).map_or(0, |last| last + 1);
        let lost = &lost[..detail];
        let mut spectrum =
            Self { log_density: lost.iter().enumerate().map(|(level, v)| v.max(1e-12).ln() + 4_f64.powi(level as i32).ln()).collect() };
        let places = places(detail);
        for _ in 0..ROUNDS {
            let mut found = vec![0.0; detail];
            for (frequency, area, shares) in &places {
                let power = spectrum.density(*frequency) * area;
                found.iter_mut().zip(shares).for_each(|(sum, share)| *sum += share * power);
            }
            for ((log_density, wanted), found) in spectrum.log_density.iter_mut().zip(lost).zip(found) {
                *log_density += 0.7 * (wanted.max(1e-12) / found.max(1e-300)).ln();
            }
        }
        spectrum
    }

    /// Variance for each square cycle a texel at a frequency, cycles a texel, of the texture's texels: it repeats with every whole cycle.
    pub fn density_at(&self, cycles: DVec2) -> f64 {
        self.density((cycles - cycles.round()).length())
    }

    fn density(&self, frequency: f64) -> f64 {
        let Some(last) = self.log_density.len().checked_sub(1) else { return 0.0 };
        let octaves = (FINEST / frequency.max(1e-9)).log2().clamp(0.0, last as f64);
        let below = (octaves as usize).min(last.saturating_sub(1));
        let next = self.log_density[(below + 1).min(last)];
        (self.log_density[below] + (octaves - below as f64) * (next - self.log_density[below])).exp()
    }
}

/// Frequencies of a quadrant, the area that each stands for in all four, and the share of its power that goes with each level.
fn places(levels: usize) -> Vec<(f64, f64, Vec<f64>)> {
    let octaves = levels as u32 + 2;
    let mut places = Vec::new();
    for i in 0..octaves * AN_OCTAVE {
        let frequency = 0.5_f64.sqrt() * (-(f64::from(i) + 0.5) / f64::from(AN_OCTAVE)).exp2();
        for j in 0..DIRECTIONS {
            let angle = std::f64::consts::FRAC_PI_2 * (f64::from(j) + 0.5) / f64::from(DIRECTIONS);
            let cycles = frequency * DVec2::from_angle(angle);
            if cycles.max_element() > 0.5 {
                continue;
            }
            let area =
                frequency * frequency * std::f64::consts::LN_2 / f64::from(AN_OCTAVE) * std::f64::consts::TAU / f64::from(DIRECTIONS);
            let left = |level: usize| (mean_of(1 << level, cycles.x) * mean_of(1 << level, cycles.y)).powi(2);
            places.push((frequency, area, (0..levels).map(|level| left(level) - left(level + 1)).collect()));
        }
    }
    places
}

/// What the mean of `count` texels leaves of a wave, `cycles` a texel: `sin(pi n f) / (n sin(pi f))`.
pub(super) fn mean_of(count: u32, cycles: f64) -> f64 {
    let (half, n) = (std::f64::consts::PI * cycles, f64::from(count));
    let one = half.sin();
    if one.abs() < 1e-9 { 1.0 } else { (n * half).sin() / (n * one) }
}

/// A piece of a picture in linear light.
struct Piece {
    size_px: [usize; 2],
    values: Vec<[f32; 3]>,
}

/// Variance that goes with each level of detail, the mean over a few pieces of the texture.
fn losses_of_pieces(texture: &Texture) -> Vec<f64> {
    let decode = texture.encoding.decode_table();
    let side = texture.size_px.map(|side| side.min(PIECE_PX));
    let mut sums: Vec<f64> = Vec::new();
    for piece in 0..PIECES * PIECES {
        let first = |k: usize, of: u32| (texture.size_px[k] - side[k]) * of / (PIECES - 1).max(1);
        let [x0, y0] = [first(0, piece % PIECES), first(1, piece / PIECES)];
        let values = (0..side[0] * side[1]).map(|i| color(texture, &decode, x0 + i % side[0], y0 + i / side[0])).collect();
        let found = losses(Piece { size_px: side.map(|n| n as usize), values });
        sums.resize(found.len(), 0.0);
        sums.iter_mut().zip(found).for_each(|(sum, lost)| *sum += lost / f64::from(PIECES * PIECES));
    }
    sums
}

fn color(texture: &Texture, decode: &[f32; 256], x: u32, y: u32) -> [f32; 3] {
    let at = 4 * (y as usize * texture.size_px[0] as usize + x as usize);
    [0, 1, 2].map(|c| decode[texture.rgba8[at + c] as usize])
}

/// The whole texture, one value for each `block` x `block` texels.
fn thinned(texture: &Texture, block: u32) -> Piece {
    let decode = texture.encoding.decode_table();
    let [width, height] = texture.size_px.map(|side| side / block);
    let step = (block / OF_BLOCK).max(1);
    let values = (0..width * height).map(|i| {
        let [x0, y0] = [i % width, i / width].map(|k| k * block + step / 2);
        let (mut sum, mut count) = ([0.0; 3], 0.0_f32);
        for (dx, dy) in (0..block).step_by(step as usize).flat_map(|dy| (0..block).step_by(step as usize).map(move |dx| (dx, dy))) {
            let here = color(texture, &decode, (x0 + dx).min(texture.size_px[0] - 1), (y0 + dy).min(texture.size_px[1] - 1));
            sum.iter_mut().zip(here).for_each(|(sum, value)| *sum += value);
            count += 1.0;
        }
        sum.map(|sum| sum / count)
    });
    Piece { size_px: [width as usize, height as usize], values: values.collect() }
}

/// Variance within each 2x2 values, again and again on their means.
fn losses(mut piece: Piece) -> Vec<f64> {
    let mut lost = Vec::new();
    while piece.size_px.iter().all(|&side| side >= 2) {
        let [width, height] = piece.size_px.map(|side| side / 2);
        let (mut means, mut sum) = (Vec::with_capacity(width * height), 0.0);
        for y in 0..height {
            for x in 0..width {
                let at = 2 * y * piece.size_px[0] + 2 * x;
                let four = [at, at + 1, at + piece.size_px[0], at + piece.size_px[0] + 1].map(|i| piece.values[i]);
                let mean = [0, 1, 2].map(|c: usize| 0.25 * four.iter().map(|value| value[c]).sum::<f32>());
                let square = |value: &[f32; 3]| value.iter().zip(mean).map(|(v, m)| f64::from(v - m).powi(2)).sum::<f64>();
                sum += four.iter().map(square).sum::<f64>() / 12.0;
                means.push(mean);
            }
        }
        lost.push(sum / (width * height) as f64);
        piece = Piece { size_px: [width, height], values: means };
    }
    lost
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{noise::pcg4d, scene::Encoding};

    fn picture(side: u32, value: &dyn Fn(u32, u32) -> f64) -> Texture {
        let rgba8 =
            (0..side * side).flat_map(|i| [(255.0 * value(i % side, i / side)).round() as u8; 3].into_iter().chain([255])).collect();
        Texture { size_px: [side, side], rgba8, encoding: Encoding::Linear }
    }

    #[test]
    fn white_noise_is_flat() {
        let noise = |x: u32, y: u32| f64::from(pcg4d([x, y, 1, 1])[0] >> 8) / f64::from(1 << 24);
        let spectrum = Spectrum::of(&picture(512, &noise));
        // A uniform value has a variance of 1/12, over one square cycle.
        for frequency in [0.03, 0.1, 0.2, 0.4] {
            let found = 12.0 * spectrum.density(frequency);
            assert!((0.8..1.25).contains(&found), "{frequency}: {found}");
        }
    }

    #[test]
    fn waves_are_found_at_their_frequency() {
        for cycles in [1.0 / 4.0, 1.0 / 16.0, 1.0 / 64.0] {
            let spectrum = Spectrum::of(&picture(512, &|x, y| {
                0.5 + 0.4 * (std::f64::consts::TAU * cycles * (0.8 * f64::from(x) + 0.6 * f64::from(y))).sin()
            }));
            let ratio = |away: f64| spectrum.density(cycles * away) / spectrum.density(cycles);
            assert!(ratio(5.0) < 0.1 && ratio(0.2) < 1.0, "{cycles}: {} {}", ratio(5.0), ratio(0.2));
            // Its variance is 0.08; an octave and a half holds most of it.
            let area = |f: f64| std::f64::consts::TAU * f * f * 0.25 * std::f64::consts::LN_2;
            let held: f64 = (-3..=3).map(|k| cycles * (0.25 * f64::from(k)).exp2()).map(|f| spectrum.density(f) * area(f)).sum();
            assert!((0.04..0.12).contains(&held), "{cycles}: {held}");
        }
    }

    #[test]
    fn one_colour_has_no_grain() {
        assert_eq!(Spectrum::of(&Texture::uniform([9; 4], Encoding::Srgb)).density(0.1), 0.0);
        assert_eq!(Spectrum::of(&picture(64, &|_, _| 0.5)).density(0.1), 0.0);
    }
}
