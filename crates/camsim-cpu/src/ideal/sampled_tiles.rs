//! Tiles of an ideal frame that are rasterised per sample: those with a depth step inside or beside them, and
//! those with any triangle of a mesh, which may be thinner than a pixel. Elsewhere all samples show what the
//! pixel centre shows.

use std::{
    ops::RangeInclusive,
    sync::atomic::{AtomicU64, Ordering},
};

use rayon::prelude::*;

use super::{
    multisample::{PIXEL_ROWS, SAMPLES_PER_SIDE},
    triangles::RasterTriangle,
};
use crate::simd::{
    lanes::{LANES, fast_max},
    vectors::widest,
};

/// Side of a tile, pixels.
pub(super) const TILE_PX: usize = 8;
/// Rows of tiles per band.
const TILE_ROWS: usize = PIXEL_ROWS / TILE_PX;
/// Second difference of inverse depth, relative to the nearest of the three pixels, that counts as a step:
/// smaller than that of [`camsim_core::temporal::edge_mask`].
const DEPTH_STEP: f32 = 0.005;
const BITS: usize = u64::BITS as usize;

/// Set of tiles that are rasterised per sample, one bit each.
#[derive(Debug, Default)]
pub(super) struct SampledTiles {
    size_px: [usize; 2],
    /// Words per row of tiles.
    words: usize,
    bits: Vec<AtomicU64>,
}

/// Tiles of a band.
#[derive(Clone, Copy)]
pub(super) struct BandTiles<'a> {
    words: usize,
    bits: &'a [AtomicU64],
    /// First row of tiles of the band.
    first_row: usize,
}

impl SampledTiles {
    /// Clears the set, for a frame of this size.
    pub fn clear(&mut self, size_px: [usize; 2]) {
        self.size_px = size_px;
        self.words = size_px[0].div_ceil(TILE_PX * BITS);
        self.bits.clear();
        self.bits.resize_with(self.words * TILE_ROWS * size_px[1].div_ceil(PIXEL_ROWS), AtomicU64::default);
    }

    pub fn band(&self, number: usize) -> BandTiles<'_> {
        let clamped = self.words * TILE_ROWS;
        BandTiles {
            words: self.words,
            bits: &self.bits[number * clamped..][..clamped],
            first_row: number * TILE_ROWS,
        }
    }

    /// Adds all tiles that the bounding boxes of triangles touch.
    pub fn add_triangles(&self, raster: &[RasterTriangle]) {
        for cover in raster {
            let [columns, rows] = tiles(cover);
            for (row, column) in
                (rows[0]..=rows[1]).flat_map(|row| (columns[0]..=columns[1]).map(move |column| (row, column)))
            {
                let (bits, bit) = (&self.bits[row * self.words + column / BITS], 1 << (column % BITS));
                // Most bits are set already: a plain load avoids the atomic write.
                if bits.load(Ordering::Relaxed) & bit == 0 {
                    bits.fetch_or(bit, Ordering::Relaxed);
                }
            }
        }
    }

    /// Adds tiles with a depth step.
    pub fn add_steps(&mut self, depth: &[f32], stride: usize) {
        let height = self.size_px[1];
        let rows = self.bits.par_chunks_mut(self.words).take(height.div_ceil(TILE_PX)).enumerate();
        rows.for_each(|(tile_row, tiles)| {
            // Pixels beside a step may show it too.
            let (first, last) =
                ((TILE_PX * tile_row).saturating_sub(1), (TILE_PX * (tile_row + 1)).min(height - 1));
            add_tiles(&steps_of_rows(first..=last, depth, stride, self.size_px), tiles);
        });
    }
}

/// For each column of pixels, one bit: whether any row has a step there.
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
            add_row_steps([row(y.saturating_sub(1)), row(y), row((y + 1).min(height - 1))], &mut steps);
        }
        steps
    })
}

/// Adds tiles that contain one of these pixels or are beside one.
fn add_tiles(pixels: &[u32], tiles: &mut [AtomicU64]) {
    const { assert!(LANES == u32::BITS as usize && LANES.is_multiple_of(TILE_PX)) };
    let clamped = |block: Option<usize>| block.and_then(|block| pixels.get(block)).copied().unwrap_or(0);
    for (block, &here) in pixels.iter().enumerate() {
        let (before, after) = (clamped(block.checked_sub(1)), clamped(Some(block + 1)));
        let dilated = here | here << 1 | here >> 1 | before >> (LANES - 1) | after << (LANES - 1);
        for tile in 0..LANES / TILE_PX {
            let is_marked = dilated >> (tile * TILE_PX) & ((1 << TILE_PX) - 1) != 0;
            let column = block * (LANES / TILE_PX) + tile;
            *tiles[column / BITS].get_mut() |= u64::from(is_marked) << (column % BITS);
        }
    }
}

