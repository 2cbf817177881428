//! Time to copy a finished picture on the gpu and to memory: a lower bound for any frame.

use std::time::Instant;

use camsim_engine::{GpuContext, GpuError};

use super::{BenchError, rounds::Times};
use crate::timing::{ms, processor_ms};

/// Copies a linear RGBA picture of `size_px` on the gpu and to memory, in `rounds` bursts of `burst` copies.
///
/// # Errors
/// Faults of the adapter.
pub fn measure(gpu: &GpuContext, size_px: [u32; 2], rounds: usize, burst: u64) -> Result<Times, BenchError> {
    let size = 16 * u64::from(size_px[0]) * u64::from(size_px[1]);
    let create = |usage| {
        gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("camsim.frame_copy"),
            size,
            usage,
            mapped_at_creation: false,
        })
    };
    let source = create(wgpu::BufferUsages::COPY_SRC);
    let target = create(wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST);
    let readback = create(wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST);
    let fault = |error: &dyn std::fmt::Display| GpuError::Device(error.to_string());
    let mut times = Times::default();
    for _ in 0..rounds {
        let processor_begin_ms = processor_ms();
        let begin = Instant::now();
        for _ in 0..burst {
            let mut encoder = gpu
                .device
                .create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("camsim.frame_copy") });
            encoder.copy_buffer_to_buffer(&source, 0, &target, 0, size);
            encoder.copy_buffer_to_buffer(&target, 0, &readback, 0, size);
            gpu.queue.submit([encoder.finish()]);
            readback.slice(..).map_async(wgpu::MapMode::Read, |_| {});
            gpu.device.poll(wgpu::PollType::wait_indefinitely()).map_err(|error| fault(&error))?;
            let picture = readback.slice(..).get_mapped_range().map_err(|error| fault(&error))?.to_vec();
            std::hint::black_box(picture);
            readback.unmap();
        }
        times.wall_ms.push(ms(begin.elapsed()) / burst as f64);
        times
            .processor_ms
            .extend(processor_begin_ms.zip(processor_ms()).map(|(begin, end)| (end - begin) / burst as f64));
    }
    Ok(times)
}
