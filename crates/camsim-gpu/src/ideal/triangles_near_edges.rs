//! Selection of the terrain triangles near edge pixels: only these are drawn with several samples per pixel.

use std::sync::OnceLock;

use camsim_plan::FramePlan;

use super::{DrawSlot, key_rows, supersampled_target::SupersampledTarget};
use crate::{
    context::GpuContext,
    layout::KeyLayout,
    recorder::Recorder,
    shaders::{self, ComposeError},
};

const SHADER: &str = "ideal/triangles_near_edges.wgsl";
/// Triangles per workgroup.
const WORKGROUP: u32 = 64;
/// Maximum number of workgroups along x: every adapter allows 65535 along each axis.
const MAX_GROUPS_X: u32 = 32_768;
/// Arguments of an indexed draw without indices.
const EMPTY_DRAW: [u32; 5] = [0, 1, 0, 0, 0];

/// Selected triangles of a key frame.
#[derive(Debug)]
pub(super) struct SelectedTriangles {
    /// [`KeyLayout`] of the key frame.
    layout: wgpu::Buffer,
    /// Arguments of the indirect indexed draw.
    pub(super) arguments: wgpu::Buffer,
    /// Indices; there is room for all of the key frame.
    pub(super) indices: wgpu::Buffer,
    /// Created when the selection is first recorded.
    group: OnceLock<wgpu::BindGroup>,
}

/// Pipeline of the selection.
#[derive(Debug)]
pub(super) struct EdgeTrianglesPass {
    tiles_layout: wgpu::BindGroupLayout,
    selection_layout: wgpu::BindGroupLayout,
    pipeline: wgpu::ComputePipeline,
}

impl SelectedTriangles {
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
                "camsim.ideal.selection",
                size_of_val(&EMPTY_DRAW) as u64,
                storage | wgpu::BufferUsages::INDIRECT | wgpu::BufferUsages::COPY_SRC | written,
            ),
            indices: create(
                "camsim.ideal.selected_indices",
                index_bytes,
                storage | wgpu::BufferUsages::INDEX,
            ),
            group: OnceLock::new(),
        }
    }
}

impl EdgeTrianglesPass {
    /// `camera`, `terrain`: bind group layouts of the terrain's render pipeline, which this pass reads too.
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
                label: Some("camsim.ideal.triangles_near_edges"),
                entries: &entries,
            })
        };
        let tiles_layout = layout(&[storage(true)]);
        let selection_layout =
            layout(&[storage(true), wgpu::BufferBindingType::Uniform, storage(false), storage(false)]);
        let module = shaders::module(device, SHADER, SHADER, &[])?;
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(SHADER),
            bind_group_layouts: &[Some(camera), Some(terrain), Some(&tiles_layout), Some(&selection_layout)],
            immediate_size: 0,
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(SHADER),
            layout: Some(&pipeline_layout),
            module: &module,
            entry_point: Some("select_triangles"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        });
        Ok(Self { tiles_layout, selection_layout, pipeline })
    }

    /// Records the selection for each key frame of a plan. The edge mask must have been recorded.
    pub(super) fn encode(
        &self,
        gpu: &GpuContext,
        recorder: &mut Recorder<'_>,
        plan: &FramePlan,
        tiles_across: u32,
        slots: &[DrawSlot],
        index_counts: &[u32],
        fine: &SupersampledTarget,
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
                recorder.write(&terrain.selection.layout, 0, bytemuck::bytes_of(&layout));
                recorder.write(&terrain.selection.arguments, 0, bytemuck::cast_slice(&EMPTY_DRAW));
                (slot, terrain, index_count)
            })
            .collect();
        let mut pass = recorder.compute_pass("triangles_near_edges");
        pass.set_pipeline(&self.pipeline);
        let tiles = fine
            .edge_triangles_group
            .get_or_init(|| self.bind(gpu, &self.tiles_layout, &[&fine.dilated_tiles]));
        for &(slot, terrain, index_count) in &keys {
            let selection = &terrain.selection;
            let buffers = [&terrain.indices, &selection.layout, &selection.arguments, &selection.indices];
            let group = selection.group.get_or_init(|| self.bind(gpu, &self.selection_layout, &buffers));
            pass.set_bind_group(0, &slot.camera_group, &[]);
            pass.set_bind_group(1, terrain.group.as_ref(), &[]);
            pass.set_bind_group(2, tiles, &[]);
            pass.set_bind_group(3, group, &[]);
            let workgroups = (index_count / 3).div_ceil(WORKGROUP);
            pass.dispatch_workgroups(workgroups.min(MAX_GROUPS_X), workgroups.div_ceil(MAX_GROUPS_X), 1);
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
            label: Some("camsim.ideal.triangles_near_edges"),
            layout,
            entries: &entries,
        })
    }
}
