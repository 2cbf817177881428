//! Texture spectra: the picture error by resampling and by too few blur samples depends on them.
//!
//! A texture spectrum is a power spectrum, mean over directions and channels: variance for each square cycle
//! a texel, in linear light. It is found from the variances that go when 2x2, 4x4, ... texels become one,
//! which needs no transform: a spectrum is fitted to them. Pictures of real ground vary in
//! themselves, a lawn beside parked cars, and are often empty in their corners, so that each piece of a texture
//! has a spectrum of its own, found when first needed.

use std::sync::{Arc, OnceLock};

use camsim_core::{
    scene::{Scene, Texture},
    transfer::dirichlet,
};
use glam::DVec2;

/// Side of the pieces of a texture.
const PIECE_PX: u32 = 128;
/// Texels along each side of a block that stand for it, where the whole of a large texture is analysed.
const OF_BLOCK: u32 = 4;
/// Where blocks of texels begin, beside the first texel of a piece: what a person drew mostly has its edges
/// between blocks that begin there, as a chessboard's are, and loses nothing to them. Each of these is
/// another position in blocks of 2, 4, 8 and 16.
const BEGINNINGS: [[u32; 2]; 4] = [[0, 0], [5, 15], [10, 5], [15, 10]];
/// Frequency that the loss of the finest detail depends on most, cycles a texel; each further level is an
/// octave lower.
const FINEST: f64 = 0.4;
/// Rounds of the fit: with many more, levels that are known but roughly make spectra that go up and down.
const ROUNDS: u32 = 8;
/// Values a halving and directions of a quadrant that the fit integrates over.
const AN_OCTAVE: u32 = 4;
const DIRECTIONS: u32 = 4;

/// Spectra of every surface of a scene.
#[derive(Debug, Default)]
pub(crate) struct SceneSpectra {
    terrain: Option<Arc<TextureSpectra>>,
    meshes: Vec<Arc<TextureSpectra>>,
}

/// Spectra of the pieces of a texture.
#[derive(Debug)]
pub(crate) struct TextureSpectra {
    texture: Arc<Texture>,
    /// Spectra of the pieces row by row, the last ones of a row and a column moved inwards to be whole.
    pieces: Vec<OnceLock<TextureSpectrum>>,
    /// What goes with each level of detail of the whole, for details wider than a piece.
    whole: OnceLock<Vec<f64>>,
}

/// Power spectrum of a piece of a texture.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct TextureSpectrum {
    /// Natural logarithms at [`FINEST`] and the octaves below it; straight lines between them. Empty for a
    /// texture of one colour.
    log_density: Vec<f64>,
}

impl SceneSpectra {
    pub fn new(scene: &Scene) -> Self {
        let mut known: Vec<Arc<TextureSpectra>> = Vec::new();
        let mut of = |texture: &Arc<Texture>| {
            if let Some(spectra) = known.iter().find(|spectra| Arc::ptr_eq(&spectra.texture, texture)) {
                return spectra.clone();
            }
            known.push(Arc::new(TextureSpectra::new(texture.clone())));
            known[known.len() - 1].clone()
        };
        let terrain = scene.terrain.as_ref().map(|terrain| of(&terrain.texture));
        Self { terrain, meshes: scene.meshes.iter().map(|mesh| of(&mesh.material.texture)).collect() }
    }

    /// Spectra of surface 0 (terrain) or 1 + i (mesh i).
    pub fn of_surface(&self, surface: usize) -> Option<&TextureSpectra> {
        match surface.checked_sub(1) {
            None => self.terrain.as_deref(),
            Some(i) => self.meshes.get(i).map(AsRef::as_ref),
        }
    }
}

impl TextureSpectra {
    fn new(texture: Arc<Texture>) -> Self {
        let [columns, rows] = texture.size_px.map(|side| side.div_ceil(PIECE_PX).max(1) as usize);
        Self {
            texture,
            pieces: (0..columns * rows).map(|_| OnceLock::new()).collect(),
            whole: OnceLock::new(),
        }
    }

