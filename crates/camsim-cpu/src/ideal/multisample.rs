//! Ideal frames with four samples per pixel. In most of most frames the pixel centres determine the samples,
//! and only they are rasterised. In [sampled tiles](super::sampled_tiles) each sample is rasterised. Pixels
//! that show one surface are shaded once, at their centre. Where they show several, each is shaded at the
//! centroid of its samples and weighted by their number.

use std::sync::{Mutex, PoisonError};

use camsim_core::temporal::{SAMPLE_POSITIONS, resolve_depth};
use half::f16;
use rayon::prelude::*;

use super::{
    CHANNELS, RasterFrame, TERRAIN_MATERIAL,
    rasterise::{self, Band, QuadCentres, ROW_PADDING, SKY},
    sampled_tiles::{BandTiles, SampledTiles, TILE_PX},
    shade::{Block, PixelPlanes, Shader},
    triangles::{BAND_ROWS, Chunk, ChunkKind},
};
use crate::large_pages::LargeArray;
use crate::simd::{
    lanes::{LANES, Lanes2, ZERO, per_lane},
    vectors::{Vectors, widest},
};

/// Samples along a side of a pixel.
pub(super) const SAMPLES_PER_SIDE: usize = 2;
const SAMPLES_PER_PIXEL: usize = SAMPLES_PER_SIDE * SAMPLES_PER_SIDE;
/// Rows of pixels per band.
pub(super) const PIXEL_ROWS: usize = BAND_ROWS / SAMPLES_PER_SIDE;
/// Depth difference within terrain, relative to the distance, above which part of it may occlude another
/// part: both are then shaded separately.
const STEP: f32 = 0.005;

/// State of frames with several samples per pixel.
#[derive(Debug, Default)]
pub(super) struct Multisample {
    tiles: SampledTiles,
    /// Scratch buffers per thread.
    bands: Vec<Mutex<BandSamples>>,
}

/// Depths and visible triangles of the samples of a band, and scratch buffers.
#[derive(Debug, Default)]
struct BandSamples {
    /// Values from one row to the next.
    stride: usize,
    depth: Vec<f32>,
    visible: Vec<u32>,
    /// Columns of the pixels of a row that show several surfaces, and sums of their colours.
    mixed_pixels: Vec<(usize, [f32; CHANNELS])>,
    parts: Vec<PixelPart>,
}

/// Samples of a pixel that show the same triangle.
#[derive(Clone, Copy, Debug)]
struct PixelPart {
    /// Index in `mixed_pixels`.
    pixel: usize,
    visible: u32,
    /// Centroid of the samples.
    centroid_px: [f32; 2],
    weight: f32,
}

/// One value per sample of a pixel, row by row.
type PerSample<T> = [T; SAMPLES_PER_PIXEL];

impl Multisample {
    /// Begins a frame with this size of the sample grid.
    pub fn clear(&mut self, samples_px: [u32; 2]) {
        self.tiles.clear(samples_px.map(|side| side as usize / SAMPLES_PER_SIDE));
    }

    /// Adds the tiles of mesh triangles, which may be thinner than a pixel.
    pub fn add_meshes(&self, chunk: &Chunk) {
        if chunk.kind != ChunkKind::Terrain {
            self.tiles.add_triangles(&chunk.raster);
        }
    }