/// Adds the pixels of a row at which inverse depth bends, from three rows.
#[inline(always)]
fn add_row_steps([above, here, below]: [&[f32]; 3], steps: &mut [u32]) {
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
            // The border pixels are repeated beyond the frame.
            let clamped_value = |row: &[f32], x: usize| row[x.min(width - 1)];
            across = std::array::from_fn(|i| clamped_value(here, (first + i).saturating_sub(1)));
            down = [
                std::array::from_fn(|i| clamped_value(above, first + i)),
                std::array::from_fn(|i| clamped_value(below, first + i)),
            ];
        }
        let mut bits_found = 0;
        for i in 0..LANES {
            let centre = across[i + 1];
            let bends =
                |a: f32, b: f32| (a - 2.0 * centre + b).abs() > DEPTH_STEP * fast_max(fast_max(a, b), centre);
            bits_found |= u32::from(bends(across[i], across[i + 2]) | bends(down[0][i], down[1][i])) << i;
        }
        *steps |= bits_found;
    }
}

/// Tiles of a triangle's bounding box: first and last column, first and last row.
#[inline(always)]
fn tiles(cover: &RasterTriangle) -> [[usize; 2]; 2] {
    // No `map` here: its closure may be compiled without the enabled vector instructions.
    let clamped = |k: usize| {
        [
            usize::from(cover.first[k]) / (TILE_PX * SAMPLES_PER_SIDE),
            usize::from(cover.last[k]) / (TILE_PX * SAMPLES_PER_SIDE),
        ]
    };
    [clamped(0), clamped(1)]
}

impl BandTiles<'_> {
    pub fn is_empty(&self) -> bool {
        self.bits.iter().all(|bits| bits.load(Ordering::Relaxed) == 0)
    }

    /// Whether the bounding box of a triangle touches any tile of the set.
    #[inline(always)]
    pub fn has(&self, cover: &RasterTriangle) -> bool {
        let [columns, rows] = tiles(cover);
        let last_row = self.first_row + TILE_ROWS - 1;
        (rows[0].max(self.first_row)..=rows[1].min(last_row))
            .any(|row| (columns[0]..=columns[1]).any(|column| self.contains(column, row - self.first_row)))
    }

    /// Whether a tile is in the set, by its column and its row within the band.
    #[inline(always)]
    pub fn contains(&self, column: usize, row: usize) -> bool {
        self.bits[row * self.words + column / BITS].load(Ordering::Relaxed) >> (column % BITS) & 1 == 1
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use camsim_core::noise::pcg4d;

    use super::*;
    use crate::large_pages::LargeArray;

    /// Tiles with a step inside or beside them, by the definition.
    fn marked(depth: &[f32], stride: usize, [width, height]: [usize; 2]) -> Vec<[usize; 2]> {
        let at = |x: isize, y: isize| {
            depth[y.clamp(0, height as isize - 1) as usize * stride + x.clamp(0, width as isize - 1) as usize]
        };
        let bends = |a: f32, b: f32, c: f32| (a - 2.0 * b + c).abs() > DEPTH_STEP * a.max(b).max(c);
        let is_step = |x: isize, y: isize| {
            let clamp_to = (0..width as isize).contains(&x) && (0..height as isize).contains(&y);
            clamp_to
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
    fn tiles_with_depth_steps_inside_or_beside_are_in_the_set() {
        for (size_px, step) in
            [([100, 70], 7919), ([513, 40], 12_289), ([64, 9], 31), ([1105, 33], 24_593), ([2, 2], 1)]
        {
            let [width, height] = size_px;
            let stride = width + 9;
            let mut depth: LargeArray<f32> = LargeArray::zeros(stride * height);
            // A slope with occluders here and there.
            for (i, clamped) in depth.iter_mut().enumerate() {
                *clamped = 0.01 + 1e-5 * (i % stride) as f32;
            }
            for k in (0..stride * height).step_by(step) {
                let [texel, ..] = pcg4d([k as u32, 1, 2, 3]);
                let texel = texel as usize % (stride * height);
                depth[texel] *= 1.5;
            }
            let mut tiles = SampledTiles::default();
            tiles.clear(size_px);
            tiles.add_steps(&depth, stride);
            let mut bits_found = Vec::new();
            for row in 0..height.div_ceil(TILE_PX) {
                let of_band = tiles.band(row / TILE_ROWS);
                bits_found.extend(
                    (0..width.div_ceil(TILE_PX))
                        .filter(|&column| of_band.contains(column, row % TILE_ROWS))
                        .map(|column| [column, row]),
                );
            }
            bits_found.sort_unstable();
            assert_eq!(bits_found, marked(&depth, stride, size_px), "{size_px:?}");
        }
    }
}
