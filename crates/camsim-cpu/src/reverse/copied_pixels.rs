//! Output pixels that coincide with ideal pixels: only the photometric stage applies.

use super::{Stages, ideal_texels::CHANNELS, photometric};
use crate::simd::{lanes::LANES, vectors::Vectors};

impl Stages<'_> {
    /// Renders rows from `first`. `from` is the ideal pixel of the output's first pixel.
    #[inline(always)]
    pub(super) fn copied_rows(&self, vectors: impl Vectors, from: [u32; 2], first: u32, rows: &mut [f32]) {
        let width = self.frame.size_px[0] as usize;
        for (row, y) in rows.chunks_exact_mut(CHANNELS * width).zip(first..) {
            for (block, x) in row.chunks_mut(CHANNELS * LANES).zip((0_u32..).step_by(LANES)) {
                let colors = self.copied_block(vectors, from, [x, y]);
                let [r, g, b] =
                    photometric::photometric(self.frame, self.segments, [x, y], &colors, &self.weights(x, y));
                for (i, pixel) in block.as_chunks_mut::<CHANNELS>().0.iter_mut().enumerate() {
                    *pixel = [r[i], g[i], b[i], 1.0];
                }
            }
        }
    }

    /// Colours of a block, also of lanes beyond the end of the row.
    #[inline(always)]
    pub(super) fn copied_block(
        &self,
        vectors: impl Vectors,
        [left, top]: [u32; 2],
        [x, y]: [u32; 2],
    ) -> [[f32; CHANNELS]; LANES] {
        let first = CHANNELS * ((top + y) as usize * self.ideal.color_stride as usize + (left + x) as usize);
        let ideal = self.ideal.color.get(first..).unwrap_or_default();
        let mut halves = [0; CHANNELS * LANES];
        match ideal.first_chunk() {
            Some(block) => halves = *block,
            None => halves[..ideal.len()].copy_from_slice(ideal),
        }
        let mut colors = [[0.0; CHANNELS]; LANES];
        for (two, halves) in
            colors.as_flattened_mut().as_chunks_mut::<8>().0.iter_mut().zip(halves.as_chunks::<8>().0)
        {
            *two = vectors.floats_from_halves(*halves);
        }
        colors
    }
}
