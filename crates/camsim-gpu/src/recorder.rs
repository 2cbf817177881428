//! Commands of a frame as they are recorded, what the host writes for them, and how long each pass takes on
//! the device by its own clock.

use crate::{
    context::{GpuContext, GpuError},
    staging::Staging,
};

/// Passes of a frame: lens map and the map it starts from, ideal frame, marks, triangles near them, samples,
/// stamp, borders, reverse, rays; and some to spare.
const MAX_PASSES: u32 = 12;
const STAMPS_BYTES: u64 = 16 * MAX_PASSES as u64;

/// A pass and the milliseconds between its begin and its end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PassTime {
    /// As `camsim explain` names it.
    pub name: &'static str,
    /// By the device's clock.
    pub ms: f64,
}

/// Time stamps of one frame in flight.
#[derive(Debug)]
pub struct PassClock {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    on_host: wgpu::Buffer,
    names: Vec<&'static str>,
}

impl PassClock {
    /// `None` where the adapter has no time stamps.
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
            on_host: buffer(wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST),
            names: Vec::new(),
        })
    }

    /// The stamps' numbers for the begin and the end of the next pass.
    fn next(&mut self, name: &'static str) -> Option<(&wgpu::QuerySet, u32)> {
        let first = 2 * self.names.len() as u32;
        (first < 2 * MAX_PASSES).then(|| {
            self.names.push(name);
            (&self.queries, first)
        })
    }

    /// Where the host reads the stamps.
    pub(crate) fn on_host(&self) -> &wgpu::Buffer {
        &self.on_host
    }

    /// The passes of the recorded frame, in order, from the stamps that the host has read.
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

/// One frame's commands.
#[derive(Debug)]
pub struct Recorder<'a> {
    device: &'a wgpu::Device,
    encoder: wgpu::CommandEncoder,
    clock: Option<&'a mut PassClock>,
    staging: &'a mut Staging,
    fault: Option<GpuError>,
}

impl<'a> Recorder<'a> {
    /// Begins a frame; its passes are timed where there is a clock. What is written for it goes through
    /// `staging`, which no other frame may use before this one has been waited for.
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

    /// Writes to a buffer, after all that has been recorded so far and before what follows. A fault shows in
    /// [`Recorder::finish`].
    pub fn write(&mut self, to: &wgpu::Buffer, offset: u64, bytes: &[u8]) {
        if self.fault.is_none() {
            self.fault = self.staging.write(self.device, &mut self.encoder, to, offset, bytes).err();
        }
    }

    /// For commands outside of passes.
    pub fn encoder(&mut self) -> &mut wgpu::CommandEncoder {
        &mut self.encoder
    }

    /// Begins a compute pass.
    pub fn compute_pass(&mut self, name: &'static str) -> wgpu::ComputePass<'_> {
        let stamps = self.clock.as_mut().and_then(|clock| clock.next(name));
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
        let stamps = self.clock.as_mut().and_then(|clock| clock.next(name));
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

    /// The commands, to be submitted.
    ///
    /// # Errors
    /// [`GpuError::Device`] if the device would not take what was written.
    pub fn finish(mut self) -> Result<wgpu::CommandBuffer, GpuError> {
        if let Some(fault) = self.fault {
            return Err(fault);
        }
        self.staging.end();
        if let Some(clock) = self.clock {
            let stamps = 2 * clock.names.len() as u32;
            if stamps > 0 {
                self.encoder.resolve_query_set(&clock.queries, 0..stamps, &clock.resolved, 0);
            }
            self.encoder.copy_buffer_to_buffer(&clock.resolved, 0, &clock.on_host, 0, STAMPS_BYTES);
        }
        Ok(self.encoder.finish())
    }
}
