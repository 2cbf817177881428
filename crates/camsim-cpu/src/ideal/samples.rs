//! Ideal frames of four samples a pixel. Where the middles of pixels tell all that there is, in most of most
//! frames, they are all that is looked at. In tiles that are [marked](super::marks) it is asked of each
//! sample which triangle it shows: pixels that show one surface are shaded once, at the pixel's middle, and
//! where they show several each of these is, in the middle of its own samples, and counts for as much as it
//! has of them.

use std::sync::{Mutex, PoisonError};

use camsim_core::temporal::{SAMPLE_POSITIONS, resolve_depth};
use half::f16;
use rayon::prelude::*;

use super::{
    CHANNELS, DrawnFrame, GROUND,
    cover::{self, BEYOND, Band, Fours, SKY},
    marks::{Marks, OfBand, TILE_PX},
    shade::{Block, Planes, Shader},
    triangles::{BAND_ROWS, Chunk},
};
use crate::large_pages::Large;
use crate::simd::{
    lanes::{LANES, Lanes2, ZERO, each},
    vectors::{Vectors, widest},
};

/// Samples along a side of a pixel.
pub(super) const ALONG: usize = 2;
const SAMPLES: usize = ALONG * ALONG;
/// Rows of pixels in a band.
pub(super) const PIXEL_ROWS: usize = BAND_ROWS / ALONG;
/// Ground that is nearer than ground beside it by more than this part of its distance may hide some: each has
/// a colour of its own.
const STEP: f32 = 0.005;

/// What frames of several samples a pixel need.
#[derive(Debug, Default)]
pub(super) struct Sampled {
    marks: Marks,
    /// For each thread.
    bands: Vec<Mutex<Samples>>,
}

/// Depths and triangles of the samples of a band, and what a thread needs for it.
#[derive(Debug, Default)]
struct Samples {
    /// Numbers from one row to the next.
    stride: usize,
    depth: Vec<f32>,
    shown: Vec<u32>,
    /// Pixels of a row that show several surfaces, and the sums of their colours.
    mixed: Vec<(usize, [f32; CHANNELS])>,
    parts: Vec<Part>,
}

/// Some of a pixel's samples, which show one triangle.
#[derive(Clone, Copy, Debug)]
struct Part {
    /// Which of the mixed pixels.
    pixel: usize,
    shown: u32,
    /// In the middle of the samples.
    at: [f32; 2],
    weight: f32,
}

/// One of each of a pixel's samples, row by row.
type Four<T> = [T; SAMPLES];

impl Sampled {
    /// Begins a frame of so many samples: nothing is marked yet.
    pub fn clear(&mut self, samples_px: [u32; 2]) {
        self.marks.clear(samples_px.map(|side| side as usize / ALONG));
    }

    /// Has all that triangles of models may cover looked at by samples: they may be thinner than a pixel.
    pub fn mark(&self, chunk: &Chunk) {
        if !chunk.is_of_ground {
            self.marks.add_triangles(&chunk.covers);
        }
    }

    /// Depth and colour of every pixel.
    pub fn fill(&mut self, shader: &Shader<'_>, shown: &mut Large<u32>, into: &mut DrawnFrame) {
        let stride = into.stride;
        let of_band = stride * PIXEL_ROWS;
        let bands = into.depth.par_chunks_mut(of_band).zip(shown.par_chunks_mut(of_band));
        bands.enumerate().for_each(|(number, (depth, shown))| {
            depth.fill(0.0);
            shown.fill(SKY);
            let mut band = Band { number, stride, depth, shown };
            widest!(vectors => draw_middles(vectors, shader, &mut band))
        });
        self.marks.add_steps(&into.depth, stride);
        self.bands.resize_with(rayon::current_num_threads(), Mutex::default);
        let Self { marks, bands: of_threads } = self;
        let rows = into
            .depth
            .par_chunks_mut(of_band)
            .zip(shown.par_chunks(of_band))
            .zip(into.color.par_chunks_mut(CHANNELS * of_band));
        rows.enumerate().for_each(|(number, ((depth, shown), color))| {
            // Tasks of this loop are the pool's own, one at a time in each of its threads.
            let of_thread = of_threads.get(rayon::current_thread_index().unwrap_or_default());
            let Some(mut samples) = of_thread.map(|of| of.lock().unwrap_or_else(PoisonError::into_inner))
            else {
                return;
            };
            let marks = marks.of_band(number);
            widest!(vectors => samples.fill(vectors, shader, number, marks, stride, depth, shown, color))
        });
    }
}

/// What of the ground the middles of pixels show; where models are their samples tell all.
#[inline(always)]
fn draw_middles(vectors: impl Vectors, shader: &Shader<'_>, band: &mut Band<'_>) {
    for (number, chunk) in (0..).zip(shader.chunks).filter(|(_, chunk)| chunk.is_of_ground) {
        band.draw(vectors, Fours, chunk, number, |_| true);
    }
}

