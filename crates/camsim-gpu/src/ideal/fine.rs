//! Supersampled ideal frames: their textures, and the pass that resolves them to one colour and depth a pixel.

use camsim_core::plan::{EdgeStage, FramePlan};

use super::{COLOR_FORMAT, DEPTH_FORMAT, IdealTarget, STORED_FORMAT, STORED_VIEW, key_rows};
use crate::{
    context::GpuContext,
    recorder::Recorder,
    shaders::{self, ComposeError},
};

/// Samples of a fine pixel; every adapter has 4, at the standard places.
pub const FINE_SAMPLES: u32 = 4;
/// A packed normal and offset, and the depth value between the surfaces.
const LINES_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rg32Uint;
/// Edge of the square workgroups.
const WORKGROUP_PX: u32 = 8;

/// Textures that a supersampled ideal frame is drawn to.
#[derive(Debug)]
pub struct FineTarget {
    /// Fine pixels along a side of an ideal pixel.
    pub scale: u32,
    /// Linear colour, 4 samples a fine pixel.
    pub color: wgpu::Texture,
    /// near / z, 4 samples a fine pixel.
    pub depth: wgpu::Texture,
    /// Mean colour of each fine pixel.
    pub averaged: wgpu::Texture,
    /// One u32: the bits of the frame's largest near / z.
    pub nearest: wgpu::Buffer,
    /// Borders of two surfaces within fine pixels: `shaders/ideal/lines.wgsl`.
    pub lines: wgpu::Texture,
    /// Four u32: width and height of an ideal frame and the rows from one to the next, for the resolve pass.
    layout: wgpu::Buffer,
}

/// Fine pixels along a side of an ideal pixel, for frames that need any.
pub(super) fn scale_of(edges: EdgeStage) -> Option<u32> {
    match edges {
        EdgeStage::None => None,
        EdgeStage::Supersampled { scale, .. } => Some(scale),
    }
}

pub(super) fn texture(
    gpu: &GpuContext,
    label: &str,
    size_px: [u32; 2],
    format: wgpu::TextureFormat,
    samples: u32,
    usage: wgpu::TextureUsages,
) -> wgpu::Texture {
    gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width: size_px[0], height: size_px[1], depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: samples,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: if format == STORED_FORMAT { &[STORED_VIEW] } else { &[] },
    })
}

impl FineTarget {
    pub(super) fn new(gpu: &GpuContext, ideal_px: [u32; 2], scale: u32) -> Self {
        let size_px = ideal_px.map(|side| side * scale);
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING;
        let nearest = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("camsim.ideal.nearest"),
            size: 4,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let layout = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("camsim.ideal.layout"),
            size: 16,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let written = wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::TEXTURE_BINDING;
        Self {
            scale,
            lines: texture(gpu, "camsim.ideal.lines", size_px, LINES_FORMAT, 1, written),
            layout,
            color: texture(gpu, "camsim.ideal.fine_color", size_px, COLOR_FORMAT, FINE_SAMPLES, usage),
            depth: texture(gpu, "camsim.ideal.fine_depth", size_px, DEPTH_FORMAT, FINE_SAMPLES, usage),
            averaged: texture(gpu, "camsim.ideal.averaged_color", size_px, COLOR_FORMAT, 1, usage),
            nearest,
        }
    }

    /// The depth samples.
    #[must_use]
    pub fn depth_view(&self) -> wgpu::TextureView {
        self.depth.create_view(&wgpu::TextureViewDescriptor::default())
    }
}

/// Samples to pixels, and the mark of silhouettes.
#[derive(Debug)]
pub(super) struct ResolvePass {
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::ComputePipeline,
}

impl ResolvePass {
    pub(super) fn new(gpu: &GpuContext) -> Result<Self, ComposeError> {
        let device = &gpu.device;
        let entry = |binding, ty| wgpu::BindGroupLayoutEntry { binding, visibility: wgpu::ShaderStages::COMPUTE, ty, count: None };
        let view_dimension = wgpu::TextureViewDimension::D2;
        let read = |sample_type, multisampled| wgpu::BindingType::Texture { sample_type, view_dimension, multisampled };
        let write = |format| wgpu::BindingType::StorageTexture { access: wgpu::StorageTextureAccess::WriteOnly, format, view_dimension };
        let buffer = |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("camsim.ideal.resolve"),
            entries: &[
                entry(0, read(wgpu::TextureSampleType::Depth, true)),
                entry(1, read(wgpu::TextureSampleType::Float { filterable: false }, false)),
                entry(2, write(COLOR_FORMAT)),
                entry(3, write(wgpu::TextureFormat::R32Float)),
                entry(4, buffer(wgpu::BufferBindingType::Storage { read_only: false })),
                entry(5, buffer(wgpu::BufferBindingType::Uniform)),
                entry(6, write(LINES_FORMAT)),
            ],
        });
        let module = shaders::module(device, "camsim.ideal.resolve", "ideal/resolve.wgsl", &[])?;
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("camsim.ideal.resolve"),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("camsim.ideal.resolve"),
            layout: Some(&pipeline_layout),
            module: &module,
            entry_point: Some("resolve"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        });
        Ok(Self { layout, pipeline })
    }

    /// Records the resolve of a plan's ideal frames.
    pub(super) fn encode(&self, gpu: &GpuContext, recorder: &mut Recorder<'_>, plan: &FramePlan, target: &IdealTarget, fine: &FineTarget) {
        let (rows, last) = (key_rows(&plan.ideal), plan.keys.len() as u32 - 1);
        let size_px = [plan.ideal.size_px[0], rows * last + plan.ideal.size_px[1]];
        let layout = [plan.ideal.size_px[0], plan.ideal.size_px[1], rows, 0];
        gpu.queue.write_buffer(&fine.layout, 0, bytemuck::cast_slice(&layout));
        let view = |texture: &wgpu::Texture| texture.create_view(&wgpu::TextureViewDescriptor::default());
        let (depth_samples, averaged, color, depth) = (fine.depth_view(), view(&fine.averaged), view(&target.color), view(&target.depth));
        let lines = view(&fine.lines);
        let entry = |binding, resource| wgpu::BindGroupEntry { binding, resource };
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("camsim.ideal.resolve"),
            layout: &self.layout,
            entries: &[
                entry(0, wgpu::BindingResource::TextureView(&depth_samples)),
                entry(1, wgpu::BindingResource::TextureView(&averaged)),
                entry(2, wgpu::BindingResource::TextureView(&color)),
                entry(3, wgpu::BindingResource::TextureView(&depth)),
                entry(4, fine.nearest.as_entire_binding()),
                entry(5, fine.layout.as_entire_binding()),
                entry(6, wgpu::BindingResource::TextureView(&lines)),
            ],
        });
        recorder.encoder().clear_buffer(&fine.nearest, 0, None);
        let mut pass = recorder.compute_pass("resolve");
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(size_px[0].div_ceil(WORKGROUP_PX), size_px[1].div_ceil(WORKGROUP_PX), 1);
    }
}
