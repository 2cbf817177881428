//! Edge mask of an ideal frame, in single precision: twin of [`camsim_core::temporal::edge_mask`].

use camsim_core::temporal::edge_mask::{EDGE_STEP, FINE_EDGE_STEP};
use rayon::prelude::*;

use super::DepthPlane;
use crate::simd::{
    lanes::{LANES, fast_max, fast_min},
    vectors::widest,
};

/// The edge pixels of a frame.
#[derive(Clone, Debug)]
pub(super) struct EdgeMask {
    /// Words of a row.
    words: usize,
    /// A bit a pixel, [`LANES`] a word.
    bits: Vec<u32>,
    /// Edge pixels before each word.
    before: Vec<u32>,
}

/// Pixels of a row and one on each side of it, of which the border pixels are repeated beyond the frame.
type Padded = Vec<f32>;

impl EdgeMask {
    /// `samples` find surfaces thinner than a pixel.
    pub fn new(
        [width, height]: [u32; 2],
        scale: u32,
        centres: &DepthPlane<'_>,
        samples: Option<&DepthPlane<'_>>,
    ) -> Self {
        let [width, height] = [width as usize, height as usize];
        let edge_step = if scale > 1 { FINE_EDGE_STEP } else { EDGE_STEP } as f32;
        let words = width.div_ceil(LANES);
        let mut bits = vec![0; words * height];
        bits.par_chunks_mut(words).enumerate().for_each(|(y, bits)| {
            let padded = |y: usize| padded(&centres.values[y * centres.stride..][..width]);
            let rows = [padded(y.saturating_sub(1)), padded(y), padded((y + 1).min(height - 1))];
            // Nothing is beyond the last pixel.
            let within = u32::MAX >> (words * LANES - width);
            widest!(_vectors => {
                mark_steps(&rows, edge_step, bits);
                if let Some(samples) = samples {
                    // In the unit of the centres.
                    let factor = samples.per_m / centres.per_m;
                    mark_thin(samples, y, scale as usize, factor, &rows, edge_step, bits);
                }
                bits.iter_mut().skip(words - 1).for_each(|last| *last &= within);
            })
        });
        let mut count = 0;
        let before = bits.iter().map(|bits: &u32| {
            let before = count;
            count += bits.count_ones();
            before
        });
        Self { words, before: before.collect(), bits }
    }

    pub fn is_edge(&self, [x, y]: [usize; 2]) -> bool {
        self.bits[y * self.words + x / LANES] >> (x % LANES) & 1 == 1
    }

    /// Whether any of a range of pixels of a row, within one word, is an edge pixel.
    pub fn has_edge(&self, first: usize, count: usize, y: usize) -> bool {
        self.bits[y * self.words + first / LANES] >> (first % LANES) & ((1 << count) - 1) != 0
    }

    /// Number of a pixel among the edge pixels, if it is one.
    pub fn number(&self, [x, y]: [usize; 2]) -> Option<u32> {
        let word = y * self.words + x / LANES;
        let (bits, bit) = (self.bits[word], 1 << (x % LANES));
        (bits & bit != 0).then(|| self.before[word] + (bits & (bit - 1)).count_ones())
    }

    /// The edge pixels, row by row.
    pub fn pixels(&self) -> impl Iterator<Item = [usize; 2]> + '_ {
        let of_word = |(word, &bits): (usize, &u32)| {
            let first = [word % self.words * LANES, word / self.words];
            (0..LANES).filter(move |i| bits >> i & 1 == 1).map(move |i| [first[0] + i, first[1]])
        };
        self.bits.iter().enumerate().filter(|(_, bits)| **bits != 0).flat_map(of_word)
    }
}

fn padded(row: &[f32]) -> Padded {
    let mut padded = vec![0.0; row.len().next_multiple_of(LANES) + 2];
    padded[1..=row.len()].copy_from_slice(row);
    padded[0] = row[0];
    padded[row.len() + 1] = row[row.len() - 1];
    padded
}

/// Marks pixels with an edge along any direction: twin of [`camsim_core::temporal::edge_mask::steps`].
#[inline(always)]
fn mark_steps([above, here, below]: &[Padded; 3], edge_step: f32, bits: &mut [u32]) {
    const BLOCK: usize = LANES + 2;
    let block =
        |row: &[f32], first: usize| row[first..].first_chunk::<BLOCK>().copied().unwrap_or([0.0; BLOCK]);
    for (bits, first) in bits.iter_mut().zip((0..).step_by(LANES)) {
        let (above, here, below) = (block(above, first), block(here, first), block(below, first));
        for i in 0..LANES {
            let centre = here[i + 1];
            let is_step = |a: f32, b: f32| {
                let (high, low) = (fast_max(fast_max(a, b), centre), fast_min(fast_min(a, b), centre));
                ((a - 2.0 * centre + b).abs() > edge_step * high) | ((low == 0.0) & (high > 0.0))
            };
            let is_edge = is_step(here[i], here[i + 2])
                | is_step(above[i + 1], below[i + 1])
                | is_step(above[i], below[i + 2])
                | is_step(below[i], above[i + 2]);
            *bits |= u32::from(is_edge) << i;
        }
    }
}

