//! What reads leave of four waves at a time, in single precision: as `exact.rs` has it of one, in a third
//! of the time.

use camsim_core::{scenario::MAX_FOOTPRINT_TAPS, temporal::Footprint};
use glam::Vec4;

use super::alias::{ReadSpan, SampledPath};

/// Most taps along a side that the planner chooses by itself.
const FEW_TAPS: usize = 4;

/// Four complex numbers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Waves4 {
    pub re: Vec4,
    pub im: Vec4,
}

impl Waves4 {
    const ZERO: Self = Self { re: Vec4::ZERO, im: Vec4::ZERO };

    fn real(re: Vec4) -> Self {
        Self { re, im: Vec4::ZERO }
    }

    /// Each after so many turns.
    fn turned_by(turns: Vec4) -> Self {
        Self { re: sin_pi(2.0 * turns + 0.5), im: sin_pi(2.0 * turns) }
    }

    fn times(self, other: Self) -> Self {
        Self { re: self.re * other.re - self.im * other.im, im: self.re * other.im + self.im * other.re }
    }

    fn plus(self, other: Self) -> Self {
        Self { re: self.re + other.re, im: self.im + other.im }
    }

    fn scaled(self, by: Vec4) -> Self {
        Self { re: by * self.re, im: by * self.im }
    }
}

/// The nearest whole numbers, of up to four million.
fn whole(x: Vec4) -> Vec4 {
    const WHOLE: f32 = 1.5 * (1_u32 << 23) as f32;
    (x + WHOLE) - WHOLE
}

/// `sin(pi x)` of half a turn, to 3e-7 of itself.
fn sin_pi_of_half(x: Vec4) -> Vec4 {
    // Of x, x^3, ...: exact at five positions, 7e-9 off between them; the rest is rounding.
    const SERIES: [f32; 5] = [std::f32::consts::PI, -5.167_71, 2.550_077_4, -0.598_290_4, 0.077_655_91];
    let square = x * x;
    x * SERIES.iter().rev().fold(Vec4::ZERO, |sum, &term| sum * square + term)
}

/// 1 for even whole numbers, -1 for odd ones.
fn sign_of(whole_number: Vec4) -> Vec4 {
    let odd = whole_number - 2.0 * whole(0.5 * whole_number);
    1.0 - 2.0 * odd * odd
}

fn sin_pi(x: Vec4) -> Vec4 {
    let near = whole(x);
    sign_of(near) * sin_pi_of_half(x - near)
}

/// `a / b` where that is no less than this, and 1 elsewhere: both are sines that vanish together.
fn ratio(a: Vec4, b: Vec4) -> Vec4 {
    const LEAST: f32 = 1e-12;
    let is_some = b.abs().cmpge(Vec4::splat(LEAST));
    Vec4::select(is_some, a / Vec4::select(is_some, b, Vec4::ONE), Vec4::ONE)
}

fn sinc(x: Vec4) -> Vec4 {
    ratio(sin_pi(x), std::f32::consts::PI * x)
}

/// `sin(pi n x) / (n sin(pi x))`. Both sines are of what `x` is beside a whole number, so that they vanish
/// together however large it is.
fn dirichlet(n: u32, x: Vec4) -> Vec4 {
    let (count, near) = (n as f32, whole(x));
    let beside = x - near;
    let mean = ratio(sin_pi(count * beside), count * sin_pi_of_half(beside));
    if n % 2 == 1 { mean } else { sign_of(near) * mean }
}

/// `n` samples evenly over stretches of `x` cycles.
fn sampled_box(n: u32, x: Vec4) -> Vec4 {
    if n == 1 { Vec4::ONE } else { dirichlet(n, x / n as f32) }
}

/// Frequencies of four waves, cycles an ideal pixel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frequencies4 {
    pub x: Vec4,
    pub y: Vec4,
}

impl Frequencies4 {
    fn dot(self, direction: glam::DVec2) -> Vec4 {
        direction.x as f32 * self.x + direction.y as f32 * self.y
    }
}

/// What the grid of taps and the samples of an exposure leave of a wave.
pub(crate) struct Sampler<'a> {
    area: &'a Footprint,
    over: ReadSpan,
    /// Cells of the grid in the order in which samples take them; empty where all of them have as good as all
    /// samples.
    turns: Vec<[usize; 2]>,
}

impl<'a> Sampler<'a> {
    pub fn new(area: &'a Footprint, over: ReadSpan) -> Self {
        let taps = area.taps[0] * area.taps[1];
        let in_turns =
            matches!(over, ReadSpan::Samples(SampledPath { samples, .. }) if taps > 1 && samples <= 8 * taps);
        let cells = if in_turns { taps } else { 0 };
        Self { area, over, turns: (0..cells).map(|tap| area.cell(tap).map(|k| k as usize)).collect() }
    }

    pub fn leaves(&self, f: Frequencies4) -> Waves4 {
        match self.over {
            ReadSpan::Instant => Waves4::real(self.grid(f)),
            ReadSpan::All(along) => Waves4::real(self.grid(f) * sinc(f.dot(along))),
            ReadSpan::Samples(SampledPath { along, samples }) if self.turns.is_empty() => {
                Waves4::real(self.grid(f) * sampled_box(samples, f.dot(along)))
            }
            ReadSpan::Samples(path) if self.area.taps.iter().all(|&side| side as usize <= FEW_TAPS) => {
                self.in_turns::<FEW_TAPS>(path, f)
            }
            ReadSpan::Samples(path) => self.in_turns::<{ MAX_FOOTPRINT_TAPS as usize }>(path, f),
        }
    }

