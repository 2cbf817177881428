//! Render pipelines for surfaces.

use super::DEPTH_FORMAT;
use crate::{
    context::GpuContext,
    shaders::{self, ComposeError, ShaderSlot},
};

/// Attachments that a pipeline writes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum WriteMode {
    /// Colour, if there is an attachment, and depth.
    #[default]
    All,
    /// Colour blended over what is there, with depth test. The attachment's own alpha stays: it is the edge
    /// mask.
    Blended,
    /// Depth alone, although there is a colour attachment.
    Depth,
}

/// Fixed-function state of a pipeline.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct DrawState {
    pub samples: u32,
    /// `None`: depth alone.
    pub color: Option<wgpu::TextureFormat>,
    pub one_sided: bool,
    pub masked: bool,
    pub writes: WriteMode,
}

/// Blending of premultiplied colours.
const OVER: wgpu::BlendComponent = wgpu::BlendComponent {
    src_factor: wgpu::BlendFactor::One,
    dst_factor: wgpu::BlendFactor::OneMinusSrcAlpha,
    operation: wgpu::BlendOperation::Add,
};

impl DrawState {
    fn target(self, format: wgpu::TextureFormat) -> wgpu::ColorTargetState {
        let usual = wgpu::ColorTargetState::from(format);
        match self.writes {
            WriteMode::All => usual,
            WriteMode::Blended => {
                let blend = Some(wgpu::BlendState { color: OVER, alpha: OVER });
                wgpu::ColorTargetState { blend, write_mask: wgpu::ColorWrites::COLOR, ..usual }
            }
            WriteMode::Depth => wgpu::ColorTargetState { write_mask: wgpu::ColorWrites::empty(), ..usual },
        }
    }

    fn entry_point(self) -> Option<&'static str> {
        match (self.color, self.writes) {
            (Some(_), WriteMode::All | WriteMode::Blended) => Some("fragment"),
            _ => self.masked.then_some("fragment_depth"),
        }
    }
}

pub(super) fn pipeline(
    gpu: &GpuContext,
    file: &str,
    slots: &[ShaderSlot],
    layouts: &[&wgpu::BindGroupLayout],
    buffers: &[Option<wgpu::VertexBufferLayout<'_>>],
    drawing: DrawState,
) -> Result<wgpu::RenderPipeline, ComposeError> {
    let module = shaders::module(&gpu.device, file, file, slots)?;
    let groups: Vec<_> = layouts.iter().map(|layout| Some(*layout)).collect();
    let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(file),
        bind_group_layouts: &groups,
        immediate_size: 0,
    });
    let compilation_options = wgpu::PipelineCompilationOptions::default();
    let DrawState { samples, color, one_sided, writes, .. } = drawing;
    let targets = [color.map(|format| drawing.target(format))];
    Ok(gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(file),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("vertex"),
            compilation_options: compilation_options.clone(),
            buffers,
        },
        // Front faces are anticlockwise in the image: image rows go down, unlike the GPU's y axis.
        primitive: wgpu::PrimitiveState {
            cull_mode: one_sided.then_some(wgpu::Face::Back),
            ..Default::default()
        },
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH_FORMAT,
            depth_write_enabled: Some(writes != WriteMode::Blended),
            depth_compare: Some(wgpu::CompareFunction::Greater),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState { count: samples, ..Default::default() },
        fragment: drawing.entry_point().map(|entry_point| wgpu::FragmentState {
            module: &module,
            entry_point: Some(entry_point),
            compilation_options,
            targets: if color.is_some() { &targets } else { &[] },
        }),
        multiview_mask: None,
        cache: None,
    }))
}
