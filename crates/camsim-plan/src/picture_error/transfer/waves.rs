//! The waves of a texture that stand for all of them, and what is left of each. Their frequencies in the
//! ideal frame are always the same, and so is what a single read leaves of each and of those that look like
//! it: `TABLE`.

use std::{
    f64::consts::{LN_2, PI},
    sync::LazyLock,
};

use camsim_core::{scene::Prefilter, temporal::Footprint, transfer::sinc};
use glam::{DMat2, DVec2};

use super::{
    alias::{AxisAlias, ReadSpan, Transfer, turned_by},
    reads::AliasedReads,
};
use crate::picture_error::texture_spectra::TextureSpectrum;

/// Frequencies that count, cycles an ideal pixel: two an octave from the lowest up, in six directions of a
/// half-plane.
const LOWEST: f64 = 0.062_5;
const OCTAVES: u32 = 6;
const AN_OCTAVE: u32 = 2;
const DIRECTIONS: u32 = 6;
/// Whole cycles that may lie between the highest of them and what it looks like, and one more.
const MOST_AWAY: usize = 5;
/// Cycles a texel above which a bilinear texture has no more to show.
const MOST_CYCLES: f64 = 1.5;
static TABLE: LazyLock<Vec<TabledWave>> = LazyLock::new(|| {
    let all = (0..OCTAVES * AN_OCTAVE).flat_map(|i| (0..DIRECTIONS).map(move |j| [i, j]));
    all.map(TabledWave::new).collect()
});

/// What is known of a wave before anything is of the texture.
struct TabledWave {
    /// Cycles an ideal pixel.
    f: DVec2,
    /// Square cycles that it stands for.
    weight: f64,
    /// Along each axis the wave and the slowest two that look like it.
    aliases: [[AxisAlias; 3]; 2],
}

impl TabledWave {
    fn new([i, j]: [u32; 2]) -> Self {
        let length = LOWEST * ((f64::from(i) + 0.5) / f64::from(AN_OCTAVE)).exp2();
        let f = length * DVec2::from_angle(PI * (f64::from(j) + 0.5) / f64::from(DIRECTIONS));
        // Of a half-plane: the other half is its mirror image.
        let weight = 2.0 * length * length * LN_2 / f64::from(AN_OCTAVE) * PI / f64::from(DIRECTIONS);
        Self { f, weight, aliases: [AxisAlias::all(f.x), AxisAlias::all(f.y)] }
    }
}

/// Waves of a texture that a pixel sees.
#[derive(Debug)]
pub(crate) struct TextureWaves(Vec<TextureWave>);

#[derive(Debug)]
struct TextureWave {
    /// Its index in the table.
    index: usize,
    /// Cycles a texel.
    cycles: DVec2,
    power: f64,
    /// What the exact mean leaves.
    exact: f64,
}

impl TextureWaves {
    /// `sides`: of the pixel, ideal px; `along`: the path over the exposure, if that shows.
    pub fn new(
        spectrum: &TextureSpectrum,
        texel_from_ideal: DMat2,
        sides: DMat2,
        along: Option<DVec2>,
    ) -> Self {
        let per_texel = texel_from_ideal.determinant().abs().recip();
        let texel_cycles = texel_from_ideal.inverse().transpose();
        let wave = |(index, known): (usize, &TabledWave)| {
            let (f, cycles) = (known.f, texel_cycles * known.f);
            if cycles.abs().max_element() > MOST_CYCLES {
                return None;
            }
            let power = known.weight
                * per_texel
                * spectrum.density_at(cycles)
                * (sinc(cycles.x) * sinc(cycles.y)).powi(4);
            let exact = sinc(sides.x_axis.dot(f))
                * sinc(sides.y_axis.dot(f))
                * along.map_or(1.0, |along| sinc(along.dot(f)));
            Some(TextureWave { index, cycles, power, exact })
        };
        Self(TABLE.iter().enumerate().filter_map(wave).collect())
    }

    /// What the filter of the surfaces leaves of each.
    pub fn filtered(&self, filter: &Prefilter) -> Vec<f64> {
        self.0.iter().map(|wave| filter.transfer(wave.cycles)).collect()
    }

