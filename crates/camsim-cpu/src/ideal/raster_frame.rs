//! A rasterised ideal frame.

use camsim_plan::NEAR_M;
use rayon::prelude::*;

use super::{CHANNELS, rasterise::ROW_PADDING};
use crate::{general::IdealImage, large_pages::LargeArray, reverse::IdealTexels, simd::lanes::LANES};

/// An ideal frame in memory.
#[derive(Debug, Default)]
pub struct RasterFrame {
    /// Linear R G B A, half floats.
    pub(crate) color: LargeArray<u16>,
    /// near / z, 0 = infinitely far.
    pub(crate) depth: LargeArray<f32>,
    /// Texels from one row to the next, of colour and depth.
    pub(crate) stride: usize,
}

impl RasterFrame {
    /// Sets the size.
    pub(super) fn fit(&mut self, size_px: [u32; 2]) {
        let [width, height] = size_px.map(|side| side as usize);
        self.stride = (width + ROW_PADDING).next_multiple_of(LANES);
        self.depth.fit(self.stride * height);
        self.color.fit(CHANNELS * self.stride * height);
    }

    /// Converts linear R G B A and inverse depths in single precision.
    pub(crate) fn from_image(image: &IdealImage) -> Self {
        let mut frame = Self::default();
        frame.fit(image.geometry.size_px);
        let width = image.geometry.size_px[0] as usize;
        let (stride, near_m) = (frame.stride, NEAR_M as f32);
        let rows = frame.color.par_chunks_mut(CHANNELS * stride).zip(frame.depth.par_chunks_mut(stride));
        let values = image.color_rgba.par_chunks(CHANNELS * width).zip(image.inverse_depth.par_chunks(width));
        rows.zip(values).for_each(|((color, depth), (rgba, inverse_depth))| {
            color
                .iter_mut()
                .zip(rgba)
                .for_each(|(half, &value)| *half = half::f16::from_f32(value).to_bits());
            depth
                .iter_mut()
                .zip(inverse_depth)
                .for_each(|(depth, &inverse_depth)| *depth = inverse_depth * near_m);
        });
        frame
    }

    /// The frame as the vectorised pass reads it.
    pub(crate) fn texels(&self) -> IdealTexels<'_> {
        let stride = self.stride as u32;
        IdealTexels { color: &self.color, color_stride: stride, depth: &self.depth, depth_stride: stride }
    }

    /// Linear R G B A and inverse depth, 1/m, of a frame of this size, row-major.
    pub fn images(&self, [width, height]: [u32; 2]) -> (Vec<f32>, Vec<f32>) {
        let (width, height) = (width as usize, height as usize);
        let color = self
            .color
            .chunks_exact(CHANNELS * self.stride)
            .take(height)
            .flat_map(|row| &row[..CHANNELS * width]);
        let depth = self.depth.chunks_exact(self.stride).take(height).flat_map(|row| &row[..width]);
        (
            color.map(|&bits| half::f16::from_bits(bits).to_f32()).collect(),
            depth.map(|depth| depth / NEAR_M as f32).collect(),
        )
    }
}