    /// Computes depth and colour of every pixel.
    pub fn fill(&mut self, shader: &Shader<'_>, visible: &mut LargeArray<u32>, into: &mut RasterFrame) {
        let stride = into.stride;
        let band_len = stride * PIXEL_ROWS;
        let bands = into.depth.par_chunks_mut(band_len).zip(visible.par_chunks_mut(band_len));
        bands.enumerate().for_each(|(number, (depth, visible))| {
            depth.fill(0.0);
            visible.fill(SKY);
            let mut band = Band { number, stride, depth, visible };
            widest!(vectors => draw_centres(vectors, shader, &mut band))
        });
        self.tiles.add_steps(&into.depth, stride);
        self.bands.resize_with(rayon::current_num_threads(), Mutex::default);
        let Self { tiles, bands: thread_scratch } = self;
        let rows = into
            .depth
            .par_chunks_mut(band_len)
            .zip(visible.par_chunks(band_len))
            .zip(into.color.par_chunks_mut(CHANNELS * band_len));
        rows.enumerate().for_each(|(number, ((depth, visible), color))| {
            // The tasks of this loop run on rayon's pool, one at a time per thread, so the lock is never
            // contended.
            let scratch_of_thread = thread_scratch.get(rayon::current_thread_index().unwrap_or_default());
            let Some(scratch) = scratch_of_thread else { return };
            let mut band_samples = scratch.lock().unwrap_or_else(PoisonError::into_inner);
            let tiles = tiles.band(number);
            widest!(vectors => {
                band_samples.fill(vectors, shader, number, tiles, stride, depth, visible, color);
            })
        });
    }
}

/// Draws the terrain at pixel centres; where meshes are, the samples determine everything.
#[inline(always)]
fn draw_centres(vectors: impl Vectors, shader: &Shader<'_>, band: &mut Band<'_>) {
    for (number, chunk) in (0..).zip(shader.chunks).filter(|(_, chunk)| chunk.kind == ChunkKind::Terrain) {
        band.draw(vectors, QuadCentres, chunk, number, |_| true);
    }
}

impl BandSamples {
    /// Computes the colours of a band, and the depths of its pixels in sampled tiles.
    #[inline(always)]
    fn fill(
        &mut self,
        vectors: impl Vectors,
        shader: &Shader<'_>,
        number: usize,
        tiles: BandTiles<'_>,
        stride: usize,
        depth: &mut [f32],
        visible: &[u32],
        color: &mut [u16],
    ) {
        let width = shader.camera.size_px[0] as usize / SAMPLES_PER_SIDE;
        self.draw(vectors, shader, number, tiles, width);
        let mut planes = PixelPlanes::new();
        let rows = depth
            .chunks_exact_mut(stride)
            .zip(visible.chunks_exact(stride))
            .zip(color.chunks_exact_mut(CHANNELS * stride));
        for (row, ((depth, visible), color)) in rows.enumerate() {
            let blocks = depth
                .as_chunks_mut()
                .0
                .iter_mut()
                .zip(visible.as_chunks().0)
                .zip(color.chunks_exact_mut(CHANNELS * LANES));
            for (block, ((depth, visible), color)) in blocks.take(width.div_ceil(LANES)).enumerate() {
                let column = block * LANES;
                let y = ((number * PIXEL_ROWS + row) * SAMPLES_PER_SIDE) as f32 + 0.5;
                let positions =
                    Lanes2 { x: per_lane(|i| (SAMPLES_PER_SIDE * (column + i)) as f32 + 0.5), y: [y; LANES] };
                let mut block = Block { visible: *visible, positions };
                for tile in
                    (0..LANES / TILE_PX).filter(|tile| tiles.contains(column / TILE_PX + tile, row / TILE_PX))
                {
                    let pixels = tile * TILE_PX..(tile + 1) * TILE_PX;
                    self.resolve(shader, [column, row], pixels, &mut block, depth);
                }
                let colors = shader.colors(&block, &mut planes);
                let pairs =
                    color.as_chunks_mut::<8>().0.iter_mut().zip(colors.as_flattened().as_chunks::<8>().0);
                pairs.for_each(|(out, pixels)| *out = vectors.halves_from_floats(*pixels));
            }
            self.finish_row(vectors, shader, &mut planes, color);
        }
    }

