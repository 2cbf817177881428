//! Staging memory for uploads. The commands of a frame copy from it; later frames reuse it.
//! `Queue::write_buffer` would allocate a buffer for each call.

use crate::adapter::GpuError;

/// Initial size: enough for a frame of a few thousand triangles.
const FIRST_BYTES: u64 = 1 << 18;

/// Staging memory of one frame in flight, mapped while the frame is recorded.
#[derive(Debug)]
pub struct Staging {
    buffer: wgpu::Buffer,
    used: u64,
}

fn mapped_buffer(device: &wgpu::Device, size: u64) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("camsim.staging"),
        size,
        usage: wgpu::BufferUsages::MAP_WRITE | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: true,
    })
}

impl Staging {
    /// Creates the memory; it grows as frames need it.
    #[must_use]
    pub fn new(device: &wgpu::Device) -> Self {
        Self { buffer: mapped_buffer(device, FIRST_BYTES), used: 0 }
    }

    /// Begins a frame. Uploads of a frame that was never submitted are dropped.
    pub(crate) fn begin(&mut self) {
        self.used = 0;
    }

    /// Copies `bytes` to the staging memory and records the copy to `to`, `offset` bytes from its start.
    /// Length and offset are multiples of 4.
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
        if self.used + size > self.buffer.size() {
            // The recorded commands keep the old buffer alive.
            self.buffer.unmap();
            self.buffer = mapped_buffer(device, (self.buffer.size() + size).next_power_of_two());
            self.used = 0;
        }
        let range = self.used..self.used + size;
        let to_error = |error: wgpu::MapRangeError| GpuError::Device(error.to_string());
        self.buffer.get_mapped_range_mut(range).map_err(to_error)?.copy_from_slice(bytes);
        commands.copy_buffer_to_buffer(&self.buffer, self.used, to, offset, size);
        self.used = (self.used + size).next_multiple_of(wgpu::MAP_ALIGNMENT);
        Ok(())
    }

    /// Unmaps the memory. Must be called before submission: the GPU may not read mapped memory.
    pub(crate) fn unmap(&mut self) {
        self.buffer.unmap();
    }

    /// Requests the mapping again. Must be called after submission. The memory is mapped once the frame has
    /// been waited for; a failure shows at the next write.
    pub(crate) fn request_mapping(&mut self) {
        self.buffer.map_async(wgpu::MapMode::Write, .., |_| {});
    }
}
