//! Gaussian blur by rows and columns.

use std::f64::consts::{PI, TAU};

use rayon::prelude::*;

use super::{RGBA, put_row};

/// Standard deviation above which the transform is faster (docs/theory/IMAGING.md).
const MAX_SIGMA_PX: f64 = 8.0;
/// Reach of the taps beyond which what is left of them changes no transfer function by 0.01.
const LEAST_RADIUS: usize = 10;
/// Samples of the spectrum from which the taps are computed.
const SPECTRUM: u32 = 4096;

/// A Gaussian as taps along each axis.
#[derive(Clone, Debug)]
pub(super) struct Separable {
    taps: Vec<f32>,
}

impl Separable {
    /// `None` if it is too wide to be fast.
    pub fn new(sigma_px: f64) -> Option<Self> {
        (sigma_px <= MAX_SIGMA_PX).then(|| Self { taps: taps(sigma_px) })
    }

    /// Spreads the light of `filled`, all of whose pixels have light, into those of `color_rgba` that have a
    /// ray.
    pub fn spread(&self, size_px: [u32; 2], filled: &[f32], color_rgba: &mut [f32]) {
        let stride = RGBA * size_px[0] as usize;
        let edge = RGBA * (self.taps.len() / 2);
        let memory = || (vec![0.0_f32; stride + 2 * edge], vec![0.0_f32; stride]);
        color_rgba.par_chunks_mut(stride).enumerate().for_each_init(memory, |(padded, sum), (y, row)| {
            let column = &mut padded[edge..edge + stride];
            self.along_columns(filled, stride, y, column);
            extend(padded, edge);
            sum.fill(0.0);
            for (i, tap) in self.taps.iter().enumerate() {
                add(*tap, &padded[RGBA * i..][..stride], sum);
            }
            put_row(sum.chunks_exact(RGBA).map(|rgba| [rgba[0], rgba[1], rgba[2]]), row);
        });
    }

    fn along_columns(&self, filled: &[f32], stride: usize, y: usize, sum: &mut [f32]) {
        let (radius, last) = (self.taps.len() / 2, filled.len() / stride - 1);
        sum.fill(0.0);
        for (j, tap) in self.taps.iter().enumerate() {
            let from = (y + j).saturating_sub(radius).min(last);
            add(*tap, &filled[from * stride..][..stride], sum);
        }
    }
}

/// Adds a row times a factor.
fn add(factor: f32, row: &[f32], sum: &mut [f32]) {
    sum.iter_mut().zip(row).for_each(|(sum, value)| *sum += factor * *value);
}

/// Repeats the first and last pixel of a row into the margins beside it.
fn extend(padded: &mut [f32], edge: usize) {
    let end = padded.len() - edge;
    let (first, last) = (edge..edge + RGBA, end - RGBA..end);
    for at in (0..edge).step_by(RGBA) {
        padded.copy_within(first.clone(), at);
        padded.copy_within(last.clone(), end + at);
    }
}

/// Taps whose transfer function is that of the Gaussian up to the Nyquist frequency: the picture holds means
/// over pixels already, so that none is taken here.
fn taps(sigma_px: f64) -> Vec<f32> {
    let radius = ((4.0 * sigma_px).ceil() as usize).max(LEAST_RADIUS);
    let spectrum: Vec<f64> = (0..SPECTRUM)
        .map(|i| {
            let cycles = f64::from(i) / f64::from(SPECTRUM);
            (-2.0 * (PI * sigma_px * cycles.min(1.0 - cycles)).powi(2)).exp()
        })
        .collect();
    let tap = |offset: usize| {
        let wave = |i: usize| (TAU * ((i * offset) % SPECTRUM as usize) as f64 / f64::from(SPECTRUM)).cos();
        spectrum.iter().enumerate().map(|(i, value)| value * wave(i)).sum::<f64>() / f64::from(SPECTRUM)
    };
    let half: Vec<f64> = (0..=radius).map(tap).collect();
    let sum = half[0] + 2.0 * half[1..].iter().sum::<f64>();
    (0..=2 * radius).map(|i| (half[i.abs_diff(radius)] / sum) as f32).collect()
}
