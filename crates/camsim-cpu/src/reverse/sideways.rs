//! Frames that are read sideways: their lines are columns of the picture. The pass makes the transposed picture, so
//! that all pixels of a block have one line's poses.

use camsim_plan::uniforms::FrameUniforms;
use rayon::prelude::*;

use super::{KernelFrame, KernelInputs, LensMap, Listed};
use crate::{large_pages::LargeArray, simd::lanes::LANES};

/// Whether blocks of pixels are parts of columns.
#[inline(always)]
pub(super) fn is_sideways(frame: &FrameUniforms) -> bool {
    frame.line_axis == 1
}

/// Gives `make` what the transposed picture needs, and transposes the frame that it makes.
pub(super) fn turned(
    inputs: &KernelInputs<'_>,
    make: impl FnOnce(&KernelInputs<'_>) -> KernelFrame,
) -> KernelFrame {
    let [width, height] = inputs.frame.size_px;
    let frame = FrameUniforms { size_px: [height, width], ..*inputs.frame };
    let map = inputs.map.map(|map| {
        let mut uv = LargeArray::zeros(map.uv.len());
        transpose(&map.uv, width as usize, &mut uv);
        LensMap { uv }
    });
    let weights = match inputs.vignette {
        [one] => vec![*one],
        all => transposed(all, width as usize),
    };
    let made = make(&KernelInputs { frame: &frame, map: map.as_ref(), vignette: &weights, ..*inputs });
    let height = height as usize;
    KernelFrame {
        color_rgba: transposed(made.color_rgba.as_chunks::<4>().0, height).into_flattened(),
        truth: made.truth.map(|truth| transposed(&truth, height)),
        listed: transposed_lists(&made.listed, height),
    }
}

/// The columns of rows of `width` values, one after the other.
fn transposed<T: Copy + Default + Send + Sync>(values: &[T], width: usize) -> Vec<T> {
    let mut columns = vec![T::default(); values.len()];
    transpose(values, width, &mut columns);
    columns
}

fn transpose<T: Copy + Send + Sync>(values: &[T], width: usize, columns: &mut [T]) {
    /// Columns at once, which are next to each other in memory.
    const BAND: usize = 16;
    let height = values.len() / width.max(1);
    columns.par_chunks_mut(BAND * height.max(1)).enumerate().for_each(|(band, columns)| {
        for (y, row) in values.chunks_exact(width).enumerate() {
            for (column, value) in columns.chunks_exact_mut(height).zip(&row[band * BAND..]) {
                column[y] = *value;
            }
        }
    });
}

/// As [`transposed`], of lists of pixels in lines of `width`.
fn transposed_lists(lists: &[Listed], width: usize) -> Vec<Listed> {
    let blocks = width.div_ceil(LANES);
    let lines = lists.len() / blocks;
    let across = lines.div_ceil(LANES);
    let mut turned = vec![Listed::default(); if lists.is_empty() { 0 } else { across * width }];
    for (number, Listed { touched, near }) in lists.iter().enumerate() {
        let (line, first) = (number / blocks, number % blocks * LANES);
        let mut left = touched | near;
        while left != 0 {
            let lane = left.trailing_zeros();
            left &= left - 1;
            let to = &mut turned[(first + lane as usize) * across + line / LANES];
            to.touched |= (touched >> lane & 1) << (line % LANES);
            to.near |= (near >> lane & 1) << (line % LANES);
        }
    }
    turned
}
