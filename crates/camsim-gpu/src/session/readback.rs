//! From the device to the host: output buffers, and textures for a look at single stages.

use std::{
    num::NonZero,
    sync::{Mutex, PoisonError},
    thread::{Builder, available_parallelism},
};

use crate::context::{GpuContext, GpuError};

/// A buffer that the device writes, and its copy that the host reads.
#[derive(Debug)]
pub(super) struct Output {
    pub on_device: wgpu::Buffer,
    pub on_host: wgpu::Buffer,
}

impl Output {
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

/// Bytes that are worth a thread of their own, and threads at most: the system gives large pictures their
/// memory page by page as it is first written, which takes several times as long as the copy.
const BYTES_A_THREAD: usize = 8 << 20;
const MOST_THREADS: usize = 8;

/// Takes the values of a buffer that has been asked to be mapped, and unmaps it.
pub(super) fn read_mapped<T: bytemuck::Pod>(buffer: &wgpu::Buffer) -> Result<Vec<T>, GpuError> {
    let view = buffer.slice(..).get_mapped_range().map_err(|error| GpuError::Device(error.to_string()))?;
    let values = copied(&view);
    drop(view);
    buffer.unmap();
    Ok(values)
}

/// The whole values among so many bytes. Threads are not those of the pool, which may all be at plans.
fn copied<T: bytemuck::Pod>(bytes: &[u8]) -> Vec<T> {
    let bytes = &bytes[..bytes.len() / size_of::<T>() * size_of::<T>()];
    let threads =
        (bytes.len() / BYTES_A_THREAD).min(MOST_THREADS).min(available_parallelism().map_or(1, NonZero::get));
    if threads < 2 {
        // Where they are aligned, as mapped memory is, one copy; the other way fills the numbers with zeros
        // first.
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
            // Where there are no threads to be had this one does all of it.
            let _ = Builder::new().spawn_scoped(scope, work);
        }
        work();
    });
    values
}

/// All of a buffer.
pub(super) fn read_buffer<T: bytemuck::Pod>(
    gpu: &GpuContext,
    buffer: &wgpu::Buffer,
) -> Result<Vec<T>, GpuError> {
    let on_host = on_host(gpu, "camsim.read_buffer", buffer.size());
    let mut encoder = gpu
        .device
        .create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("camsim.read_buffer") });
    encoder.copy_buffer_to_buffer(buffer, 0, &on_host, 0, buffer.size());
    gpu.queue.submit([encoder.finish()]);
    on_host.slice(..).map_async(wgpu::MapMode::Read, |_| {});
    gpu.device
        .poll(wgpu::PollType::wait_indefinitely())
        .map_err(|error| GpuError::Device(error.to_string()))?;
    read_mapped(&on_host)
}

/// A buffer for the top-left texels of a texture, row by row as copies want them.
#[derive(Debug)]
pub(super) struct Rows {
    buffer: wgpu::Buffer,
    label: &'static str,
    size_px: [u32; 2],
    /// From one row to the next.
    pub stride_bytes: u32,
    /// Whether the host has it, or has asked for it.
    is_asked_for: bool,
}

impl Rows {
    /// For texels of so many bytes.
    pub fn new(gpu: &GpuContext, label: &'static str, size_px: [u32; 2], texel_bytes: usize) -> Self {
        let mut rows = Self::empty(gpu, label);
        rows.fit(gpu, size_px, texel_bytes);
        rows
    }

    /// For none yet.
    pub fn empty(gpu: &GpuContext, label: &'static str) -> Self {
        Self {
            buffer: on_host(gpu, label, wgpu::COPY_BUFFER_ALIGNMENT),
            label,
            size_px: [0; 2],
            stride_bytes: 0,
            is_asked_for: false,
        }
    }

    /// Takes texels of so many bytes from now on, and is not mapped any more. The buffer grows, but does not
    /// shrink: sizes that come and go need no other one.
    pub fn fit(&mut self, gpu: &GpuContext, size_px: [u32; 2], texel_bytes: usize) {
        self.size_px = size_px;
        self.stride_bytes =
            (size_px[0] * texel_bytes as u32).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let bytes = u64::from(self.stride_bytes) * u64::from(size_px[1]);
        if std::mem::take(&mut self.is_asked_for) {
            self.buffer.unmap();
        }
        if self.buffer.size() < bytes {
            self.buffer = on_host(gpu, self.label, bytes.next_multiple_of(GROWS_BY_BYTES));
        }
    }

    /// Once the copy has been submitted: asks for it. A failure shows when it is read.
    pub fn recall(&mut self) {
        self.is_asked_for = true;
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

    /// All of it, once it is mapped.
    pub fn view(&self) -> Result<wgpu::BufferView, GpuError> {
        self.buffer.slice(..).get_mapped_range().map_err(|error| GpuError::Device(error.to_string()))
    }

    /// The texels without what lies between rows, once it is mapped.
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

/// Steps in which buffers for texels grow.
const GROWS_BY_BYTES: u64 = 1 << 20;

fn on_host(gpu: &GpuContext, label: &str, size: u64) -> wgpu::Buffer {
    let usage = wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ;
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size,
        usage,
        mapped_at_creation: false,
    })
}

/// The top-left `width` x `height` texels of a texture.
pub(super) fn read_texture<T: bytemuck::Pod>(
    gpu: &GpuContext,
    texture: &wgpu::Texture,
    width: u32,
    height: u32,
) -> Result<Vec<T>, GpuError> {
    // Depth can only be copied whole.
    let mut copied =
        Rows::new(gpu, "camsim.read_texture", [texture.width(), texture.height()], size_of::<T>());
    let mut encoder = gpu
        .device
        .create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("camsim.read_texture") });
    copied.copy(&mut encoder, texture);
    gpu.queue.submit([encoder.finish()]);
    copied.recall();
    gpu.device
        .poll(wgpu::PollType::wait_indefinitely())
        .map_err(|error| GpuError::Device(error.to_string()))?;
    let all = copied.read::<T>()?;
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
    fn large_pictures_are_copied_whole_by_several_threads() {
        for values in [0, 1, 5_000_017, 2 * BYTES_A_THREAD] {
            let all: Vec<u32> = (0..values as u32).map(|i| i.wrapping_mul(2_654_435_761)).collect();
            let bytes = [bytemuck::cast_slice(&all), &[1, 2, 3][..]].concat();
            assert!(copied::<u32>(&bytes) == all, "{values}");
        }
    }
}
