//! Blur by the Fourier transform: exact for any transfer function, at a cost that does not grow with its
//! width.

use std::sync::Arc;

use rayon::prelude::*;
use rustfft::{Fft, FftPlanner, num_complex::Complex32};

use super::{RGBA, put_row, transfer::LensTransfer};

/// Columns that are transformed together, so that whole lines of memory are read.
const BLOCK: usize = 8;

/// Transforms for pictures of one size, with a margin in which the border pixels are repeated.
pub(super) struct Fourier {
    size: [usize; 2],
    grid: [usize; 2],
    forth: [Arc<dyn Fft<f32>>; 2],
    back: [Arc<dyn Fft<f32>>; 2],
    /// Transfer functions of red, green and blue, or of all three; column by column of the spectrum, divided
    /// by the number of pixels of the grid.
    factors: Vec<Vec<Complex32>>,
}

impl std::fmt::Debug for Fourier {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Fourier").field("size", &self.size).field("grid", &self.grid).finish_non_exhaustive()
    }
}

impl Fourier {
    pub fn new(size_px: [u32; 2], transfer: &LensTransfer) -> Self {
        let size = size_px.map(|side| side as usize);
        let reach = transfer.reach_px();
        let grid = [0, 1].map(|k: usize| {
            let margin = (reach[k].ceil() as usize).min(size[k]);
            fast_length(size[k] + 2 * margin)
        });
        let along = grid.map(frequencies);
        let fraction = 1.0 / (grid[0] * grid[1]) as f32;
        let channels = if transfer.is_gray() { 1 } else { 3 };
        let factors = (0..channels)
            .map(|channel| {
                let mut factors = transfer.on_grid(channel, [&along[0], &along[1]]);
                factors.par_iter_mut().for_each(|factor| *factor *= fraction);
                factors
            })
            .collect();
        let mut planner = FftPlanner::new();
        Self {
            size,
            grid,
            forth: grid.map(|length| planner.plan_fft_forward(length)),
            back: grid.map(|length| planner.plan_fft_inverse(length)),
            factors,
        }
    }

    /// Spreads the light of `filled`, all of whose pixels have light, into those of `color_rgba` that have a
    /// ray.
    pub fn spread(&self, filled: &[f32], color_rgba: &mut [f32]) {
        let stride = RGBA * self.size[0];
        let [red_green, blue] = [[Some(0), Some(1)], [Some(2), None]].map(|channels| {
            let spectrum = self.columns(&self.rows(filled, channels), channels);
            self.rows_back(&spectrum)
        });
        let rows = color_rgba.par_chunks_mut(stride).zip(red_green.par_chunks(self.size[0]));
        rows.zip(blue.par_chunks(self.size[0])).for_each(|((row, red_green), blue)| {
            put_row(red_green.iter().zip(blue).map(|(rg, b)| [rg.re, rg.im, b.re]), row);
        });
    }

    /// Spectra of the rows of one channel, or of two as real and imaginary part.
    fn rows(&self, filled: &[f32], channels: [Option<usize>; 2]) -> Vec<Complex32> {
        let ([width, _], [length, _]) = (self.size, self.grid);
        let mut spectra = vec![Complex32::default(); length * self.size[1]];
        let forth = &self.forth[0];
        let memory = || vec![Complex32::default(); forth.get_inplace_scratch_len()];
        let rows = spectra.par_chunks_mut(length).zip(filled.par_chunks(RGBA * width));
        rows.for_each_init(memory, |scratch, (spectrum, row)| {
            let pixels = row.chunks_exact(RGBA);
            for (value, rgba) in spectrum.iter_mut().zip(pixels) {
                let [re, im] = channels.map(|channel| channel.map_or(0.0, |channel| rgba[channel]));
                *value = Complex32::new(re, im);
            }
            let (first, last) = (spectrum[0], spectrum[width - 1]);
            for (x, value) in spectrum.iter_mut().enumerate().skip(width) {
                *value = if is_after(x, width, length) { last } else { first };
            }
            forth.process_with_scratch(spectrum, scratch);
        });
        spectra
    }