    /// The spectrum about a position of the texture, texels; textures repeat.
    pub fn near(&self, texel: DVec2) -> &TextureSpectrum {
        let size_px = self.texture.size_px;
        let piece = [0, 1].map(|k| {
            (texel[k].rem_euclid(f64::from(size_px[k].max(1))) as u32).min(size_px[k].saturating_sub(1))
                / PIECE_PX
        });
        let columns = size_px[0].div_ceil(PIECE_PX).max(1);
        self.pieces[(piece[1] * columns + piece[0]) as usize].get_or_init(|| self.spectrum(piece))
    }

    fn spectrum(&self, piece: [u32; 2]) -> TextureSpectrum {
        let texture = &*self.texture;
        let decode = texture.encoding.decode_table();
        let side = texture.size_px.map(|side| side.min(PIECE_PX));
        let [x0, y0] = [0, 1].map(|k: usize| (piece[k] * PIECE_PX).min(texture.size_px[k] - side[k]));
        let lost_from = |beside: [u32; 2]| {
            let [x0, y0] = [(x0, 0), (y0, 1)]
                .map(|(first, k): (u32, usize)| moved(first, beside[k], side[k], texture.size_px[k]));
            let [width, height] = texture.size_px;
            let values = (0..side[0] * side[1])
                .map(|i| color(texture, &decode, (x0 + i % side[0]) % width, (y0 + i / side[0]) % height));
            losses(TexelBlock { size_px: side.map(|n| n as usize), values: values.collect() })
        };
        let mut lost = mean(BEGINNINGS.map(lost_from));
        // Of a large texture the blocks are seen through a few of their texels.
        let halvings = (texture.size_px[0].min(texture.size_px[1]) / PIECE_PX).max(1).ilog2();
        if halvings > 0 {
            let whole = self.whole.get_or_init(|| losses(thinned(texture, 1 << halvings)));
            let beyond = lost.len().saturating_sub(halvings as usize);
            lost.extend(whole.iter().skip(beyond));
        }
        TextureSpectrum::fitted(&lost)
    }
}

impl TextureSpectrum {
    /// A spectrum of one density at all frequencies.
    #[cfg(test)]
    pub fn flat(log_density: f64) -> Self {
        Self { log_density: vec![log_density; 2] }
    }

    /// The spectrum whose detail of 2^level texels has the variances `lost`.
    fn fitted(lost: &[f64]) -> Self {
        let detail = lost.iter().rposition(|&variance| variance > 0.0).map_or(0, |last| last + 1);
        let lost = &lost[..detail];
        let mut spectrum = Self {
            log_density: lost
                .iter()
                .enumerate()
                .map(|(level, v)| v.max(1e-12).ln() + 4_f64.powi(level as i32).ln())
                .collect(),
        };
        let bands = bands(detail);
        for _ in 0..ROUNDS {
            let mut modelled = vec![0.0; detail];
            for (frequency, area, fractions) in &bands {
                let power = spectrum.density(*frequency) * area;
                modelled.iter_mut().zip(fractions).for_each(|(sum, fraction)| *sum += fraction * power);
            }
            for ((log_density, wanted), modelled) in spectrum.log_density.iter_mut().zip(lost).zip(modelled) {
                *log_density += 0.7 * (wanted.max(1e-12) / modelled.max(1e-300)).ln();
            }
        }
        spectrum
    }

