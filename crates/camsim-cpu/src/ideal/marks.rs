//! Which parts of an ideal frame are drawn with several samples a pixel: tiles with a step of depth between
//! their pixels or beside them, and those with any triangle of a model, which may be thinner than a pixel.
//! Everywhere else samples would show what the pixel's middle shows.

use std::{
    ops::RangeInclusive,
    sync::atomic::{AtomicU64, Ordering},
};

use rayon::prelude::*;

use super::{
    samples::{ALONG, PIXEL_ROWS},
    triangles::Cover,
};
use crate::simd::{
    lanes::{LANES, higher},
    vectors::widest,
};

/// Side of a tile, pixels.
pub(super) const TILE_PX: usize = 8;
/// Rows of tiles in a band.
const TILE_ROWS: usize = PIXEL_ROWS / TILE_PX;
/// Second difference of inverse depth from pixel to pixel, of the nearest of the three, that is taken for a
/// step: what [`camsim_core::temporal::edge_mask`] takes for one, and smaller ones.
const STEP: f32 = 0.005;
const BITS: usize = u64::BITS as usize;

/// Tiles that are marked, a bit each.
#[derive(Debug, Default)]
pub(super) struct Marks {
    size_px: [usize; 2],
    /// Numbers of a row of tiles.
    words: usize,
    bits: Vec<AtomicU64>,
}

/// Those of a band.
#[derive(Clone, Copy)]
pub(super) struct OfBand<'a> {
    words: usize,
    bits: &'a [AtomicU64],
    /// Its first row of tiles.
    first_row: usize,
}

impl Marks {
    /// None yet, of a frame of so many pixels.
    pub fn clear(&mut self, size_px: [usize; 2]) {
        self.size_px = size_px;
        self.words = size_px[0].div_ceil(TILE_PX * BITS);
        self.bits.clear();
        self.bits.resize_with(self.words * TILE_ROWS * size_px[1].div_ceil(PIXEL_ROWS), AtomicU64::default);
    }

    pub fn of_band(&self, number: usize) -> OfBand<'_> {
        let of = self.words * TILE_ROWS;
        OfBand { words: self.words, bits: &self.bits[number * of..][..of], first_row: number * TILE_ROWS }
    }

    /// Adds all tiles that triangles may be in.
    pub fn add_triangles(&self, covers: &[Cover]) {
        for cover in covers {
            let [columns, rows] = tiles(cover);
            for (row, column) in
                (rows[0]..=rows[1]).flat_map(|row| (columns[0]..=columns[1]).map(move |column| (row, column)))
            {
                let (bits, bit) = (&self.bits[row * self.words + column / BITS], 1 << (column % BITS));
                // Most are there: another thread need not be told again.
                if bits.load(Ordering::Relaxed) & bit == 0 {
                    bits.fetch_or(bit, Ordering::Relaxed);
                }
            }
        }
    }

    /// Adds tiles in which depth has a step.
    pub fn add_steps(&mut self, depth: &[f32], stride: usize) {
        let height = self.size_px[1];
        let rows = self.bits.par_chunks_mut(self.words).take(height.div_ceil(TILE_PX)).enumerate();
        rows.for_each(|(tile_row, marks)| {
            // What is beside a step may show it too.
            let (first, last) =
                ((TILE_PX * tile_row).saturating_sub(1), (TILE_PX * (tile_row + 1)).min(height - 1));
            add_tiles(&steps_of_rows(first..=last, depth, stride, self.size_px), marks);
        });
    }
}

/// Bits of pixels in rows, any of which have a step.
fn steps_of_rows(
    rows: RangeInclusive<usize>,
    depth: &[f32],
    stride: usize,
    [width, height]: [usize; 2],
) -> Vec<u32> {
    let row = |y: usize| &depth[y * stride..][..width];
    let mut steps = vec![0; width.div_ceil(LANES)];
    widest!(_vectors => {
        for y in rows {
            add_steps_of_row([row(y.saturating_sub(1)), row(y), row((y + 1).min(height - 1))], &mut steps);
        }
        steps
    })
}

/// Marks tiles that have one of these pixels, or are beside one.
fn add_tiles(pixels: &[u32], marks: &mut [AtomicU64]) {
    const { assert!(LANES == u32::BITS as usize && LANES.is_multiple_of(TILE_PX)) };
    let of = |block: Option<usize>| block.and_then(|block| pixels.get(block)).copied().unwrap_or(0);
    for (block, &here) in pixels.iter().enumerate() {
        let (before, after) = (of(block.checked_sub(1)), of(Some(block + 1)));
        let beside = here | here << 1 | here >> 1 | before >> (LANES - 1) | after << (LANES - 1);
        for tile in 0..LANES / TILE_PX {
            let is_marked = beside >> (tile * TILE_PX) & ((1 << TILE_PX) - 1) != 0;
            let column = block * (LANES / TILE_PX) + tile;
            *marks[column / BITS].get_mut() |= u64::from(is_marked) << (column % BITS);
        }
    }
}

