//! Read-back: output buffers, and textures for the inspection of single stages.

use std::{
    num::NonZero,
    sync::{Mutex, PoisonError},
    thread::{Builder, available_parallelism},
};

use crate::{adapter::GpuError, context::GpuContext};

/// An output buffer and its copy that the CPU reads.
#[derive(Debug)]
pub(super) struct ReadbackBuffer {
    pub gpu_buffer: wgpu::Buffer,
    pub cpu_buffer: wgpu::Buffer,
}

impl ReadbackBuffer {
    pub fn new(gpu: &GpuContext, label: &str, size: u64) -> Self {
        let create = |usage| {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage,
                mapped_at_creation: false,
            })
        };
        Self {
            gpu_buffer: create(wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC),
            cpu_buffer: create(wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST),
        }
    }

    pub fn copy(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.copy_buffer_to_buffer(&self.gpu_buffer, 0, &self.cpu_buffer, 0, self.cpu_buffer.size());
    }

    pub fn read<T: bytemuck::Pod>(&self) -> Result<Vec<T>, GpuError> {
        read_mapped(&self.cpu_buffer)
    }
}

/// Bytes per copying thread, and maximum number of threads: the system provides memory of large images page
/// by page at the first write, which takes several times as long as the copy.
const BYTES_PER_THREAD: usize = 8 << 20;
const MAX_THREADS: usize = 8;

/// Takes the values of a buffer for which a mapping was requested, and unmaps it.
pub(super) fn read_mapped<T: bytemuck::Pod>(buffer: &wgpu::Buffer) -> Result<Vec<T>, GpuError> {
    let view = buffer.slice(..).get_mapped_range().map_err(|error| GpuError::Device(error.to_string()))?;
    let values = copy_values(&view);
    drop(view);
    buffer.unmap();
    Ok(values)
}

/// The whole values among the bytes. The threads are not those of rayon's pool, which may all be busy with
/// plans.
fn copy_values<T: bytemuck::Pod>(bytes: &[u8]) -> Vec<T> {
    let bytes = &bytes[..bytes.len() / size_of::<T>() * size_of::<T>()];
    let threads = (bytes.len() / BYTES_PER_THREAD)
        .min(MAX_THREADS)
        .min(available_parallelism().map_or(1, NonZero::get));
    if threads < 2 {
        // Aligned bytes, as mapped memory has, need one copy; otherwise the values would first be zeroed.
        return bytemuck::try_cast_slice(bytes)
            .map_or_else(|_| bytemuck::pod_collect_to_vec(bytes), <[T]>::to_vec);
    }
    let mut values: Vec<T> = bytemuck::zeroed_vec(bytes.len() / size_of::<T>());
    let piece = bytes.len().div_ceil(threads);
    let pieces =
        Mutex::new(bytemuck::cast_slice_mut::<T, u8>(&mut values).chunks_mut(piece).zip(bytes.chunks(piece)));
    let next = || pieces.lock().unwrap_or_else(PoisonError::into_inner).next();
    let work = || {
        while let Some((into, from)) = next() {
            into.copy_from_slice(from);
        }
    };
    std::thread::scope(|scope| {
        for _ in 1..threads {
            // If no thread can be started, this one does all the work.
            let _ = Builder::new().spawn_scoped(scope, work);
        }
        work();
    });
    values
}

/// Contents of a buffer.
pub(super) fn read_buffer<T: bytemuck::Pod>(
    gpu: &GpuContext,
    buffer: &wgpu::Buffer,
) -> Result<Vec<T>, GpuError> {
    let cpu_buffer = cpu_buffer(gpu, "camsim.read_buffer", buffer.size());
    let mut encoder = gpu
        .device
        .create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("camsim.read_buffer") });
    encoder.copy_buffer_to_buffer(buffer, 0, &cpu_buffer, 0, buffer.size());
    gpu.queue.submit([encoder.finish()]);
    cpu_buffer.slice(..).map_async(wgpu::MapMode::Read, |_| {});
    gpu.device
        .poll(wgpu::PollType::wait_indefinitely())
        .map_err(|error| GpuError::Device(error.to_string()))?;
    read_mapped(&cpu_buffer)
}

/// A buffer for the top-left texels of a texture, with the row alignment of texture copies.
#[derive(Debug)]
pub(super) struct TextureReadback {
    buffer: wgpu::Buffer,
    label: &'static str,
    size_px: [u32; 2],
    /// Bytes from one row to the next.
    pub stride_bytes: u32,
    /// Whether it is mapped or a mapping was requested.
    is_map_requested: bool,
}

