//! A rasterised ideal frame.

use camsim_plan::NEAR_M;
use half::f16;
use rayon::prelude::*;

use super::{CHANNELS, rasterise::ROW_PADDING};
use crate::{
    large_pages::LargeArray,
    reverse::IdealTexels,
    silhouettes::{DepthPlane, FineSamples, IdealImage},
    simd::lanes::LANES,
};

/// An ideal frame in memory.
#[derive(Debug, Default)]
pub(crate) struct RasterFrame {
    /// Linear R G B A, half floats. A is 0 where the silhouettes have an edge pixel.
    pub(crate) color: LargeArray<u16>,
    /// near / z, 0 = infinitely far.
    pub(crate) depth: LargeArray<f32>,
    /// Texels from one row to the next, of colour and depth.
    pub(crate) stride: usize,
    /// What silhouette rays read, if the plan has such.
    pub(crate) silhouettes: Option<Silhouettes>,
}

/// What silhouette rays read of an ideal frame beside its colours.
#[derive(Debug)]
pub(crate) struct Silhouettes {
    /// Inverse depths of the pixels, 1/m, row-major.
    pub inverse_depth: Vec<f32>,
    pub fine: FineSamples,
}

impl RasterFrame {
    /// Sets the size of the depths.
    pub(super) fn fit_depth(&mut self, [width, height]: [u32; 2]) {
        self.stride = (width as usize + ROW_PADDING).next_multiple_of(LANES);
        self.depth.fit(self.stride * height as usize);
    }

    /// Makes room for as many colours as there are depths.
    pub(super) fn fit_color(&mut self) {
        self.color.fit(CHANNELS * self.depth.len());
    }

    /// Adds what silhouette rays read: `samples` has a pixel a sample.
    pub(super) fn add_silhouettes(&mut self, size_px: [u32; 2], (scale, thin): (u32, bool), samples: &Self) {
        let inverse_depth = self.inverse_depths(size_px);
        let color = |at: usize| [0, 1, 2].map(|k: usize| f16::from_bits(samples.color[CHANNELS * at + k]));
        let fine_px = size_px.map(|side| side * scale);
        let colors = if scale > 1 { samples.quads(fine_px, color) } else { Vec::new() };
        let fine = FineSamples::new(size_px, &self.plane(), (scale, thin), &samples.plane(), colors);
        self.set_silhouettes(Silhouettes { inverse_depth, fine });
    }

    /// Values of each 2x2 pixels, row-major.
    fn quads<T: Send>(&self, [width, height]: [u32; 2], value: impl Fn(usize) -> T + Sync) -> Vec<[T; 4]> {
        let quad = |i: u32| {
            let first = 2 * (i / width) as usize * self.stride + 2 * (i % width) as usize;
            [first, first + 1, first + self.stride, first + self.stride + 1].map(&value)
        };
        (0..width * height).into_par_iter().map(quad).collect()
    }

    fn plane(&self) -> DepthPlane<'_> {
        DepthPlane { values: &self.depth, stride: self.stride, per_m: (1.0 / NEAR_M) as f32 }
    }

    /// Inverse depths, 1/m, row-major.
    fn inverse_depths(&self, [width, height]: [u32; 2]) -> Vec<f32> {
        let mut inverse_depth = vec![0.0; width as usize * height as usize];
        let rows = inverse_depth.par_chunks_mut(width as usize).zip(self.depth.par_chunks(self.stride));
        rows.for_each(|(row, depth)| {
            row.iter_mut()
                .zip(depth)
                .for_each(|(inverse_depth, depth)| *inverse_depth = depth / NEAR_M as f32);
        });
        inverse_depth
    }

    fn set_silhouettes(&mut self, silhouettes: Silhouettes) {
        for [x, y] in silhouettes.fine.edge_pixels() {
            self.color[CHANNELS * (y * self.stride + x) + CHANNELS - 1] = 0;
        }
        self.silhouettes = Some(silhouettes);
    }

    /// Converts linear R G B A and inverse depths in single precision.
    pub(crate) fn from_image(image: &IdealImage) -> Self {
        let mut frame = Self::default();
        frame.fit_depth(image.geometry.size_px);
        frame.fit_color();
        let width = image.geometry.size_px[0] as usize;
        let (stride, near_m) = (frame.stride, NEAR_M as f32);
        let rows = frame.color.par_chunks_mut(CHANNELS * stride).zip(frame.depth.par_chunks_mut(stride));
        let values = image.color_rgba.par_chunks(CHANNELS * width).zip(image.inverse_depth.par_chunks(width));
        rows.zip(values).for_each(|((color, depth), (rgba, inverse_depth))| {
            color.iter_mut().zip(rgba).for_each(|(half, &value)| *half = f16::from_f32(value).to_bits());
            depth
                .iter_mut()
                .zip(inverse_depth)
                .for_each(|(depth, &inverse_depth)| *depth = inverse_depth * near_m);
        });
        if let Some(fine) = image.fine.clone() {
            let inverse_depth = image.inverse_depth.clone();
            frame.set_silhouettes(Silhouettes { inverse_depth, fine });
        }
        frame
    }

    /// The frame as the vectorised pass reads it.
    pub(crate) fn texels(&self) -> IdealTexels<'_> {
        let stride = self.stride as u32;
        IdealTexels { color: &self.color, color_stride: stride, depth: &self.depth, depth_stride: stride }
    }

    /// Linear R G B A and inverse depth, 1/m, of a frame of this size, row-major.
    pub fn images(&self, size_px: [u32; 2]) -> (Vec<f32>, Vec<f32>) {
        let [width, height] = size_px.map(|side| side as usize);
        let rows = self.color.par_chunks(CHANNELS * self.stride).take(height);
        let color =
            rows.flat_map_iter(|row| row[..CHANNELS * width].iter().map(|&bits| f16::from_bits(bits)));
        (color.map(f16::to_f32).collect(), self.inverse_depths(size_px))
    }
}
