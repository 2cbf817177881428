//! The pipeline that draws images, on egui's device.

use std::{collections::HashMap, sync::Arc};

use eframe::{
    egui::{self, ColorImage, PaintCallbackInfo, Rect},
    egui_wgpu::{CallbackResources, CallbackTrait, RenderState, ScreenDescriptor},
    wgpu,
};

use super::{ImageSlot, pipeline_registered};

/// One image drawn in one pass.
pub struct Blit {
    /// Texture slot.
    pub slot: ImageSlot,
    /// The image; uploaded if the slot has another one.
    pub image: Arc<ColorImage>,
    /// Texture coordinates of the part that is drawn.
    pub uv: Rect,
    /// Whether texels are filtered linearly; else the nearest is read.
    pub is_linear: bool,
}

/// Resources on the device.
struct BlitResources {
    pipeline: wgpu::RenderPipeline,
    nearest: wgpu::Sampler,
    linear: wgpu::Sampler,
    slots: HashMap<ImageSlot, SlotResources>,
}

/// The texture of a slot, with the image in it.
struct SlotResources {
    image: Arc<ColorImage>,
    texture: wgpu::Texture,
    /// Texture coordinates of the drawn part.
    uv_rect: wgpu::Buffer,
    /// For the nearest and the linear sampler.
    bind_groups: [wgpu::BindGroup; 2],
}

/// Makes the pipeline, unless the window's format is sRGB and would convert codes.
pub fn register(context: &egui::Context, state: &RenderState) {
    if state.target_format.is_srgb() {
        return;
    }
    let resources = BlitResources::new(&state.device, state.target_format);
    state.renderer.write().callback_resources.insert(resources);
    context.data_mut(|data| data.insert_temp(pipeline_registered(), true));
}

impl BlitResources {
    fn new(device: &wgpu::Device, format: wgpu::TextureFormat) -> Self {
        let module = device.create_shader_module(wgpu::include_wgsl!("blit.wgsl"));
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("image"),
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("vertex_main"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState {
                topology: wgpu::PrimitiveTopology::TriangleStrip,
                ..wgpu::PrimitiveState::default()
            },
            depth_stencil: None,
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("fragment_main"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &[Some(wgpu::ColorTargetState {
                    format,
                    // Invalid pixels are transparent.
                    blend: Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING),
                    write_mask: wgpu::ColorWrites::ALL,
                })],
            }),
            multiview_mask: None,
            cache: None,
        });
        let sampler = |filter| {
            device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some("image"),
                mag_filter: filter,
                min_filter: filter,
                ..Default::default()
            })
        };
        let [nearest, linear] = [wgpu::FilterMode::Nearest, wgpu::FilterMode::Linear].map(sampler);
        Self { pipeline, nearest, linear, slots: HashMap::new() }
    }

    /// The slot with the image in it, uploaded if necessary.
    fn upload_to_slot(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        slot: ImageSlot,
        image: &Arc<ColorImage>,
    ) -> &SlotResources {
        let before = self.slots.remove(&slot).filter(|slot| slot.image.size == image.size);
        let is_uploaded = before.as_ref().is_some_and(|slot| Arc::ptr_eq(&slot.image, image));
        let resources = before.map_or_else(
            || self.slot_resources(device, image),
            |before| SlotResources { image: image.clone(), ..before },
        );
        if !is_uploaded {
            upload(queue, &resources.texture, image);
        }
        self.slots.entry(slot).or_insert(resources)
    }

    fn slot_resources(&self, device: &wgpu::Device, image: &Arc<ColorImage>) -> SlotResources {
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("image"),
            size: extent(image),
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba8Unorm,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let uv_rect = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("texture coordinates of the image"),
            size: size_of::<[f32; 4]>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let bind_groups = [&self.nearest, &self.linear].map(|sampler| {
            device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("image"),
                layout: &self.pipeline.get_bind_group_layout(0),
                entries: &[
                    wgpu::BindGroupEntry { binding: 0, resource: uv_rect.as_entire_binding() },
                    wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::TextureView(&view) },
                    wgpu::BindGroupEntry { binding: 2, resource: wgpu::BindingResource::Sampler(sampler) },
                ],
            })
        });
        SlotResources { image: image.clone(), texture, uv_rect, bind_groups }
    }
}

fn extent(image: &ColorImage) -> wgpu::Extent3d {
    wgpu::Extent3d { width: image.size[0] as u32, height: image.size[1] as u32, depth_or_array_layers: 1 }
}

fn upload(queue: &wgpu::Queue, texture: &wgpu::Texture, image: &ColorImage) {
    let layout = wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some(4 * image.size[0] as u32),
        rows_per_image: None,
    };
    queue.write_texture(texture.as_image_copy(), image.as_raw(), layout, extent(image));
}

impl CallbackTrait for Blit {
    #[expect(
        clippy::disallowed_methods,
        reason = "sixteen bytes a pass on egui's device, which has no recorder"
    )]
    fn prepare(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        _screen: &ScreenDescriptor,
        _encoder: &mut wgpu::CommandEncoder,
        resources: &mut CallbackResources,
    ) -> Vec<wgpu::CommandBuffer> {
        if let Some(resources) = resources.get_mut::<BlitResources>() {
            let slot = resources.upload_to_slot(device, queue, self.slot, &self.image);
            let uv_rect = [self.uv.left(), self.uv.top(), self.uv.right(), self.uv.bottom()];
            queue.write_buffer(&slot.uv_rect, 0, bytemuck::cast_slice(&uv_rect));
        }
        Vec::new()
    }

    fn paint(
        &self,
        _info: PaintCallbackInfo,
        pass: &mut wgpu::RenderPass<'static>,
        resources: &CallbackResources,
    ) {
        let Some(resources) = resources.get::<BlitResources>() else { return };
        let Some(slot) = resources.slots.get(&self.slot) else { return };
        pass.set_pipeline(&resources.pipeline);
        pass.set_bind_group(0, &slot.bind_groups[usize::from(self.is_linear)], &[]);
        pass.draw(0..4, 0..1);
    }
}
