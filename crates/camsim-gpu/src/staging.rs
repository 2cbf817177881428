//! What the host writes for a frame: memory that the frame's commands copy from, used again by a later frame.
//! `Queue::write_buffer` makes a buffer for each call.

use crate::context::GpuError;

/// Enough for a frame of a few thousand triangles.
const FIRST_BYTES: u64 = 1 << 18;

/// Host memory of one frame in flight, mapped while the frame is recorded.
#[derive(Debug)]
pub struct Staging {
    on_host: wgpu::Buffer,
    used: u64,
}

fn mapped(device: &wgpu::Device, size: u64) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("camsim.staging"),
        size,
        usage: wgpu::BufferUsages::MAP_WRITE | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: true,
    })
}

impl Staging {
    /// Ready for a first frame; grows as frames need it.
    #[must_use]
    pub fn new(device: &wgpu::Device) -> Self {
        Self { on_host: mapped(device, FIRST_BYTES), used: 0 }
    }

    /// Begins a frame. What a frame left that was never submitted is forgotten.
    pub(crate) fn begin(&mut self) {
        self.used = 0;
    }

    /// Takes `bytes` and records their way to `to`, `offset` bytes from its start. Length and offset are
    /// multiples of 4.
    pub(crate) fn write(
        &mut self,
        device: &wgpu::Device,
        commands: &mut wgpu::CommandEncoder,
        to: &wgpu::Buffer,
        offset: u64,
        bytes: &[u8],
    ) -> Result<(), GpuError> {
        let size = bytes.len() as u64;
        if size == 0 {
            return Ok(());
        }
        if self.used + size > self.on_host.size() {
            // The commands keep the old one as long as they need it.
            self.on_host.unmap();
            self.on_host = mapped(device, (self.on_host.size() + size).next_power_of_two());
            self.used = 0;
        }
        let range = self.used..self.used + size;
        let fault = |error: wgpu::MapRangeError| GpuError::Device(error.to_string());
        self.on_host.get_mapped_range_mut(range).map_err(fault)?.copy_from_slice(bytes);
        commands.copy_buffer_to_buffer(&self.on_host, self.used, to, offset, size);
        self.used = (self.used + size).next_multiple_of(wgpu::MAP_ALIGNMENT);
        Ok(())
    }

    /// To be called before the commands are submitted: what the device reads may not be mapped.
    pub(crate) fn end(&mut self) {
        self.on_host.unmap();
    }

    /// To be called after: asks for the memory back. It is there once the frame has been waited for; a
    /// failure shows at the next write.
    pub(crate) fn recall(&mut self) {
        self.on_host.map_async(wgpu::MapMode::Write, .., |_| {});
    }
}