    /// Rasterises the samples of the band's sampled tiles.
    #[inline(always)]
    fn draw(
        &mut self,
        vectors: impl Vectors,
        shader: &Shader<'_>,
        number: usize,
        tiles: BandTiles<'_>,
        width: usize,
    ) {
        if tiles.is_empty() {
            return;
        }
        self.stride = SAMPLES_PER_SIDE * width.next_multiple_of(LANES) + ROW_PADDING;
        self.depth.resize(self.stride * BAND_ROWS, 0.0);
        self.visible.resize(self.stride * BAND_ROWS, SKY);
        let tile_samples = TILE_PX * SAMPLES_PER_SIDE;
        // Up to the end of the blocks: tiles beside a step at the frame's border are in the set too.
        let columns = width.next_multiple_of(LANES) / TILE_PX;
        for (row, column) in
            (0..PIXEL_ROWS / TILE_PX).flat_map(|row| (0..columns).map(move |column| (row, column)))
        {
            if tiles.contains(column, row) {
                for row in row * tile_samples..(row + 1) * tile_samples {
                    let first = row * self.stride + column * tile_samples;
                    self.depth[first..first + tile_samples].fill(0.0);
                    self.visible[first..first + tile_samples].fill(SKY);
                }
            }
        }
        let mut band =
            Band { number, stride: self.stride, depth: &mut self.depth, visible: &mut self.visible };
        for (number, chunk) in (0..).zip(shader.chunks) {
            // Tiles with mesh triangles are in the set.
            band.draw(vectors, rasterise::SamplePositions, chunk, number, |triangle| {
                chunk.kind != ChunkKind::Terrain || tiles.has(triangle)
            });
        }
    }

    /// Resolves pixels of a sampled tile: those that show one surface go to the block, the parts of the
    /// others are collected.
    #[inline(always)]
    fn resolve(
        &mut self,
        shader: &Shader<'_>,
        [column, row]: [usize; 2],
        pixels: std::ops::Range<usize>,
        block: &mut Block,
        depth: &mut [f32; LANES],
    ) {
        for i in pixels {
            let first = SAMPLES_PER_SIDE * row * self.stride + SAMPLES_PER_SIDE * (column + i);
            let second = first + self.stride;
            let visible = [
                self.visible[first],
                self.visible[first + 1],
                self.visible[second],
                self.visible[second + 1],
            ];
            let depths =
                [self.depth[first], self.depth[first + 1], self.depth[second], self.depth[second + 1]];
            if visible[1..].iter().all(|&other| other == visible[0]) {
                block.visible[i] = visible[0];
                depth[i] = 0.25 * ((depths[0] + depths[3]) + (depths[1] + depths[2]));
                continue;
            }
            let majority = majority(&visible);
            let [_, across, down] = shader.surface(majority).inverse_depth;
            depth[i] =
                resolve_depth(depths, [SAMPLES_PER_SIDE as f32 * across, SAMPLES_PER_SIDE as f32 * down]);
            if is_terrain(shader, &visible, &depths) {
                block.visible[i] = majority;
            } else {
                block.visible[i] = SKY;
                self.add(shader, column + i, [block.positions.x[i], block.positions.y[i]], &visible);
            }
        }
    }

    /// Collects the parts of a pixel that shows several triangles.
    #[inline(always)]
    fn add(&mut self, shader: &Shader<'_>, column: usize, [x, y]: [f32; 2], visible: &PerSample<u32>) {
        let [r, g, b, _] = shader.camera.uniforms.sky;
        let pixel = self.mixed_pixels.len();
        let mut sky = 0.0;
        for (k, &id) in visible.iter().enumerate() {
            if id == SKY {
                sky += 0.25;
            } else if !visible[..k].contains(&id) {
                let (mut count, mut offset_sum) = (0.0, [0.0; 2]);
                for (position, _) in SAMPLE_POSITIONS.iter().zip(visible).filter(|(_, other)| **other == id) {
                    count += 1.0;
                    offset_sum = [offset_sum[0] + position.x as f32, offset_sum[1] + position.y as f32];
                }
                let scale = SAMPLES_PER_SIDE as f32 / count;
                let centroid_px = [scale.mul_add(offset_sum[0], x), scale.mul_add(offset_sum[1], y)];
                self.parts.push(PixelPart { pixel, visible: id, centroid_px, weight: 0.25 * count });
            }
        }
        self.mixed_pixels.push((column, [r, g, b, 1.0].map(|channel| sky * channel)));
    }

