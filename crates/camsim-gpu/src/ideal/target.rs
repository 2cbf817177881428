//! Textures of ideal frames.

use camsim_plan::{FramePlan, SIZE_QUANTUM_PX, uniforms::key_rows};

use super::{
    DEPTH_FORMAT, SRGB_ENCODED_VIEW, SRGB_FORMAT, color_format,
    multisampled_target::MultisampledTarget,
    supersampled_target::{SupersampledTarget, full_view, supersampling_scale, texture},
};
use crate::context::GpuContext;

/// Textures of the ideal frames of an output frame.
#[derive(Debug)]
pub struct RenderTarget {
    /// Allocated width and height, pixels.
    pub allocated_px: [u32; 2],
    /// Linear colour.
    pub color: wgpu::Texture,
    /// near / z.
    pub depth: wgpu::Texture,
    /// Supersampled textures, for frames with silhouettes.
    pub supersampled: Option<SupersampledTarget>,
    /// Multisampled textures, for frames with several samples per pixel.
    pub(super) multisampled: Option<MultisampledTarget>,
    /// Attachment for colour with one sample per pixel.
    pub(super) color_attachment_view: wgpu::TextureView,
    pub(super) depth_attachment_view: wgpu::TextureView,
    /// Colour as the gather reads it.
    pub gather_color: wgpu::TextureView,
    /// Depth as the gather reads it.
    pub gather_depth: wgpu::TextureView,
}

impl RenderTarget {
    /// Allocated size for the ideal frames of a plan, one below the other. It is rounded up, so that a few
    /// allocations serve all frames, and depends on the frame alone.
    #[must_use]
    pub fn size_for(plan: &FramePlan, max_side_px: u32) -> [u32; 2] {
        let width = plan.ideal.size_px[0].next_multiple_of(SIZE_QUANTUM_PX);
        [width, key_rows(&plan.ideal) * plan.keys.len() as u32].map(|side| side.min(max_side_px))
    }

    /// Whether the ideal frames of a plan, which need this size, are drawn to this target.
    #[must_use]
    pub fn serves(&self, allocated_px: [u32; 2], plan: &FramePlan) -> bool {
        self.allocated_px == allocated_px
            && self.supersampled.as_ref().map(|supersampled| supersampled.scale)
                == supersampling_scale(plan.edges)
            && self.multisampled.is_some() == (plan.samples_a_pixel > 1)
    }

    /// Whether it has multisampled textures of any kind.
    #[must_use]
    pub fn has_samples(&self) -> bool {
        self.supersampled.is_some() || self.multisampled.is_some()
    }

    /// Allocates the textures for a plan.
    #[must_use]
    pub fn new(gpu: &GpuContext, allocated_px: [u32; 2], plan: &FramePlan) -> Self {
        let supersampled =
            supersampling_scale(plan.edges).map(|scale| SupersampledTarget::new(gpu, allocated_px, scale));
        let multisampled = (plan.samples_a_pixel > 1).then(|| MultisampledTarget::new(gpu, allocated_px));
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT
            | wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::COPY_SRC;
        let color = texture(gpu, "camsim.ideal.color", allocated_px, color_format(plan.preset), 1, usage);
        let depth = texture(gpu, "camsim.ideal.depth", allocated_px, DEPTH_FORMAT, 1, usage);
        let format = (color.format() == SRGB_FORMAT).then_some(SRGB_ENCODED_VIEW);
        // Not every usage of the texture is legal for a view of another format, and the gather needs only
        // this one.
        let usage = Some(wgpu::TextureUsages::TEXTURE_BINDING);
        let gather_color =
            color.create_view(&wgpu::TextureViewDescriptor { format, usage, ..Default::default() });
        let (color_attachment_view, depth_attachment_view, gather_depth) =
            (full_view(&color), full_view(&depth), full_view(&depth));
        Self {
            allocated_px,
            color,
            depth,
            supersampled,
            multisampled,
            color_attachment_view,
            depth_attachment_view,
            gather_color,
            gather_depth,
        }
    }
}