impl Samples {
    /// Colours of a band of rows, and depths of those of its pixels that are in marked tiles.
    #[inline(always)]
    fn fill(
        &mut self,
        vectors: impl Vectors,
        shader: &Shader<'_>,
        number: usize,
        marks: OfBand<'_>,
        stride: usize,
        depth: &mut [f32],
        shown: &[u32],
        color: &mut [u16],
    ) {
        let width = shader.camera.size_px[0] as usize / ALONG;
        self.draw(vectors, shader, number, marks, width);
        let mut planes = Planes::new();
        let rows = depth
            .chunks_exact_mut(stride)
            .zip(shown.chunks_exact(stride))
            .zip(color.chunks_exact_mut(CHANNELS * stride));
        for (row, ((depth, shown), color)) in rows.enumerate() {
            let blocks = depth
                .as_chunks_mut()
                .0
                .iter_mut()
                .zip(shown.as_chunks().0)
                .zip(color.chunks_exact_mut(CHANNELS * LANES));
            for (block, ((depth, shown), color)) in blocks.take(width.div_ceil(LANES)).enumerate() {
                let column = block * LANES;
                let y = ((number * PIXEL_ROWS + row) * ALONG) as f32 + 0.5;
                let places = Lanes2 { x: each(|i| (ALONG * (column + i)) as f32 + 0.5), y: [y; LANES] };
                let mut block = Block { shown: *shown, places };
                for tile in (0..LANES / TILE_PX)
                    .filter(|tile| marks.is_marked_at(column / TILE_PX + tile, row / TILE_PX))
                {
                    let pixels = tile * TILE_PX..(tile + 1) * TILE_PX;
                    self.look(shader, [column, row], pixels, &mut block, depth);
                }
                let colors = shader.colors(vectors, &block, &mut planes);
                let pairs =
                    color.as_chunks_mut::<8>().0.iter_mut().zip(colors.as_flattened().as_chunks::<8>().0);
                pairs.for_each(|(out, pixels)| *out = vectors.halves(*pixels));
            }
            self.finish_row(vectors, shader, &mut planes, color);
        }
    }

    /// Which triangles the samples of marked tiles show.
    #[inline(always)]
    fn draw(
        &mut self,
        vectors: impl Vectors,
        shader: &Shader<'_>,
        number: usize,
        marks: OfBand<'_>,
        width: usize,
    ) {
        if marks.is_empty() {
            return;
        }
        self.stride = ALONG * width.next_multiple_of(LANES) + BEYOND;
        self.depth.resize(self.stride * BAND_ROWS, 0.0);
        self.shown.resize(self.stride * BAND_ROWS, SKY);
        let of_tile = TILE_PX * ALONG;
        // Up to where blocks end: tiles beside a step at the frame's border are marked there too.
        let columns = width.next_multiple_of(LANES) / TILE_PX;
        for (row, column) in
            (0..PIXEL_ROWS / TILE_PX).flat_map(|row| (0..columns).map(move |column| (row, column)))
        {
            if marks.is_marked_at(column, row) {
                for row in row * of_tile..(row + 1) * of_tile {
                    let first = row * self.stride + column * of_tile;
                    self.depth[first..first + of_tile].fill(0.0);
                    self.shown[first..first + of_tile].fill(SKY);
                }
            }
        }
        let mut band = Band { number, stride: self.stride, depth: &mut self.depth, shown: &mut self.shown };
        for (number, chunk) in (0..).zip(shader.chunks) {
            // Where triangles of models are is marked.
            band.draw(vectors, cover::Samples, chunk, number, |cover| {
                !chunk.is_of_ground || marks.has(cover)
            });
        }
    }

    /// What some pixels of a row show by their samples: those that show one surface have it in the block, the
    /// others' parts are kept.
    #[inline(always)]
    fn look(
        &mut self,
        shader: &Shader<'_>,
        [column, row]: [usize; 2],
        pixels: std::ops::Range<usize>,
        block: &mut Block,
        depth: &mut [f32; LANES],
    ) {
        for i in pixels {
            let first = ALONG * row * self.stride + ALONG * (column + i);
            let second = first + self.stride;
            let shown =
                [self.shown[first], self.shown[first + 1], self.shown[second], self.shown[second + 1]];
            let depths =
                [self.depth[first], self.depth[first + 1], self.depth[second], self.depth[second + 1]];
            if shown[1..].iter().all(|&other| other == shown[0]) {
                block.shown[i] = shown[0];
                depth[i] = 0.25 * ((depths[0] + depths[3]) + (depths[1] + depths[2]));
                continue;
            }
            let most = most(&shown);
            let [_, across, down] = shader.surface(most).inverse;
            depth[i] = resolve_depth(depths, [ALONG as f32 * across, ALONG as f32 * down]);
            if is_ground(shader, &shown, &depths) {
                block.shown[i] = most;
            } else {
                block.shown[i] = SKY;
                self.add(shader, column + i, [block.places.x[i], block.places.y[i]], &shown);
            }
        }
    }

