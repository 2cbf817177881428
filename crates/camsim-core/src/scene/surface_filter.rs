//! What the filter of the ideal frame's surfaces leaves of a wave of their pictures, by the reads that the
//! plan takes.

use glam::{DMat2, DVec2};

use serde::Serialize;

use crate::waves::{evenly, mean_of, sinc};

/// How a pixel of the ideal frame reads the picture of the surface that it shows. The order is that of cost.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum SurfaceReads {
    /// One, of a version of the picture for the pixel's longer axis.
    One,
    /// Two reads along the pixel's longer axis.
    Two,
    /// Four: two by two, or in a row where the pixel is long.
    Four,
    /// One or two across, and up to 32 along.
    Grid,
}

impl SurfaceReads {
    /// All of them, each at its own number.
    pub const ALL: [Self; 4] = [Self::One, Self::Two, Self::Four, Self::Grid];
}

/// As in shaders/ideal/surface.wgsl and shaders/ideal/reads.
const CLOSE_TEXELS: f64 = 0.8;
const CELL_VARIANCE: f64 = 1.5;
const IN_A_ROW: f64 = 1.6;
const MAX_TAPS: f64 = 32.0;
const SHORT_TAPS: f64 = 2.0;
const ONE_TAP: f64 = 0.5;

/// A smaller version of a picture.
struct Version {
    level: f64,
    /// Times 12, beyond what the picture has between its texels, texels^2: `3 (4^level - 1)`, a mixture
    /// between whole levels.
    variance: f64,
}

impl Version {
    fn of_level(level: f64) -> Self {
        Self {
            level,
            variance: 3.0 * ((2.0 * level.floor()).exp2() * (1.0 + 3.0 * (level - level.floor())) - 1.0),
        }
    }

    /// For reads `cell` texels apart.
    fn for_cell(cell: f64) -> Self {
        let variance = if cell > CLOSE_TEXELS { CELL_VARIANCE * cell * cell } else { 0.0 };
        let texels2 = variance / 3.0 + 1.0;
        let below = (0.5 * texels2.log2()).floor();
        Self { level: below + (texels2 / (2.0 * below).exp2() - 1.0) / 3.0, variance }
    }
}

/// The filter of the ideal frame's surfaces. Twin of `picture_at` in shaders/ideal/reads.
#[derive(Clone, Debug)]
pub struct SurfaceFilter {
    /// Sides of the grid of reads, texels, and its reads.
    sides: [DVec2; 2],
    taps: [u32; 2],
    level: f64,
}

