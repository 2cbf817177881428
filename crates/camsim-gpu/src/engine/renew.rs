//! Going on with another sequence: what a viewer does whenever somebody turns a knob. Kernels and the scene's
//! pictures, which take longest to make, stay on the device; what depends on the camera is made anew.

use std::sync::Arc;

use camsim_core::{
    noise::{SEGMENTS, tail_segments},
    photometric::vignette_weights,
    scenario::Channel,
    sequence::Sequence,
};
use camsim_plan::Planner;
use wgpu::util::DeviceExt;

use super::{Engine, FRAMES_IN_FLIGHT, RenderError, Session, slot::Slot};
use crate::{
    context::{GpuContext, GpuError},
    layout::Truth,
};

impl Session<'_> {
    /// Goes on with `sequence`: the next frames are the ones that a session of its own would make, to the
    /// last bit. Fast where its scene is the one of this session (the same [`Arc`]) and its preset too;
    /// otherwise everything is made anew.
    ///
    /// # Errors
    /// As [`Engine::session`]; the session then stays as it was.
    pub fn renew<E: std::error::Error + 'static>(
        &mut self,
        sequence: Arc<Sequence>,
        channels: &[Channel],
    ) -> Result<(), RenderError<E>> {
        let before = self.planner.sequence();
        let (old, new) = (&before.scenario, &sequence.scenario);
        if !Arc::ptr_eq(&before.scene, &sequence.scene) || old.quality.preset != new.quality.preset {
            *self = self.engine.session(sequence, channels)?;
            return Ok(());
        }
        let gpu = &self.engine.gpu;
        let planner = Arc::new(self.planner.renewed(sequence.clone(), channels)?);
        self.engine.check_output(&planner)?;
        let same_size = old.camera.size_px == new.camera.size_px;
        if !same_size || planner.wants_truth() != self.planner.wants_truth() {
            let truth = planner.wants_truth();
            self.slots = (0..FRAMES_IN_FLIGHT).map(|_| Slot::new(gpu, &sequence, truth)).collect();
            self.drawn = None;
        }
        if !same_size {
            self.lists = None;
        }
        self.lens_map = None;
        self.zoom_maps.clear();
        self.vignette = vignette(gpu, &sequence);
        self.on_host.iter_mut().for_each(|on_host| on_host.renew(&sequence));
        // Bind groups hold what has just been replaced.
        self.targets.iter_mut().flat_map(|target| &mut target.groups).for_each(|groups| groups.clear());
        self.planner = planner;
        self.engine.check()?;
        Ok(())
    }
}

impl Engine {
    /// Refuses output frames that no storage buffer holds.
    pub(super) fn check_output(&self, planner: &Planner) -> Result<(), GpuError> {
        let [width, height] = planner.sequence().scenario.camera.size_px.map(u64::from);
        // Lens map and vignette are textures of its size.
        let (needed, limit) = (width.max(height), u64::from(self.gpu.max_side_px()));
        if needed > limit {
            let (what, limit_name) = ("a side of the output frame".into(), "max_texture_dimension_2d (px)");
            return Err(GpuError::TooLarge { what, needed, limit_name, limit, fix: "reduce camera.size_px" });
        }
        self.gpu.check_storage("the output frame's colour", 16 * width * height, "reduce camera.size_px")?;
        if planner.wants_truth() {
            let bytes = size_of::<Truth>() as u64 * width * height;
            let fix = "reduce camera.size_px or leave them out of output.channels";
            self.gpu.check_storage("the output frame's depth and coords", bytes, fix)?;
        }
        Ok(())
    }
}

/// Numbers that never change, by places: one or two a texel.
fn table(
    gpu: &GpuContext,
    label: &str,
    [width, height]: [u32; 2],
    format: wgpu::TextureFormat,
    values: &[f32],
) -> wgpu::TextureView {
    let descriptor = wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    };
    let order = wgpu::util::TextureDataOrder::LayerMajor;
    let texture =
        gpu.device.create_texture_with_data(&gpu.queue, &descriptor, order, bytemuck::cast_slice(values));
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

/// What the segments of the normal quantiles begin with and add, a row an octave.
pub(super) fn noise_table(gpu: &GpuContext) -> wgpu::TextureView {
    let segments = tail_segments();
    let size = [SEGMENTS as u32, (segments.len() / SEGMENTS) as u32];
    table(gpu, "camsim.noise_table", size, wgpu::TextureFormat::Rg32Float, segments.as_flattened())
}

/// Weights of the vignette map at every pixel, and the size of their picture; one for all without a map.
pub(super) fn vignette_weights_of(sequence: &Sequence) -> ([u32; 2], Vec<f32>) {
    let camera = &sequence.scenario.camera;
    match &sequence.vignette {
        Some(map) => {
            (camera.size_px, vignette_weights(map, camera.size_px, camera.photometric.vignette_thresholds))
        }
        None => ([1, 1], vec![1.0]),
    }
}

/// The same for the device.
pub(super) fn vignette(gpu: &GpuContext, sequence: &Sequence) -> wgpu::TextureView {
    let (size, weights) = vignette_weights_of(sequence);
    table(gpu, "camsim.vignette", size, wgpu::TextureFormat::R32Float, &weights)
}
