//! Pipelines that draw surfaces.

use super::DEPTH_FORMAT;
use crate::{
    context::GpuContext,
    shaders::{self, ComposeError, Slot},
};

/// What a pipeline writes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Writes {
    /// Colour, if there is any, and depth.
    #[default]
    All,
    /// Colour over what is there, by alpha; what has depth hides it. The target's own alpha stays: it is a
    /// mark.
    Mixed,
    /// Depth alone, beside a target of colour.
    Depth,
}

/// How a pipeline draws.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Drawing {
    pub samples: u32,
    /// None: depth alone.
    pub color: Option<wgpu::TextureFormat>,
    pub one_sided: bool,
    pub holes: bool,
    pub writes: Writes,
}

/// Colours come times their alpha.
const OVER: wgpu::BlendComponent = wgpu::BlendComponent {
    src_factor: wgpu::BlendFactor::One,
    dst_factor: wgpu::BlendFactor::OneMinusSrcAlpha,
    operation: wgpu::BlendOperation::Add,
};

impl Drawing {
    fn target(self, format: wgpu::TextureFormat) -> wgpu::ColorTargetState {
        let usual = wgpu::ColorTargetState::from(format);
        match self.writes {
            Writes::All => usual,
            Writes::Mixed => {
                let blend = Some(wgpu::BlendState { color: OVER, alpha: OVER });
                wgpu::ColorTargetState { blend, write_mask: wgpu::ColorWrites::COLOR, ..usual }
            }
            Writes::Depth => wgpu::ColorTargetState { write_mask: wgpu::ColorWrites::empty(), ..usual },
        }
    }

    fn entry_point(self) -> Option<&'static str> {
        match (self.color, self.writes) {
            (Some(_), Writes::All | Writes::Mixed) => Some("fragment"),
            _ => self.holes.then_some("fragment_depth"),
        }
    }
}

pub(super) fn pipeline(
    gpu: &GpuContext,
    file: &str,
    slots: &[Slot],
    layouts: &[&wgpu::BindGroupLayout],
    buffers: &[Option<wgpu::VertexBufferLayout<'_>>],
    drawing: Drawing,
) -> Result<wgpu::RenderPipeline, ComposeError> {
    let module = shaders::module(&gpu.device, file, file, slots)?;
    let groups: Vec<_> = layouts.iter().map(|layout| Some(*layout)).collect();
    let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(file),
        bind_group_layouts: &groups,
        immediate_size: 0,
    });
    let compilation_options = wgpu::PipelineCompilationOptions::default();
    let Drawing { samples, color, one_sided, writes, .. } = drawing;
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
        // Anticlockwise is anticlockwise in the picture, whose rows go down as the device's do not.
        primitive: wgpu::PrimitiveState {
            cull_mode: one_sided.then_some(wgpu::Face::Back),
            ..Default::default()
        },
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH_FORMAT,
            depth_write_enabled: Some(writes != Writes::Mixed),
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
