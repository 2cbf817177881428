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

#[cfg(test)]
mod exact;
mod lanes;
mod waves;

use std::f64::consts::PI;

use glam::{DVec2, Vec4};

use super::grain::mean_of;
use crate::temporal::Footprint;
use lanes::{Frequencies4, Sampler};
pub(super) use waves::{Waves, error2};

/// Of a wave less than this is left out: nine together move the error of a pixel by less than a hundredth of the wave.
const UNSEEN: f64 = 1e-3;

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
pub(super) fn evenly(n: u32, x: f64) -> f64 {
    mean_of(n, x / f64::from(n))
}

/// Samples on the path of an exposure, ideal pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Path {
    pub along: DVec2,
    pub samples: u32,
}

/// A complex number: what is left of a wave, and how far it is shifted.
pub(super) type Wave = DVec2;

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

/// A read of a wave or of one that looks like it on the grid of ideal pixels.
struct Read {
    /// Which of the waves.
    of: usize,
    /// Cycles an ideal pixel.
    f: DVec2,
    /// What one read leaves.
    leaves: Wave,
}

/// The wave itself, and those that it looks like on the grid of ideal pixels, the slow ones foremost, as far as they count.
fn reads_of(of: usize, f: DVec2, area: &Footprint, beside_px: DVec2) -> impl Iterator<Item = Read> {
    let [x, y] = [0, 1].map(|k| aliases(area.spline.map(|softness| softness[k]), f[k], beside_px[k]));
    let both = (0..9).map(move |i| {
        let (x, y) = (&x[i / 3], &y[i % 3]);
        Read { of, f: DVec2::new(x.seen, y.seen), leaves: x.read.rotate(y.read) }
    });
    both.filter(|read| read.leaves.length_squared() >= UNSEEN * UNSEEN)
}

/// What reading the ideal frame leaves of waves, each with the place between ideal pixels where it is read.
pub(super) fn read_waves(waves: &[[DVec2; 2]], area: &Footprint, over: Over) -> Vec<Wave> {
    let reads: Vec<Read> = waves.iter().enumerate().flat_map(|(of, &[f, beside_px])| reads_of(of, f, area, beside_px)).collect();
    sum_of(&reads, waves.len(), area, over)
}

/// What is left of so many waves, four reads at a time.
fn sum_of(reads: &[Read], count: usize, area: &Footprint, over: Over) -> Vec<Wave> {
    let sampler = Sampler::new(area, over);
    let mut left = vec![Wave::ZERO; count];
    for four in reads.chunks(4) {
        let of_four = |value: &dyn Fn(&Read) -> f64| Vec4::from_array(std::array::from_fn(|i| four.get(i).map_or(0.0, value) as f32));
        let sampled = sampler.leaves(Frequencies4 { x: of_four(&|read| read.f.x), y: of_four(&|read| read.f.y) });
        for (i, read) in four.iter().enumerate() {
            left[read.of] += read.leaves.rotate(Wave::new(f64::from(sampled.re[i]), f64::from(sampled.im[i])));
        }
    }
    left
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::temporal::ColorImage;

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
}
