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
//! | mean over an area of the sides `a` | `sinc(f_x) sinc(a_x f_x) sinc(f_y) sinc(a_y f_y)`; the same aliases |
//! | grid of reads, samples on a path | `sin(pi n x) / (n sin(pi x))` of the step along each |
//! | exact: mean over the pixel's sides and the path | `sinc` of each |

#[cfg(test)]
mod exact;
mod lanes;
mod waves;

use std::f64::consts::PI;

use glam::{DVec2, Vec4};

use camsim_core::temporal::{Footprint, Kernel};
use camsim_core::waves::{sin_pi, sinc};
use lanes::{Frequencies4, Sampler};
pub(super) use waves::{Waves, error2};

/// Of a wave less than this is left out: nine together move the error of a pixel by less than a hundredth of
/// the wave.
const UNSEEN: f64 = 1e-3;

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

/// Samples on the path of an exposure, ideal pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Path {
    pub along: DVec2,
    pub samples: u32,
}

/// A complex number: what is left of a wave, and how far it is shifted.
pub(super) type Wave = DVec2;

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

/// One axis of a wave that looks like another on the grid of ideal pixels.
#[derive(Clone, Copy)]
struct Alias {
    /// Whole cycles between the two, and what is left.
    away: i32,
    seen: f64,
    /// What reads leave of it: a mean over a pixel, a bilinear one, and the two kernels that a spline is
    /// mixed of.
    mean: f64,
    bilinear: f64,
    sharp: f64,
    soft: f64,
}

impl Alias {
    /// The slowest three.
    fn all(f: f64) -> [Self; 3] {
        [-1, 0, 1].map(|step| Self::new(f, step))
    }

    fn new(f: f64, step: i32) -> Self {
        let away = step - f.round() as i32;
        let seen = f + f64::from(away);
        let mean = sinc(seen);
        Self { away, seen, mean, bilinear: mean.powi(2), sharp: catmull_rom(seen), soft: mean.powi(4) }
    }

    /// What a read leaves of it along x (0) or y (1).
    fn read(&self, kernel: Kernel, axis: usize) -> f64 {
        match kernel {
            Kernel::Bilinear => self.bilinear,
            Kernel::Spline(softness) => self.sharp + softness[axis] * (self.soft - self.sharp),
            Kernel::Area(sides_px) => self.mean * sinc(sides_px[axis] * self.seen),
        }
    }
}

/// Reads of waves and of those that look like them on the grid of ideal pixels.
struct Reads {
    /// Which of the waves.
    of: Vec<u32>,
    /// Cycles an ideal pixel.
    x: Vec<f32>,
    y: Vec<f32>,
    /// What one read leaves.
    leaves: Vec<Wave>,
}

impl Reads {
    /// For so many waves, each with about as many others that count as there are.
    fn of_waves(count: usize) -> Self {
        let most = 5 * count;
        let cycles = || Vec::with_capacity(most);
        Self { of: Vec::with_capacity(most), x: cycles(), y: cycles(), leaves: Vec::with_capacity(most) }
    }

    /// Those of one wave, as far as they count; `turned` by where it is read, for so many whole cycles along
    /// x and y.
    fn add(
        &mut self,
        of: usize,
        [along_x, along_y]: &[[Alias; 3]; 2],
        area: &Footprint,
        turned: impl Fn([usize; 2]) -> Wave,
    ) {
        let by_y = [0, 1, 2].map(|k: usize| along_y[k].read(area.kernel, 1));
        for (i, x) in along_x.iter().enumerate() {
            let by_x = x.read(area.kernel, 0);
            for (k, y) in along_y.iter().enumerate() {
                let by_both = by_x * by_y[k];
                if by_both.abs() >= UNSEEN {
                    self.of.push(of as u32);
                    self.x.push(x.seen as f32);
                    self.y.push(y.seen as f32);
                    self.leaves.push(by_both * turned([i, k]));
                }
            }
        }
    }