    /// Variance for each square cycle a texel at a frequency, cycles a texel, of the texture's texels: it
    /// repeats with every whole cycle.
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

/// The first texel of so many, moved by some: forwards, where the texture ends backwards, and where it has no
/// more it begins again.
fn moved(first: u32, by: u32, side: u32, size: u32) -> u32 {
    if first + by + side > size && first >= by { first - by } else { first + by }
}

/// Mean of several, level by level.
fn mean(losses: [Vec<f64>; BEGINNINGS.len()]) -> Vec<f64> {
    let levels = losses[0].len();
    (0..levels)
        .map(|level| losses.iter().map(|lost| lost[level]).sum::<f64>() / BEGINNINGS.len() as f64)
        .collect()
}

/// Frequencies of a quadrant, the area that each stands for in all four, and the fraction of its power that goes
/// with each level.
fn bands(levels: usize) -> Vec<(f64, f64, Vec<f64>)> {
    let octaves = levels as u32 + 2;
    let mut bands = Vec::new();
    for i in 0..octaves * AN_OCTAVE {
        let frequency = 0.5_f64.sqrt() * (-(f64::from(i) + 0.5) / f64::from(AN_OCTAVE)).exp2();
        for j in 0..DIRECTIONS {
            let angle = std::f64::consts::FRAC_PI_2 * (f64::from(j) + 0.5) / f64::from(DIRECTIONS);
            let cycles = frequency * DVec2::from_angle(angle);
            if cycles.max_element() > 0.5 {
                continue;
            }
            let area = frequency * frequency * std::f64::consts::LN_2 / f64::from(AN_OCTAVE)
                * std::f64::consts::TAU
                / f64::from(DIRECTIONS);
            let left =
                |level: usize| (dirichlet(1 << level, cycles.x) * dirichlet(1 << level, cycles.y)).powi(2);
            bands.push((frequency, area, (0..levels).map(|level| left(level) - left(level + 1)).collect()));
        }
    }
    bands
}

/// A piece of a picture in linear light.
struct TexelBlock {
    size_px: [usize; 2],
    values: Vec<[f32; 3]>,
}

fn color(texture: &Texture, decode: &[f32; 256], x: u32, y: u32) -> [f32; 3] {
    let first = 4 * (y as usize * texture.size_px[0] as usize + x as usize);
    [0, 1, 2].map(|c| decode[texture.rgba8[first + c] as usize])
}

/// The whole texture, one value for each `block` x `block` texels.
fn thinned(texture: &Texture, block: u32) -> TexelBlock {
    let decode = texture.encoding.decode_table();
    let [width, height] = texture.size_px.map(|side| side / block);
    let step = (block / OF_BLOCK).max(1);
    let values = (0..width * height).map(|i| {
        let [x0, y0] = [i % width, i / width].map(|k| k * block + step / 2);
        let (mut sum, mut count) = ([0.0; 3], 0.0_f32);
        for (dx, dy) in (0..block)
            .step_by(step as usize)
            .flat_map(|dy| (0..block).step_by(step as usize).map(move |dx| (dx, dy)))
        {
            let texel = color(
                texture,
                &decode,
                (x0 + dx).min(texture.size_px[0] - 1),
                (y0 + dy).min(texture.size_px[1] - 1),
            );
            sum.iter_mut().zip(texel).for_each(|(sum, value)| *sum += value);
            count += 1.0;
        }
        sum.map(|sum| sum / count)
    });
    TexelBlock { size_px: [width as usize, height as usize], values: values.collect() }
}

/// Variance within each 2x2 values, again and again on their means.
fn losses(mut piece: TexelBlock) -> Vec<f64> {
    let mut lost = Vec::new();
    while piece.size_px.iter().all(|&side| side >= 2) {
        let [width, height] = piece.size_px.map(|side| side / 2);
        let (mut means, mut sum) = (Vec::with_capacity(width * height), 0.0);
        for y in 0..height {
            for x in 0..width {
                let corner = 2 * y * piece.size_px[0] + 2 * x;
                let four = [corner, corner + 1, corner + piece.size_px[0], corner + piece.size_px[0] + 1]
                    .map(|i| piece.values[i]);
                let mean = [0, 1, 2].map(|c: usize| 0.25 * four.iter().map(|value| value[c]).sum::<f32>());
                let square = |value: &[f32; 3]| {
                    value.iter().zip(mean).map(|(v, m)| f64::from(v - m).powi(2)).sum::<f64>()
                };
                sum += four.iter().map(square).sum::<f64>() / 12.0;
                means.push(mean);
            }
        }
        lost.push(sum / (width * height) as f64);
        piece = TexelBlock { size_px: [width, height], values: means };
    }
    lost
}

#[cfg(test)]
mod tests {
    use super::*;
    use camsim_core::{noise::pcg4d, scene::Encoding};

    fn picture(side: u32, value: &dyn Fn(u32, u32) -> f64) -> Texture {
        let rgba8 = (0..side * side)
            .flat_map(|i| [(255.0 * value(i % side, i / side)).round() as u8; 3].into_iter().chain([255]))
            .collect();
        Texture { size_px: [side, side], rgba8, encoding: Encoding::Linear }
    }

    fn noise(x: u32, y: u32) -> f64 {
        f64::from(pcg4d([x, y, 1, 1])[0] >> 8) / f64::from(1 << 24)
    }

