//! Textures and buffers of ideal frames with silhouettes.

use std::sync::OnceLock;

use camsim_plan::EdgeStage;

use super::{
    COLOR_FORMAT, DEPTH_FORMAT, SRGB_ENCODED_VIEW, SRGB_FORMAT,
    edge_mask::{EDGE_TILES_HEAD_BYTES, EdgeMaskGroups, LINES_FORMAT},
};
use crate::context::GpuContext;

/// Samples of a fine pixel; every adapter supports 4, at the standard positions.
pub const FINE_SAMPLES: u32 = 4;
/// Side of the tiles by which the edge mask is listed, pixels.
pub(super) const TILE_PX: u32 = 8;
/// Size of a list entry: position and 64 bits of the tile.
const EDGE_TILE_BYTES: u64 = 12;

/// Resources of a frame with silhouettes besides colour and depth at the pixel centres.
#[derive(Debug)]
pub struct SupersampledTarget {
    /// Fine pixels along a side of an ideal pixel.
    pub scale: u32,
    /// near / z, 4 samples per fine pixel. If no surface is thinner than a pixel, only terrain near edge
    /// pixels is drawn to it.
    pub depth: wgpu::Texture,
    /// Linear colour, 4 samples per fine pixel, if there is more than one fine pixel per pixel: surfaces
    /// thinner than a pixel then have their own colour.
    pub color: Option<wgpu::Texture>,
    /// Borders of two surfaces within fine pixels: `shaders/ideal/edge_lines.wgsl`.
    pub lines: wgpu::Texture,
    /// Dilated tiles, one word each: `shaders/ideal/dilate_tiles.wgsl`.
    pub dilated_tiles: wgpu::Buffer,
    /// View of `depth`.
    pub depth_view: wgpu::TextureView,
    /// View of `color`.
    pub color_view: Option<wgpu::TextureView>,
    /// Tiles dilated along rows only.
    pub(super) row_dilated_tiles: wgpu::Buffer,
    /// List of tiles with edge pixels: `shaders/ideal/edge_tiles.wgsl`.
    pub(super) edge_tiles: wgpu::Buffer,
    /// Four u32: width and height of an ideal frame, rows from one to the next, `scale`.
    pub(super) layout: wgpu::Buffer,
    /// Four u32: tiles along x and y, dilation radius in tiles, 0.
    pub(super) tile_layout: wgpu::Buffer,
    /// Four f32: width and height of the target.
    pub(super) target_px: wgpu::Buffer,
    /// Created when the edge mask is first recorded.
    pub(super) edge_mask_groups: OnceLock<EdgeMaskGroups>,
    /// Bind group of the tiles for `shaders/ideal/triangles_near_edges.wgsl`, created when first recorded.
    pub(super) edge_triangles_group: OnceLock<wgpu::BindGroup>,
}

/// Fine pixels along a side of an ideal pixel; `None` for frames without silhouettes.
pub(super) fn supersampling_scale(edges: EdgeStage) -> Option<u32> {
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
        view_formats: if format == SRGB_FORMAT { &[SRGB_ENCODED_VIEW] } else { &[] },
    })
}

impl SupersampledTarget {
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
            depth_view: full_view(&depth),
            color_view: color.as_ref().map(full_view),
            lines: texture(gpu, "camsim.ideal.edge_lines", size_px, LINES_FORMAT, 1, written),
            dilated_tiles: buffer("camsim.ideal.dilated_tiles", 4 * across * down, storage),
            row_dilated_tiles: buffer("camsim.ideal.row_dilated_tiles", 4 * across * down, storage),
            edge_tiles: buffer(
                "camsim.ideal.edge_tiles",
                EDGE_TILES_HEAD_BYTES + EDGE_TILE_BYTES * across * down,
                storage | wgpu::BufferUsages::INDIRECT,
            ),
            layout: buffer("camsim.ideal.layout", 16, uniform),
            tile_layout: buffer("camsim.ideal.tile_layout", 16, uniform),
            target_px: buffer("camsim.ideal.target_px", 16, uniform),
            depth,
            color,
            edge_mask_groups: OnceLock::new(),
            edge_triangles_group: OnceLock::new(),
        }
    }
}

/// View of a whole texture.
pub(crate) fn full_view(texture: &wgpu::Texture) -> wgpu::TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}