    /// Keeps the parts of a pixel that shows several triangles.
    #[inline(always)]
    fn add(&mut self, shader: &Shader<'_>, column: usize, [x, y]: [f32; 2], shown: &Four<u32>) {
        let [r, g, b, _] = shader.camera.uniforms.sky;
        let pixel = self.mixed.len();
        let mut sky = 0.0;
        for (k, &of) in shown.iter().enumerate() {
            if of == SKY {
                sky += 0.25;
            } else if !shown[..k].contains(&of) {
                let (mut count, mut beside) = (0.0, [0.0; 2]);
                for (place, _) in SAMPLE_POSITIONS.iter().zip(shown).filter(|(_, other)| **other == of) {
                    count += 1.0;
                    beside = [beside[0] + place.x as f32, beside[1] + place.y as f32];
                }
                let times = ALONG as f32 / count;
                let at = [times.mul_add(beside[0], x), times.mul_add(beside[1], y)];
                self.parts.push(Part { pixel, shown: of, at, weight: 0.25 * count });
            }
        }
        self.mixed.push((column, [r, g, b, 1.0].map(|of| sky * of)));
    }

    /// Colours of the row's pixels that show several surfaces.
    #[inline(always)]
    fn finish_row(
        &mut self,
        vectors: impl Vectors,
        shader: &Shader<'_>,
        planes: &mut Planes,
        color: &mut [u16],
    ) {
        for parts in self.parts.chunks(LANES) {
            let mut block = Block { shown: [SKY; LANES], places: Lanes2 { x: ZERO, y: ZERO } };
            for (i, part) in parts.iter().enumerate() {
                block.shown[i] = part.shown;
                [block.places.x[i], block.places.y[i]] = part.at;
            }
            let colors = shader.colors(vectors, &block, planes);
            for (part, color) in parts.iter().zip(&colors) {
                let sum = &mut self.mixed[part.pixel].1;
                for k in 0..CHANNELS {
                    sum[k] = part.weight.mul_add(color[k], sum[k]);
                }
            }
        }
        for pair in self.mixed.chunks(2) {
            let mut pixels = [0.0; 2 * CHANNELS];
            for (to, (_, from)) in pixels.as_chunks_mut::<CHANNELS>().0.iter_mut().zip(pair) {
                *to = *from;
            }
            let halves = vectors.halves(pixels);
            for (&(column, _), halves) in pair.iter().zip(halves.as_chunks::<CHANNELS>().0) {
                color[CHANNELS * column..][..CHANNELS].copy_from_slice(halves);
            }
        }
        self.parts.clear();
        self.mixed.clear();
    }
}

/// Pixels from their samples, each drawn as a pixel.
pub(super) fn mix(samples: &DrawnFrame, size_px: [u32; 2], into: &mut DrawnFrame) {
    let [width, height] = size_px.map(|side| side as usize);
    let stride = into.stride;
    let rows =
        into.depth.par_chunks_mut(stride).zip(into.color.par_chunks_mut(CHANNELS * stride)).take(height);
    rows.enumerate().for_each(|(row, (depth, color))| {
        for column in 0..width {
            let at = |k: usize| (ALONG * row + k / ALONG) * samples.stride + ALONG * column + k % ALONG;
            depth[column] = resolve_depth([0, 1, 2, 3].map(|k| samples.depth[at(k)]), [0.0; 2]);
            for channel in 0..CHANNELS {
                let of = |k: usize| f16::from_bits(samples.color[CHANNELS * at(k) + channel]).to_f32();
                color[CHANNELS * column + channel] =
                    f16::from_f32(0.25 * ((of(0) + of(3)) + (of(1) + of(2)))).to_bits();
            }
        }
    });
}

/// Whether samples all show the ground, without a step between them.
#[inline(always)]
fn is_ground(shader: &Shader<'_>, shown: &Four<u32>, depths: &Four<f32>) -> bool {
    let [least, most] =
        depths.iter().fold([f32::INFINITY, 0.0_f32], |[least, most], &of| [least.min(of), most.max(of)]);
    least >= (1.0 - STEP) * most && shown.iter().all(|&of| shader.surface(of).paint == GROUND)
}

/// What most samples show, of as many the first.
fn most(&[a, b, c, d]: &Four<u32>) -> u32 {
    if a == b || a == c || a == d || (b != c && b != d && c != d) {
        a
    } else if b == c || b == d {
        b
    } else {
        c
    }
}