    /// Shades the parts of a row and writes the pixels that show several surfaces.
    #[inline(always)]
    fn finish_row(
        &mut self,
        vectors: impl Vectors,
        shader: &Shader<'_>,
        planes: &mut PixelPlanes,
        color: &mut [u16],
    ) {
        for parts in self.parts.chunks(LANES) {
            let mut block = Block { visible: [SKY; LANES], positions: Lanes2 { x: ZERO, y: ZERO } };
            for (i, part) in parts.iter().enumerate() {
                block.visible[i] = part.visible;
                [block.positions.x[i], block.positions.y[i]] = part.centroid_px;
            }
            let colors = shader.colors(&block, planes);
            for (part, color) in parts.iter().zip(&colors) {
                let sum = &mut self.mixed_pixels[part.pixel].1;
                for k in 0..CHANNELS {
                    sum[k] = part.weight.mul_add(color[k], sum[k]);
                }
            }
        }
        for pair in self.mixed_pixels.chunks(2) {
            let mut pixels = [0.0; 2 * CHANNELS];
            for (to, (_, from)) in pixels.as_chunks_mut::<CHANNELS>().0.iter_mut().zip(pair) {
                *to = *from;
            }
            let halves = vectors.halves_from_floats(pixels);
            for (&(column, _), halves) in pair.iter().zip(halves.as_chunks::<CHANNELS>().0) {
                color[CHANNELS * column..][..CHANNELS].copy_from_slice(halves);
            }
        }
        self.parts.clear();
        self.mixed_pixels.clear();
    }
}

/// Resolves a frame whose samples were drawn as pixels.
pub(super) fn resolve_samples(samples: &RasterFrame, size_px: [u32; 2], into: &mut RasterFrame) {
    let [width, height] = size_px.map(|side| side as usize);
    let stride = into.stride;
    let rows =
        into.depth.par_chunks_mut(stride).zip(into.color.par_chunks_mut(CHANNELS * stride)).take(height);
    rows.enumerate().for_each(|(row, (depth, color))| {
        for column in 0..width {
            let sample_index = |k: usize| {
                (SAMPLES_PER_SIDE * row + k / SAMPLES_PER_SIDE) * samples.stride
                    + SAMPLES_PER_SIDE * column
                    + k % SAMPLES_PER_SIDE
            };
            depth[column] = resolve_depth([0, 1, 2, 3].map(|k| samples.depth[sample_index(k)]), [0.0; 2]);
            for channel in 0..CHANNELS {
                let value =
                    |k: usize| f16::from_bits(samples.color[CHANNELS * sample_index(k) + channel]).to_f32();
                color[CHANNELS * column + channel] =
                    f16::from_f32(0.25 * ((value(0) + value(3)) + (value(1) + value(2)))).to_bits();
            }
        }
    });
}

/// Whether all samples show terrain without a depth step.
#[inline(always)]
fn is_terrain(shader: &Shader<'_>, visible: &PerSample<u32>, depths: &PerSample<f32>) -> bool {
    let [least, most] = depths
        .iter()
        .fold([f32::INFINITY, 0.0_f32], |[least, most], &depth| [least.min(depth), most.max(depth)]);
    least >= (1.0 - STEP) * most && visible.iter().all(|&id| shader.surface(id).material == TERRAIN_MATERIAL)
}

/// The triangle of most samples, or the first of several with as many.
fn majority(&[a, b, c, d]: &PerSample<u32>) -> u32 {
    if a == b || a == c || a == d || (b != c && b != d && c != d) {
        a
    } else if b == c || b == d {
        b
    } else {
        c
    }
}
