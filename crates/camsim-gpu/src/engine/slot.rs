//! Buffers that frames are made in.

use camsim_core::sequence::Sequence;

use super::readback::Output;
use crate::{
    context::GpuContext,
    ideal::{IdealPass, IdealSlot},
    layout::{FrameUniforms, Truth},
    recorder::PassClock,
    reverse::list_size,
    upload::SceneBuffers,
};

/// Buffers of one frame in flight.
#[derive(Debug)]
pub(super) struct Slot {
    /// One for each ideal frame, as many as any frame needed so far.
    pub ideal: Vec<IdealSlot>,
    pub frame: wgpu::Buffer,
    pub poses: wgpu::Buffer,
    pub color: Output,
    pub truth: Option<Output>,
    pub clock: Option<PassClock>,
}

impl Slot {
    pub fn new(gpu: &GpuContext, ideal_pass: &IdealPass, sequence: &Sequence, buffers: &SceneBuffers, truth: bool) -> Self {
        let [width, height] = sequence.scenario.camera.size_px.map(u64::from);
        let frame = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("camsim.frame"),
            size: size_of::<FrameUniforms>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        Self {
            ideal: vec![ideal_pass.slot(gpu, &sequence.scene, buffers)],
            frame,
            poses: pose_buffer(gpu, 48 * width.max(height)),
            color: Output::new(gpu, "camsim.color", 16 * width * height),
            truth: truth.then(|| Output::new(gpu, "camsim.truth", size_of::<Truth>() as u64 * width * height)),
            clock: None,
        }
    }
}

pub(super) fn pose_buffer(gpu: &GpuContext, size: u64) -> wgpu::Buffer {
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("camsim.poses"),
        size,
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

pub(super) fn list_buffer(gpu: &GpuContext, size_px: [u32; 2]) -> wgpu::Buffer {
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("camsim.listed"),
        size: list_size(size_px),
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::INDIRECT | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}
