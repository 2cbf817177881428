//! The pipeline of pictures, on egui's device.

use std::{collections::HashMap, sync::Arc};

use eframe::{
    egui::{self, ColorImage, PaintCallbackInfo, Rect},
    egui_wgpu::{CallbackResources, CallbackTrait, RenderState, ScreenDescriptor},
    wgpu,
};

use super::{Place, flag};

/// One picture in one pass.
pub struct Blit {
    pub place: Place,
    pub image: Arc<ColorImage>,
    /// The part of it that is drawn, as shares of its size.
    pub uv: Rect,
    /// Whether texels are averaged.
    pub smooth: bool,
}

/// What is kept on the device from pass to pass.
struct Kept {
    pipeline: wgpu::RenderPipeline,
    near: wgpu::Sampler,
    smooth: wgpu::Sampler,
    slots: HashMap<Place, Slot>,
}

/// The picture of a place.
struct Slot {
    image: Arc<ColorImage>,
    texture: wgpu::Texture,
    part: wgpu::Buffer,
    /// Read by the nearest texel, and smoothly.
    bindings: [wgpu::BindGroup; 2],
}

/// Makes the pipeline, if codes can be written to the window as they are.
pub fn register(context: &egui::Context, state: &RenderState) {
    if state.target_format.is_srgb() {
        return;
    }
    let kept = Kept::new(&state.device, state.target_format);
    state.renderer.write().callback_resources.insert(kept);
    context.data_mut(|data| data.insert_temp(flag(), true));
}

impl Kept {
    fn new(device: &wgpu::Device, format: wgpu::TextureFormat) -> Self {
        let module = device.create_shader_module(wgpu::include_wgsl!("blit.wgsl"));
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("picture"),
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("corner"),
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
                entry_point: Some("codes"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &[Some(wgpu::ColorTargetState {
                    format,
                    // Pixels without a ray show what is behind them.
                    blend: Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING),
                    write_mask: wgpu::ColorWrites::ALL,
                })],
            }),
            multiview_mask: None,
            cache: None,
        });
        let sampler = |filter| {
            device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some("picture"),
                mag_filter: filter,
                min_filter: filter,
                ..Default::default()
            })
        };
        let [near, smooth] = [wgpu::FilterMode::Nearest, wgpu::FilterMode::Linear].map(sampler);
        Self { pipeline, near, smooth, slots: HashMap::new() }
    }

    /// The slot of a place with the picture in it; what is there already stays.
    fn fill(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        place: Place,
        image: &Arc<ColorImage>,
    ) -> &Slot {
        let before = self.slots.remove(&place).filter(|slot| slot.image.size == image.size);
        let is_there = before.as_ref().is_some_and(|slot| Arc::ptr_eq(&slot.image, image));
        let slot =
            before.map_or_else(|| self.slot(device, image), |slot| Slot { image: image.clone(), ..slot });
        if !is_there {
            upload(queue, &slot.texture, image);
        }
        self.slots.entry(place).or_insert(slot)
    }

    fn slot(&self, device: &wgpu::Device, image: &Arc<ColorImage>) -> Slot {
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("picture"),
            size: extent(image),
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba8Unorm,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let part = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("part of a picture"),
            size: size_of::<[f32; 4]>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let bindings = [&self.near, &self.smooth].map(|sampler| {
            device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("picture"),
                layout: &self.pipeline.get_bind_group_layout(0),
                entries: &[
                    wgpu::BindGroupEntry { binding: 0, resource: part.as_entire_binding() },
                    wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::TextureView(&view) },
                    wgpu::BindGroupEntry { binding: 2, resource: wgpu::BindingResource::Sampler(sampler) },
                ],
            })
        });
        Slot { image: image.clone(), texture, part, bindings }
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
        if let Some(kept) = resources.get_mut::<Kept>() {
            let slot = kept.fill(device, queue, self.place, &self.image);
            let part = [self.uv.left(), self.uv.top(), self.uv.right(), self.uv.bottom()];
            queue.write_buffer(&slot.part, 0, bytemuck::cast_slice(&part));
        }
        Vec::new()
    }

    fn paint(
        &self,
        _info: PaintCallbackInfo,
        pass: &mut wgpu::RenderPass<'static>,
        resources: &CallbackResources,
    ) {
        let Some(kept) = resources.get::<Kept>() else { return };
        let Some(slot) = kept.slots.get(&self.place) else { return };
        pass.set_pipeline(&kept.pipeline);
        pass.set_bind_group(0, &slot.bindings[usize::from(self.smooth)], &[]);
        pass.draw(0..4, 0..1);
    }
}