    fn grid(&self, f: Frequencies4) -> Vec4 {
        let Footprint { dx, dy, taps, .. } = *self.area;
        sampled_box(taps[0], f.dot(dx)) * sampled_box(taps[1], f.dot(dy))
    }

    /// Samples each at one of at most `SIDE` taps along each side, in turns: of each tap its samples' mean,
    /// turned by where the middle of them is on the path and by where the tap is in the grid. From tap to tap
    /// both turn by as much again.
    fn in_turns<const SIDE: usize>(
        &self,
        SampledPath { along, samples }: SampledPath,
        f: Frequencies4,
    ) -> Waves4 {
        let (area, cycles, count) = (self.area, f.dot(along), samples as f32);
        let line = |side: glam::DVec2, taps: u32| -> [Waves4; SIDE] {
            let turns = f.dot(side) / taps as f32;
            let (mut at, step) =
                (Waves4::turned_by(0.5 * turns * (1.0 - taps as f32)), Waves4::turned_by(turns));
            std::array::from_fn(|_| {
                let next = at.times(step);
                std::mem::replace(&mut at, next)
            })
        };
        let (columns, rows) = (line(area.dx, area.taps[0]), line(area.dy, area.taps[1]));
        let taps = self.turns.len() as u32;
        let a_sample = cycles / count;
        let (a_turn, to_next) = (taps as f32 * a_sample, Waves4::turned_by(a_sample));
        // The first taps have one sample more than the others.
        let most = samples.div_ceil(taps);
        let with_most = samples - (most - 1) * taps;
        let of_taps = |first: u32, turns: &[[usize; 2]], each: u32| {
            let middle = 0.5 - 0.5 * count + first as f32 + 0.5 * (taps * (each - 1)) as f32;
            let mut on_path = Waves4::turned_by(middle * a_sample);
            let mut sum = Waves4::ZERO;
            for &[column, row] in turns {
                sum = sum.plus(on_path.times(columns[column].times(rows[row])));
                on_path = on_path.times(to_next);
            }
            sum.scaled(each as f32 / count * dirichlet(each, a_turn))
        };
        let (those_with_most, others) = self.turns.split_at(with_most as usize);
        let of_first = of_taps(0, those_with_most, most);
        if most > 1 { of_first.plus(of_taps(with_most, others, most - 1)) } else { of_first }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::{super::exact::sampled, *};
    use camsim_core::temporal::Kernel;

    #[test]
    fn the_polynomial_sine_is_exact_to_its_bound() {
        for i in -4000..4000 {
            let x = f64::from(i) * 0.003_7;
            let short = sin_pi(Vec4::splat(x as f32)).x;
            let exact = (std::f64::consts::PI * f64::from(x as f32)).sin();
            assert!((f64::from(short) - exact).abs() < 4e-7, "{x}: {short} {exact}");
        }
    }

    #[test]
    fn samples_in_turns_are_the_sum_of_all_samples() {
        for (taps, samples) in [
            ([4, 4], 7),
            ([4, 4], 16),
            ([4, 4], 41),
            ([3, 2], 5),
            ([2, 4], 64),
            ([7, 3], 30),
            ([1, 5], 3),
            ([3, 2], 48),
            ([64, 64], 9000),
        ] {
            let area = Footprint {
                dx: DVec2::new(3.1, 0.4),
                dy: DVec2::new(-0.2, 2.7),
                taps,
                kernel: Kernel::Bilinear,
            };
            let over = ReadSpan::Samples(SampledPath { along: DVec2::new(5.3, -2.1), samples });
            for f in [DVec2::new(0.11, 0.05), DVec2::new(-0.7, 0.3), DVec2::new(1.4, 0.9), DVec2::ZERO] {
                let found = Sampler::new(&area, over)
                    .leaves(Frequencies4 { x: Vec4::splat(f.x as f32), y: Vec4::splat(f.y as f32) });
                let (found, all) =
                    (DVec2::new(f64::from(found.re.z), f64::from(found.im.z)), sampled(&area, over, f));
                // Each turn adds its rounding.
                let bound = 2e-6 + 1e-7 * f64::from(taps[0] * taps[1]);
                assert!(found.distance(all) < bound, "{taps:?} {samples} {f}: {found} {all}");
            }
        }
    }

    #[test]
    fn means_are_whole_near_whole_numbers() {
        for n in [1, 2, 3, 16, 17, 512] {
            for x in [0.0, 1.0, 2.0, 37.0, 1e-7, 1.0 + 1e-6, 0.3, 12.7, -5.000_01] {
                let x = x as f32;
                let exact = camsim_core::transfer::dirichlet(n, f64::from(x));
                let found = f64::from(dirichlet(n, Vec4::splat(x)).w);
                assert!((found - exact).abs() < 2e-5, "{n}, {x}: {found} {exact}");
            }
        }
    }
}
