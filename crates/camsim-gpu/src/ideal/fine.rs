//! Supersampled ideal frames: their textures, and the pass that resolves them to one colour and depth a pixel.

use std::sync::OnceLock;

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
/// Edge of the square workgroups, and of the tiles.
const WORKGROUP_PX: u32 = 8;
/// Tiles that a workgroup of `shaders/ideal/reach.wgsl` takes.
const REACH_WORKGROUP: u32 = 64;

/// Textures that a supersampled ideal frame is drawn to.
#[derive(Debug)]
pub struct FineTarget {
    /// Fine pixels along a side of an ideal pixel.
    pub scale: u32,
    /// near / z, 4 samples a fine pixel.
    pub depth: wgpu::Texture,
    /// Linear colour, 4 samples a fine pixel, where there is more than one a pixel: what is thinner than a pixel then has its own.
    pub color: Option<wgpu::Texture>,
    /// Linear colour at the middle of each ideal pixel.
    pub centre_color: wgpu::Texture,
    /// near / z there.
    pub centre_depth: wgpu::Texture,
    /// Borders of two surfaces within fine pixels: `shaders/ideal/lines.wgsl`.
    pub lines: wgpu::Texture,
    /// A word for each 8x8 ideal pixels of the target, see `shaders/ideal/reach.wgsl`.
    pub within_reach: wgpu::Buffer,
    /// All of [`FineTarget::depth`].
    pub depth_view: wgpu::TextureView,
    /// All of [`FineTarget::color`].
    pub color_view: Option<wgpu::TextureView>,
    /// The same half done.
    within_rows: wgpu::Buffer,
    /// Four u32: width and height of an ideal frame, and the rows from one to the next, for the resolve pass.
    layout: wgpu::Buffer,
    /// Four u32: tiles across and down, and the reach in tiles.
    tile_layout: wgpu::Buffer,
    /// Bind groups of the resolve pass, made when it is first recorded.
    groups: OnceLock<[wgpu::BindGroup; 3]>,
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
        let tiles = ideal_px.map(|side| u64::from(side.div_ceil(WORKGROUP_PX)));
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING;
        let buffer = |label, size, usage| {
            let usage = usage | wgpu::BufferUsages::COPY_DST;
            gpu.device.create_buffer(&wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false })
        };
        let (storage, uniform) = (wgpu::BufferUsages::STORAGE, wgpu::BufferUsages::UNIFORM);
        let written = wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::TEXTURE_BINDING;
        let depth = texture(gpu, "camsim.ideal.fine_depth", size_px, DEPTH_FORMAT, FINE_SAMPLES, usage);
        let color = (scale > 1).then(|| texture(gpu, "camsim.ideal.fine_color", size_px, COLOR_FORMAT, FINE_SAMPLES, usage));
        Self {
            scale,
            depth_view: whole(&depth),
            color_view: color.as_ref().map(whole),
            lines: texture(gpu, "camsim.ideal.lines", size_px, LINES_FORMAT, 1, written),
            layout: buffer("camsim.ideal.layout", 16, uniform),
            tile_layout: buffer("camsim.ideal.tile_layout", 16, uniform),
            within_reach: buffer("camsim.ideal.within_reach", 4 * tiles[0] * tiles[1], storage),
            within_rows: buffer("camsim.ideal.within_rows", 4 * tiles[0] * tiles[1], storage),
            depth,
            color,
            centre_color: texture(gpu, "camsim.ideal.centre_color", ideal_px, COLOR_FORMAT, 1, usage),
            centre_depth: texture(gpu, "camsim.ideal.centre_depth", ideal_px, DEPTH_FORMAT, 1, usage),
            groups: OnceLock::new(),
        }
    }
}

/// A view of all of a texture.
pub(crate) fn whole(texture: &wgpu::Texture) -> wgpu::TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

/// Samples to pixels, the mark of silhouettes, and what lies within reach of each place.
#[derive(Debug)]
pub(super) struct ResolvePass {
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::ComputePipeline,
    reach_layout: wgpu::BindGroupLayout,
    reach: [wgpu::ComputePipeline; 2],
}