    /// About the middle of a picture.
    fn spectrum(texture: Texture) -> TextureSpectrum {
        let middle = 0.5 * DVec2::from_array(texture.size_px.map(f64::from));
        TextureSpectra::new(Arc::new(texture)).near(middle).clone()
    }

    #[test]
    fn white_noise_is_flat() {
        let spectra = TextureSpectra::new(Arc::new(picture(512, &noise)));
        // A uniform value has a variance of 1/12, over one square cycle. Of the slow waves a piece has few.
        for frequency in [0.03, 0.1, 0.2, 0.4] {
            let of_piece = |i: u32| {
                spectra.near(DVec2::new(f64::from(i % 4), f64::from(i / 4)) * 128.0).density(frequency)
            };
            let found = 12.0 * (0..16).map(of_piece).sum::<f64>() / 16.0;
            assert!((0.8..1.25).contains(&found), "{frequency}: {found}");
        }
    }

    #[test]
    fn waves_are_found_at_their_frequency() {
        for cycles in [1.0 / 4.0, 1.0 / 16.0, 1.0 / 64.0] {
            let spectrum = spectrum(picture(512, &|x, y| {
                0.5 + 0.4 * (std::f64::consts::TAU * cycles * (0.8 * f64::from(x) + 0.6 * f64::from(y))).sin()
            }));
            let ratio = |away: f64| spectrum.density(cycles * away) / spectrum.density(cycles);
            assert!(ratio(5.0) < 0.1 && ratio(0.2) < 1.0, "{cycles}: {} {}", ratio(5.0), ratio(0.2));
            // Its variance is 0.08; an octave and a half holds most of it.
            let area = |f: f64| std::f64::consts::TAU * f * f * 0.25 * std::f64::consts::LN_2;
            let held: f64 = (-3..=3)
                .map(|k| cycles * (0.25 * f64::from(k)).exp2())
                .map(|f| spectrum.density(f) * area(f))
                .sum();
            assert!((0.04..0.12).contains(&held), "{cycles}: {held}");
        }
    }

    #[test]
    fn each_piece_has_its_own_spectrum() {
        // 300 texels: the last piece of a row is moved inwards, over a third of the noise.
        let spectra =
            TextureSpectra::new(Arc::new(picture(300, &|x, y| if x < 192 { noise(x, y) } else { 0.5 })));
        let density = |x: f64| 12.0 * spectra.near(DVec2::new(x, 70.0)).density(0.4);
        assert!((0.8..1.25).contains(&density(5.0)), "{}", density(5.0));
        assert!((0.4..0.6).contains(&density(200.0)), "{}", density(200.0));
        // Of the last one 20 to 35 of 128 columns, by where its blocks begin.
        assert!((0.15..0.28).contains(&density(299.9)), "{}", density(299.9));
        assert_eq!(
            [density(-295.0), density(600.5), density(-0.1)],
            [density(5.0), density(0.5), density(299.9)]
        );
    }

    #[test]
    fn edges_between_blocks_have_the_spectrum_of_edges_within_them() {
        // Squares of 32 texels from the first one on, and from the 13th.
        let squares = |beside: u32| {
            spectrum(picture(512, &|x, y| f64::from(((x + beside) / 32 + (y + beside) / 32) % 2)))
        };
        for (spectrum, frequency) in
            [0, 13].map(squares).iter().flat_map(|of| [0.05, 0.1, 0.2, 0.4].map(|frequency| (of, frequency)))
        {
            // Of edges of a contrast of 1, as long along each axis as is an edge in 32 texels, spread over
            // all directions: 2 / 32 / (4 pi^3 f^3).
            let exact = 2.0 / 32.0 / (4.0 * (std::f64::consts::PI * frequency).powi(3));
            // Found: 0.3 to 2.6 times, since it is straight lines from octave to octave, and squares are not
            // edges at random. Blocks that begin with the squares alone find nothing here.
            let off = spectrum.density(frequency) / exact;
            assert!((0.25..3.0).contains(&off), "{frequency}: {off}");
        }
    }

    #[test]
    fn a_texture_of_one_colour_has_no_power() {
        assert_eq!(spectrum(Texture::uniform([9; 4], Encoding::Srgb)).density(0.1), 0.0);
        assert_eq!(spectrum(picture(64, &|_, _| 0.5)).density(0.1), 0.0);
    }
}
