//! The texture prefilter of the ideal frame: its taps, and its transfer function.

use glam::{DMat2, DVec2};

use serde::Serialize;

use crate::transfer::{dirichlet, sampled_box, sinc};

/// Number of texture taps of an ideal pixel, in the order of cost.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum PrefilterTaps {
    /// One tap, at the mip level for the longer axis of the pixel.
    One,
    /// Two taps along the longer axis of the pixel.
    Two,
    /// Four taps: two by two, or in a row for an elongated pixel.
    Four,
    /// A grid of one or two taps across and up to 32 along.
    Grid,
}

impl PrefilterTaps {
    /// All variants, each at its own index.
    pub const ALL: [Self; 4] = [Self::One, Self::Two, Self::Four, Self::Grid];
}

/// Constants of camsim-gpu/shaders/ideal/surface.wgsl and camsim-gpu/shaders/ideal/prefilter.
const CLOSE_TEXELS: f64 = 0.8;
const CELL_VARIANCE: f64 = 1.5;
const IN_A_ROW: f64 = 1.6;
const MAX_TAPS: f64 = 32.0;
const SHORT_TAPS: f64 = 2.0;
const ONE_TAP: f64 = 0.5;

/// A mip level, or a blend of two.
struct MipBlend {
    level: f64,
    /// Twelve times the variance beyond that of the bilinear texel, texels^2: `3 (4^level - 1)`, blended
    /// between whole levels.
    variance: f64,
}

impl MipBlend {
    fn of_level(level: f64) -> Self {
        Self {
            level,
            variance: 3.0 * ((2.0 * level.floor()).exp2() * (1.0 + 3.0 * (level - level.floor())) - 1.0),
        }
    }

    /// The level for taps `cell` texels apart.
    fn for_cell(cell: f64) -> Self {
        let variance = if cell > CLOSE_TEXELS { CELL_VARIANCE * cell * cell } else { 0.0 };
        let texels2 = variance / 3.0 + 1.0;
        let below = (0.5 * texels2.log2()).floor();
        Self { level: below + (texels2 / (2.0 * below).exp2() - 1.0) / 3.0, variance }
    }
}

/// Prefilter of an ideal pixel. f64 twin of `filtered_texture` in camsim-gpu/shaders/ideal/prefilter.
#[derive(Clone, Debug)]
pub struct Prefilter {
    /// Sides of the grid of taps, texels, and its taps.
    sides: [DVec2; 2],
    taps: [u32; 2],
    level: f64,
}

impl Prefilter {
    /// Filter of a pixel whose axes span `texel_from_ideal` texels.
    #[must_use]
    pub fn new(texel_from_ideal: DMat2, reads: PrefilterTaps) -> Self {
        let DMat2 { x_axis: dx, y_axis: dy } = texel_from_ideal;
        let [a, b, c] = [dx.x * dx.x + dy.x * dy.x, dx.x * dx.y + dy.x * dy.y, dx.y * dx.y + dy.y * dy.y];
        let mean = 0.5 * (a + c);
        let spread = (0.25 * (a - c) * (a - c) + b * b).sqrt();
        let (longer, shorter) = ((mean + spread).sqrt(), (mean - spread).max(0.0).sqrt());
        let along = if spread > 1e-6 * mean {
            let both = if a >= c {
                DVec2::new(0.5 * (a - c) + spread, b)
            } else {
                DVec2::new(b, 0.5 * (c - a) + spread)
            };
            both.normalize_or(DVec2::X)
        } else {
            DVec2::X
        };
        let ([long_taps, short_taps], MipBlend { level, variance }) = match reads {
            PrefilterTaps::One => ([1.0, 1.0], MipBlend::for_cell(longer)),
            PrefilterTaps::Two => ([2.0, 1.0], MipBlend::for_cell((0.5 * longer).max(shorter))),
            PrefilterTaps::Four if longer < IN_A_ROW * shorter.max(1.0) => {
                ([2.0, 2.0], MipBlend::for_cell(0.5 * longer))
            }
            PrefilterTaps::Four => ([4.0, 1.0], MipBlend::for_cell((0.25 * longer).max(shorter))),
            PrefilterTaps::Grid => {
                let short_taps = if shorter > ONE_TAP { SHORT_TAPS } else { 1.0 };
                let covered = (shorter / short_taps).max(1.0);
                let long_taps = (longer / covered - 0.1).ceil().clamp(short_taps, MAX_TAPS);
                ([long_taps, short_taps], MipBlend::of_level((longer / long_taps).max(covered).log2()))
            }
        };
        let length = |side: f64, taps: f64| {
            ((side * side - variance).max(0.0) / (1.0 - (taps * taps).recip()).max(0.5)).sqrt()
        };
        Self {
            sides: [along * length(longer, long_taps), along.perp() * length(shorter, short_taps)],
            taps: [long_taps as u32, short_taps as u32],
            level,
        }
    }

    /// Mip level of the taps, and the sides of their grid in texels of the full texture.
    #[cfg(test)]
    pub fn reads(&self) -> (f64, [DVec2; 2]) {
        (self.level, self.sides)
    }

    /// Mip level of the taps.
    #[must_use]
    pub fn level(&self) -> f64 {
        self.level
    }

    /// Positions of the taps relative to the pixel's middle, texels of the full-size picture.
    pub fn offsets(&self) -> impl Iterator<Item = DVec2> + use<> {
        let Self { sides: [long, short], taps: [along, across], .. } = *self;
        let fraction = |i: u32, taps: u32| (f64::from(i) + 0.5) / f64::from(taps) - 0.5;
        (0..across).flat_map(move |j| {
            (0..along).map(move |i| fraction(i, along) * long + fraction(j, across) * short)
        })
    }