impl ResolvePass {
    pub(super) fn new(gpu: &GpuContext) -> Result<Self, ComposeError> {
        let device = &gpu.device;
        let entry = |binding, ty| wgpu::BindGroupLayoutEntry { binding, visibility: wgpu::ShaderStages::COMPUTE, ty, count: None };
        let view_dimension = wgpu::TextureViewDimension::D2;
        let read = |sample_type, multisampled| wgpu::BindingType::Texture { sample_type, view_dimension, multisampled };
        let write = |format| wgpu::BindingType::StorageTexture { access: wgpu::StorageTextureAccess::WriteOnly, format, view_dimension };
        let buffer = |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
        let storage = |read_only| buffer(wgpu::BufferBindingType::Storage { read_only });
        let group = |entries: &[wgpu::BindGroupLayoutEntry]| {
            device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some("camsim.ideal.resolve"), entries })
        };
        let layout = group(&[
            entry(0, read(wgpu::TextureSampleType::Depth, true)),
            entry(1, read(wgpu::TextureSampleType::Float { filterable: false }, false)),
            entry(2, write(COLOR_FORMAT)),
            entry(3, write(wgpu::TextureFormat::R32Float)),
            entry(4, storage(false)),
            entry(5, buffer(wgpu::BufferBindingType::Uniform)),
            entry(6, write(LINES_FORMAT)),
        ]);
        let reach_layout = group(&[entry(0, storage(true)), entry(1, storage(false)), entry(2, buffer(wgpu::BufferBindingType::Uniform))]);
        let pipeline = |file, entry_point, layout| -> Result<_, ComposeError> {
            let module = shaders::module(device, file, file, &[])?;
            let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some(file),
                bind_group_layouts: &[Some(layout)],
                immediate_size: 0,
            });
            Ok(device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(file),
                layout: Some(&layout),
                module: &module,
                entry_point: Some(entry_point),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                cache: None,
            }))
        };
        Ok(Self {
            pipeline: pipeline("ideal/resolve.wgsl", "resolve", &layout)?,
            reach: [
                pipeline("ideal/reach.wgsl", "along_rows", &reach_layout)?,
                pipeline("ideal/reach.wgsl", "along_columns", &reach_layout)?,
            ],
            layout,
            reach_layout,
        })
    }

    /// Records the resolve of a plan's ideal frames.
    pub(super) fn encode(&self, gpu: &GpuContext, recorder: &mut Recorder<'_>, plan: &FramePlan, target: &IdealTarget, fine: &FineTarget) {
        let (rows, last) = (key_rows(&plan.ideal), plan.keys.len() as u32 - 1);
        let size_px = [plan.ideal.size_px[0], rows * last + plan.ideal.size_px[1]];
        let layout = [plan.ideal.size_px[0], plan.ideal.size_px[1], rows, 0];
        recorder.write(&fine.layout, 0, bytemuck::cast_slice(&layout));
        let [across, down] = target.allocated_px.map(|side| side.div_ceil(WORKGROUP_PX));
        let reach = plan.mark_reach_px().div_ceil(WORKGROUP_PX).min(across.max(down));
        recorder.write(&fine.tile_layout, 0, bytemuck::cast_slice(&[across, down, reach, 0]));
        // What the frame does not cover has nothing.
        recorder.encoder().clear_buffer(&fine.within_reach, 0, None);
        let [group, along_rows, along_columns] = fine.groups.get_or_init(|| self.bind(gpu, target, fine));
        let mut pass = recorder.compute_pass("resolve");
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, group, &[]);
        pass.dispatch_workgroups(size_px[0].div_ceil(WORKGROUP_PX), size_px[1].div_ceil(WORKGROUP_PX), 1);
        for (pipeline, group) in self.reach.iter().zip([along_rows, along_columns]) {
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, group, &[]);
            pass.dispatch_workgroups((across * down).div_ceil(REACH_WORKGROUP), 1, 1);
        }
    }

    fn bind(&self, gpu: &GpuContext, target: &IdealTarget, fine: &FineTarget) -> [wgpu::BindGroup; 3] {
        let (drawn, color, depth, lines) = (whole(&fine.centre_color), whole(&target.color), whole(&target.depth), whole(&fine.lines));
        let bind = |layout: &wgpu::BindGroupLayout, entries: &[wgpu::BindGroupEntry<'_>]| {
            gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some("camsim.ideal.resolve"), layout, entries })
        };
        let reach = |from: &wgpu::Buffer, to: &wgpu::Buffer| {
            let entries =
                [entry(0, from.as_entire_binding()), entry(1, to.as_entire_binding()), entry(2, fine.tile_layout.as_entire_binding())];
            bind(&self.reach_layout, &entries)
        };
        [
            bind(
                &self.layout,
                &[
                    entry(0, wgpu::BindingResource::TextureView(&fine.depth_view)),
                    entry(1, wgpu::BindingResource::TextureView(&drawn)),
                    entry(2, wgpu::BindingResource::TextureView(&color)),
                    entry(3, wgpu::BindingResource::TextureView(&depth)),
                    entry(4, fine.within_reach.as_entire_binding()),
                    entry(5, fine.layout.as_entire_binding()),
                    entry(6, wgpu::BindingResource::TextureView(&lines)),
                ],
            ),
            reach(&fine.within_reach, &fine.within_rows),
            reach(&fine.within_rows, &fine.within_reach),
        ]
    }
}

fn entry(binding: u32, resource: wgpu::BindingResource<'_>) -> wgpu::BindGroupEntry<'_> {
    wgpu::BindGroupEntry { binding, resource }
}
