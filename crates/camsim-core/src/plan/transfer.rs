//! What the stages between a texture and a pixel leave of a wave: transfer functions.
//!
//! Frequencies `f` are cycles an ideal pixel, `nu` cycles a texel; `sinc(x) = sin(pi x) / (pi x)`.
//!
//! | stage | leaves |
//! |---|---|
//! | texture, bilinear between texels | `sinc^2(nu_x) sinc^2(nu_y)` |
//! | surface filter, some reads of a smaller version | mean over the reads, times what a version of 2^m texels has |
//! | bilinear read between ideal pixels | `sinc^2(f_x) sinc^2(f_y)`, and as much of `f + k` for whole `k` |
//! | spline | that of Catmull and Rom's kernel and of the B-spline, mixed by softness; the same aliases |
//! | grid of reads, samples on a path | `sin(pi n x) / (n sin(pi x))` of the step along each |
//! | exact: mean over the pixel's sides and the path | `sinc` of each |

use std::f64::consts::{LN_2, PI};

use glam::{DMat2, DVec2};

use super::{
    SurfaceReads,
    grain::{Spectrum, mean_of},
};
use crate::{scenario::MAX_FOOTPRINT_TAPS, temporal::Footprint};

/// Frequencies that count, cycles an ideal pixel: two an octave from the lowest up, in six directions of a half-plane.
const LOWEST: f64 = 0.062_5;
const OCTAVES: u32 = 6;
const AN_OCTAVE: u32 = 2;
const DIRECTIONS: u32 = 6;
/// Cycles a texel above which a bilinear texture has no more to show.
const MOST_CYCLES: f64 = 1.5;
/// Of a wave less than this is left out: nine together move the error of a pixel by less than a hundredth of the wave.
const UNSEEN: f64 = 1e-3;
/// Taps along a side that the plan asks for by itself, at most.
const FEW_TAPS: u32 = 4;
/// As in shaders/ideal/surface.wgsl and shaders/ideal/reads.
const CLOSE_TEXELS: f64 = 0.8;
const CELL_VARIANCE: f64 = 1.5;
const IN_A_ROW: f64 = 1.6;
const MAX_TAPS: f64 = 32.0;
const SHORT_TAPS: f64 = 2.0;
const ONE_TAP: f64 = 0.5;

pub(super) fn sinc(x: f64) -> f64 {
    if x.abs() < 1e-6 { 1.0 } else { sin_pi(x) / (PI * x) }
}

/// `sin(pi x)` to 3e-11, in a fifth of the time: most of what levels take is spent here.
pub(super) fn sin_pi(x: f64) -> f64 {
    // Adding this rounds to a whole number, whose lowest bit tells the sign.
    const WHOLE: f64 = 1.5 * (1_u64 << 52) as f64;
    // Of x, x^3, ...: least squares over half a turn, of the relative error.
    const SERIES: [f64; 6] = [
        3.141_592_653_536_209,
        -5.167_712_764_617_051,
        2.550_163_318_755_717,
        -0.599_252_195_857_807,
        0.082_050_393_077_642_25,
        -0.007_028_372_448_082_572,
    ];
    let whole = x + WHOLE;
    let beside = x - (whole - WHOLE);
    let square = beside * beside;
    let sine = beside * SERIES.iter().rev().fold(0.0, |sum, term| sum * square + term);
    if whole.to_bits() & 1 == 0 { sine } else { -sine }
}

/// A wave after so many turns.
fn turned_by(turns: f64) -> Wave {
    Wave::new(sin_pi(2.0 * turns + 0.5), sin_pi(2.0 * turns))
}

/// Catmull and Rom's kernel: the transform of Keys's cubic convolution with a = -1/2 (1981).
fn catmull_rom(f: f64) -> f64 {
    if f.abs() < 0.02 {
        return 1.0;
    }
    let (one, two) = (sinc(f), sinc(2.0 * f));
    (3.0 * (one * one - two) - (3.0 * two * two - 2.0 * two - sinc(4.0 * f))) / (PI * f).powi(2)
}

