//! Ideal frames with four samples per pixel: their textures, and the resolve of their depth.

use super::{
    COLOR_FORMAT, DEPTH_FORMAT, FINE_SAMPLES,
    supersampled_target::{full_view, texture},
};
use crate::{
    context::GpuContext,
    recorder::Recorder,
    shaders::{self, ComposeError},
};

const _: () = assert!(FINE_SAMPLES == camsim_core::temporal::SAMPLES);

/// Multisampled textures.
#[derive(Debug)]
pub(super) struct MultisampledTarget {
    pub color: wgpu::TextureView,
    pub depth: wgpu::TextureView,
    group: std::sync::OnceLock<wgpu::BindGroup>,
}

impl MultisampledTarget {
    pub fn new(gpu: &GpuContext, allocated_px: [u32; 2]) -> Self {
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let color =
            texture(gpu, "camsim.ideal.multisampled_color", allocated_px, COLOR_FORMAT, FINE_SAMPLES, usage);
        let usage = usage | wgpu::TextureUsages::TEXTURE_BINDING;
        let depth =
            texture(gpu, "camsim.ideal.multisampled_depth", allocated_px, DEPTH_FORMAT, FINE_SAMPLES, usage);
        Self { color: full_view(&color), depth: full_view(&depth), group: std::sync::OnceLock::new() }
    }
}

/// Pipeline that resolves the depth.
#[derive(Debug)]
pub(super) struct ResolveDepthPass {
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::RenderPipeline,
}

impl ResolveDepthPass {
    pub fn new(gpu: &GpuContext) -> Result<Self, ComposeError> {
        const FILE: &str = "ideal/resolve_depth.wgsl";
        let device = &gpu.device;
        let ty = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Depth,
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: true,
        };
        let entries = [wgpu::BindGroupLayoutEntry {
            binding: 0,
            visibility: wgpu::ShaderStages::FRAGMENT,
            ty,
            count: None,
        }];
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some(FILE),
            entries: &entries,
        });
        let module = shaders::module(device, FILE, FILE, &[])?;
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(FILE),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let compilation_options = wgpu::PipelineCompilationOptions::default();
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(FILE),
            layout: Some(&pipeline_layout),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("vertex"),
                compilation_options: compilation_options.clone(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: Some(wgpu::DepthStencilState {
                format: DEPTH_FORMAT,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Always),
                stencil: wgpu::StencilState::default(),
                bias: wgpu::DepthBiasState::default(),
            }),
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("fragment"),
                compilation_options,
                targets: &[],
            }),
            multiview_mask: None,
            cache: None,
        });
        Ok(Self { layout, pipeline })
    }

    /// Resolves the depth of all pixels into `depth`.
    pub fn encode(
        &self,
        gpu: &GpuContext,
        recorder: &mut Recorder<'_>,
        from: &MultisampledTarget,
        depth: wgpu::RenderPassDepthStencilAttachment<'_>,
    ) {
        let group = from.group.get_or_init(|| {
            let entries = [wgpu::BindGroupEntry {
                binding: 0,
                resource: wgpu::BindingResource::TextureView(&from.depth),
            }];
            let label = Some("camsim.ideal.resolve_depth");
            gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label,
                layout: &self.layout,
                entries: &entries,
            })
        });
        let mut pass = recorder.render_pass("resolve_depth", None, Some(depth));
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, group, &[]);
        pass.draw(0..3, 0..1);
    }
}
