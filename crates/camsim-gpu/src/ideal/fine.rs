//! Textures and buffers of ideal frames in which silhouettes can be seen.

use std::sync::OnceLock;

use camsim_plan::EdgeStage;

use super::{
    COLOR_FORMAT, DEPTH_FORMAT, STORED_FORMAT, STORED_VIEW,
    marks::{LINES_FORMAT, MARKED_HEAD_BYTES, MarkGroups},
};
use crate::context::GpuContext;

/// Samples of a fine pixel; every adapter has 4, at the standard places.
pub const FINE_SAMPLES: u32 = 4;
/// Edge of the square tiles that marks are listed by, pixels.
pub(super) const TILE_PX: u32 = 8;
/// A marked tile's place and its 64 bits.
const MARKED_TILE_BYTES: u64 = 12;

/// What a frame with silhouettes has besides colour and depth at the middle of each pixel.
#[derive(Debug)]
pub struct FineTarget {
    /// Fine pixels along a side of an ideal pixel.
    pub scale: u32,
    /// near / z, 4 samples a fine pixel; where surfaces are not thin, near marked pixels only.
    pub depth: wgpu::Texture,
    /// Linear colour, 4 samples a fine pixel, where there is more than one a pixel: what is thinner than a
    /// pixel then has its own.
    pub color: Option<wgpu::Texture>,
    /// Borders of two surfaces within fine pixels: `shaders/ideal/lines.wgsl`.
    pub lines: wgpu::Texture,
    /// A word for each tile of the target, see `shaders/ideal/reach.wgsl`.
    pub within_reach: wgpu::Buffer,
    /// All of [`FineTarget::depth`].
    pub depth_view: wgpu::TextureView,
    /// All of [`FineTarget::color`].
    pub color_view: Option<wgpu::TextureView>,
    /// The same half done.
    pub(super) within_rows: wgpu::Buffer,
    /// The tiles that have marks: `shaders/ideal/marked_tiles.wgsl`.
    pub(super) marked: wgpu::Buffer,
    /// Four u32: width and height of an ideal frame, rows from one to the next, `scale`.
    pub(super) layout: wgpu::Buffer,
    /// Four u32: tiles across and down, and the reach in tiles.
    pub(super) tile_layout: wgpu::Buffer,
    /// Four f32: width and height of the target.
    pub(super) target_px: wgpu::Buffer,
    /// Made when the marks are first recorded.
    pub(super) mark_groups: OnceLock<MarkGroups>,
    /// The tiles alone, for `shaders/ideal/near_marks.wgsl`; likewise.
    pub(super) near_marks_group: OnceLock<wgpu::BindGroup>,
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
        let [across, down] = ideal_px.map(|side| u64::from(side.div_ceil(TILE_PX)));
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING;
        let buffer = |label, size, usage| {
            let usage = usage | wgpu::BufferUsages::COPY_DST;
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage,
                mapped_at_creation: false,
            })
        };
        let (storage, uniform) = (wgpu::BufferUsages::STORAGE, wgpu::BufferUsages::UNIFORM);
        let written = wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::TEXTURE_BINDING;
        let depth = texture(gpu, "camsim.ideal.fine_depth", size_px, DEPTH_FORMAT, FINE_SAMPLES, usage);
        let color = (scale > 1)
            .then(|| texture(gpu, "camsim.ideal.fine_color", size_px, COLOR_FORMAT, FINE_SAMPLES, usage));
        Self {
            scale,
            depth_view: whole(&depth),
            color_view: color.as_ref().map(whole),
            lines: texture(gpu, "camsim.ideal.lines", size_px, LINES_FORMAT, 1, written),
            within_reach: buffer("camsim.ideal.within_reach", 4 * across * down, storage),
            within_rows: buffer("camsim.ideal.within_rows", 4 * across * down, storage),
            marked: buffer(
                "camsim.ideal.marked",
                MARKED_HEAD_BYTES + MARKED_TILE_BYTES * across * down,
                storage | wgpu::BufferUsages::INDIRECT,
            ),
            layout: buffer("camsim.ideal.layout", 16, uniform),
            tile_layout: buffer("camsim.ideal.tile_layout", 16, uniform),
            target_px: buffer("camsim.ideal.target_px", 16, uniform),
            depth,
            color,
            mark_groups: OnceLock::new(),
            near_marks_group: OnceLock::new(),
        }
    }
}

/// A view of all of a texture.
pub(crate) fn whole(texture: &wgpu::Texture) -> wgpu::TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}
