//! Sums over the reads of waves and of those that look like them.

use camsim_core::temporal::Footprint;
use glam::Vec4;

use super::{
    alias::{AxisAlias, PlacedWave, ReadSpan, Transfer},
    lanes::{Frequencies4, Sampler},
};

/// Aliases of which less than this is left are skipped: nine together move the error of a pixel by less than
/// a hundredth of the wave.
pub(crate) const UNSEEN: f64 = 1e-3;

/// Reads of waves and of those that look like them on the grid of ideal pixels.
pub(crate) struct AliasedReads {
    /// Numbers of the waves.
    of: Vec<u32>,
    /// Cycles an ideal pixel.
    x: Vec<f32>,
    y: Vec<f32>,
    /// What one read leaves.
    leaves: Vec<Transfer>,
}

impl AliasedReads {
    /// For so many waves, each with about as many others that count as there are.
    pub fn of_waves(count: usize) -> Self {
        let most = 5 * count;
        let cycles = || Vec::with_capacity(most);
        Self { of: Vec::with_capacity(most), x: cycles(), y: cycles(), leaves: Vec::with_capacity(most) }
    }

    /// Those of one wave, as far as they count; `turned` by where it is read, for so many whole cycles along
    /// x and y.
    pub fn add(
        &mut self,
        of: usize,
        [along_x, along_y]: &[[AxisAlias; 3]; 2],
        area: &Footprint,
        turned: impl Fn([usize; 2]) -> Transfer,
    ) {
        let by_y = [0, 1, 2].map(|k: usize| along_y[k].read(area.kernel, 1));
        for (i, x) in along_x.iter().enumerate() {
            let by_x = x.read(area.kernel, 0);
            for (k, y) in along_y.iter().enumerate() {
                let by_both = by_x * by_y[k];
                if by_both.abs() >= UNSEEN {
                    self.of.push(of as u32);
                    self.x.push(x.frequency as f32);
                    self.y.push(y.frequency as f32);
                    self.leaves.push(by_both * turned([i, k]));
                }
            }
        }
    }

    /// What is left of so many waves, four reads at a time.
    pub fn sum(mut self, count: usize, area: &Footprint, over: ReadSpan) -> Vec<Transfer> {
        let (sampler, reads) = (Sampler::new(area, over), self.of.len());
        for cycles in [&mut self.x, &mut self.y] {
            cycles.resize(reads.next_multiple_of(4), 0.0);
        }
        let mut left = vec![Transfer::ZERO; count];
        let fours = self.x.chunks_exact(4).zip(self.y.chunks_exact(4));
        for ((x, y), (of, leaves)) in fours.zip(self.of.chunks(4).zip(self.leaves.chunks(4))) {
            let sampled = sampler.leaves(Frequencies4 { x: Vec4::from_slice(x), y: Vec4::from_slice(y) });
            for (i, (&of, leaves)) in of.iter().zip(leaves).enumerate() {
                left[of as usize] +=
                    leaves.rotate(Transfer::new(f64::from(sampled.re[i]), f64::from(sampled.im[i])));
            }
        }
        left
    }
}

/// What reading the ideal frame leaves of waves.
pub(crate) fn read_waves<'a>(
    waves: impl ExactSizeIterator<Item = &'a PlacedWave>,
    area: &Footprint,
    over: ReadSpan,
) -> Vec<Transfer> {
    let count = waves.len();
    let mut reads = AliasedReads::of_waves(count);
    for (of, PlacedWave { aliases, turned }) in waves.enumerate() {
        reads.add(of, aliases, area, |[x, y]| turned[0][x].rotate(turned[1][y]));
    }
    reads.sum(count, area, over)
}
