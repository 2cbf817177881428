//! Marks of silhouettes in an ideal frame, the borders of surfaces within marked pixels, and what lies within
//! reach of each place.

use camsim_plan::{FramePlan, SIZE_QUANTUM_PX};

use super::{
    COLOR_FORMAT, IdealTarget,
    fine::{FineTarget, TILE_PX, whole},
    key_rows,
};
use crate::{
    context::GpuContext,
    recorder::Recorder,
    shaders::{self, ComposeError, Slot},
};

/// A packed normal and offset, and the depth value between the surfaces.
pub(super) const LINES_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rg32Uint;
/// Side of the square of pixels that a workgroup of `shaders/ideal/marks.wgsl` takes: frames begin at
/// multiples of it in their target.
const MARKS_PX: u32 = 16;
const _: () = assert!(SIZE_QUANTUM_PX.is_multiple_of(MARKS_PX) && MARKS_PX.is_multiple_of(TILE_PX));
/// Tiles that a workgroup of `shaders/ideal/reach.wgsl` takes.
const REACH_WORKGROUP: u32 = 64;
/// Head of the list of marked tiles before a frame: a draw of strips of four vertices, none yet, and an empty
/// dispatch.
const NO_MARKED: [u32; 8] = [4, 0, 0, 0, 0, 1, 1, 0];
/// Bytes of that head.
pub(super) const MARKED_HEAD_BYTES: u64 = 4 * NO_MARKED.len() as u64;
/// Where its arguments of a dispatch begin.
const DISPATCH_BYTES: u64 = 16;

/// What marks look at: at each pixel's middle, or at its samples too, where something thinner than a pixel
/// may be in view.
pub(crate) fn spread_slot(thin: bool) -> Slot {
    ("spread", if thin { "ideal/spread/samples.wgsl" } else { "ideal/spread/none.wgsl" })
}

/// Pipelines of the passes between an ideal frame and its gather.
#[derive(Debug)]
pub(super) struct MarksPass {
    /// Without and with samples.
    marks: [Compute; 2],
    stamp: (wgpu::BindGroupLayout, wgpu::RenderPipeline),
    borders: Compute,
    reach_layout: wgpu::BindGroupLayout,
    reach: [wgpu::ComputePipeline; 2],
}

/// Bind groups of a target.
#[derive(Debug)]
pub(super) struct MarkGroups {
    /// Without and with samples.
    marks: [wgpu::BindGroup; 2],
    stamp: wgpu::BindGroup,
    borders: wgpu::BindGroup,
    reach: [wgpu::BindGroup; 2],
}

#[derive(Debug)]
struct Compute {
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::ComputePipeline,
}

