//! Buffers that frames are made in.

use camsim_core::sequence::Sequence;

use super::{FRAMES_IN_FLIGHT, readback::Output};
use crate::{
    context::GpuContext,
    ideal::{IdealSlot, IdealTarget},
    layout::{FrameUniforms, Truth},
    recorder::PassClock,
    reverse::{ReverseGroups, list_size},
    staging::Staging,
};

/// Textures of ideal frames, and what each frame in flight reads them by.
#[derive(Debug)]
pub(super) struct Target {
    pub ideal: IdealTarget,
    pub groups: [ReverseGroups; FRAMES_IN_FLIGHT],
}

/// Buffers of one frame in flight.
#[derive(Debug)]
pub(super) struct Slot {
    /// What the host writes for the frame; made with the first.
    pub staging: Option<Staging>,
    /// One for each ideal frame, as many as any frame needed so far.
    pub ideal: Vec<IdealSlot>,
    pub frame: wgpu::Buffer,
    pub poses: wgpu::Buffer,
    pub color: Output,
    pub truth: Option<Output>,
    pub clock: Option<PassClock>,
}

impl Slot {
    pub fn new(gpu: &GpuContext, sequence: &Sequence, truth: bool) -> Self {
        let [width, height] = sequence.scenario.camera.size_px.map(u64::from);
        let frame = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("camsim.frame"),
            size: size_of::<FrameUniforms>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        Self {
            staging: None,
            ideal: Vec::new(),
            frame,
            poses: pose_buffer(gpu, 48 * width.max(height)),
            color: Output::new(gpu, "camsim.color", 16 * width * height),
            truth: truth
                .then(|| Output::new(gpu, "camsim.truth", size_of::<Truth>() as u64 * width * height)),
            clock: None,
        }
    }

    /// Once the frame has been submitted: asks for what the host reads of it, the outputs where the device
    /// has made them, and for what it writes the next one to.
    pub fn recall(&mut self, has_outputs: bool) {
        let outputs = has_outputs
            .then(|| std::iter::once(&self.color).chain(&self.truth))
            .into_iter()
            .flatten()
            .map(|output| &output.on_host);
        for on_host in outputs.chain(self.clock.as_ref().map(PassClock::on_host)) {
            // A failed mapping shows when the range is read.
            on_host.map_async(wgpu::MapMode::Read, .., |_| {});
        }
        self.staging.iter_mut().for_each(Staging::recall);
    }
}

/// For at least so many bytes: a power of two, so that few frames need another.
pub(super) fn pose_buffer(gpu: &GpuContext, bytes: u64) -> wgpu::Buffer {
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("camsim.poses"),
        size: bytes.next_power_of_two(),
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

pub(super) fn list_buffer(gpu: &GpuContext, label: &str, size_px: [u32; 2]) -> wgpu::Buffer {
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: list_size(size_px),
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::INDIRECT | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}