impl SurfaceFilter {
    /// The reads of a pixel whose axes span so many texels.
    #[must_use]
    pub fn new(texel_from_ideal: DMat2, reads: SurfaceReads) -> Self {
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
        let ([long_taps, short_taps], Version { level, variance }) = match reads {
            SurfaceReads::One => ([1.0, 1.0], Version::for_cell(longer)),
            SurfaceReads::Two => ([2.0, 1.0], Version::for_cell((0.5 * longer).max(shorter))),
            SurfaceReads::Four if longer < IN_A_ROW * shorter.max(1.0) => {
                ([2.0, 2.0], Version::for_cell(0.5 * longer))
            }
            SurfaceReads::Four => ([4.0, 1.0], Version::for_cell((0.25 * longer).max(shorter))),
            SurfaceReads::Grid => {
                let short_taps = if shorter > ONE_TAP { SHORT_TAPS } else { 1.0 };
                let covered = (shorter / short_taps).max(1.0);
                let long_taps = (longer / covered - 0.1).ceil().clamp(short_taps, MAX_TAPS);
                ([long_taps, short_taps], Version::of_level((longer / long_taps).max(covered).log2()))
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

    /// The version that is read, and the sides of the grid of reads, texels of the picture itself.
    #[cfg(test)]
    pub fn reads(&self) -> (f64, [DVec2; 2]) {
        (self.level, self.sides)
    }

    /// How many reads there are.
    pub fn taps(&self) -> u32 {
        self.taps[0] * self.taps[1]
    }

    /// Whether each of them is of two versions of the picture.
    pub fn is_of_two(&self) -> bool {
        self.level > 0.0
    }

    /// What is left of a wave beyond what the texture itself has.
    pub fn leaves(&self, cycles: DVec2) -> f64 {
        let grid: f64 = (0..2).map(|k| evenly(self.taps[k], self.sides[k].dot(cycles))).product();
        let below = self.level.floor();
        let version = |level: f64| {
            let texels = level.exp2();
            let axis = |nu: f64| {
                let own = sinc(nu);
                if texels < 1.5 || own.abs() < 1e-3 {
                    1.0
                } else {
                    mean_of(texels as u32, nu) * (sinc(texels * nu) / own).powi(2)
                }
            };
            axis(cycles.x) * axis(cycles.y)
        };
        let share = self.level - below;
        grid * ((1.0 - share) * version(below) + if share > 0.0 { share * version(below + 1.0) } else { 0.0 })
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    #[test]
    fn the_surface_filter_has_the_variance_of_the_pixel() {
        // 1 - 2 pi^2 f^2 variance for low frequencies; a pixel has 1/12.
        let of = |sides: DVec2, reads, f: DVec2| {
            let filter = SurfaceFilter::new(DMat2::from_diagonal(sides), reads);
            12.0 * (1.0 - filter.leaves(f / sides)) / (2.0 * PI * PI * f.length_squared())
        };
        for texels in [0.7, 1.0, 1.5, 2.0, 3.0, 4.0, 6.5, 8.0] {
            for reads in [SurfaceReads::Four, SurfaceReads::Grid] {
                let variance = of(DVec2::splat(texels), reads, DVec2::new(0.02, 0.0));
                assert!((variance - 1.0).abs() < 0.03, "{reads:?}, {texels}: {variance}");
            }
            // Twice as long: no filter may fail along the longer axis.
            for reads in [SurfaceReads::Two, SurfaceReads::Four, SurfaceReads::Grid] {
                let variance = of(DVec2::new(2.0 * texels, texels), reads, DVec2::new(0.02, 0.0));
                assert!((variance - 1.0).abs() < 0.03, "{reads:?}, {texels} twice as long: {variance}");
            }
        }
        // Two reads of a square, and one of anything: what stands for the cell, which is as wide as the pixel
        // is long.
        let variance = of(DVec2::splat(2.0), SurfaceReads::Two, DVec2::new(0.0, 0.02));
        assert!((variance - CELL_VARIANCE).abs() < 0.03, "{variance}");
        for (sides, times) in [(DVec2::splat(2.0), 1.0), (DVec2::new(3.0, 1.5), 4.0)] {
            let variance = of(sides, SurfaceReads::One, DVec2::new(0.0, 0.01));
            assert!((variance - times * CELL_VARIANCE).abs() < 0.05 * times, "{sides}: {variance}");
        }
        // Pixels narrower than texels: the picture itself.
        assert_eq!(
            SurfaceFilter::new(DMat2::from_diagonal(DVec2::splat(0.7)), SurfaceReads::One)
                .leaves(DVec2::new(0.2, 0.3)),
            1.0
        );
    }

    #[test]
    fn more_reads_are_nearer_to_the_pixel() {
        // Of a texture with the power 1 / nu^2, what is left of its waves against the mean over the pixel,
        // RMS of the texture's own.
        let error = |sides: DVec2, reads| {
            let filter = SurfaceFilter::new(DMat2::from_diagonal(sides), reads);
            let waves = (0..56 * 56).map(|i| {
                let cycles = (DVec2::new(f64::from(i % 56), f64::from(i / 56)) - 27.5) / 20.0;
                let power =
                    (sinc(cycles.x) * sinc(cycles.y)).powi(4) / (cycles - cycles.round()).length_squared();
                let exact = sinc(sides.x * cycles.x) * sinc(sides.y * cycles.y);
                (power, power * (filter.leaves(cycles) - exact).powi(2))
            });
            let (all, wrong) = waves.fold((0.0, 0.0), |sum, wave| (sum.0 + wave.0, sum.1 + wave.1));
            (wrong / all).sqrt()
        };
        // Texels along and across, and what one read, two, four and the grid miss: measured, rounded up.
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
            let found = SurfaceReads::ALL.map(|reads| error(DVec2::from_array(sides), reads));
            eprintln!("{sides:?}: {found:.3?} of {most:?}");
            assert!((0..SurfaceReads::ALL.len()).all(|k| found[k] <= most[k]), "{sides:?}: {found:?}");
        }
    }
}