impl MarksPass {
    pub(super) fn new(gpu: &GpuContext) -> Result<Self, ComposeError> {
        let device = &gpu.device;
        let uniform = buffer(wgpu::BufferBindingType::Uniform);
        let group = |visibility, types: &[wgpu::BindingType]| {
            let entries: Vec<_> = (0..)
                .zip(types)
                .map(|(binding, &ty)| wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None })
                .collect();
            device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                label: Some("camsim.ideal.marks"),
                entries: &entries,
            })
        };
        let compute = |file: &str,
                       slots: &[Slot],
                       entry_point: &str,
                       types: &[wgpu::BindingType]|
         -> Result<_, ComposeError> {
            let layout = group(wgpu::ShaderStages::COMPUTE, types);
            let pipeline = compute_pipeline(gpu, file, slots, entry_point, &layout)?;
            Ok(Compute { layout, pipeline })
        };
        let marks = |thin: bool| {
            let samples = thin.then_some(depth_texture(true));
            let types: Vec<_> = [depth_texture(false), storage(false), uniform, storage(false)]
                .into_iter()
                .chain(samples)
                .collect();
            compute("ideal/marks.wgsl", &[spread_slot(thin)], "marks", &types)
        };
        let view_dimension = wgpu::TextureViewDimension::D2;
        let lines = wgpu::BindingType::StorageTexture {
            access: wgpu::StorageTextureAccess::WriteOnly,
            format: LINES_FORMAT,
            view_dimension,
        };
        let reach_layout = group(wgpu::ShaderStages::COMPUTE, &[storage(true), storage(false), uniform]);
        let reach = |entry_point| compute_pipeline(gpu, "ideal/reach.wgsl", &[], entry_point, &reach_layout);
        let stamp_layout = group(wgpu::ShaderStages::VERTEX, &[storage(true), uniform]);
        Ok(Self {
            marks: [marks(false)?, marks(true)?],
            stamp: (stamp_layout.clone(), stamp_pipeline(gpu, &stamp_layout)?),
            borders: compute(
                "ideal/borders.wgsl",
                &[],
                "borders",
                &[depth_texture(true), storage(true), uniform, lines],
            )?,
            reach: [reach("along_rows")?, reach("along_columns")?],
            reach_layout,
        })
    }

    /// Marks the pixels of a plan's ideal frames; `thin` where samples are drawn already and are to be asked.
    pub(super) fn mark(
        &self,
        gpu: &GpuContext,
        recorder: &mut Recorder<'_>,
        plan: &FramePlan,
        target: &IdealTarget,
        fine: &FineTarget,
        thin: bool,
    ) {
        let (rows, last) = (key_rows(&plan.ideal), plan.keys.len() as u32 - 1);
        let [width, height] = plan.ideal.size_px;
        let target_px = [target.allocated_px[0] as f32, target.allocated_px[1] as f32, 0.0, 0.0];
        recorder.write(&fine.layout, 0, bytemuck::cast_slice(&[width, height, rows, fine.scale]));
        recorder.write(&fine.target_px, 0, bytemuck::cast_slice(&target_px));
        recorder.write(&fine.marked, 0, bytemuck::cast_slice(&NO_MARKED));
        // What the frame does not cover has nothing.
        recorder.encoder().clear_buffer(&fine.within_reach, 0, None);
        let groups = fine.mark_groups.get_or_init(|| self.bind(gpu, target, fine));
        let mut pass = recorder.compute_pass("marks");
        pass.set_pipeline(&self.marks[usize::from(thin)].pipeline);
        pass.set_bind_group(0, &groups.marks[usize::from(thin)], &[]);
        pass.dispatch_workgroups(width.div_ceil(MARKS_PX), (rows * last + height).div_ceil(MARKS_PX), 1);
    }

    /// Writes the marks into the frame's colour; once they are known.
    pub(super) fn stamp(
        &self,
        gpu: &GpuContext,
        recorder: &mut Recorder<'_>,
        target: &IdealTarget,
        fine: &FineTarget,
    ) {
        let groups = fine.mark_groups.get_or_init(|| self.bind(gpu, target, fine));
        let attachment = wgpu::RenderPassColorAttachment {
            view: &target.drawn_color,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Store },
        };
        let mut pass = recorder.render_pass("stamp", Some(attachment), None);
        pass.set_pipeline(&self.stamp.1);
        pass.set_bind_group(0, &groups.stamp, &[]);
        pass.draw_indirect(&fine.marked, 0);
    }

    /// Finds the borders within marked pixels, and what lies within reach; once the samples are drawn.
    pub(super) fn borders(
        &self,
        gpu: &GpuContext,
        recorder: &mut Recorder<'_>,
        plan: &FramePlan,
        target: &IdealTarget,
        fine: &FineTarget,
    ) {
        let [across, down] = target.allocated_px.map(|side| side.div_ceil(TILE_PX));
        let reach = plan.mark_reach_px().div_ceil(TILE_PX).min(across.max(down));
        recorder.write(&fine.tile_layout, 0, bytemuck::cast_slice(&[across, down, reach, 0]));
        let groups = fine.mark_groups.get_or_init(|| self.bind(gpu, target, fine));
        let mut pass = recorder.compute_pass("borders");
        pass.set_pipeline(&self.borders.pipeline);
        pass.set_bind_group(0, &groups.borders, &[]);
        pass.dispatch_workgroups_indirect(&fine.marked, DISPATCH_BYTES);
        for (pipeline, group) in self.reach.iter().zip(&groups.reach) {
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, group, &[]);
            pass.dispatch_workgroups((across * down).div_ceil(REACH_WORKGROUP), 1, 1);
        }
    }

    fn bind(&self, gpu: &GpuContext, target: &IdealTarget, fine: &FineTarget) -> MarkGroups {
        let bind = |layout: &wgpu::BindGroupLayout, resources: &[wgpu::BindingResource<'_>]| {
            let entries: Vec<_> = (0..)
                .zip(resources)
                .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource: resource.clone() })
                .collect();
            gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("camsim.ideal.marks"),
                layout,
                entries: &entries,
            })
        };
        let lines = whole(&fine.lines);
        let [samples, depth, lines] =
            [&fine.depth_view, &target.gathered_depth, &lines].map(wgpu::BindingResource::TextureView);
        let of = wgpu::Buffer::as_entire_binding;
        let (marked, layout) = (of(&fine.marked), of(&fine.layout));
        let marks = [depth, of(&fine.within_reach), layout.clone(), marked.clone(), samples.clone()];
        let reach = |from, to| bind(&self.reach_layout, &[of(from), of(to), of(&fine.tile_layout)]);
        MarkGroups {
            marks: [bind(&self.marks[0].layout, &marks[..4]), bind(&self.marks[1].layout, &marks)],
            stamp: bind(&self.stamp.0, &[marked.clone(), of(&fine.target_px)]),
            borders: bind(&self.borders.layout, &[samples, marked, layout, lines]),
            reach: [
                reach(&fine.within_reach, &fine.within_rows),
                reach(&fine.within_rows, &fine.within_reach),
            ],
        }
    }
}

