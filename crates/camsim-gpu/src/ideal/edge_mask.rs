//! Edge mask of an ideal frame, the borders of surfaces within edge pixels, and the dilated tiles.

use camsim_plan::{FramePlan, SIZE_QUANTUM_PX};

use super::{
    COLOR_FORMAT, RenderTarget, key_rows,
    supersampled_target::{SupersampledTarget, TILE_PX, full_view},
};
use crate::{
    context::GpuContext,
    recorder::Recorder,
    shaders::{self, ComposeError, ShaderSlot},
};

/// Packed normal and offset of the border, and the depth value that separates the surfaces.
pub(super) const LINES_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rg32Uint;
/// Side of the square of pixels per workgroup of `shaders/ideal/edge_mask.wgsl`: ideal frames begin at
/// multiples of it in their target.
const EDGE_MASK_WORKGROUP_PX: u32 = 16;
const _: () = assert!(
    SIZE_QUANTUM_PX.is_multiple_of(EDGE_MASK_WORKGROUP_PX) && EDGE_MASK_WORKGROUP_PX.is_multiple_of(TILE_PX)
);
/// Tiles per workgroup of `shaders/ideal/dilate_tiles.wgsl`.
const DILATION_WORKGROUP: u32 = 64;
/// Initial head of the list of edge tiles: an indirect draw of strips of four vertices without instances, and
/// an empty indirect dispatch.
const EMPTY_EDGE_TILES: [u32; 8] = [4, 0, 0, 0, 0, 1, 1, 0];
/// Size of the head, bytes.
pub(super) const EDGE_TILES_HEAD_BYTES: u64 = 4 * EMPTY_EDGE_TILES.len() as u64;
/// Offset of the dispatch arguments in the head, bytes.
const DISPATCH_OFFSET_BYTES: u64 = 16;

/// Slot of the edge mask: depths at pixel centres, or also at samples, if something thinner than a pixel may
/// be in view.
pub(crate) fn thin_surfaces_slot(thin: bool) -> ShaderSlot {
    ("thin_surfaces", if thin { "ideal/thin_surfaces/samples.wgsl" } else { "ideal/thin_surfaces/none.wgsl" })
}

/// Pipelines of the passes between an ideal frame and its gather.
#[derive(Debug)]
pub(super) struct EdgeMaskPass {
    /// Without and with samples.
    mask: [ComputeStage; 2],
    write_alpha: (wgpu::BindGroupLayout, wgpu::RenderPipeline),
    edge_lines: ComputeStage,
    dilation_layout: wgpu::BindGroupLayout,
    dilation: [wgpu::ComputePipeline; 2],
}

/// Bind groups of a target.
#[derive(Debug)]
pub(super) struct EdgeMaskGroups {
    /// Without and with samples.
    mask: [wgpu::BindGroup; 2],
    write_alpha: wgpu::BindGroup,
    edge_lines: wgpu::BindGroup,
    dilation: [wgpu::BindGroup; 2],
}

#[derive(Debug)]
struct ComputeStage {
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::ComputePipeline,
}

