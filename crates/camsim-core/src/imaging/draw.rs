//! Random numbers of the image sensor: pure functions of random bits, by additions, multiplications, divisions
//! and square roots alone, so that they are the same on every machine.
//!
//! Both distributions are drawn by inversion, which is monotonic: where two renderers differ by d electrons of
//! light, their pictures differ by one electron in a fraction d of the pixels.

use crate::noise::{pcg4d, upper_quantile};

/// Octaves of tail probability that 32 bits reach.
const OCTAVES: usize = 32;
/// Parabolas per octave.
const SEGMENTS: usize = 16;
/// Mean from which the asymptotic quantile is used.
pub const LARGE_MEAN: f32 = 12.0;
/// Cells of `exp(-x)` per unit.
const EXP_CELLS: usize = 16;

/// Tables for normal and Poisson variates.
#[derive(Clone, Debug)]
pub struct Draws {
    /// Quantile of the upper tail over each segment: `c0 + t (c1 + t c2)` for t in 0..1.
    parabolas: Vec<[f32; 4]>,
    /// `exp(-i / EXP_CELLS)`.
    exponentials: Vec<f64>,
}

/// Two words of 32 random bits for a pixel of a frame.
///
/// The low 8 bits of `pcg4d` have a pattern; the high ones of two further words replace them.
#[must_use]
#[inline(always)]
pub fn two_words(pixel: u32, frame: u32, seed: u64, stream: u32) -> [u32; 2] {
    let stream = stream.wrapping_mul(0x9e37_79b9);
    let [a, b, c, d] = pcg4d([pixel, frame, seed as u32, (seed >> 32) as u32 ^ stream]);
    [(a & !0xff) | (c >> 24), (b & !0xff) | (d >> 24)]
}

impl Draws {
    /// Computes the tables.
    #[must_use]
    pub fn new() -> Self {
        let parabola = |octave: usize, segment: usize| {
            let p = |t: f64| (1.0 + (segment as f64 + t) / SEGMENTS as f64) * 0.5_f64.powi(octave as i32 + 2);
            let [begin, middle, end] = [0.0, 0.5, 1.0].map(|t| upper_quantile(p(t)));
            let [slope, bend] = [4.0 * middle - 3.0 * begin - end, 2.0 * begin - 4.0 * middle + 2.0 * end];
            [begin, slope, bend, 0.0].map(|value| value as f32)
        };
        let parabolas = (0..OCTAVES).flat_map(|k| (0..SEGMENTS).map(move |s| parabola(k, s))).collect();
        let cells = LARGE_MEAN as usize * EXP_CELLS;
        let step = exp_of_small(-1.0 / EXP_CELLS as f64);
        let exponentials = (0..=cells).map(|i| step.powi(i as i32)).collect();
        Self { parabolas, exponentials }
    }

    /// Standard normal variate: the quantile at `(bits + 1/2) / 2^32`, to 2e-5.
    #[must_use]
    #[inline(always)]
    pub fn normal(&self, bits: u32) -> f32 {
        // Below 1/2 the lower tail, from 1/2 on the upper one: an odd number of 32 bits over 2^33.
        let lower = if bits >> 31 == 0 { bits } else { !bits };
        // Rounded to 24 bits; in the middle that moves the quantile by 1e-7.
        let tail = (lower as i32 as f32 + 0.5).min(2_147_483_520.0).to_bits();
        let octave = 30 + 127 - (tail >> 23);
        let segment = (tail >> 19) & 15;
        let t = (tail & 0x0007_ffff) as f32 * (1.0 / 524_288.0);
        let [c0, c1, c2, _] = self.parabolas[octave as usize * SEGMENTS + segment as usize];
        let z = c0 + t * (c1 + t * c2);
        if bits >> 31 == 0 { -z } else { z }
    }

    /// Poisson variate with a mean of 0 or more, increasing in `bits` and in the mean.
    ///
    /// Below [`LARGE_MEAN`] it is exact to the 32 bits; above, the rounded quantile of Giles (ACM TOMS 42, 2016)
    /// has probabilities to 4e-5 at 12 and 2e-6 at 100.
    #[must_use]
    #[inline(always)]
    pub fn poisson(&self, mean: f32, bits: u32) -> f32 {
        if mean < LARGE_MEAN { self.small_poisson(mean, bits) } else { self.large_poisson(mean, bits) }
    }

    /// [`Self::poisson`] of a mean of at least [`LARGE_MEAN`].
    #[must_use]
    #[inline(always)]
    pub fn large_poisson(&self, mean: f32, bits: u32) -> f32 {
        let w = self.normal(bits);
        let root = mean.sqrt();
        let w2 = w * w;
        let whole = 1.0 / 3.0 + w2 * (1.0 / 6.0);
        let first = -w * (1.0 / 36.0) - w2 * w * (1.0 / 72.0);
        let second = -8.0 / 405.0 + w2 * (7.0 / 810.0) + w2 * w2 * (1.0 / 270.0);
        (mean + (root * w + (whole + (first + second / root) / root))).floor().max(0.0)
    }

    /// [`Self::poisson`] of a mean below [`LARGE_MEAN`], by adding up probabilities.
    #[must_use]
    pub fn small_poisson(&self, mean: f32, bits: u32) -> f32 {
        // Electrons beyond which less than 2^-32 is left.
        const MOST: u32 = 64;
        let mean = f64::from(mean.max(0.0));
        let cell = (mean * EXP_CELLS as f64) as usize;
        let table = self.exponentials.get(cell).copied().unwrap_or(0.0);
        let rest = exp_of_small(cell as f64 / EXP_CELLS as f64 - mean);
        let uniform = (f64::from(bits) + 0.5) / 4_294_967_296.0;
        let mut probability = table * rest;
        let mut sum = probability;
        let mut count = 0;
        while uniform > sum && count < MOST {
            count += 1;
            probability *= mean / f64::from(count);
            sum += probability;
        }
        count as f32
    }
}

