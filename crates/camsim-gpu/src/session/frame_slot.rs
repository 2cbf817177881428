//! Buffers of the frames in flight.

use camsim_core::{
    scenario::{Face, Primary},
    sequence::Sequence,
};

use super::readback::ReadbackBuffer;
use crate::{
    adapter::FRAMES_IN_FLIGHT,
    context::GpuContext,
    ideal::{DrawSlot, RenderTarget},
    layout::{FrameUniforms, Truth},
    recorder::PassClock,
    reverse::{ReverseBindGroups, list_size},
    staging::Staging,
};

/// Colours of a picture.
const COLORS: usize = Primary::ALL.len();

/// Textures of ideal frames, and the bind groups with which each frame in flight reads them.
#[derive(Debug)]
pub(super) struct SessionTarget {
    /// The face whose lens map the bind groups have.
    pub face: Option<Face>,
    pub ideal: RenderTarget,
    /// Those of each colour that has a lens map of its own, one colour after the other.
    pub groups: [ReverseBindGroups; COLORS * FRAMES_IN_FLIGHT],
}

/// Number of the bind groups of a frame in flight with the lens map of a colour.
pub(super) fn group_of(slot: usize, primary: Option<Primary>) -> usize {
    FRAMES_IN_FLIGHT * primary.map_or(0, Primary::channel) + slot
}

impl SessionTarget {
    /// Forgets the bind groups of a frame in flight.
    pub fn clear(&mut self, slot: usize) {
        self.groups.iter_mut().skip(slot).step_by(FRAMES_IN_FLIGHT).for_each(|groups| groups.clear());
    }
}

/// Buffers of one frame in flight.
#[derive(Debug)]
pub(super) struct FrameSlot {
    /// Staging memory for the frame's uploads; created with the first frame.
    pub staging: Option<Staging>,
    /// One per ideal frame, as many as any frame has needed so far.
    pub ideal: Vec<DrawSlot>,
    pub frame: wgpu::Buffer,
    pub poses: wgpu::Buffer,
    pub color: ReadbackBuffer,
    pub truth: Option<ReadbackBuffer>,
    pub clock: Option<PassClock>,
    /// The last frame's submission.
    pub submission: Option<wgpu::SubmissionIndex>,
}

impl FrameSlot {
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
            color: ReadbackBuffer::new(gpu, "camsim.color", 16 * width * height),
            truth: truth.then(|| {
                ReadbackBuffer::new(gpu, "camsim.truth", size_of::<Truth>() as u64 * width * height)
            }),
            clock: None,
            submission: None,
        }
    }

    /// What a frame puts out: its colour, and its truth if it has any.
    pub fn outputs(&self, has_truth: bool) -> impl Iterator<Item = &ReadbackBuffer> {
        std::iter::once(&self.color).chain(self.truth.as_ref().filter(|_| has_truth))
    }

    /// To be called after submission: requests the mapping of the buffers that the CPU reads, the outputs
    /// only if the frame has any, and of the staging memory.
    pub fn request_mapping(&mut self, has_outputs: bool, has_truth: bool) {
        let outputs = has_outputs
            .then(|| self.outputs(has_truth))
            .into_iter()
            .flatten()
            .map(|output| &output.cpu_buffer);
        for cpu_buffer in outputs.chain(self.clock.as_ref().map(PassClock::cpu_buffer)) {
            // A failed mapping shows when the range is read.
            cpu_buffer.map_async(wgpu::MapMode::Read, .., |_| {});
        }
        self.staging.iter_mut().for_each(Staging::request_mapping);
    }
}

/// Buffer of at least this size: a power of two, so that few frames need a larger one.
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
