//! Commands of a frame while they are recorded, its uploads, and GPU time stamps of its passes.

use crate::{
    adapter::{GpuError, PassTime},
    context::GpuContext,
    staging::Staging,
};

/// Maximum number of timed passes of a frame: two of the lens map, ideal frame, its multisampled depth, edge
/// mask, triangles near edges, supersampled frame, edge mask to alpha, edge lines, reverse, candidates, rays.
const MAX_PASSES: u32 = 12;
const STAMPS_BYTES: u64 = 16 * MAX_PASSES as u64;

/// Time stamps of the passes of one frame in flight.
#[derive(Debug)]
pub struct PassClock {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    cpu_buffer: wgpu::Buffer,
    names: Vec<&'static str>,
}

impl PassClock {
    /// `None` if the adapter has no time stamps.
    #[must_use]
    pub fn new(gpu: &GpuContext) -> Option<Self> {
        let buffer = |usage| {
            let label = Some("camsim.stamps");
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label,
                size: STAMPS_BYTES,
                usage,
                mapped_at_creation: false,
            })
        };
        gpu.device.features().contains(wgpu::Features::TIMESTAMP_QUERY).then(|| Self {
            queries: gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("camsim.stamps"),
                ty: wgpu::QueryType::Timestamp,
                count: 2 * MAX_PASSES,
            }),
            resolved: buffer(wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC),
            cpu_buffer: buffer(wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST),
            names: Vec::new(),
        })
    }

    /// Registers the next pass. Returns the query set and the index of its first time stamp.
    fn next_pass(&mut self, name: &'static str) -> Option<(&wgpu::QuerySet, u32)> {
        let first = 2 * self.names.len() as u32;
        (first < 2 * MAX_PASSES).then(|| {
            self.names.push(name);
            (&self.queries, first)
        })
    }

    /// Buffer from which the CPU reads the time stamps.
    pub(crate) fn cpu_buffer(&self) -> &wgpu::Buffer {
        &self.cpu_buffer
    }

    /// Passes of the recorded frame in order, from the time stamps that were read back.
    pub(crate) fn passes(&self, gpu: &GpuContext, stamps: &[u64]) -> Vec<PassTime> {
        let ms_per_tick = f64::from(gpu.queue.get_timestamp_period()) * 1e-6;
        let ms = |stamp: &[u64]| stamp[1].saturating_sub(stamp[0]) as f64 * ms_per_tick;
        self.names
            .iter()
            .zip(stamps.chunks_exact(2))
            .map(|(name, stamp)| PassTime { name, ms: ms(stamp) })
            .collect()
    }
}

/// Commands of one frame.
#[derive(Debug)]
pub struct Recorder<'a> {
    device: &'a wgpu::Device,
    encoder: wgpu::CommandEncoder,
    clock: Option<&'a mut PassClock>,
    staging: &'a mut Staging,
    fault: Option<GpuError>,
}

impl<'a> Recorder<'a> {
    /// Begins a frame. Passes are timed if there is a clock. Uploads go through `staging`, which no other
    /// frame may use until this one has been waited for.
    #[must_use]
    pub fn new(
        device: &'a wgpu::Device,
        mut clock: Option<&'a mut PassClock>,
        staging: &'a mut Staging,
    ) -> Self {
        if let Some(clock) = &mut clock {
            clock.names.clear();
        }
        staging.begin();
        let encoder =
            device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("camsim.frame") });
        Self { device, encoder, clock, staging, fault: None }
    }

    /// Records an upload to a buffer, ordered after all that has been recorded so far. Errors are returned by
    /// [`Recorder::finish`].
    pub fn write(&mut self, to: &wgpu::Buffer, offset: u64, bytes: &[u8]) {
        if self.fault.is_none() {
            self.fault = self.staging.write(self.device, &mut self.encoder, to, offset, bytes).err();
        }
    }

    /// Encoder for commands outside of passes.
    pub fn encoder(&mut self) -> &mut wgpu::CommandEncoder {
        &mut self.encoder
    }

    /// Begins a compute pass.
    pub fn compute_pass(&mut self, name: &'static str) -> wgpu::ComputePass<'_> {
        let stamps = self.clock.as_mut().and_then(|clock| clock.next_pass(name));
        let timestamp_writes = stamps.map(|(query_set, first)| wgpu::ComputePassTimestampWrites {
            query_set,
            beginning_of_pass_write_index: Some(first),
            end_of_pass_write_index: Some(first + 1),
        });
        self.encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some(name), timestamp_writes })
    }

    /// Begins a render pass.
    pub fn render_pass(
        &mut self,
        name: &'static str,
        color: Option<wgpu::RenderPassColorAttachment<'_>>,
        depth: Option<wgpu::RenderPassDepthStencilAttachment<'_>>,
    ) -> wgpu::RenderPass<'_> {
        let stamps = self.clock.as_mut().and_then(|clock| clock.next_pass(name));
        let timestamp_writes = stamps.map(|(query_set, first)| wgpu::RenderPassTimestampWrites {
            query_set,
            beginning_of_pass_write_index: Some(first),
            end_of_pass_write_index: Some(first + 1),
        });
        let colors = [color];
        self.encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some(name),
            color_attachments: if colors[0].is_some() { &colors } else { &[] },
            depth_stencil_attachment: depth,
            timestamp_writes,
            occlusion_query_set: None,
            multiview_mask: None,
        })
    }

    /// Finishes the command buffer for submission.
    ///
    /// # Errors
    /// [`GpuError::Device`] if the device would not take what was written.
    pub fn finish(mut self) -> Result<wgpu::CommandBuffer, GpuError> {
        if let Some(fault) = self.fault {
            return Err(fault);
        }
        self.staging.unmap();
        if let Some(clock) = self.clock {
            let stamps = 2 * clock.names.len() as u32;
            if stamps > 0 {
                self.encoder.resolve_query_set(&clock.queries, 0..stamps, &clock.resolved, 0);
            }
            self.encoder.copy_buffer_to_buffer(&clock.resolved, 0, &clock.cpu_buffer, 0, STAMPS_BYTES);
        }
        Ok(self.encoder.finish())
    }
}