fn buffer(ty: wgpu::BufferBindingType) -> wgpu::BindingType {
    wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None }
}

fn storage(read_only: bool) -> wgpu::BindingType {
    buffer(wgpu::BufferBindingType::Storage { read_only })
}

fn depth_texture(multisampled: bool) -> wgpu::BindingType {
    let view_dimension = wgpu::TextureViewDimension::D2;
    wgpu::BindingType::Texture { sample_type: wgpu::TextureSampleType::Depth, view_dimension, multisampled }
}

fn pipeline_layout(gpu: &GpuContext, label: &str, layout: &wgpu::BindGroupLayout) -> wgpu::PipelineLayout {
    gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(label),
        bind_group_layouts: &[Some(layout)],
        immediate_size: 0,
    })
}

fn compute_pipeline(
    gpu: &GpuContext,
    file: &str,
    slots: &[Slot],
    entry_point: &str,
    layout: &wgpu::BindGroupLayout,
) -> Result<wgpu::ComputePipeline, ComposeError> {
    let module = shaders::module(&gpu.device, file, file, slots)?;
    Ok(gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(file),
        layout: Some(&pipeline_layout(gpu, file, layout)),
        module: &module,
        entry_point: Some(entry_point),
        // What a workgroup shares is set by the shader where it is not written whole.
        compilation_options: wgpu::PipelineCompilationOptions {
            zero_initialize_workgroup_memory: false,
            ..Default::default()
        },
        cache: None,
    }))
}

/// Writes alpha alone.
fn stamp_pipeline(
    gpu: &GpuContext,
    layout: &wgpu::BindGroupLayout,
) -> Result<wgpu::RenderPipeline, ComposeError> {
    let file = "ideal/stamp.wgsl";
    let module = shaders::module(&gpu.device, file, file, &[])?;
    let compilation_options = wgpu::PipelineCompilationOptions::default();
    let alpha =
        wgpu::ColorTargetState { format: COLOR_FORMAT, blend: None, write_mask: wgpu::ColorWrites::ALPHA };
    Ok(gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(file),
        layout: Some(&pipeline_layout(gpu, file, layout)),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("vertex"),
            compilation_options: compilation_options.clone(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState {
            topology: wgpu::PrimitiveTopology::TriangleStrip,
            ..Default::default()
        },
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("fragment"),
            compilation_options,
            targets: &[Some(alpha)],
        }),
        multiview_mask: None,
        cache: None,
    }))
}