    /// Transforms the columns, multiplies and transforms them back: rows of the spectrum, column by column.
    fn columns(&self, rows: &[Complex32], channels: [Option<usize>; 2]) -> Vec<Complex32> {
        let [width, height] = self.grid;
        let mut spectrum = vec![Complex32::default(); width * height];
        let memory = || vec![Complex32::default(); self.forth[1].get_inplace_scratch_len()];
        spectrum.par_chunks_mut(BLOCK * height).enumerate().for_each_init(
            memory,
            |scratch, (block, columns)| {
                let x = BLOCK * block;
                for y in 0..height {
                    let row = &rows[row_at(y, self.size[1], height) * width..][x..];
                    columns[y..].iter_mut().step_by(height).zip(row).for_each(|(to, from)| *to = *from);
                }
                self.forth[1].process_with_scratch(columns, scratch);
            },
        );
        let mut product = vec![Complex32::default(); width * height];
        let memory = || vec![Complex32::default(); self.back[1].get_inplace_scratch_len()];
        product.par_chunks_mut(height).enumerate().for_each_init(memory, |scratch, (x, column)| {
            self.multiply(&spectrum, channels, x, column);
            self.back[1].process_with_scratch(column, scratch);
        });
        product
    }

    /// A column of the spectrum of a + i b, with the transfer functions of both channels: with F of a + i b
    /// and the conjugate G of F at the opposite frequency, a has the spectrum (F + G) / 2 and i b has (F - G)
    /// / 2.
    fn multiply(
        &self,
        spectrum: &[Complex32],
        [re, im]: [Option<usize>; 2],
        x: usize,
        column: &mut [Complex32],
    ) {
        let [width, height] = self.grid;
        let factors =
            |channel: usize| &self.factors[channel.min(self.factors.len() - 1)][x * height..][..height];
        let own = &spectrum[x * height..][..height];
        let of_re = factors(re.unwrap_or_default());
        let (Some(im), 2..) = (im, self.factors.len()) else {
            column.iter_mut().zip(own).zip(of_re).for_each(|((to, from), factor)| *to = from * factor);
            return;
        };
        let of_im = factors(im);
        let opposite = &spectrum[(width - x) % width * height..][..height];
        for (y, to) in column.iter_mut().enumerate() {
            let other = opposite[(height - y) % height].conj();
            let (sum, difference) = (of_re[y] + of_im[y], of_re[y] - of_im[y]);
            *to = 0.5 * (own[y] * sum + other * difference);
        }
    }

    /// The rows of the picture, from rows of the spectrum, column by column.
    fn rows_back(&self, spectrum: &[Complex32]) -> Vec<Complex32> {
        let ([width, height], [length, column]) = (self.size, self.grid);
        let mut picture = vec![Complex32::default(); width * height];
        let back = &self.back[0];
        let memory = || {
            (
                vec![Complex32::default(); BLOCK * length],
                vec![Complex32::default(); back.get_inplace_scratch_len()],
            )
        };
        picture.par_chunks_mut(BLOCK * width).enumerate().for_each_init(
            memory,
            |(lines, scratch), (block, rows)| {
                let y = BLOCK * block;
                let count = rows.len() / width;
                for x in 0..length {
                    let from = &spectrum[x * column + y..][..count];
                    lines[x..].iter_mut().step_by(length).zip(from).for_each(|(to, from)| *to = *from);
                }
                back.process_with_scratch(&mut lines[..count * length], scratch);
                for (row, line) in rows.chunks_exact_mut(width).zip(lines.chunks_exact(length)) {
                    row.copy_from_slice(&line[..width]);
                }
            },
        );
        picture
    }
}

/// Whether a position in the margin is beyond the last pixel, and not before the first one: pictures repeat.
fn is_after(at: usize, size: usize, grid: usize) -> bool {
    at < size + (grid - size) / 2
}

/// The row of the picture that is in a row of the grid.
fn row_at(y: usize, height: usize, grid: usize) -> usize {
    match y {
        y if y < height => y,
        y if is_after(y, height, grid) => height - 1,
        _ => 0,
    }
}

/// Frequencies of a transform, cycles per sample.
fn frequencies(length: usize) -> Vec<f64> {
    let signed = |i: usize| if 2 * i <= length { i as f64 } else { i as f64 - length as f64 };
    (0..length).map(|i| signed(i) / length as f64).collect()
}

/// The least length from `least` on without a prime factor above 7.
fn fast_length(least: usize) -> usize {
    let is_fast = |length: &usize| {
        let mut left = *length;
        for factor in [2, 3, 5, 7] {
            while left.is_multiple_of(factor) {
                left /= factor;
            }
        }
        left == 1
    };
    (least.max(1)..).find(is_fast).unwrap_or(least)
}
