//! From the device to the host: output buffers, and textures for a look at single stages.

use camsim_core::plan::{FramePlan, Planner};
use glam::DVec2;
use rayon::prelude::*;

use crate::{
    context::{GpuContext, GpuError},
    layout::Truth,
};

/// A buffer that the device writes, and its copy that the host reads.
#[derive(Debug)]
pub(super) struct Output {
    pub on_device: wgpu::Buffer,
    pub on_host: wgpu::Buffer,
}

impl Output {
    pub fn new(gpu: &GpuContext, label: &str, size: u64) -> Self {
        let create =
            |usage| gpu.device.create_buffer(&wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false });
        Self {
            on_device: create(wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC),
            on_host: create(wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST),
        }
    }

    pub fn copy(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.copy_buffer_to_buffer(&self.on_device, 0, &self.on_host, 0, self.on_host.size());
    }

    pub fn read<T: bytemuck::Pod>(&self) -> Result<Vec<T>, GpuError> {
        read_mapped(&self.on_host)
    }
}

/// Takes the values of a buffer that has been asked to be mapped, and unmaps it.
pub(super) fn read_mapped<T: bytemuck::Pod>(buffer: &wgpu::Buffer) -> Result<Vec<T>, GpuError> {
    let view = buffer.slice(..).get_mapped_range().map_err(|error| GpuError::Device(error.to_string()))?;
    // Where it is aligned, as mapped memory is, one copy; the other way fills the numbers with zeros first.
    let values = bytemuck::try_cast_slice(&view).map_or_else(|_| bytemuck::pod_collect_to_vec(&view), <[T]>::to_vec);
    drop(view);
    buffer.unmap();
    Ok(values)
}

/// Casts the rays that the shader left to the host: those of pixels that may see a silhouette. `phase` is that of the coordinates.
pub(super) fn look_for_unknown(truth: &mut [Truth], planner: &Planner, plan: &FramePlan, phase: f64) {
    let width = plan.camera.size_px[0];
    let of_rows = truth.par_chunks_mut(width as usize).zip(0_u32..u32::MAX);
    of_rows.for_each(|(row, y)| {
        for (unknown, x) in row.iter_mut().zip(0..).filter(|(t, _)| t.depth_m < 0.0) {
            let uv = DVec2::new(f64::from(unknown.uv[0]), f64::from(unknown.uv[1]));
            let sight = planner.sight(plan, [x, y], uv, phase);
            unknown.source_px = sight.source_px.as_vec2().to_array();
            unknown.point_ned_m = sight.met.map_or([0.0; 3], |(point_ned_m, _)| point_ned_m.as_vec3().to_array());
            unknown.depth_m = sight.met.map_or(0.0, |(_, depth_m)| depth_m as f32);
        }
    });
}

/// What the shader wrote beside the picture, with each pixel's time shift.
pub(super) fn coords(truth: &[Truth], plan: &FramePlan) -> Vec<[f32; 8]> {
    let width = plan.camera.size_px[0];
    let dt_s = |i: u32| plan.shutter.dt_pixel_s(i % width, i / width) as f32;
    truth
        .iter()
        .zip(0..)
        .map(|(t, i)| [t.uv[0], t.uv[1], t.source_px[0], t.source_px[1], dt_s(i), t.point_ned_m[0], t.point_ned_m[1], t.point_ned_m[2]])
        .collect()
}

/// All of a buffer.
pub(super) fn read_buffer<T: bytemuck::Pod>(gpu: &GpuContext, buffer: &wgpu::Buffer) -> Result<Vec<T>, GpuError> {
    let on_host = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("camsim.read_buffer"),
        size: buffer.size(),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("camsim.read_buffer") });
    encoder.copy_buffer_to_buffer(buffer, 0, &on_host, 0, buffer.size());
    gpu.queue.submit([encoder.finish()]);
    on_host.slice(..).map_async(wgpu::MapMode::Read, |_| {});
    gpu.device.poll(wgpu::PollType::wait_indefinitely()).map_err(|error| GpuError::Device(error.to_string()))?;
    read_mapped(&on_host)
}

/// The top-left `width` x `height` texels of a texture.
pub(super) fn read_texture<T: bytemuck::Pod>(
    gpu: &GpuContext,
    texture: &wgpu::Texture,
    width: u32,
    height: u32,
) -> Result<Vec<T>, GpuError> {
    let row = width * size_of::<T>() as u32;
    let padded = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    // Depth can only be copied whole.
    let (copy_width, copy_height) = (texture.width(), texture.height());
    let copy_row = (copy_width * size_of::<T>() as u32).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT).max(padded);
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("camsim.read_texture"),
        size: u64::from(copy_row) * u64::from(copy_height),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("camsim.read_texture") });
    encoder.copy_texture_to_buffer(
        wgpu::TexelCopyTextureInfo { texture, mip_level: 0, origin: wgpu::Origin3d::ZERO, aspect: wgpu::TextureAspect::All },
        wgpu::TexelCopyBufferInfo {
            buffer: &buffer,
            layout: wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(copy_row), rows_per_image: None },
        },
        wgpu::Extent3d { width: copy_width, height: copy_height, depth_or_array_layers: 1 },
    );
    gpu.queue.submit([encoder.finish()]);
    buffer.slice(..).map_async(wgpu::MapMode::Read, |_| {});
    gpu.device.poll(wgpu::PollType::wait_indefinitely()).map_err(|error| GpuError::Device(error.to_string()))?;
    let view = buffer.slice(..).get_mapped_range().map_err(|error| GpuError::Device(error.to_string()))?;
    let mut values = Vec::with_capacity((width * height) as usize);
    for y in 0..height {
        let start = (y * copy_row) as usize;
        values.extend(bytemuck::pod_collect_to_vec::<u8, T>(&view[start..start + row as usize]));
    }
    Ok(values)
}
