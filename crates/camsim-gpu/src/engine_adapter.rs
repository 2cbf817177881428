//! An open adapter as the engine drives it.

use std::sync::Arc;

use camsim_core::{scene::SceneBatches, sequence::Sequence};

use crate::{
    adapter::{Adapter, AdapterLimits, AdapterSession, AdapterSummary, GpuError},
    context::GpuContext,
    session::GpuSession,
};

impl Adapter for GpuContext {
    fn summary(&self) -> &AdapterSummary {
        &self.adapter
    }

    fn limits(&self) -> AdapterLimits {
        AdapterLimits {
            is_software: self.is_software,
            max_picture_px: self.max_picture_px,
            max_side_px: self.max_side_px(),
            max_storage_bytes: self.max_storage_bytes(),
        }
    }

    fn limit_pictures(&mut self, max_side_px: u32) {
        self.max_picture_px = max_side_px.min(self.max_side_px());
    }

    fn set_pixels_per_thread(&mut self, pixels: u32) {
        self.pixels_per_thread = pixels.clamp(1, 4096);
    }

    fn session<'a>(
        &'a self,
        sequence: &Sequence,
        meshes: Arc<SceneBatches>,
        truth: bool,
    ) -> Result<Box<dyn AdapterSession + 'a>, GpuError> {
        Ok(Box::new(GpuSession::new(self, sequence, meshes, truth)?))
    }
}
