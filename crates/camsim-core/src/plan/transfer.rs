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

mod lanes;
mod waves;

use std::f64::consts::PI;

use glam::DVec2;

use super::grain::mean_of;
use crate::{scenario::MAX_FOOTPRINT_TAPS, temporal::Footprint};
pub(super) use waves::{Waves, error2};

/// Of a wave less than this is left out: nine together move the error of a pixel by less than a hundredth of the wave.
const UNSEEN: f64 = 1e-3;
/// Taps along a side that the plan asks for by itself, at most.
const FEW_TAPS: u32 = 4;
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
}
