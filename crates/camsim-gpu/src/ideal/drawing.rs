//! Pipelines that draw surfaces.

use super::DEPTH_FORMAT;
use crate::{
    context::GpuContext,
    shaders::{self, ComposeError, Slot},
};

/// How a pipeline draws.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Drawing {
    pub samples: u32,
    /// None: depth alone.
    pub color: Option<wgpu::TextureFormat>,
    pub one_sided: bool,
    pub holes: bool,
}

pub(super) fn pipeline(
    gpu: &GpuContext,
    file: &str,
    slots: &[Slot],
    layouts: &[&wgpu::BindGroupLayout],
    buffers: &[Option<wgpu::VertexBufferLayout<'_>>],
    Drawing { samples, color, one_sided, holes }: Drawing,
) -> Result<wgpu::RenderPipeline, ComposeError> {
    let module = shaders::module(&gpu.device, file, file, slots)?;
    let groups: Vec<_> = layouts.iter().map(|layout| Some(*layout)).collect();
    let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(file),
        bind_group_layouts: &groups,
        immediate_size: 0,
    });
    let compilation_options = wgpu::PipelineCompilationOptions::default();
    let targets = [color.map(wgpu::ColorTargetState::from)];
    Ok(gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(file),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("vertex"),
            compilation_options: compilation_options.clone(),
            buffers,
        },
        // Anticlockwise is anticlockwise in the picture, whose rows go down as the device's do not.
        primitive: wgpu::PrimitiveState { cull_mode: one_sided.then_some(wgpu::Face::Back), ..Default::default() },
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH_FORMAT,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Greater),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState { count: samples, ..Default::default() },
        fragment: (color.is_some() || holes).then(|| wgpu::FragmentState {
            module: &module,
            entry_point: Some(if color.is_some() { "fragment" } else { "fragment_depth" }),
            compilation_options,
            targets: if color.is_some() { &targets } else { &[] },
        }),
        multiview_mask: None,
        cache: None,
    }))
}
