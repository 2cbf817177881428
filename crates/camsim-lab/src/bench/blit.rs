//! The least that any frame costs: a finished picture copied on the device, and to the host. For scale.

use std::time::Instant;

use camsim_engine::{GpuContext, GpuError};

use super::{BenchError, rounds::Times};
use crate::timing::{ms, processor_ms};

/// Copies a linear R G B A picture of `size_px` on the device and to the host, `rounds` bursts of `burst`,
/// one after the other.
///
/// # Errors
/// Device faults.
pub fn measure(gpu: &GpuContext, size_px: [u32; 2], rounds: usize, burst: u64) -> Result<Times, BenchError> {
    let size = 16 * u64::from(size_px[0]) * u64::from(size_px[1]);
    let create = |usage| {
        gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("camsim.blit"),
            size,
            usage,
            mapped_at_creation: false,
        })
    };
    let source = create(wgpu::BufferUsages::COPY_SRC);
    let target = create(wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST);
    let on_host = create(wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST);
    let fault = |error: &dyn std::fmt::Display| GpuError::Device(error.to_string());
    let mut times = Times::default();
    for _ in 0..rounds {
        let busy = processor_ms();
        let begin = Instant::now();
        for _ in 0..burst {
            let mut encoder = gpu
                .device
                .create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("camsim.blit") });
            encoder.copy_buffer_to_buffer(&source, 0, &target, 0, size);
            encoder.copy_buffer_to_buffer(&target, 0, &on_host, 0, size);
            gpu.queue.submit([encoder.finish()]);
            on_host.slice(..).map_async(wgpu::MapMode::Read, |_| {});
            gpu.device.poll(wgpu::PollType::wait_indefinitely()).map_err(|error| fault(&error))?;
            let picture = on_host.slice(..).get_mapped_range().map_err(|error| fault(&error))?.to_vec();
            std::hint::black_box(picture);
            on_host.unmap();
        }
        times.wall_ms.push(ms(begin.elapsed()) / burst as f64);
        times
            .processor_ms
            .extend(busy.zip(processor_ms()).map(|(before, after)| (after - before) / burst as f64));
    }
    Ok(times)
}