/// A read of the ideal frame along one axis; softness as of [`Footprint::spline`], `None` is bilinear.
fn read(softness: Option<f64>, f: f64) -> f64 {
    match softness {
        None => sinc(f).powi(2),
        Some(soft) if soft > 0.0 => (1.0 - soft) * catmull_rom(f) + soft * sinc(f).powi(4),
        Some(_) => catmull_rom(f),
    }
}

/// `n` samples evenly over a stretch of `x` cycles.
fn evenly(n: u32, x: f64) -> f64 {
    mean_of(n, x / f64::from(n))
}

/// A smaller version of a picture.
struct Version {
    level: f64,
    /// Times 12, beyond what the picture has between its texels, texels^2: `3 (4^level - 1)`, a mixture between whole levels.
    variance: f64,
}

impl Version {
    fn of_level(level: f64) -> Self {
        Self { level, variance: 3.0 * ((2.0 * level.floor()).exp2() * (1.0 + 3.0 * (level - level.floor())) - 1.0) }
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
pub(crate) struct SurfaceFilter {
    /// Sides of the grid of reads, texels, and its reads.
    sides: [DVec2; 2],
    taps: [u32; 2],
    level: f64,
}

impl SurfaceFilter {
    pub fn new(texel_from_ideal: DMat2, reads: SurfaceReads) -> Self {
        let DMat2 { x_axis: dx, y_axis: dy } = texel_from_ideal;
        let [a, b, c] = [dx.x * dx.x + dy.x * dy.x, dx.x * dx.y + dy.x * dy.y, dx.y * dx.y + dy.y * dy.y];
        let mean = 0.5 * (a + c);
        let spread = (0.25 * (a - c) * (a - c) + b * b).sqrt();
        let (longer, shorter) = ((mean + spread).sqrt(), (mean - spread).max(0.0).sqrt());
        let along = if spread > 1e-6 * mean {
            let both = if a >= c { DVec2::new(0.5 * (a - c) + spread, b) } else { DVec2::new(b, 0.5 * (c - a) + spread) };
            both.normalize_or(DVec2::X)
        } else {
            DVec2::X
        };
        let ([long_taps, short_taps], Version { level, variance }) = match reads {
            SurfaceReads::One => ([1.0, 1.0], Version::for_cell(longer)),
            SurfaceReads::Two => ([2.0, 1.0], Version::for_cell((0.5 * longer).max(shorter))),
            SurfaceReads::Four if longer < IN_A_ROW * shorter.max(1.0) => ([2.0, 2.0], Version::for_cell(0.5 * longer)),
            SurfaceReads::Four => ([4.0, 1.0], Version::for_cell((0.25 * longer).max(shorter))),
            SurfaceReads::Grid => {
                let short_taps = if shorter > ONE_TAP { SHORT_TAPS } else { 1.0 };
                let covered = (shorter / short_taps).max(1.0);
                let long_taps = (longer / covered - 0.1).ceil().clamp(short_taps, MAX_TAPS);
                ([long_taps, short_taps], Version::of_level((longer / long_taps).max(covered).log2()))
            }
        };
        let length = |side: f64, taps: f64| ((side * side - variance).max(0.0) / (1.0 - (taps * taps).recip()).max(0.5)).sqrt();
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
    fn leaves(&self, cycles: DVec2) -> f64 {
        let grid: f64 = (0..2).map(|k| evenly(self.taps[k], self.sides[k].dot(cycles))).product();
        let below = self.level.floor();
        let version = |level: f64| {
            let texels = level.exp2();
            let axis = |nu: f64| {
                let own = sinc(nu);
                if texels < 1.5 || own.abs() < 1e-3 { 1.0 } else { mean_of(texels as u32, nu) * (sinc(texels * nu) / own).powi(2) }
            };
            axis(cycles.x) * axis(cycles.y)
        };
        let share = self.level - below;
        grid * ((1.0 - share) * version(below) + if share > 0.0 { share * version(below + 1.0) } else { 0.0 })
    }
}

/// Samples on the path of an exposure, ideal pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Path {
    pub along: DVec2,
    pub samples: u32,
}

/// A complex number: what is left of a wave, and how far it is shifted.
pub(super) type Wave = DVec2;

/// The samples of an exposure, each at its place on the path and at one of the taps in turn. Those of one tap stand evenly on the path: their
/// sum is a geometric one.
fn sampled(area: &Footprint, path: Path, f: DVec2) -> Wave {
    let Path { along, samples } = path;
    let (taps, cycles) = (area.taps[0] * area.taps[1], along.dot(f));
    if taps == 1 || samples > 8 * taps {
        return Wave::new(grid(area, f) * evenly(samples, cycles), 0.0);
    }
    if area.taps.iter().all(|&side| side <= FEW_TAPS) {
        in_turns::<{ FEW_TAPS as usize }>(area, samples, cycles, f)
    } else {
        in_turns::<{ MAX_FOOTPRINT_TAPS as usize }>(area, samples, cycles, f)
    }
}

/// A wave that is then turned by a step.
fn after(wave: &mut Wave, step: Wave) -> Wave {
    let next = wave.rotate(step);
    std::mem::replace(wave, next)
}

/// The same with at most `SIDE` taps along each side: of each tap its samples' mean, turned by where the middle of them is on the path and by where the tap is
/// in the grid. From tap to tap both turn by as much again.
fn in_turns<const SIDE: usize>(area: &Footprint, samples: u32, cycles: f64, f: DVec2) -> Wave {
    let line = |side: DVec2, taps: u32| -> [Wave; SIDE] {
        let turns = side.dot(f) / f64::from(taps);
        let (mut at, step) = (turned_by(0.5 * turns * (1.0 - f64::from(taps))), turned_by(turns));
        std::array::from_fn(|_| after(&mut at, step))
    };
    let (columns, rows) = (line(area.dx, area.taps[0]), line(area.dy, area.taps[1]));
    let taps = area.taps[0] * area.taps[1];
    let (step, a_sample) = (f64::from(taps) / f64::from(samples), cycles / f64::from(samples));
    let to_next = turned_by(a_sample);
    // The first taps have one sample more than the others.
    let most = samples.div_ceil(taps);
    let with_most = samples - (most - 1) * taps;
    let of_taps = |first: u32, end: u32, count: u32| {
        let middle = 0.5 - 0.5 * f64::from(samples) + f64::from(first) + 0.5 * f64::from(taps) * f64::from(count - 1);
        let mut on_path = f64::from(count) * mean_of(count, step * cycles) * turned_by(middle * a_sample);
        let of_tap = |tap: u32| {
            let [column, row] = area.cell(tap).map(|k| k as usize);
            after(&mut on_path, to_next).rotate(columns[column].rotate(rows[row]))
        };
        (first..end).map(of_tap).sum::<Wave>()
    };
    let of_others = if most > 1 { of_taps(with_most, taps, most - 1) } else { Wave::ZERO };
    (of_taps(0, with_most, most) + of_others) / f64::from(samples)
}

/// The grid of taps.
fn grid(area: &Footprint, f: DVec2) -> f64 {
    evenly(area.taps[0], area.dx.dot(f)) * evenly(area.taps[1], area.dy.dot(f))
}

/// One axis of a wave that looks like another on the grid of ideal pixels.
struct Alias {
    seen: f64,
    /// What a read leaves of it, turned as the read's place turns it.
    read: Wave,
}

/// A wave along one axis and the slowest two that look like it.
fn aliases(softness: Option<f64>, f: f64, beside_px: f64) -> [Alias; 3] {
    [-1.0, 0.0, 1.0].map(|step: f64| {
        let away = step - f.round();
        let seen = f + away;
        Alias { seen, read: read(softness, seen) * turned_by(away * beside_px) }
    })
}

/// Waves of a texture that a pixel sees.
#[derive(Debug)]
pub(super) struct Waves(Vec<Seen>);

#[derive(Debug)]
struct Seen {
    /// Cycles an ideal pixel, and cycles a texel.
    f: DVec2,
    cycles: DVec2,
    power: f64,
    /// What the exact mean leaves.
    exact: f64,
}

impl Waves {
    /// `sides`: of the pixel, ideal px; `along`: the path over the exposure, if that shows.
    pub fn new(spectrum: &Spectrum, texel_from_ideal: DMat2, sides: DMat2, along: Option<DVec2>) -> Self {
        let per_texel = texel_from_ideal.determinant().abs().recip();
        let texel_cycles = texel_from_ideal.inverse().transpose();
        let wave = |(i, j): (u32, u32)| {
            let length = LOWEST * ((f64::from(i) + 0.5) / f64::from(AN_OCTAVE)).exp2();
            // Of a half-plane: the other half is its mirror image.
            let weight = 2.0 * length * length * LN_2 / f64::from(AN_OCTAVE) * PI / f64::from(DIRECTIONS);
            let f = length * DVec2::from_angle(PI * (f64::from(j) + 0.5) / f64::from(DIRECTIONS));
            let cycles = texel_cycles * f;
            if cycles.abs().max_element() > MOST_CYCLES {
                return None;
            }
            let power = weight * per_texel * spectrum.density_at(cycles) * (sinc(cycles.x) * sinc(cycles.y)).powi(4);
            let exact = sinc(sides.x_axis.dot(f)) * sinc(sides.y_axis.dot(f)) * along.map_or(1.0, |along| sinc(along.dot(f)));
            Some(Seen { f, cycles, power, exact })
        };
        Self((0..OCTAVES * AN_OCTAVE).flat_map(|i| (0..DIRECTIONS).map(move |j| (i, j))).filter_map(wave).collect())
    }

    /// What the filter of the surfaces leaves of each.
    pub fn filtered(&self, filter: &SurfaceFilter) -> Vec<f64> {
        self.0.iter().map(|wave| filter.leaves(wave.cycles)).collect()
    }

    /// What reading the ideal frame leaves of each, over the path or with its samples. `beside_px` is where the source lies between ideal pixels.
    pub fn read(&self, area: &Footprint, over: Over, beside_px: DVec2) -> Vec<Wave> {
        self.0.iter().map(|wave| read_wave(wave.f, area, over, beside_px)).collect()
    }
}

/// What reads are taken over.
#[derive(Clone, Copy, Debug)]
pub(super) enum Over {
    /// One instant.
    Instant,
    /// All of a path.
    All(DVec2),
    /// Its samples.
    Samples(Path),
}

/// The wave itself, and those that it looks like on the grid of ideal pixels, the slow ones foremost.
pub(super) fn read_wave(f: DVec2, area: &Footprint, over: Over, beside_px: DVec2) -> Wave {
    let [x, y] = [0, 1].map(|k| aliases(area.spline.map(|softness| softness[k]), f[k], beside_px[k]));
    let seen = x.iter().flat_map(|x| y.iter().map(move |y| (x, y)));
    let of = |(x, y): (&Alias, &Alias)| {
        let turned = x.read.rotate(y.read);
        if turned.length_squared() < UNSEEN * UNSEEN {
            return Wave::ZERO;
        }
        let seen = DVec2::new(x.seen, y.seen);
        match over {
            Over::Instant => turned * grid(area, seen),
            Over::All(along) => turned * grid(area, seen) * sinc(along.dot(seen)),
            Over::Samples(path) => turned.rotate(sampled(area, path, seen)),
        }
    };
    seen.map(of).sum()
}

/// Expected squared error of a pixel, of the linear range.
pub(super) fn error2(waves: &Waves, filtered: &[f64], read: &[Wave]) -> f64 {
    let parts = waves.0.iter().zip(filtered).zip(read);
    parts.map(|((wave, &ideal), &read)| wave.power * (ideal * read - Wave::new(wave.exact, 0.0)).length_squared()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::temporal::{ColorImage, TapStage};

    /// A wave read between the pixels of a picture, over positions and phases: mean squared difference from `exact` times the wave itself.
    fn measured(f: DVec2, softness: Option<f64>, at: DVec2, exact: f64) -> f64 {
        let turns = 12;
        let size_px = [24, 24];
        let area = Footprint { dx: DVec2::ZERO, dy: DVec2::ZERO, taps: [1, 1], spline: softness.map(DVec2::splat) };
        let wave = |px: DVec2, phase: f64| (2.0 * PI * f.dot(px) + phase).cos();
        let squares = (0..turns).map(|turn| {
            let phase = 2.0 * PI * f64::from(turn) / f64::from(turns);
            let value = |i: u32| wave(DVec2::new(f64::from(i % 24), f64::from(i / 24)), phase) as f32;
            let rgba: Vec<f32> = (0..24 * 24).flat_map(|i| [value(i), 0.0, 0.0, 1.0]).collect();
            let px = DVec2::new(11.0, 12.0) + at;
            (area.tap_color(&ColorImage { size_px, rgba: &rgba }, px, 0).x - exact * wave(px, phase)).powi(2)
        });
        squares.sum::<f64>() / f64::from(turns)
    }

    #[test]
    fn samples_in_turns_are_the_sum_of_them_all() {
        for (taps, samples) in
            [([4, 4], 7), ([4, 4], 16), ([4, 4], 41), ([3, 2], 5), ([2, 4], 64), ([7, 3], 30), ([1, 5], 3), ([64, 64], 9000)]
        {
            let area = Footprint { dx: DVec2::new(3.1, 0.4), dy: DVec2::new(-0.2, 2.7), taps, spline: None };
            let along = DVec2::new(5.3, -2.1);
            for f in [DVec2::new(0.11, 0.05), DVec2::new(-0.7, 0.3), DVec2::new(1.4, 0.9)] {
                let wave = |k: u32| {
                    let share = (f64::from(k) + 0.5) / f64::from(samples) - 0.5;
                    DVec2::from_angle(2.0 * PI * (area.offset_px(k) + share * along).dot(f))
                };
                let all = (0..samples).map(wave).sum::<DVec2>() / f64::from(samples);
                let found = sampled(&area, Path { along, samples }, f);
                // The short sine is off by 3e-11, and the same way in every turn.
                let bound = 1e-10 * f64::from(1 + taps[0] * taps[1]);
                assert!(found.distance(all) < bound, "{taps:?} {samples} {f}: {found} {all}");
            }
        }
    }

    #[test]
    fn reads_between_pixels_leave_and_alias_what_their_transforms_say() {
        for softness in [None, Some(0.0), Some(0.4)] {
            for f in [DVec2::new(0.11, 0.05), DVec2::new(0.3, -0.2), DVec2::new(0.45, 0.4)] {
                for at in [DVec2::ZERO, DVec2::new(0.5, 0.5), DVec2::new(0.2, 0.7)] {
                    let exact = 0.8;
                    let left: DVec2 = (-40..=40)
                        .flat_map(|x| (-40..=40).map(move |y| DVec2::new(f64::from(x), f64::from(y))))
                        .map(|away| {
                            read(softness, (f + away).x) * read(softness, (f + away).y) * DVec2::from_angle(2.0 * PI * away.dot(at))
                        })
                        .sum();
                    // The mean square of a real wave is half of its squared amplitude.
                    let expected = 0.5 * (left - DVec2::new(exact, 0.0)).length_squared();
                    let found = measured(f, softness, at, exact);
                    // Further aliases, and the four corners that the spline leaves out.
                    assert!((found.sqrt() - expected.sqrt()).abs() < 0.01, "{softness:?} {f} {at}: {found:.5} {expected:.5}");
                }
            }
        }
    }

    #[test]
    fn the_short_sine_is_a_sine() {
        for i in -4000..4000 {
            let x = f64::from(i) * 0.003_7;
            assert!((sin_pi(x) - (PI * x).sin()).abs() < 3e-11, "{x}: {}", sin_pi(x) - (PI * x).sin());
        }
        assert!((sin_pi(1e6 + 0.25) - 0.5_f64.sqrt()).abs() < 3e-11);
    }

    #[test]
    fn samples_of_each_tap_add_up() {
        let area = Footprint { dx: DVec2::new(2.3, 0.4), dy: DVec2::new(-0.2, 1.9), taps: [3, 2], spline: None };
        for samples in [1, 4, 6, 17, 48] {
            let path = Path { along: DVec2::new(7.0, -3.0), samples };
            for f in [DVec2::new(0.1, 0.03), DVec2::new(-0.4, 0.3), DVec2::ZERO] {
                let at = |i: u32| area.offset_px(i) + path.along * ((f64::from(i) + 0.5) / f64::from(samples) - 0.5);
                let each: Wave = (0..samples).map(|i| Wave::from_angle(2.0 * PI * f.dot(at(i)))).sum::<Wave>() / f64::from(samples);
                assert!(sampled(&area, path, f).distance(each) < 1e-9, "{samples} samples, {f}");
            }
        }
    }

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
        // Two reads of a square, and one of anything: what stands for the cell, which is as wide as the pixel is long.
        let variance = of(DVec2::splat(2.0), SurfaceReads::Two, DVec2::new(0.0, 0.02));
        assert!((variance - CELL_VARIANCE).abs() < 0.03, "{variance}");
        for (sides, times) in [(DVec2::splat(2.0), 1.0), (DVec2::new(3.0, 1.5), 4.0)] {
            let variance = of(sides, SurfaceReads::One, DVec2::new(0.0, 0.01));
            assert!((variance - times * CELL_VARIANCE).abs() < 0.05 * times, "{sides}: {variance}");
        }
        // Pixels narrower than texels: the picture itself.
        assert_eq!(SurfaceFilter::new(DMat2::from_diagonal(DVec2::splat(0.7)), SurfaceReads::One).leaves(DVec2::new(0.2, 0.3)), 1.0);
    }

    #[test]
    fn more_reads_are_nearer_to_the_pixel() {
        // Of a texture with the power 1 / nu^2, what is left of its waves against the mean over the pixel, RMS of the texture's own.
        let error = |sides: DVec2, reads| {
            let filter = SurfaceFilter::new(DMat2::from_diagonal(sides), reads);
            let waves = (0..56 * 56).map(|i| {
                let cycles = (DVec2::new(f64::from(i % 56), f64::from(i / 56)) - 27.5) / 20.0;
                let power = (sinc(cycles.x) * sinc(cycles.y)).powi(4) / (cycles - cycles.round()).length_squared();
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

    #[test]
    fn an_aligned_pixel_reads_nothing_between_pixels_and_one_beside_does() {
        let spectrum = Spectrum::flat(-2.0);
        let filter = SurfaceFilter::new(DMat2::IDENTITY, SurfaceReads::Grid);
        let error = |stage, beside_px| {
            let area = Footprint::new(DVec2::X, DVec2::Y, stage);
            let waves = Waves::new(&spectrum, DMat2::IDENTITY, DMat2::IDENTITY, None);
            error2(&waves, &waves.filtered(&filter), &waves.read(&area, Over::Instant, beside_px))
        };
        let half = DVec2::splat(0.5);
        assert!(error(TapStage::Bilinear, half) > 2.0 * error(TapStage::Bilinear, DVec2::ZERO));
        assert!(error(TapStage::Bilinear, half) > 1.5 * error(TapStage::Spline, half));
        assert!(error(TapStage::Spline, half) > 2.0 * error(TapStage::Spline, DVec2::ZERO));
    }
}