    /// What is left of so many waves, four reads at a time.
    fn sum(mut self, count: usize, area: &Footprint, over: Over) -> Vec<Wave> {
        let (sampler, reads) = (Sampler::new(area, over), self.of.len());
        for cycles in [&mut self.x, &mut self.y] {
            cycles.resize(reads.next_multiple_of(4), 0.0);
        }
        let mut left = vec![Wave::ZERO; count];
        let fours = self.x.chunks_exact(4).zip(self.y.chunks_exact(4));
        for ((x, y), (of, leaves)) in fours.zip(self.of.chunks(4).zip(self.leaves.chunks(4))) {
            let sampled = sampler.leaves(Frequencies4 { x: Vec4::from_slice(x), y: Vec4::from_slice(y) });
            for (i, (&of, leaves)) in of.iter().zip(leaves).enumerate() {
                left[of as usize] +=
                    leaves.rotate(Wave::new(f64::from(sampled.re[i]), f64::from(sampled.im[i])));
            }
        }
        left
    }
}

/// A wave that is always read at the same place between ideal pixels.
pub(super) struct PlacedWave {
    aliases: [[Alias; 3]; 2],
    /// Of each alias along x and y, by that place.
    turned: [[Wave; 3]; 2],
}

impl PlacedWave {
    /// Cycles an ideal pixel, and the place beside an ideal pixel.
    pub fn new(f: DVec2, beside_px: DVec2) -> Self {
        let aliases = [Alias::all(f.x), Alias::all(f.y)];
        let turned =
            [0, 1].map(|k: usize| aliases[k].map(|alias| turned_by(f64::from(alias.away) * beside_px[k])));
        Self { aliases, turned }
    }
}

/// What reading the ideal frame leaves of waves.
pub(super) fn read_waves<'a>(
    waves: impl ExactSizeIterator<Item = &'a PlacedWave>,
    area: &Footprint,
    over: Over,
) -> Vec<Wave> {
    let count = waves.len();
    let mut reads = Reads::of_waves(count);
    for (of, PlacedWave { aliases, turned }) in waves.enumerate() {
        reads.add(of, aliases, area, |[x, y]| turned[0][x].rotate(turned[1][y]));
    }
    reads.sum(count, area, over)
}

#[cfg(test)]
mod tests {
    use super::{exact::read, *};
    use camsim_core::temporal::ColorImage;

    /// A wave read between the pixels of a picture, over positions and phases: mean squared difference from
    /// `exact` times the wave itself.
    fn measured(f: DVec2, kernel: Kernel, at: DVec2, exact: f64) -> f64 {
        let turns = 12;
        let size_px = [24, 24];
        let area = Footprint { dx: DVec2::ZERO, dy: DVec2::ZERO, taps: [1, 1], kernel };
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
        let splines = [0.0, 0.4].map(|softness| Kernel::Spline(DVec2::splat(softness)));
        let areas = [[1.0, 1.0], [1.3, 2.1], [3.0, 4.2]].map(|sides_px| Kernel::Area(sides_px.into()));
        for kernel in [Kernel::Bilinear].into_iter().chain(splines).chain(areas) {
            for f in [DVec2::new(0.11, 0.05), DVec2::new(0.3, -0.2), DVec2::new(0.45, 0.4)] {
                for at in [DVec2::ZERO, DVec2::new(0.5, 0.5), DVec2::new(0.2, 0.7)] {
                    let exact = 0.8;
                    let left: DVec2 = (-40..=40)
                        .flat_map(|x| (-40..=40).map(move |y| DVec2::new(f64::from(x), f64::from(y))))
                        .map(|away| {
                            read(kernel, 0, (f + away).x)
                                * read(kernel, 1, (f + away).y)
                                * DVec2::from_angle(2.0 * PI * away.dot(at))
                        })
                        .sum();
                    // The mean square of a real wave is half of its squared amplitude.
                    let expected = 0.5 * (left - DVec2::new(exact, 0.0)).length_squared();
                    let found = measured(f, kernel, at, exact);
                    // Further aliases, and the four corners that the spline leaves out.
                    assert!(
                        (found.sqrt() - expected.sqrt()).abs() < 0.01,
                        "{kernel:?} {f} {at}: {found:.5} {expected:.5}"
                    );
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