impl TextureReadback {
    /// Creates a buffer for texels of this size.
    pub fn new(gpu: &GpuContext, label: &'static str, size_px: [u32; 2], texel_bytes: usize) -> Self {
        let mut rows = Self::empty(gpu, label);
        rows.fit(gpu, size_px, texel_bytes);
        rows
    }

    /// Creates a buffer without texels.
    pub fn empty(gpu: &GpuContext, label: &'static str) -> Self {
        Self {
            buffer: cpu_buffer(gpu, label, wgpu::COPY_BUFFER_ALIGNMENT),
            label,
            size_px: [0; 2],
            stride_bytes: 0,
            is_map_requested: false,
        }
    }

    /// Sets the size and unmaps the buffer. It grows, but does not shrink, so that alternating sizes need no
    /// reallocation.
    pub fn fit(&mut self, gpu: &GpuContext, size_px: [u32; 2], texel_bytes: usize) {
        self.size_px = size_px;
        self.stride_bytes =
            (size_px[0] * texel_bytes as u32).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let bytes = u64::from(self.stride_bytes) * u64::from(size_px[1]);
        if std::mem::take(&mut self.is_map_requested) {
            self.buffer.unmap();
        }
        if self.buffer.size() < bytes {
            self.buffer = cpu_buffer(gpu, self.label, bytes.next_multiple_of(SIZE_STEP_BYTES));
        }
    }

    /// To be called after submission of the copy: requests the mapping. A failure shows when it is read.
    pub fn request_mapping(&mut self) {
        self.is_map_requested = true;
        self.buffer.map_async(wgpu::MapMode::Read, .., |_| {});
    }

    pub fn copy(&self, encoder: &mut wgpu::CommandEncoder, texture: &wgpu::Texture) {
        encoder.copy_texture_to_buffer(
            wgpu::TexelCopyTextureInfo {
                texture,
                mip_level: 0,
                origin: wgpu::Origin3d::ZERO,
                aspect: wgpu::TextureAspect::All,
            },
            wgpu::TexelCopyBufferInfo {
                buffer: &self.buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(self.stride_bytes),
                    rows_per_image: None,
                },
            },
            wgpu::Extent3d { width: self.size_px[0], height: self.size_px[1], depth_or_array_layers: 1 },
        );
    }

    /// The mapped bytes.
    pub fn view(&self) -> Result<wgpu::BufferView, GpuError> {
        self.buffer.slice(..).get_mapped_range().map_err(|error| GpuError::Device(error.to_string()))
    }

    /// The mapped texels without row padding.
    pub fn read<T: bytemuck::Pod>(&self) -> Result<Vec<T>, GpuError> {
        let [width, height] = self.size_px.map(|side| side as usize);
        let mut values = vec![T::zeroed(); width * height];
        for (into, row) in
            values.chunks_exact_mut(width).zip(self.view()?.chunks_exact(self.stride_bytes as usize))
        {
            let into: &mut [u8] = bytemuck::cast_slice_mut(into);
            into.copy_from_slice(&row[..into.len()]);
        }
        Ok(values)
    }
}

/// Granularity of the buffer size.
const SIZE_STEP_BYTES: u64 = 1 << 20;

fn cpu_buffer(gpu: &GpuContext, label: &str, size: u64) -> wgpu::Buffer {
    let usage = wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ;
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size,
        usage,
        mapped_at_creation: false,
    })
}

/// Top-left `width` x `height` texels of a texture.
pub(super) fn read_texture<T: bytemuck::Pod>(
    gpu: &GpuContext,
    texture: &wgpu::Texture,
    width: u32,
    height: u32,
) -> Result<Vec<T>, GpuError> {
    // Depth textures can only be copied whole.
    let mut rows =
        TextureReadback::new(gpu, "camsim.read_texture", [texture.width(), texture.height()], size_of::<T>());
    let mut encoder = gpu
        .device
        .create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("camsim.read_texture") });
    rows.copy(&mut encoder, texture);
    gpu.queue.submit([encoder.finish()]);
    rows.request_mapping();
    gpu.device
        .poll(wgpu::PollType::wait_indefinitely())
        .map_err(|error| GpuError::Device(error.to_string()))?;
    let all = rows.read::<T>()?;
    Ok(all
        .chunks_exact(texture.width() as usize)
        .take(height as usize)
        .flat_map(|row| &row[..width as usize])
        .copied()
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_images_are_copied_completely_by_several_threads() {
        for values in [0, 1, 5_000_017, 2 * BYTES_PER_THREAD] {
            let all: Vec<u32> = (0..values as u32).map(|i| i.wrapping_mul(2_654_435_761)).collect();
            let bytes = [bytemuck::cast_slice(&all), &[1, 2, 3][..]].concat();
            assert!(copy_values::<u32>(&bytes) == all, "{values}");
        }
    }
}