impl Default for Draws {
    fn default() -> Self {
        Self::new()
    }
}

/// `exp(x)` for |x| up to 1/16, to f64 rounding, by its series.
fn exp_of_small(x: f64) -> f64 {
    (1..=10).rev().fold(1.0, |sum, k| 1.0 + x / f64::from(k) * sum)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Cumulative probabilities of a Poisson distribution from `first` on, by recurrence from the mode in f64.
    fn cumulative(mean: f64, first: usize, last: usize) -> Vec<f64> {
        let mode = mean as usize;
        let mut weights = vec![0.0; last + 1];
        weights[mode] = 1.0;
        for k in mode..last {
            weights[k + 1] = weights[k] * mean / (k + 1) as f64;
        }
        for k in (1..=mode).rev() {
            weights[k - 1] = weights[k] * k as f64 / mean;
        }
        let total: f64 = weights.iter().sum();
        let mut sum = 0.0;
        let sums: Vec<f64> = weights
            .iter()
            .map(|weight| {
                sum += weight / total;
                sum
            })
            .collect();
        sums[first..].to_vec()
    }

    #[test]
    fn normals_are_quantiles() {
        let draws = Draws::new();
        for bits in (0..1 << 31).step_by(999_331).chain([0, 1, 2, 3, 100, (1 << 31) - 1]) {
            let p = (f64::from(bits) + 0.5) / 4_294_967_296.0;
            let (lower, upper) = (f64::from(draws.normal(bits)), f64::from(draws.normal(!bits)));
            assert!((upper - upper_quantile(p)).abs() < 2e-5, "{bits}: {upper} {}", upper_quantile(p));
            assert_eq!(lower, -upper);
        }
    }

    /// The quantile is increasing, so the cumulative probability of k is the fraction of bits that give at most k.
    fn worst_probability(draws: &Draws, mean: f32) -> f64 {
        let spread = 12.0 * f64::from(mean).sqrt() + 12.0;
        let first = (f64::from(mean) - spread).max(0.0) as usize;
        let last = (f64::from(mean) + spread) as usize;
        let exact = cumulative(f64::from(mean), first, last);
        let mut worst = 0.0_f64;
        for (k, exact) in (first..).zip(exact) {
            let (mut low, mut high) = (0_u64, 1 << 32);
            while low < high {
                let middle = (low + high) / 2;
                if draws.poisson(mean, middle as u32) as usize <= k {
                    low = middle + 1
                } else {
                    high = middle
                }
            }
            worst = worst.max((low as f64 / 4_294_967_296.0 - exact).abs());
        }
        worst
    }

    #[test]
    fn electrons_have_the_probabilities_of_poisson() {
        let draws = Draws::new();
        for mean in [0.0, 0.01, 0.5, 1.0, 2.3, 7.0, 11.99] {
            let worst = worst_probability(&draws, mean);
            assert!(worst < 1e-8, "{mean}: {worst}");
        }
        for (mean, most) in
            [(12.0, 4e-5), (20.0, 2e-5), (50.0, 5e-6), (300.0, 4e-6), (2000.0, 4e-6), (50_000.0, 8e-6)]
        {
            let worst = worst_probability(&draws, mean);
            assert!(worst < most, "{mean}: {worst}");
        }
    }

    #[test]
    fn ten_million_electron_counts_pass_kolmogorov_and_smirnov() {
        let draws = Draws::new();
        const SAMPLES: u32 = 10_000_000;
        for (stream, mean) in (10..).zip([0.5_f32, 3.0, 12.5, 150.0, 5000.0, 50_000.0]) {
            let last = (mean + 12.0 * mean.sqrt() + 12.0) as usize;
            let mut counts = vec![0_u32; last + 1];
            for i in 0..SAMPLES / 2 {
                let words = two_words((i % 2000) | ((i / 2000) << 16), 3, 20_261_127, stream);
                words.iter().for_each(|&bits| counts[draws.poisson(mean, bits) as usize] += 1);
            }
            let n = f64::from(SAMPLES);
            let (mut sum, mut distance, mut first, mut second) = (0.0, 0.0_f64, 0.0, 0.0);
            for (k, (&count, exact)) in counts.iter().zip(cumulative(f64::from(mean), 0, last)).enumerate() {
                sum += f64::from(count);
                distance = distance.max((sum / n - exact).abs());
                let from_mean = k as f64 - f64::from(mean);
                first += f64::from(count) * from_mean;
                second += f64::from(count) * from_mean * from_mean;
            }
            let (mean, bias, variance) = (f64::from(mean), first / n, second / n);
            // Of a discrete distribution the distance is smaller than of a continuous one: exceeded once in 20 times
            // at most.
            assert!(distance * n.sqrt() < 1.36, "{mean}: {}", distance * n.sqrt());
            // Four standard errors; that of the variance is (2 mean^2 + mean) / n.
            assert!(bias.abs() < 4.0 * (mean / n).sqrt(), "{mean}: mean off by {bias}");
            let error = 4.0 * ((2.0 * mean * mean + mean) / n).sqrt();
            assert!((variance - mean).abs() < error + 2e-4 * mean, "{mean}: variance {variance}");
        }
    }
}