/// Marks pixels of a row whose samples differ by more than the slope around the pixel explains.
#[inline(always)]
fn mark_thin(
    samples: &DepthPlane<'_>,
    y: usize,
    scale: usize,
    factor: f32,
    [above, here, below]: &[Padded; 3],
    edge_step: f32,
    bits: &mut [u32],
) {
    let side = 2 * scale;
    for (word, bits) in bits.iter_mut().enumerate() {
        let (mut low, mut high) = ([f32::INFINITY; LANES], [0.0; LANES]);
        for row in y * side..(y + 1) * side {
            let row = &samples.values[row * samples.stride..][..samples.stride];
            let row = &row[(word * LANES * side).min(row.len())..];
            for (i, quad) in row.chunks_exact(side).take(LANES).enumerate() {
                for &depth in quad {
                    (low[i], high[i]) = (fast_min(depth, low[i]), fast_max(depth, high[i]));
                }
            }
        }
        for i in 0..LANES {
            let x = word * LANES + i;
            let slope = (here[x + 2] - here[x]).abs() + (below[x + 1] - above[x + 1]).abs();
            let (low, high) = (factor * low[i], factor * high[i]);
            let is_thin = ((low == 0.0) & (high > 0.0)) | (high - low > slope + edge_step * high);
            *bits |= u32::from(is_thin) << i;
        }
    }
}

#[cfg(test)]
mod tests {
    use camsim_core::{noise::pcg4d, temporal::edge_mask::is_edge};

    use super::*;

    #[test]
    fn edge_pixels_are_those_of_the_twin() {
        for (size_px, scale) in [([70, 20], 1), ([32, 9], 2), ([33, 7], 3), ([1, 1], 1), ([2, 3], 1)] {
            let ([width, height], side) = (size_px.map(|side: u32| i64::from(side)), 2 * i64::from(scale));
            // A slope with steps, and with thin surfaces before it and holes in it.
            let random = |k: i64| pcg4d([k as u32, 5, 6, 7])[0] % 40;
            let depth = |x: f32, y: f32, kind: u32| match kind {
                0 => 0.0,
                1 => 0.4,
                2 => 0.301,
                _ => 0.3 + 1e-3 * x - 2e-3 * y,
            };
            let centre = |i: i64| depth((i % width) as f32, (i / width) as f32, random(i));
            let centres: Vec<f32> = (0..width * height).map(centre).collect();
            let [across, down] = [width * side, height * side];
            let sample = |i: i64| {
                let [x, y] =
                    [(i % across) as f32, (i / across) as f32].map(|at| (at + 0.5) / side as f32 - 0.5);
                2.0 * depth(x, y, if random(-i) == 0 { random(i) % 3 } else { 3 })
            };
            let samples: Vec<f32> = (0..across * down).map(sample).collect();
            let plane = DepthPlane { values: &centres, stride: width as usize, per_m: 1.0 };
            let fine = DepthPlane { values: &samples, stride: across as usize, per_m: 0.5 };
            for thin in [false, true] {
                let mask = EdgeMask::new(size_px, scale, &plane, thin.then_some(&fine));
                let mut pixels = Vec::new();
                for i in 0..width * height {
                    let [x, y] = [i % width, i / width];
                    let within = (0..side * side)
                        .map(|k| samples[((y * side + k / side) * across + x * side + k % side) as usize]);
                    let range = || {
                        within.fold([f64::INFINITY, 0.0], |[low, high], w| {
                            [f64::min(low, 0.5 * f64::from(w)), f64::max(high, 0.5 * f64::from(w))]
                        })
                    };
                    let centre = |[x, y]: [i64; 2]| f64::from(centres[(y * width + x) as usize]);
                    if is_edge([x, y], size_px, scale, centre, thin.then(range)) {
                        pixels.push([x as usize, y as usize]);
                    }
                }
                let found: Vec<_> = mask.pixels().collect();
                let differing = found.iter().zip(&pixels).find(|(a, b)| a != b);
                assert!(found == pixels, "{size_px:?} {thin}: {differing:?}");
                let numbers: Vec<_> = pixels.iter().map(|&pixel| mask.number(pixel)).collect();
                assert_eq!(numbers, (0..pixels.len() as u32).map(Some).collect::<Vec<_>>());
                assert!(width < 3 || pixels.len() > 10 && pixels.len() < (width * height) as usize);
            }
        }
    }
}