impl EdgeMaskPass {
    pub(super) fn new(gpu: &GpuContext) -> Result<Self, ComposeError> {
        let device = &gpu.device;
        let uniform = buffer(wgpu::BufferBindingType::Uniform);
        let group = |visibility, types: &[wgpu::BindingType]| {
            let entries: Vec<_> = (0..)
                .zip(types)
                .map(|(binding, &ty)| wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None })
                .collect();
            device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                label: Some("camsim.ideal.edge_mask"),
                entries: &entries,
            })
        };
        let compute = |file: &str,
                       slots: &[ShaderSlot],
                       entry_point: &str,
                       types: &[wgpu::BindingType]|
         -> Result<_, ComposeError> {
            let layout = group(wgpu::ShaderStages::COMPUTE, types);
            let pipeline = compute_pipeline(gpu, file, slots, entry_point, &layout)?;
            Ok(ComputeStage { layout, pipeline })
        };
        let mask = |thin: bool| {
            let samples = thin.then_some(depth_texture(true));
            let types: Vec<_> = [depth_texture(false), storage(false), uniform, storage(false)]
                .into_iter()
                .chain(samples)
                .collect();
            compute("ideal/edge_mask.wgsl", &[thin_surfaces_slot(thin)], "edge_mask", &types)
        };
        let view_dimension = wgpu::TextureViewDimension::D2;
        let lines = wgpu::BindingType::StorageTexture {
            access: wgpu::StorageTextureAccess::WriteOnly,
            format: LINES_FORMAT,
            view_dimension,
        };
        let dilation_layout = group(wgpu::ShaderStages::COMPUTE, &[storage(true), storage(false), uniform]);
        let dilation = |entry_point| {
            compute_pipeline(gpu, "ideal/dilate_tiles.wgsl", &[], entry_point, &dilation_layout)
        };
        let alpha_layout = group(wgpu::ShaderStages::VERTEX, &[storage(true), uniform]);
        Ok(Self {
            mask: [mask(false)?, mask(true)?],
            write_alpha: (alpha_layout.clone(), alpha_pipeline(gpu, &alpha_layout)?),
            edge_lines: compute(
                "ideal/find_edge_lines.wgsl",
                &[],
                "find_edge_lines",
                &[depth_texture(true), storage(true), uniform, lines],
            )?,
            dilation: [dilation("along_rows")?, dilation("along_columns")?],
            dilation_layout,
        })
    }

    /// Computes the edge mask of a plan's ideal frames. `thin`: samples have been drawn and are tested too.
    pub(super) fn compute_mask(
        &self,
        gpu: &GpuContext,
        recorder: &mut Recorder<'_>,
        plan: &FramePlan,
        target: &RenderTarget,
        fine: &SupersampledTarget,
        thin: bool,
    ) {
        let (rows, last) = (key_rows(&plan.ideal), plan.keys.len() as u32 - 1);
        let [width, height] = plan.ideal.size_px;
        let target_px = [target.allocated_px[0] as f32, target.allocated_px[1] as f32, 0.0, 0.0];
        recorder.write(&fine.layout, 0, bytemuck::cast_slice(&[width, height, rows, fine.scale]));
        recorder.write(&fine.target_px, 0, bytemuck::cast_slice(&target_px));
        recorder.write(&fine.edge_tiles, 0, bytemuck::cast_slice(&EMPTY_EDGE_TILES));
        // Tiles outside of the ideal frames stay 0.
        recorder.encoder().clear_buffer(&fine.dilated_tiles, 0, None);
        let groups = fine.edge_mask_groups.get_or_init(|| self.bind(gpu, target, fine));
        let mut pass = recorder.compute_pass("edge_mask");
        pass.set_pipeline(&self.mask[usize::from(thin)].pipeline);
        pass.set_bind_group(0, &groups.mask[usize::from(thin)], &[]);
        pass.dispatch_workgroups(
            width.div_ceil(EDGE_MASK_WORKGROUP_PX),
            (rows * last + height).div_ceil(EDGE_MASK_WORKGROUP_PX),
            1,
        );
    }

    /// Writes the edge mask into the alpha of the frame's colour.
    pub(super) fn write_alpha(
        &self,
        gpu: &GpuContext,
        recorder: &mut Recorder<'_>,
        target: &RenderTarget,
        fine: &SupersampledTarget,
    ) {
        let groups = fine.edge_mask_groups.get_or_init(|| self.bind(gpu, target, fine));
        let attachment = wgpu::RenderPassColorAttachment {
            view: &target.color_attachment_view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Store },
        };
        let mut pass = recorder.render_pass("edge_mask_to_alpha", Some(attachment), None);
        pass.set_pipeline(&self.write_alpha.1);
        pass.set_bind_group(0, &groups.write_alpha, &[]);
        pass.draw_indirect(&fine.edge_tiles, 0);
    }

    /// Fits the borders within edge pixels and dilates the tiles. The samples must have been drawn.
    pub(super) fn edge_lines(
        &self,
        gpu: &GpuContext,
        recorder: &mut Recorder<'_>,
        plan: &FramePlan,
        target: &RenderTarget,
        fine: &SupersampledTarget,
    ) {
        let [across, down] = target.allocated_px.map(|side| side.div_ceil(TILE_PX));
        let dilation = plan.mark_reach_px().div_ceil(TILE_PX).min(across.max(down));
        recorder.write(&fine.tile_layout, 0, bytemuck::cast_slice(&[across, down, dilation, 0]));
        let groups = fine.edge_mask_groups.get_or_init(|| self.bind(gpu, target, fine));
        let mut pass = recorder.compute_pass("edge_lines");
        pass.set_pipeline(&self.edge_lines.pipeline);
        pass.set_bind_group(0, &groups.edge_lines, &[]);
        pass.dispatch_workgroups_indirect(&fine.edge_tiles, DISPATCH_OFFSET_BYTES);
        for (pipeline, group) in self.dilation.iter().zip(&groups.dilation) {
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, group, &[]);
            pass.dispatch_workgroups((across * down).div_ceil(DILATION_WORKGROUP), 1, 1);
        }
    }

    fn bind(&self, gpu: &GpuContext, target: &RenderTarget, fine: &SupersampledTarget) -> EdgeMaskGroups {
        let bind = |layout: &wgpu::BindGroupLayout, resources: &[wgpu::BindingResource<'_>]| {
            let entries: Vec<_> = (0..)
                .zip(resources)
                .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource: resource.clone() })
                .collect();
            gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("camsim.ideal.edge_mask"),
                layout,
                entries: &entries,
            })
        };
        let lines = full_view(&fine.lines);
        let [samples, depth, lines] =
            [&fine.depth_view, &target.gather_depth, &lines].map(wgpu::BindingResource::TextureView);
        let of = wgpu::Buffer::as_entire_binding;
        let (edge_tiles, layout) = (of(&fine.edge_tiles), of(&fine.layout));
        let mask = [depth, of(&fine.dilated_tiles), layout.clone(), edge_tiles.clone(), samples.clone()];
        let dilation = |from, to| bind(&self.dilation_layout, &[of(from), of(to), of(&fine.tile_layout)]);
        EdgeMaskGroups {
            mask: [bind(&self.mask[0].layout, &mask[..4]), bind(&self.mask[1].layout, &mask)],
            write_alpha: bind(&self.write_alpha.0, &[edge_tiles.clone(), of(&fine.target_px)]),
            edge_lines: bind(&self.edge_lines.layout, &[samples, edge_tiles, layout, lines]),
            dilation: [
                dilation(&fine.dilated_tiles, &fine.row_dilated_tiles),
                dilation(&fine.row_dilated_tiles, &fine.dilated_tiles),
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
    slots: &[ShaderSlot],
    entry_point: &str,
    layout: &wgpu::BindGroupLayout,
) -> Result<wgpu::ComputePipeline, ComposeError> {
    let module = shaders::module(&gpu.device, file, file, slots)?;
    Ok(gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(file),
        layout: Some(&pipeline_layout(gpu, file, layout)),
        module: &module,
        entry_point: Some(entry_point),
        // The shader initialises workgroup memory where it does not write all of it.
        compilation_options: wgpu::PipelineCompilationOptions {
            zero_initialize_workgroup_memory: false,
            ..Default::default()
        },
        cache: None,
    }))
}

/// Pipeline that writes alpha alone.
fn alpha_pipeline(
    gpu: &GpuContext,
    layout: &wgpu::BindGroupLayout,
) -> Result<wgpu::RenderPipeline, ComposeError> {
    let file = "ideal/edge_mask_to_alpha.wgsl";
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