    /// Number of taps.
    pub fn taps(&self) -> u32 {
        self.taps[0] * self.taps[1]
    }

    /// Whether each tap blends two mip levels.
    pub fn is_trilinear(&self) -> bool {
        self.level > 0.0
    }

    /// Transfer function beyond that of the texture itself, at `cycles` per texel.
    pub fn transfer(&self, cycles: DVec2) -> f64 {
        let grid: f64 = (0..2).map(|k| sampled_box(self.taps[k], self.sides[k].dot(cycles))).product();
        let below = self.level.floor();
        let version = |level: f64| {
            let texels = level.exp2();
            let axis = |nu: f64| {
                let own = sinc(nu);
                if texels < 1.5 || own.abs() < 1e-3 {
                    1.0
                } else {
                    dirichlet(texels as u32, nu) * (sinc(texels * nu) / own).powi(2)
                }
            };
            axis(cycles.x) * axis(cycles.y)
        };
        let fraction = self.level - below;
        grid * ((1.0 - fraction) * version(below)
            + if fraction > 0.0 { fraction * version(below + 1.0) } else { 0.0 })
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    #[test]
    fn prefilter_has_the_variance_of_the_pixel() {
        // 1 - 2 pi^2 f^2 variance for low frequencies; a pixel has 1/12.
        let transfer = |sides: DVec2, reads, f: DVec2| {
            let filter = Prefilter::new(DMat2::from_diagonal(sides), reads);
            12.0 * (1.0 - filter.transfer(f / sides)) / (2.0 * PI * PI * f.length_squared())
        };
        for texels in [0.7, 1.0, 1.5, 2.0, 3.0, 4.0, 6.5, 8.0] {
            for reads in [PrefilterTaps::Four, PrefilterTaps::Grid] {
                let variance = transfer(DVec2::splat(texels), reads, DVec2::new(0.02, 0.0));
                assert!((variance - 1.0).abs() < 0.03, "{reads:?}, {texels}: {variance}");
            }
            // Twice as long: no filter may fail along the longer axis.
            for reads in [PrefilterTaps::Two, PrefilterTaps::Four, PrefilterTaps::Grid] {
                let variance = transfer(DVec2::new(2.0 * texels, texels), reads, DVec2::new(0.02, 0.0));
                assert!((variance - 1.0).abs() < 0.03, "{reads:?}, {texels} twice as long: {variance}");
            }
        }
        // Two taps of a square pixel, and one tap in general: the mip level represents the cell, which is as
        // wide as the pixel is long.
        let variance = transfer(DVec2::splat(2.0), PrefilterTaps::Two, DVec2::new(0.0, 0.02));
        assert!((variance - CELL_VARIANCE).abs() < 0.03, "{variance}");
        for (sides, times) in [(DVec2::splat(2.0), 1.0), (DVec2::new(3.0, 1.5), 4.0)] {
            let variance = transfer(sides, PrefilterTaps::One, DVec2::new(0.0, 0.01));
            assert!((variance - times * CELL_VARIANCE).abs() < 0.05 * times, "{sides}: {variance}");
        }
        // Pixels narrower than texels read the full texture.
        assert_eq!(
            Prefilter::new(DMat2::from_diagonal(DVec2::splat(0.7)), PrefilterTaps::One)
                .transfer(DVec2::new(0.2, 0.3)),
            1.0
        );
    }

    #[test]
    fn more_taps_reduce_the_prefilter_error() {
        // For a texture with power 1 / nu^2: RMS difference of the transfer function from that of the pixel's
        // area.
        let error = |sides: DVec2, reads| {
            let filter = Prefilter::new(DMat2::from_diagonal(sides), reads);
            let waves = (0..56 * 56).map(|i| {
                let cycles = (DVec2::new(f64::from(i % 56), f64::from(i / 56)) - 27.5) / 20.0;
                let power =
                    (sinc(cycles.x) * sinc(cycles.y)).powi(4) / (cycles - cycles.round()).length_squared();
                let exact = sinc(sides.x * cycles.x) * sinc(sides.y * cycles.y);
                (power, power * (filter.transfer(cycles) - exact).powi(2))
            });
            let (all, wrong) = waves.fold((0.0, 0.0), |sum, wave| (sum.0 + wave.0, sum.1 + wave.1));
            (wrong / all).sqrt()
        };
        // Texels along and across, and the errors of one tap, two, four and the grid: measured, rounded up.
        let expected = [
            ([0.7, 0.7], [0.06, 0.05, 0.01, 0.01]),
            ([1.0, 1.0], [0.07, 0.07, 0.02, 0.02]),
            ([2.0, 2.0], [0.10, 0.10, 0.05, 0.06]),
            ([3.0, 1.0], [0.20, 0.08, 0.04, 0.04]),
            ([8.0, 1.0], [0.32, 0.20, 0.08, 0.02]),
            ([8.0, 4.0], [0.20, 0.10, 0.08, 0.04]),
            ([16.0, 2.0], [0.35, 0.20, 0.10, 0.03]),
        ];
        for (sides, most) in expected {
            let errors = PrefilterTaps::ALL.map(|reads| error(DVec2::from_array(sides), reads));
            eprintln!("{sides:?}: {errors:.3?} of {most:?}");
            assert!((0..PrefilterTaps::ALL.len()).all(|k| errors[k] <= most[k]), "{sides:?}: {errors:?}");
        }
    }
}
