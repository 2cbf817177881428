//! Which parts of an ideal frame are drawn with several samples a pixel: tiles with a step of depth between their pixels or beside them, and those with any triangle of a model, which
//! may be thinner than a pixel. Everywhere else samples would show what the pixel's middle shows.

use rayon::prelude::*;

use super::{
    samples::{ALONG, PIXEL_ROWS},
    triangles::Cover,
};
use crate::host::lanes::{LANES, higher};

/// Side of a tile, pixels.
pub(super) const TILE_PX: usize = 8;
/// Rows of tiles in a band.
const TILE_ROWS: usize = PIXEL_ROWS / TILE_PX;
/// Second difference of inverse depth from pixel to pixel, of the nearest of the three, that is taken for a step: what [`camsim_core::temporal::marks`] takes for one, and smaller ones.
const STEP: f32 = 0.005;
const BITS: usize = u64::BITS as usize;

/// Tiles that are marked, a bit each.
#[derive(Debug, Default)]
pub(super) struct Marks {
    size_px: [usize; 2],
    /// Numbers of a row of tiles.
    words: usize,
    bits: Vec<u64>,
}

/// Those of a band.
#[derive(Clone, Copy)]
pub(super) struct OfBand<'a> {
    words: usize,
    bits: &'a [u64],
    /// Its first row of tiles.
    first_row: usize,
}

impl Marks {
    /// None yet, of a frame of so many pixels.
    pub fn clear(&mut self, size_px: [usize; 2]) {
        self.size_px = size_px;
        self.words = size_px[0].div_ceil(TILE_PX * BITS);
        self.bits.clear();
        self.bits.resize(self.words * TILE_ROWS * size_px[1].div_ceil(PIXEL_ROWS), 0);
    }

    /// Of each band, in their order.
    pub fn bands_mut(&mut self) -> impl IndexedParallelIterator<Item = &mut [u64]> {
        self.bits.par_chunks_mut(self.words * TILE_ROWS)
    }

    pub fn of_band(&self, number: usize) -> OfBand<'_> {
        let of = self.words * TILE_ROWS;
        OfBand { words: self.words, bits: &self.bits[number * of..][..of], first_row: number * TILE_ROWS }
    }

    /// Adds tiles in which depth has a step.
    pub fn add_steps(&mut self, depth: &[f32], stride: usize) {
        let [width, height] = self.size_px;
        let of = |tile_row: usize, marks: &mut [u64]| {
            let mut steps = vec![0_u32; width.div_ceil(LANES)];
            // What is beside a step may show it too.
            let first = (TILE_PX * tile_row).saturating_sub(1);
            for y in first..(TILE_PX * (tile_row + 1) + 1).min(height) {
                let row = |y: usize| &depth[y * stride..][..width];
                add_steps_of_row([row(y.saturating_sub(1)), row(y), row((y + 1).min(height - 1))], &mut steps);
            }
            for tile in 0..width.div_ceil(TILE_PX) {
                if (0..TILE_PX + 2).any(|k| {
                    // From the pixel before the tile to the one after it.
                    let x = (TILE_PX * tile + k).wrapping_sub(1);
                    steps.get(x / LANES).is_some_and(|steps| steps >> (x % LANES) & 1 == 1)
                }) {
                    marks[tile / BITS] |= 1 << (tile % BITS);
                }
            }
        };
        self.bits.par_chunks_mut(self.words).enumerate().filter(|(row, _)| row * TILE_PX < height).for_each(|(row, marks)| of(row, marks));
    }
}

/// Bits of pixels at which inverse depth bends, by three rows.
fn add_steps_of_row([above, here, below]: [&[f32]; 3], steps: &mut [u32]) {
    let width = here.len();
    for (block, steps) in steps.iter_mut().enumerate() {
        let first = block * LANES;
        // Beyond the frame is what is at its border.
        let at = |row: &[f32], x: isize| row[(first as isize + x).clamp(0, width as isize - 1) as usize];
        let is_within = first > 0 && first + LANES < width;
        let mut across = [0.0; LANES + 2];
        let mut down = [[0.0; LANES]; 2];
        if is_within {
            across.copy_from_slice(&here[first - 1..first + LANES + 1]);
            down[0].copy_from_slice(&above[first..first + LANES]);
            down[1].copy_from_slice(&below[first..first + LANES]);
        } else {
            for i in 0..LANES + 2 {
                across[i] = at(here, i as isize - 1);
            }
            for i in 0..LANES {
                down[0][i] = at(above, i as isize);
                down[1][i] = at(below, i as isize);
            }
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
fn tiles(cover: &Cover) -> [[usize; 2]; 2] {
    [0, 1].map(|k| [cover.first[k], cover.last[k]].map(|of| usize::from(of) / (TILE_PX * ALONG)))
}

/// Marks all tiles of a band that a triangle may be in.
pub(super) fn add_triangle(marks: &mut [u64], number: usize, cover: &Cover) {
    let words = marks.len() / TILE_ROWS;
    let [columns, rows] = tiles(cover);
    let first_row = number * TILE_ROWS;
    for row in rows[0].max(first_row)..=rows[1].min(first_row + TILE_ROWS - 1) {
        for column in columns[0]..=columns[1] {
            marks[(row - first_row) * words + column / BITS] |= 1 << (column % BITS);
        }
    }
}

impl OfBand<'_> {
    pub fn is_empty(&self) -> bool {
        self.bits.iter().all(|&bits| bits == 0)
    }

    /// Whether a triangle may be in any of them.
    #[inline(always)]
    pub fn has(&self, cover: &Cover) -> bool {
        let [columns, rows] = tiles(cover);
        let last_row = self.first_row + TILE_ROWS - 1;
        (rows[0].max(self.first_row)..=rows[1].min(last_row))
            .any(|row| (columns[0]..=columns[1]).any(|column| self.is_marked_at(column, row - self.first_row)))
    }

    /// By the tile's column and its row within the band.
    #[inline(always)]
    pub fn is_marked_at(&self, column: usize, row: usize) -> bool {
        self.bits[row * self.words + column / BITS] >> (column % BITS) & 1 == 1
    }
}
