//! Constant tables that all frames read.

use camsim_core::{
    noise::{SEGMENTS, tail_segments},
    sequence::Sequence,
};
use wgpu::util::DeviceExt;

use crate::context::GpuContext;

/// A constant table as a texture, one or two floats per texel.
fn table(
    gpu: &GpuContext,
    label: &str,
    [width, height]: [u32; 2],
    format: wgpu::TextureFormat,
    values: &[f32],
) -> wgpu::TextureView {
    let descriptor = wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    };
    let order = wgpu::util::TextureDataOrder::LayerMajor;
    let texture =
        gpu.device.create_texture_with_data(&gpu.queue, &descriptor, order, bytemuck::cast_slice(values));
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

/// Normal quantiles: value at the start of each segment and increment over it, one row per octave.
pub(super) fn noise_table(gpu: &GpuContext) -> wgpu::TextureView {
    let segments = tail_segments();
    let size = [SEGMENTS as u32, (segments.len() / SEGMENTS) as u32];
    table(gpu, "camsim.noise_table", size, wgpu::TextureFormat::Rg32Float, segments.as_flattened())
}

/// Vignette weights.
pub(super) fn vignette(gpu: &GpuContext, sequence: &Sequence) -> wgpu::TextureView {
    let (size, weights) = sequence.vignette_weights();
    table(gpu, "camsim.vignette", size, wgpu::TextureFormat::R32Float, &weights)
}