/// Bits of pixels at which inverse depth bends, by three rows.
#[inline(always)]
fn add_steps_of_row([above, here, below]: [&[f32]; 3], steps: &mut [u32]) {
    let width = here.len();
    for (block, steps) in steps.iter_mut().enumerate() {
        let first = block * LANES;
        let mut across = [0.0; LANES + 2];
        let mut down = [[0.0; LANES]; 2];
        if first > 0 && first + LANES < width {
            across.copy_from_slice(&here[first - 1..first + LANES + 1]);
            down[0].copy_from_slice(&above[first..first + LANES]);
            down[1].copy_from_slice(&below[first..first + LANES]);
        } else {
            // Beyond the frame is what is at its border.
            let at = |row: &[f32], x: usize| row[x.min(width - 1)];
            across = std::array::from_fn(|i| at(here, (first + i).saturating_sub(1)));
            down = [
                std::array::from_fn(|i| at(above, first + i)),
                std::array::from_fn(|i| at(below, first + i)),
            ];
        }
        let mut found = 0;
        for i in 0..LANES {
            let middle = across[i + 1];
            let bends = |a: f32, b: f32| (a - 2.0 * middle + b).abs() > STEP * higher(higher(a, b), middle);
            found |= u32::from(bends(across[i], across[i + 2]) | bends(down[0][i], down[1][i])) << i;
        }
        *steps |= found;
    }
}

/// Tiles of a triangle: first and last columns, and rows.
#[inline(always)]
fn tiles(cover: &Cover) -> [[usize; 2]; 2] {
    // Written out: what `map` calls may be compiled without the vectors that this is.
    let of = |k: usize| {
        [usize::from(cover.first[k]) / (TILE_PX * ALONG), usize::from(cover.last[k]) / (TILE_PX * ALONG)]
    };
    [of(0), of(1)]
}

impl OfBand<'_> {
    pub fn is_empty(&self) -> bool {
        self.bits.iter().all(|bits| bits.load(Ordering::Relaxed) == 0)
    }

    /// Whether a triangle may be in any of them.
    #[inline(always)]
    pub fn has(&self, cover: &Cover) -> bool {
        let [columns, rows] = tiles(cover);
        let last_row = self.first_row + TILE_ROWS - 1;
        (rows[0].max(self.first_row)..=rows[1].min(last_row)).any(|row| {
            (columns[0]..=columns[1]).any(|column| self.is_marked_at(column, row - self.first_row))
        })
    }

    /// By the tile's column and its row within the band.
    #[inline(always)]
    pub fn is_marked_at(&self, column: usize, row: usize) -> bool {
        self.bits[row * self.words + column / BITS].load(Ordering::Relaxed) >> (column % BITS) & 1 == 1
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use camsim_core::noise::pcg4d;

    use super::*;
    use crate::large_pages::Large;

    /// Pixels with a step beside them, as they are by the definition.
    fn marked(depth: &[f32], stride: usize, [width, height]: [usize; 2]) -> Vec<[usize; 2]> {
        let at = |x: isize, y: isize| {
            depth[y.clamp(0, height as isize - 1) as usize * stride + x.clamp(0, width as isize - 1) as usize]
        };
        let bends = |a: f32, b: f32, c: f32| (a - 2.0 * b + c).abs() > STEP * a.max(b).max(c);
        let is_step = |x: isize, y: isize| {
            let within = (0..width as isize).contains(&x) && (0..height as isize).contains(&y);
            within
                && (bends(at(x - 1, y), at(x, y), at(x + 1, y))
                    || bends(at(x, y - 1), at(x, y), at(x, y + 1)))
        };
        let mut tiles: Vec<[usize; 2]> = Vec::new();
        for (x, y) in (0..height as isize).flat_map(|y| (0..width as isize).map(move |x| (x, y))) {
            if (-1..=1).any(|dy| (-1..=1).any(|dx| is_step(x + dx, y + dy))) {
                tiles.push([x as usize / TILE_PX, y as usize / TILE_PX]);
            }
        }
        tiles.sort_unstable();
        tiles.dedup();
        tiles
    }

    #[test]
    fn tiles_with_steps_in_them_or_beside_them_are_marked() {
        for (size_px, step) in
            [([100, 70], 7919), ([513, 40], 12_289), ([64, 9], 31), ([1105, 33], 24_593), ([2, 2], 1)]
        {
            let [width, height] = size_px;
            let stride = width + 9;
            let mut depth: Large<f32> = Large::zeros(stride * height);
            // A slope, with things before it here and there.
            for (i, of) in depth.iter_mut().enumerate() {
                *of = 0.01 + 1e-5 * (i % stride) as f32;
            }
            for k in (0..stride * height).step_by(step) {
                let [place, ..] = pcg4d([k as u32, 1, 2, 3]);
                let place = place as usize % (stride * height);
                depth[place] *= 1.5;
            }
            let mut marks = Marks::default();
            marks.clear(size_px);
            marks.add_steps(&depth, stride);
            let mut found = Vec::new();
            for row in 0..height.div_ceil(TILE_PX) {
                let of_band = marks.of_band(row / TILE_ROWS);
                found.extend(
                    (0..width.div_ceil(TILE_PX))
                        .filter(|&column| of_band.is_marked_at(column, row % TILE_ROWS))
                        .map(|column| [column, row]),
                );
            }
            found.sort_unstable();
            assert_eq!(found, marked(&depth, stride, size_px), "{size_px:?}");
        }
    }
}