    /// What reading the ideal frame leaves of each, over the path or with its samples. `beside_px` is where
    /// the source lies between ideal pixels.
    pub fn read(&self, area: &Footprint, over: ReadSpan, beside_px: DVec2) -> Vec<Transfer> {
        // Turns of whole cycles by the position of the read.
        let turns = |beside_px: f64| -> [Transfer; 2 * MOST_AWAY + 1] {
            std::array::from_fn(|i| turned_by((i as f64 - MOST_AWAY as f64) * beside_px))
        };
        let turns = [turns(beside_px.x), turns(beside_px.y)];
        let turn = |k: usize, away: i32| turns[k][(away + MOST_AWAY as i32) as usize];
        let mut reads = AliasedReads::of_waves(self.0.len());
        for (of, wave) in self.0.iter().enumerate() {
            let aliases = &TABLE[wave.index].aliases;
            reads.add(of, aliases, area, |[x, y]| {
                turn(0, aliases[0][x].away).rotate(turn(1, aliases[1][y].away))
            });
        }
        reads.sum(self.0.len(), area, over)
    }
}

/// Expected squared error of a pixel, of the linear range.
pub(crate) fn error2(waves: &TextureWaves, filtered: &[f64], read: &[Transfer]) -> f64 {
    let parts = waves.0.iter().zip(filtered).zip(read);
    parts
        .map(|((wave, &ideal), &read)| {
            wave.power * (ideal * read - Transfer::new(wave.exact, 0.0)).length_squared()
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        ir::stages::PrefilterTaps,
        picture_error::transfer::{PlacedWave, SampledPath, exact::read_wave, read_waves},
    };
    use camsim_core::temporal::TapStage;

    #[test]
    fn four_waves_at_a_time_equal_waves_one_by_one() {
        let waves = TextureWaves::new(
            &TextureSpectrum::flat(-2.0),
            DMat2::from_diagonal(DVec2::splat(3.5)),
            DMat2::IDENTITY,
            None,
        );
        assert_eq!(waves.0.len(), TABLE.len(), "all are seen");
        let stages = [
            TapStage::Bilinear,
            TapStage::Spline,
            TapStage::Area,
            TapStage::Grid { most: 3 },
            TapStage::SplineOrGrid { most: 7 },
        ];
        for (stage, scale) in
            stages.into_iter().flat_map(|stage| [0.9, 1.3, 2.9, 6.1].map(|scale| (stage, scale)))
        {
            let area = Footprint::new(scale * DVec2::new(1.0, 0.2), scale * DVec2::new(-0.1, 0.8), stage);
            let along = DVec2::new(31.3, -17.9);
            let samples = [1, 2, 7, 40, 300].map(|samples| ReadSpan::Samples(SampledPath { along, samples }));
            for over in samples.into_iter().chain([ReadSpan::Instant, ReadSpan::All(along)]) {
                let beside_px = DVec2::new(0.37, 0.81);
                let all: Vec<DVec2> = waves.0.iter().map(|wave| TABLE[wave.index].f).collect();
                let placed: Vec<PlacedWave> = all.iter().map(|&f| PlacedWave::new(f, beside_px)).collect();
                let of_any = read_waves(placed.iter(), &area, over);
                for ((&f, found), of_any) in all.iter().zip(waves.read(&area, over, beside_px)).zip(of_any) {
                    let expected = read_wave(f, &area, over, beside_px);
                    let off = found.distance(expected).max(of_any.distance(expected));
                    assert!(off < 2e-5, "{stage:?} {scale} {over:?} {f}: {found}, {of_any}, not {expected}");
                }
            }
        }
    }

    #[test]
    fn a_pixel_between_ideal_pixels_has_more_error_than_an_aligned_one() {
        let spectrum = TextureSpectrum::flat(-2.0);
        let filter = Prefilter::new(DMat2::IDENTITY, PrefilterTaps::Grid);
        let error = |stage, beside_px| {
            let area = Footprint::new(DVec2::X, DVec2::Y, stage);
            let waves = TextureWaves::new(&spectrum, DMat2::IDENTITY, DMat2::IDENTITY, None);
            error2(&waves, &waves.filtered(&filter), &waves.read(&area, ReadSpan::Instant, beside_px))
        };
        let half = DVec2::splat(0.5);
        assert!(error(TapStage::Bilinear, half) > 2.0 * error(TapStage::Bilinear, DVec2::ZERO));
        assert!(error(TapStage::Bilinear, half) > 1.5 * error(TapStage::Spline, half));
        assert!(error(TapStage::Spline, half) > 2.0 * error(TapStage::Spline, DVec2::ZERO));
    }
}
