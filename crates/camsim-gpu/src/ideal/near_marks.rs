//! The terrain's triangles near marks: they alone are drawn with several samples a pixel.

use std::sync::OnceLock;

use camsim_plan::FramePlan;

use super::{IdealSlot, fine::FineTarget, key_rows};
use crate::{
    context::GpuContext,
    layout::KeyLayout,
    recorder::Recorder,
    shaders::{self, ComposeError},
};

const SHADER: &str = "ideal/near_marks.wgsl";
/// Triangles that a workgroup takes.
const WORKGROUP: u32 = 64;
/// Workgroups along x at most: every adapter has 65535 along each axis.
const MOST_GROUPS: u32 = 32_768;
/// Arguments of an indexed draw of nothing yet.
const NONE_KEPT: [u32; 5] = [0, 1, 0, 0, 0];

/// Triangles of a key that are kept.
#[derive(Debug)]
pub(super) struct Kept {
    /// [`KeyLayout`].
    layout: wgpu::Buffer,
    /// Arguments of an indexed draw.
    pub(super) arguments: wgpu::Buffer,
    /// As many as the key has.
    pub(super) indices: wgpu::Buffer,
    /// Made when the choice is first recorded.
    group: OnceLock<wgpu::BindGroup>,
}

/// The pipeline that keeps them.
#[derive(Debug)]
pub(super) struct NearMarksPass {
    tiles_layout: wgpu::BindGroupLayout,
    kept_layout: wgpu::BindGroupLayout,
    pipeline: wgpu::ComputePipeline,
}

impl Kept {
    pub(super) fn new(gpu: &GpuContext, index_bytes: u64) -> Self {
        let create = |label, size, usage| {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage,
                mapped_at_creation: false,
            })
        };
        let (storage, written) = (wgpu::BufferUsages::STORAGE, wgpu::BufferUsages::COPY_DST);
        Self {
            layout: create(
                "camsim.ideal.key_layout",
                size_of::<KeyLayout>() as u64,
                wgpu::BufferUsages::UNIFORM | written,
            ),
            arguments: create(
                "camsim.ideal.kept",
                size_of_val(&NONE_KEPT) as u64,
                storage | wgpu::BufferUsages::INDIRECT | wgpu::BufferUsages::COPY_SRC | written,
            ),
            indices: create("camsim.ideal.kept_indices", index_bytes, storage | wgpu::BufferUsages::INDEX),
            group: OnceLock::new(),
        }
    }
}

impl NearMarksPass {
    /// `camera`, `terrain`: layouts of what draws the terrain, which is read here too.
    pub(super) fn new(
        gpu: &GpuContext,
        camera: &wgpu::BindGroupLayout,
        terrain: &wgpu::BindGroupLayout,
    ) -> Result<Self, ComposeError> {
        let device = &gpu.device;
        let storage = |read_only| wgpu::BufferBindingType::Storage { read_only };
        let layout = |types: &[wgpu::BufferBindingType]| {
            let entries: Vec<_> = (0..)
                .zip(types)
                .map(|(binding, &ty)| super::buffer_entry(binding, wgpu::ShaderStages::COMPUTE, ty))
                .collect();
            device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                label: Some("camsim.ideal.near_marks"),
                entries: &entries,
            })
        };
        let tiles_layout = layout(&[storage(true)]);
        let kept_layout =
            layout(&[storage(true), wgpu::BufferBindingType::Uniform, storage(false), storage(false)]);
        let module = shaders::module(device, SHADER, SHADER, &[])?;
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(SHADER),
            bind_group_layouts: &[Some(camera), Some(terrain), Some(&tiles_layout), Some(&kept_layout)],
            immediate_size: 0,
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(SHADER),
            layout: Some(&pipeline_layout),
            module: &module,
            entry_point: Some("keep"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        });
        Ok(Self { tiles_layout, kept_layout, pipeline })
    }

    /// Records the choice for each key of a plan. The marks are known.
    pub(super) fn encode(
        &self,
        gpu: &GpuContext,
        recorder: &mut Recorder<'_>,
        plan: &FramePlan,
        tiles_across: u32,
        slots: &[IdealSlot],
        index_counts: &[u32],
        fine: &FineTarget,
    ) {
        let keys: Vec<_> = (0..)
            .zip(slots.iter().zip(index_counts))
            .filter_map(|(k, (slot, &count))| {
                slot.terrain.as_ref().filter(|_| count > 0).map(|terrain| (k, slot, terrain, count))
            })
            .map(|(k, slot, terrain, index_count)| {
                let layout = KeyLayout {
                    ideal_size_px: plan.ideal.size_px,
                    first_row: key_rows(&plan.ideal) * k,
                    tiles_across,
                    index_count,
                    ..KeyLayout::default()
                };
                recorder.write(&terrain.kept.layout, 0, bytemuck::bytes_of(&layout));
                recorder.write(&terrain.kept.arguments, 0, bytemuck::cast_slice(&NONE_KEPT));
                (slot, terrain, index_count)
            })
            .collect();
        let mut pass = recorder.compute_pass("near_marks");
        pass.set_pipeline(&self.pipeline);
        let tiles =
            fine.near_marks_group.get_or_init(|| self.bind(gpu, &self.tiles_layout, &[&fine.within_reach]));
        for &(slot, terrain, index_count) in &keys {
            let kept = &terrain.kept;
            let buffers = [&terrain.indices, &kept.layout, &kept.arguments, &kept.indices];
            let group = kept.group.get_or_init(|| self.bind(gpu, &self.kept_layout, &buffers));
            pass.set_bind_group(0, &slot.camera_group, &[]);
            pass.set_bind_group(1, terrain.group.as_ref(), &[]);
            pass.set_bind_group(2, tiles, &[]);
            pass.set_bind_group(3, group, &[]);
            let workgroups = (index_count / 3).div_ceil(WORKGROUP);
            pass.dispatch_workgroups(workgroups.min(MOST_GROUPS), workgroups.div_ceil(MOST_GROUPS), 1);
        }
    }

    fn bind(
        &self,
        gpu: &GpuContext,
        layout: &wgpu::BindGroupLayout,
        buffers: &[&wgpu::Buffer],
    ) -> wgpu::BindGroup {
        let entries: Vec<_> = (0..)
            .zip(buffers)
            .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
            .collect();
        gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("camsim.ideal.near_marks"),
            layout,
            entries: &entries,
        })
    }
}
